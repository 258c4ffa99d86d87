//! `sensel scene`: what it says of a glTF file, and that the scenario that it writes sees the file's surfaces.

#![allow(clippy::unwrap_used)]

use serde_json::Value;

use crate::common::{Scratch, sensel};
use crate::gltf::file::File;

/// A closed room of 4 by 5 by 2.5 units with one-sided walls that face inwards, z up, and a picture-less board in it.
fn shed(with_camera: bool) -> File {
    let (x, y, z) = (4.0_f32, 5.0_f32, 2.5_f32);
    let corners = [
        [0.0, 0.0, 0.0],
        [x, 0.0, 0.0],
        [x, y, 0.0],
        [0.0, y, 0.0],
        [0.0, 0.0, z],
        [x, 0.0, z],
        [x, y, z],
        [0.0, y, z],
    ];
    let quads: [[u16; 4]; 6] = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
    File::square().edited(|file| {
        let walls = file.floats("VEC3", corners.as_flattened());
        file.json["accessors"][walls]["min"] = serde_json::json!([0, 0, 0]);
        file.json["accessors"][walls]["max"] = serde_json::json!([x, y, z]);
        let triangles: Vec<u16> = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
        let indices = file.shorts(&triangles);
        file.json["meshes"] = serde_json::json!([{"primitives": [{"attributes": {"POSITION": walls}, "indices": indices, "material": 0}]}]);
        file.json["materials"] = serde_json::json!([{"name": "plaster", "doubleSided": false}]);
        file.json["nodes"] = serde_json::json!([{"mesh": 0}]);
        if with_camera {
            file.json["cameras"] = serde_json::json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.01}}]);
            // Looking along +y in the file, from beside the near wall: a quarter turn about x of a camera that looks along -z.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            file.json["nodes"].as_array_mut().unwrap().push(serde_json::json!({
                "name": "door", "camera": 0, "translation": [2.0, 0.5, 1.5], "rotation": [half, 0.0, 0.0, half]
            }));
            file.json["scenes"][0]["nodes"] = serde_json::json!([0, 1]);
        }
    })
}

fn described(arguments: &[&str]) -> Value {
    let outcome = sensel(&[&["scene", "--json"], arguments].concat());
    assert_eq!(outcome.code, 0, "{outcome:?}");
    serde_json::from_str(&outcome.stdout).unwrap()
}

#[test]
fn the_scenario_that_is_written_sees_the_walls_from_the_file_s_camera_and_from_a_position_that_is_found() {
    let mut tried = 0;
    for (with_camera, name) in [(true, "door"), (false, "found")] {
        let folder = Scratch::new("scene_verb");
        std::fs::write(folder.path().join("shed.glb"), shed(with_camera).glb()).unwrap();
        let (file, scenario) = (folder.join("shed.glb"), folder.join("mine.toml"));
        let said = described(&[&file, "--up", "z", "--out", &scenario, "--picture", &folder.join("sheet.png")]);
        // Z up: the height is the file's z.
        assert_eq!(said["extent_m"]["greatest"], serde_json::json!([4.0, 2.5, 0.0]), "{said}");
        assert_eq!(said["triangles"], 12);
        assert_eq!(said["materials"].as_array().unwrap().len(), 1, "{said}");
        let view = &said["views"][0];
        assert_eq!(view["name"], name, "{said}");
        assert!(view["covered"].as_f64().unwrap() > 0.99 && view["behind_surfaces"] == 0.0, "{view}");
        let sheet = image::open(folder.path().join("sheet.png")).unwrap().to_rgb8();
        assert!(sheet.pixels().any(|pixel| pixel.0[1] > 100), "the contact sheet shows lit walls");
        let small = ["--set", "sensor.width=64", "--set", "sensor.height=48", "--set", "optics.preset=pinhole_90"];
        let result = folder.join("out");
        let run =
            sensel(&[&["run", &scenario, "--frames", "1", "--keep", "codes", "--out", &result], &small[..]].concat());
        assert_eq!(run.code, 0, "{run:?}");
        let report: Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("out/report.json")).unwrap()).unwrap();
        // A closed room without light would be refused; the scenario brings a lamp.
        assert!(report["scenario"]["illuminance_lux"].as_f64().unwrap() > 1.0, "{report}");
        // Nothing that stands there is written over.
        let again = sensel(&["scene", &file, "--up", "z", "--out", &scenario]);
        assert!(again.code == 2 && again.stderr.contains("is there already"), "{again:?}");
        tried += 1;
    }
    assert_eq!(tried, 2);
}

#[test]
fn a_file_in_centimetres_is_said_and_scaled() {
    let folder = Scratch::new("scene_verb");
    let fox = File::square().edited(|file| file.json["nodes"][1]["scale"] = serde_json::json!([150, 150, 150]));
    std::fs::write(folder.path().join("fox.glb"), fox.glb()).unwrap();
    let file = folder.join("fox.glb");
    let said = described(&[&file]);
    assert!(said["warnings"][0].as_str().unwrap().contains("--scale 0.01"), "{said}");
    let scaled = described(&[&file, "--scale", "0.01"]);
    assert_eq!(scaled["warnings"], serde_json::json!([]), "{scaled}");
    assert_eq!(scaled["extent_m"]["greatest"][0], 1.5);
}

#[test]
fn what_cannot_be_a_scene_is_refused_with_what_is_accepted() {
    let folder = Scratch::new("scene_verb");
    std::fs::write(folder.path().join("shed.glb"), shed(false).glb()).unwrap();
    std::fs::write(folder.path().join("odd.glb"), b"glTF").unwrap();
    let (file, away) = (folder.join("shed.glb"), Scratch::new("scene_verb"));
    let cases: [(&[&str], &str); 6] = [
        (&["nothing.glb"], "name a .glb or .gltf file"),
        (&[&folder.join("odd.glb")], "odd.glb"),
        (&[&file, "--scale", "0"], "1e-6 to 1e6"),
        (&[&file, "--up", "x"], "use y or z"),
        (&[&file, "--out", &away.join("mine.toml")], "shed.toml"),
        (&[&file, "--picture", &folder.join("sheet.jpg")], ".png"),
    ];
    for (arguments, accepted) in cases {
        let outcome = sensel(&[&["scene"], arguments].concat());
        assert!(outcome.code == 2 && outcome.stderr.contains(accepted), "{arguments:?}: {outcome:?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{outcome:?}");
    }
    assert_eq!(folder.names(), ["odd.glb", "shed.glb"]);
}

#[test]
fn scale_and_up_of_a_file_have_no_effect_without_one() {
    for assignment in ["scene.scale=0.5", "scene.up=z"] {
        let outcome = sensel(&["plan", "box", "--set", assignment]);
        assert!(outcome.code == 2 && outcome.stderr.contains("use scene.file"), "{outcome:?}");
    }
}
