//! Rigid animation of nodes: parts, their positions, and what is refused or left out.

use glam::{DQuat, DVec3};
use serde_json::json;

use super::file::File;
use super::{refusal, scene};
use sensel::scene::Scene;
use sensel::scene::file_units::FileUnits;

/// The square's inner node (scale 2, under a node at z = 5 that is turned a quarter about z and twice as large) slides by 1 m along x in
/// two seconds and turns a quarter about y. Beside it stands another square.
fn sliding() -> File {
    let mut file = File::square();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    file.json["nodes"] = json!([
        {"children": [1], "translation": [0, 0, 5], "rotation": [0, 0, half, half], "scale": [2, 2, 2]},
        {"mesh": 0, "scale": [2, 2, 2], "name": "slider"},
        {"mesh": 0, "name": "bystander"},
    ]);
    file.json["scenes"][0]["nodes"] = json!([0, 2]);
    let times = file.floats("SCALAR", &[0.0, 2.0]);
    let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]);
    file.json["animations"] = json!([{
        "name": "slide",
        "channels": [
            {"sampler": 0, "target": {"node": 1, "path": "translation"}},
            {"sampler": 1, "target": {"node": 1, "path": "rotation"}},
        ],
        "samplers": [{"input": times, "output": positions}, {"input": times, "output": turns, "interpolation": "LINEAR"}],
    }]);
    file
}

#[test]
fn an_animated_node_is_a_part_of_its_own_that_moves_as_its_parents_turn_and_scale_it() {
    let scene = scene(&sliding());
    assert_eq!((scene.mesh.triangles.len(), scene.moving.len()), (2, 1), "{:?}", scene.notes);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let part = &scene.moving[0];
    assert_eq!((part.name.as_str(), part.shape.mesh.triangles.len(), part.chain.length_s), ("slider", 2, 2.0));
    let corner_m = |t_s: f64, x: f64, y: f64| {
        // Both scales act on the shape, and the outer one on the slide.
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let inner = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4 * t_s);
        turn * (DVec3::new(0.5 * t_s, 0.0, 0.0) * 2.0 + inner * DVec3::new(4.0 * x, 4.0 * y, 0.0))
            + DVec3::new(0.0, 0.0, 5.0)
    };
    for step in 0..20 {
        let t_s = 0.1 * f64::from(step);
        let pose = part.chain.at(t_s);
        for (number, [x, y]) in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].into_iter().enumerate() {
            let own_m = DVec3::from_array(part.shape.mesh.corners_m(0)[number].map(f64::from));
            let error_m = (pose.point(own_m) - corner_m(t_s, x, y)).length();
            // f32 of the quaternion of a quarter turn, times 5 m.
            assert!(error_m < 2e-6, "{t_s} s, corner {number}: {error_m:e} m");
        }
    }
    // As an object the file has both: what no animation moves first.
    let parts =
        Scene::parts_from_gltf("a.glb", &sliding().glb(), &FileUnits::default(), &|_| panic!("no file")).unwrap();
    let found: Vec<_> = parts.iter().map(|part| (part.name.as_str(), part.chain.joints.len())).collect();
    assert_eq!(found, [("a.glb", 0), ("slider", 2)]);
}

#[test]
fn a_file_of_which_all_moves_is_an_object_and_no_scene() {
    let alone = sliding().edited(|file| file.json["scenes"][0]["nodes"] = json!([0]));
    assert!(refusal(&alone.glb()).contains("[[scene.object]]"));
    let parts = Scene::parts_from_gltf("a.glb", &alone.glb(), &FileUnits::default(), &|_| panic!("no file")).unwrap();
    assert_eq!(parts.len(), 1);
}

#[test]
fn what_cannot_move_rigidly_stands_with_a_note_and_keys_that_make_no_sense_are_refused() {
    let noted = |edit: &dyn Fn(&mut File)| scene(&sliding().edited(|file| edit(file))).notes.join("; ");
    let unequal = noted(&|file| file.json["nodes"][0]["scale"] = json!([2, 3, 2]));
    assert!(unequal.contains("'slider' stands still"), "{unequal}");
    let mirrored = noted(&|file| file.json["nodes"][0]["scale"] = json!([-2, 2, 2]));
    assert!(mirrored.contains("'slider' stands still"), "{mirrored}");
    let scaled = noted(&|file| file.json["animations"][0]["channels"][0]["target"]["path"] = "scale".into());
    assert!(scaled.contains("scale not read of 'slider'"), "{scaled}");
    let second = noted(&|file| {
        let first = file.json["animations"][0].clone();
        file.json["animations"].as_array_mut().unwrap().push(first);
    });
    assert!(second.contains("animation 'slide' is not read: the first one plays"), "{second}");
    let keys = |times: &[f32], interpolation: &str| {
        let mut file = sliding();
        let input = file.floats("SCALAR", times);
        file.json["animations"][0]["samplers"][0]["input"] = input.into();
        file.json["animations"][0]["samplers"][0]["interpolation"] = interpolation.into();
        refusal(&file.glb())
    };
    assert!(keys(&[1.0, 0.5], "LINEAR").contains("use rising times"));
    assert!(keys(&[0.0, 1.0, 2.0], "STEP").contains("3 keys and 2 values"));
    assert!(keys(&[0.0, 1.0], "CUBICSPLINE").contains("use 6 values"));
    assert!(keys(&[-1.0, 1.0], "LINEAR").contains("negative"));
}

#[test]
fn a_channel_that_moves_no_node_is_left_out() {
    let mut file = File::square();
    let (times, values) = (file.floats("SCALAR", &[0.0, 1.0]), file.floats("SCALAR", &[0.0, 1.0]));
    let target =
        serde_json::json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/x"}}});
    file.json["animations"] = serde_json::json!([
        {"channels": [{"sampler": 0, "target": target}], "samplers": [{"input": times, "output": values}]},
    ]);
    file.json["extensionsUsed"] = serde_json::json!(["KHR_animation_pointer"]);
    let scene = scene(&file);
    assert!(scene.mesh.triangles.len() == 2 && scene.moving.is_empty());
    assert!(scene.notes.iter().any(|note| note.contains("KHR_animation_pointer")), "{:?}", scene.notes);
}
