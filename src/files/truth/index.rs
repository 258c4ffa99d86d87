//! Writes `ground_truth.json`, a machine-readable list of what is kept beside a run and what its numbers mean.

use serde_json::{Map, Value, json};

use super::encode::{DEPTH_STEPS_PER_M, FLOW_STEPS_PER_PX, FLOW_ZERO_STEPS};
use super::keep::{Keep, KeptOutput};
use crate::error::Error;
use crate::run::Setup;

/// Version of the file's own layout.
const VERSION: u32 = 1;

pub(super) fn text(keep: &Keep, setup: &Setup) -> Result<String, Error> {
    let mut kinds = Map::new();
    for kept in keep.all() {
        kinds.insert(kept.name().to_owned(), meaning(kept, setup));
    }
    let all = json!({
        "version": VERSION,
        "frames": setup.frames,
        "cameras": setup.cameras.len(),
        "file_names": "time of the frame in nanoseconds, as in mav0",
        "row_times": "middle of each row's longest exposure, to which poses and all that is seen of surfaces belong",
        "camera_frame": "x right, y down, z forward; pixel centres are integers",
        "kept": kinds,
    });
    serde_json::to_string_pretty(&all).map_err(|error| Error::Run(format!("ground_truth.json: {error}")))
}

fn meaning(kept: KeptOutput, setup: &Setup) -> Value {
    let seen = json!({
        "0": "no bearing", "1": "visible", "2": "occluded", "3": "outside the picture", "4": "passed by between rows"
    });
    match kept {
        KeptOutput::Packets => json!({ "csi2": "packets of all frames, back to back" }),
        KeptOutput::Photons => {
            json!({ "exr": { "Y": "mean photons behind each array pixel's filter, longest exposure" } })
        }
        KeptOutput::Electrons => {
            json!({ "exr": { "Y": "electrons at each array pixel's sense node, longest exposure" } })
        }
        KeptOutput::Codes => json!({ "png": {
            "unit": "LSB, unscaled",
            "bits": setup.sensor.bits(),
            "black_level_dn": setup.sensor.parameters.adc.black_level_dn,
        } }),
        KeptOutput::Features => json!({ "csv": "x,y,score,angle,octave,descriptor" }),
        KeptOutput::Colour => json!({ "exr": {
            "R": "mean photons of 600-700 nm before the filter",
            "G": "500-600 nm",
            "B": "400-500 nm",
            "NIR": "700-1000 nm, where the lens passes it",
            "transmission_by_filter": filters(setup),
            "filters": pattern(setup),
        } }),
        KeptOutput::Poses => json!({ "csv": "world_from_camera of each row: metres, unit quaternion" }),
        KeptOutput::Depth => json!({
            "png": { "unit": "depth along the axis", "steps_per_m": DEPTH_STEPS_PER_M, "0": "none, or beyond 13.1 m" },
            "exr": { "Z": "metres along the axis, infinite where nothing is met", "range": "metres along the ray" },
        }),
        KeptOutput::Normals => {
            json!({ "exr": { "normal.X": "unit vector in the camera's frame, 0 where nothing is met" } })
        }
        KeptOutput::Materials => json!({ "png": {
            "0": "nothing",
            "names_from_1": setup.world.dynamic_scene().map_or_else(Vec::new, |scene| {
                scene.shapes().all().flat_map(|shape| &shape.mesh.materials).map(|m| m.name.as_str()).collect::<Vec<_>>()
            }),
        } }),
        KeptOutput::Objects => json!({ "png": {
            "0": "the static scene, or nothing",
            "names_from_1": setup.world.dynamic_scene().map_or_else(Vec::new, |scene| {
                let firsts = scene.objects.chunk_by(|a, b| a.instance == b.instance).map(|parts| &parts[0]);
                firsts.map(|object| object.name.as_str()).collect::<Vec<_>>()
            }),
        } }),
        KeptOutput::Flow => json!({
            "exr": { "forward.u": "columns to the right until the next frame, NaN where undefined", "forward.v": "rows down" },
            "png": { "layout": "KITTI", "steps_per_px": FLOW_STEPS_PER_PX, "zero": FLOW_ZERO_STEPS },
        }),
        KeptOutput::Visibility => json!({ "png": seen }),
        KeptOutput::Stereo => json!({
            "exr": { "disparity.x": "columns to the right in the other camera, NaN where undefined", "disparity.y": "rows down" },
            "png": seen,
        }),
        KeptOutput::Tum => json!({ "folder": "TUM RGB-D, first camera" }),
        KeptOutput::Map => {
            json!({ "ply": "landmarks in the tracker's world at the end", "tum": "keyframes still held" })
        }
    }
}

/// Transmission in R, G, B and near infrared, by letter.
fn filters(setup: &Setup) -> Value {
    let mosaic = &setup.windows[0].mosaic;
    let of = |letter: char| (letter.to_string(), json!(mosaic.transmission(letter)));
    Value::Object(mosaic.letters().map(of).collect())
}

/// Letters over the window's first pixels, row by row; the pattern repeats.
fn pattern(setup: &Setup) -> Vec<String> {
    let mosaic = &setup.windows[0].mosaic;
    let row = |y: usize| (0..mosaic.width_px()).map(|x| mosaic.letter_at(x, y)).collect();
    (0..mosaic.height_px()).map(row).collect()
}
