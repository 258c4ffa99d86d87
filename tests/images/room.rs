//! The strong test: the box room rendered to pictures and fed back, against the direct render; and whole runs on such pictures.

use std::sync::Arc;

use crate::common::assets::KeptBakes;
use glam::{DQuat, DVec3};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::error::Error;
use sensel::num::{f32_nearest, f64_from_usize};
use sensel::optics::lens::{Lens, Mapping, Radtan};
use sensel::optics::{Camera, Sampling, render, resample};
use sensel::picture::{Channel, to_exr};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::run::{Assets, NoClock, NoProgress, Session, Setup};
use sensel::scene::images::{Blend, PictureBytes, pinhole};
use sensel::scene::{BakeSettings, Illuminant, LitScene, box_room};
use sensel::units::{FrameIndex, Span};

use super::{FOV_RAD, Files, WHITE_LUX, camera_with, size, stream};

/// Turn of the camera about its vertical axis.
const RATE_RAD_PER_S: f64 = 3.5;

fn turning(t_s: f64) -> Pose {
    Pose::new(DQuat::from_rotation_y(RATE_RAD_PER_S * t_s), DVec3::new(0.3 * t_s, 1.5, 0.2))
}

fn lit_box() -> LitScene {
    let scene = box_room::box_room(1);
    scene.baked_and_lit(&BakeSettings::DRAFT, DVec3::new(0.0, 1.5, 0.0), WHITE_LUX, Illuminant::D65).unwrap()
}

fn seen(scene: &LitScene, camera: &Camera, shutter: &[Span], samples_per_pixel: u32, seed: u64) -> Plane<f32> {
    let sampling = Sampling::fixed(samples_per_pixel, DrawKey::root(seed));
    render(scene, camera, shutter, &turning, sampling).photons
}

/// Photons as values of a grey picture: 1 is white under the illuminance.
fn picture(photons: &Plane<f32>, camera: &Camera, lux_s: f64) -> Vec<u8> {
    let white: f64 = camera.photons_per_lux_s(Illuminant::D65).iter().sum::<f64>() * lux_s;
    let plane = photons.map(|photons| f32_nearest(f64::from(photons) / white));
    to_exr(&[Channel { name: "Y".to_owned(), plane }]).unwrap()
}

/// Differences of two planes: mean, root mean square, and the shift in px along x that explains most of it, with its standard error.
struct Apart {
    bias: f64,
    rms: f64,
    contrast: f64,
    shift_px: f64,
    shift_se_px: f64,
}

fn apart(a: &Plane<f32>, b: &Plane<f32>) -> Apart {
    let mean = b.values().iter().map(|&value| f64::from(value)).sum::<f64>() / f64_from_usize(b.values().len());
    let at = |plane: &Plane<f32>, x: usize, y: usize| f64::from(plane.at(x, y)) / mean;
    let (mut sum, mut squares, mut along, mut slopes, mut pixels) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for y in 0..b.height_px() {
        for x in 1..b.width_px() - 1 {
            let difference = at(a, x, y) - at(b, x, y);
            let slope = 0.5 * (at(b, x + 1, y) - at(b, x - 1, y));
            sum += difference;
            squares += difference * difference;
            along += difference * slope;
            slopes += slope * slope;
            pixels += 1.0;
        }
    }
    let rms = (squares / pixels).sqrt();
    Apart {
        bias: sum / pixels,
        rms,
        contrast: (slopes / pixels).sqrt(),
        shift_px: -along / slopes,
        shift_se_px: rms / slopes.sqrt(),
    }
}

fn print(name: &str, apart: &Apart) {
    println!(
        "{name}: mean {:.5}, rms {:.4} at a slope of {:.3}/px, shift {:.4} +- {:.4} px",
        apart.bias, apart.rms, apart.contrast, apart.shift_px, apart.shift_se_px
    );
}

/// The pictures of a camera that turns, each open for its whole interval (a shutter of 360 degrees), its time in the middle.
fn film(scene: &LitScene, camera: &Camera, rate_hz: f64, count: u32) -> (Vec<Vec<u8>>, Vec<f64>) {
    let rows = sensel::num::index(camera.size.height_px);
    let mut pictures = Vec::new();
    for number in 0..count {
        let span = Span { start_s: f64::from(number) / rate_hz, end_s: f64::from(number + 1) / rate_hz };
        let photons = seen(scene, camera, &vec![span; rows], 16, 100 + u64::from(number));
        pictures.push(picture(&photons, camera, WHITE_LUX / rate_hz));
    }
    (pictures, (0..count).map(|number| (f64::from(number) + 0.5) / rate_hz).collect())
}

#[test]
fn a_rendered_film_fed_back_is_the_direct_render_blur_and_all() {
    let scene = lit_box();
    let (sensor, source) = (size(80, 60), size(160, 120));
    let camera = camera_with(Lens::pinhole(sensor, FOV_RAD), sensor);
    let (pictures, times_s) = film(&scene, &camera_with(Lens::pinhole(source, FOV_RAD), source), 120.0, 3);
    let stream = stream(pictures, &times_s, pinhole(source, FOV_RAD, [0.0; 4]), Blend::Nearest);
    let shutter = vec![Span { start_s: 0.0, end_s: 3.0 / 120.0 }; 60];
    let fed_back = resample(&stream, &camera, &shutter).unwrap().photons;
    let direct = seen(&scene, &camera, &shutter, 192, 1);
    let apart = apart(&fed_back, &direct);
    print("film", &apart);
    // Three whole intervals are the exposure, and four pixels of the picture a pixel of the sensor: both routes are means over the same
    // rays' domain, and differ by render noise and by the prefilter of textures, 1/4 px of the sensor in one and of the picture in the
    // other. That moves light by at most 1/8 px: rms under 1/8 of the slope a pixel, and doubled for the mip's own width; symmetric, so
    // it shifts nothing and adds no light. Noise: 192 samples of a contrast of some 0.3 leave 0.3/sqrt(192) = 0.02 a pixel if they were
    // not stratified, and 0.02/sqrt(4800) = 3e-4 in the mean, 4 SE of two renders 1.8e-3.
    assert!(apart.rms < 0.25 * apart.contrast + 0.03, "{}", apart.rms);
    assert!(apart.bias.abs() < 1.8e-3, "{}", apart.bias);
    assert!(apart.contrast > 0.02);
    // The blur is 5 px long: a picture more or less at one end would shift it by 0.8 px.
    assert!(apart.shift_px.abs() < 4.0 * apart.shift_se_px, "{} px", apart.shift_px);
    assert!(4.0 * apart.shift_se_px < 0.1, "{} px", apart.shift_se_px);
}

#[test]
fn rows_and_distortion_of_the_sensor_are_those_of_the_direct_render() {
    let scene = lit_box();
    let (sensor, source) = (size(80, 60), size(320, 240));
    let mut lens = Lens::pinhole(sensor, FOV_RAD);
    lens.mapping = Mapping::Radtan(Radtan { k1: -0.15, k2: 0.02, ..Radtan::default() });
    let camera = camera_with(lens, sensor);
    // Wide enough that the barrel's corners lie inside.
    let (pictures, times_s) = film(&scene, &camera_with(Lens::pinhole(source, 1.6), source), 480.0, 10);
    let stream = stream(pictures, &times_s, pinhole(source, 1.6, [0.0; 4]), Blend::Nearest);
    assert_eq!(sensel::optics::resample::outside_share(&stream, &camera), 0.0);
    let (exposure_s, row_s) = (0.010, 0.010 / 60.0);
    let rows = |row: u32| Span { start_s: row_s * f64::from(row), end_s: row_s * f64::from(row) + exposure_s };
    let shutter: Vec<Span> = (0..60).map(rows).collect();
    let fed_back = resample(&stream, &camera, &shutter).unwrap().photons;
    let direct = seen(&scene, &camera, &shutter, 96, 1);
    let apart = apart(&fed_back, &direct);
    print("rolling, distorted", &apart);
    // As above; a picture's pixel that lies across an edge between two of the sensor's gives each its share of the mean: at 1/3 px wide
    // it moves light by at most 1/12 px.
    assert!(apart.rms < (0.25 + 1.0 / 12.0) * apart.contrast + 0.04, "{}", apart.rms);
    assert!(apart.bias.abs() < 2.6e-3, "{}", apart.bias);
    // Where a row's span ends within an interval T, the whole interval's mean counts for its part: off by T^2 / (8 E) at most, 0.054 ms
    // at 200 px/s: 0.011 px. Rows that were all taken at the first one's time would shift by 1 px in the mean.
    let speed_px_per_s = RATE_RAD_PER_S * camera.lens.intrinsics.fx_px;
    let partial_px = speed_px_per_s / (480.0 * 480.0 * 8.0 * exposure_s);
    assert!(apart.shift_px.abs() < 4.0 * apart.shift_se_px + partial_px, "{} px", apart.shift_px);
    assert!(4.0 * apart.shift_se_px < 0.1, "{} px", apart.shift_se_px);
}

/// A scenario's files in memory.
impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        PictureBytes::read(self, name)
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        let inside = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        let rest = |name: &String| name.strip_prefix(&inside).map(str::to_owned);
        let names: Vec<String> = self.0.keys().filter_map(rest).filter(|rest| !rest.contains('/')).collect();
        if names.is_empty() && !self.0.keys().any(|name| name.starts_with(&inside)) {
            return Err(Error::Content { file: folder.to_owned(), reason: "is not there".to_owned() });
        }
        Ok(names)
    }

    fn during_run(&self) -> Option<Arc<dyn PictureBytes>> {
        Some(Arc::new(self.clone()))
    }
}

const FRAMES: u32 = 5;

const SENSOR: &str = "
[run]
frames = 5
[sensor]
width = 320
height = 240
[sensor.readout]
exposure_us = 6000.0
[optics]
preset = \"radtan_90\"
[compute]
threshold = 12
[motion]
kind = \"sway\"
offset_m = [0.0, 1.5, 0.3]
";

/// Pictures of the box room as two cameras see it at the frames' own times, and the time of the first.
fn stereo_pictures() -> (Files, f64) {
    let text = format!("[scene]\ngenerator = \"box\"\nilluminance_lux = 1000.0\n{SENSOR}");
    let resolved = Resolved::from_layers("box", &text, &[]).unwrap();
    let setup = Setup::new(resolved, &KeptBakes, &NoProgress).unwrap();
    let source = size(480, 360);
    let times_s: Vec<f64> = (0..FRAMES).map(|frame| setup.sensor.schedule.t_frame(FrameIndex(frame))).collect();
    let list: String = times_s.iter().map(|t_s| format!("{t_s:.9}\n")).collect();
    let mut files = Files::default();
    for (number, of_rig) in setup.cameras.iter().enumerate() {
        let mut camera = camera_with(Lens::pinhole(source, 1.75), source);
        camera.body_from_camera = of_rig.body_from_camera;
        for (frame, &t_s) in times_s.iter().enumerate() {
            let pose = setup.motion.world_from_body(t_s).unwrap();
            let sampling = Sampling::fixed(4, DrawKey::root(9));
            let shutter = vec![Span { start_s: 0.0, end_s: 0.01 }; 360];
            let photons = render(setup.world.scene().unwrap(), &camera, &shutter, &|_| pose, sampling).photons;
            files.0.insert(format!("cam{number}/{frame:03}.exr"), picture(&photons, &camera, 1000.0 * 0.01));
        }
        files.0.insert(format!("cam{number}/times.csv"), list.clone().into_bytes());
    }
    (files, times_s[0])
}

fn run(files: &Files, images: &str, start_s: f64, more: &str) -> Session {
    let text = format!(
        "[scene]\nimages = {images}\nimages_start_s = {:.9}\nilluminance_lux = 1000.0\n\
         [scene.images_camera]\nhorizontal_fov_deg = {}\n{SENSOR}{more}",
        -start_s,
        1.75_f64.to_degrees()
    );
    let resolved = Resolved::from_layers("pictures", &text, &[]).unwrap();
    let setup = Setup::new(resolved, files, &NoProgress).unwrap();
    assert!(setup.world.scene().is_none());
    println!("{:?}", setup.scene_notes);
    assert!(setup.scene_notes.iter().any(|note| note.contains("5 pictures")), "{:?}", setup.scene_notes);
    Session::new(setup).unwrap()
}

#[test]
fn runs_on_pictures_go_the_whole_way_with_one_camera_and_track_with_two() {
    let (files, start_s) = stereo_pictures();
    let mut session = run(&files, "[\"cam0\", \"cam1\"]", start_s, "");
    let mut tracked = 0;
    let mut first: Option<(Pose, Pose)> = None;
    for _ in 0..FRAMES {
        let frame = session.step(&NoClock).unwrap();
        let found = frame.cameras.iter().map(|camera| camera.features.len()).collect::<Vec<_>>();
        assert!(found.iter().all(|&count| count > 100), "{found:?}");
        let Some(pose) = frame.tracked.world_from_body else { continue };
        let (truth, estimate) = *first.get_or_insert((frame.truth, pose));
        let moved = truth.inverse().then(&frame.truth);
        let thought = estimate.inverse().then(&pose);
        println!("{:?}: {:.4} m off", frame.frame, (moved.translation_m - thought.translation_m).length());
        tracked += 1;
    }
    assert!(tracked >= 4, "{tracked} of {FRAMES} frames");
    let report = session.report("pictures").unwrap();
    assert_eq!(report.scenario.scene, "cam0, cam1");
    assert!(report.scenario.render_variance_ratio.is_none());
    assert!(report.not_measurable.contains_key("scenario.render_variance_ratio"));

    let mut alone = run(&files, "\"cam1\"", start_s, "[rig]\nbaseline_mm = 0.0\n");
    let frame = alone.step(&NoClock).unwrap();
    // One camera starts its map from two frames, so the first has no pose.
    assert!(frame.tracked.world_from_body.is_none());
    assert!(frame.cameras.len() == 1 && frame.cameras[0].features.len() > 100);
}
