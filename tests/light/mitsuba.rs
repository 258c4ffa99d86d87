//! The textured box room as Mitsuba sees it, from the same camera: direct light, and light after all bounces.

use std::path::Path;
use std::process::Command;

use super::candela::ball_of;
use super::room::{camera, looking, seen};
use glam::DVec3;
use sensel::num::{f32_from_u32, f32_nearest, index, u32_truncated_f32};
use sensel::optics::{Camera, Pupil};
use sensel::pose::Pose;
use sensel::scene::environment::{SUN_RADIUS, Sun};
use sensel::scene::maps::Maps;
use sensel::scene::mesh::{Material, Mesh};
use sensel::scene::target::cube;
use sensel::scene::texture::{Footprint, Texture, Wrap};
use sensel::scene::{BakeCost, BakeSettings, Illuminant, Scene, box_room};
use sensel::units::Size;

const SIZE: Size = Size { width_px: 40, height_px: 30 };
const FOV_RAD: f64 = 1.4;
/// Texels that one of the exported pictures stands for, along each edge: below what one of these few pixels sees.
const COARSER: f32 = 4.0;

/// Linear texels of a material's picture, a level or two down; returns the size.
fn export_texture(scene: &Scene, number: u32, path: &Path) -> [u32; 2] {
    let texture = &scene.mesh.textures[index(number)];
    let size = texture.size().map(|edge| u32_truncated_f32((edge / COARSER).ceil()));
    let mut bytes = Vec::new();
    for row in 0..size[1] {
        for column in 0..size[0] {
            let uv = [(column, size[0]), (row, size[1])].map(|(at, of)| (f32_from_u32(at) + 0.5) / f32_from_u32(of));
            for band in &texture.colour(uv, COARSER)[..3] {
                bytes.extend(band.to_le_bytes());
            }
        }
    }
    std::fs::write(path, bytes).unwrap();
    size
}

/// Writes all texels of a map, as they are.
fn export_map(scene: &Scene, number: u32, factors: [f32; 3], folder: &Path) -> serde_json::Value {
    let texture = &scene.mesh.textures[index(number)];
    let size = texture.size().map(u32_truncated_f32);
    let mut bytes = Vec::new();
    for (row, column) in (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (row, column))) {
        let uv = [(column, size[0]), (row, size[1])].map(|(at, of)| (f32_from_u32(at) + 0.5) / f32_from_u32(of));
        texture.over(uv, &Footprint::POINT)[..3].iter().for_each(|band| bytes.extend(band.to_le_bytes()));
    }
    let file = format!("map{number}.f32");
    std::fs::write(folder.join(&file), bytes).unwrap();
    serde_json::json!({"file": file, "size": size, "factors": factors})
}

/// Writes faces (two triangles each, as `append_quad` makes them) and pictures.
fn export_faces(scene: &Scene, folder: &Path) -> Vec<serde_json::Value> {
    let mut faces = Vec::new();
    // Balls are lights without size there.
    let is_face = |first: &usize| scene.mesh.materials[index(scene.mesh.material_of[*first])].bulb.is_none();
    for first in (0..scene.mesh.triangles.len()).step_by(2).filter(is_face) {
        let [a, b, c] = scene.mesh.triangles[first];
        let [_, _, d] = scene.mesh.triangles[first + 1];
        let vertices = [a, b, c, d].map(|corner| scene.mesh.vertices[index(corner)]);
        let material = &scene.mesh.materials[index(scene.mesh.material_of[first])];
        let name = format!("face{first}.f32");
        let size = material.texture.map(|number| export_texture(scene, number, &folder.join(&name)));
        faces.push(serde_json::json!({
            "corners_m": vertices.map(|vertex| vertex.position_m),
            "uvs": vertices.map(|vertex| vertex.uv),
            "colour": &material.base_colour[..3],
            "two_sided": material.double_sided,
            "is_mirror": material.metallic > 0.0,
            "radiance": &material.emission[..3],
            "texture": size.map(|_| name),
            "texture_size": size,
            "normal_map": material.maps.normal.map(|(map, _)| export_map(scene, map, [1.0; 3], folder)),
            "emission_map": material.maps.emission.map(|(map, factors)| {
                export_map(scene, map, [factors[0], factors[1], factors[2]], folder)
            }),
        }));
    }
    faces
}

#[test]
fn mitsuba_sees_the_box_room_within_two_per_cent() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mitsuba_box");
    std::fs::create_dir_all(&folder).unwrap();
    let scene = box_room::box_room(1);
    let camera = camera(SIZE, FOV_RAD, 1.0, Pupil::ThinLens);
    let poses = [(DVec3::new(0.0, 1.5, 0.3), 0.4, 0.35), (DVec3::new(0.4, 1.3, -0.2), 2.4, 0.25)];
    let views = poses.map(|(at_m, turn, down)| view(&looking(at_m, turn, down)));
    // Four times the rays that the box scenario has; those are compared as well, and may differ by a little more.
    let fine = BakeSettings { grid_rays: 1024, ..BakeSettings::ROOM };
    let all = [("direct", fine.direct()), ("full", fine), ("default", BakeSettings::of(&scene))];
    for (name, settings) in all {
        let start = std::time::Instant::now();
        let bake = scene.bake(&settings, &|_| {});
        println!("{name}: baked in {:.2} s, {:?}", start.elapsed().as_secs_f64(), BakeCost::of(&scene, &settings));
        let lit = scene.clone().lit_absolutely(&bake, DVec3::new(0.0, 1.5, 0.3), Illuminant::D65).unwrap();
        for (number, (at_m, turn, down)) in poses.into_iter().enumerate() {
            let photons = seen(&lit, &camera, looking(at_m, turn, down), 2048).photons;
            let bytes: Vec<u8> = photons.values().iter().flat_map(|value| value.to_le_bytes()).collect();
            std::fs::write(folder.join(format!("{name}{number}.f32")), bytes).unwrap();
        }
    }
    let description = serde_json::json!({
        "size": [SIZE.width_px, SIZE.height_px],
        "horizontal_fov_deg": FOV_RAD.to_degrees(),
        "views": views,
        "faces": export_faces(&scene, &folder),
        "photons_per_radiance": per_radiance(&camera),
    });
    std::fs::write(folder.join("scene.json"), description.to_string()).unwrap();
    let found = judged(&folder, 1024);
    // 2 % is asked for, and is compared over squares of 2 by 2 pixels, where Mitsuba's own noise with 1,024 paths a pixel is 0.5 %
    // (two seeds). The default's 256 rays per sample leave about 2 %, alike over a wall.
    for (name, bound) in [("direct", 0.02), ("full", 0.02), ("default", 0.025)] {
        let error = found[name]["mean_relative_error"].as_f64().unwrap();
        assert!(error < bound, "{name}: {found}");
        let ratio = found[name]["ratio_of_means"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 0.005, "{name}: {found}");
    }
    // Two pictures of two views, four pixels to a square.
    assert_eq!(found["pixels"], SIZE.width_px * SIZE.height_px);
}

/// What the judge says of a folder, with so many paths a pixel. Fails where this Mitsuba's pictures are recorded for another scene,
/// since they would take a minute each day from then on. Another Mitsuba renders each time.
fn judged(folder: &Path, paths: u32) -> serde_json::Value {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/judges/mitsuba_box.py");
    let name = folder.file_name().unwrap().to_str().unwrap();
    let record = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/vectors/mitsuba/{name}.npz"));
    let output = Command::new(python).arg(script).arg(folder).arg(paths.to_string()).arg(record).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // The judge's answer is its last line; Mitsuba's own warnings end in an escape code that has none.
    let said = String::from_utf8_lossy(&output.stdout);
    let answer = said.rfind("{\"spp\"").map(|at| &said[at..]).unwrap_or_else(|| panic!("no answer in {said:?}"));
    let found: serde_json::Value = serde_json::from_str(answer.trim_end()).unwrap();
    println!("{found}");
    let is_right = !["stale", "wrong"].iter().any(|state| found["record"] == *state);
    assert!(is_right, "SENSEL_UPDATE=1 records Mitsuba's pictures of this scene: {found}");
    found
}

/// A camera's pose as the judge takes it.
fn view(pose: &Pose) -> serde_json::Value {
    let (at_m, axis) = (pose.translation_m, |axis: DVec3| pose.rotation * axis);
    let target_m = (at_m + axis(DVec3::Z)).to_array();
    serde_json::json!({"origin_m": at_m.to_array(), "target_m": target_m, "up": axis(-DVec3::Y).to_array()})
}

/// Photons by band of a radiance of 1 over the exposure: white light of one lux has exitance 1, and a radiance of 1 an exitance of pi.
fn per_radiance(camera: &Camera) -> Vec<f64> {
    let per_lux_s = camera.photons_per_lux_s(Illuminant::D65);
    per_lux_s[..3].iter().map(|per_lux| per_lux * 0.01 * std::f64::consts::PI).collect()
}

/// A floor and a wall with white pictures on them, a grey wall; and what lights them.
fn white_corner() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.textures.push(Texture::from_srgb(2, 2, &[[255; 3]; 4], [Wrap::Repeat; 2]));
    mesh.materials.push(Material { texture: Some(0), ..Material::plain("white", [1.0; 3]) });
    mesh.materials.push(Material::plain("grey", [0.4, 0.5, 0.6]));
    mesh.append_quad(0, [[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0], [-2.0, 0.0, -2.0]], [1.0, 1.0]);
    mesh.append_quad(0, [[-2.0, 0.0, -2.0], [2.0, 0.0, -2.0], [2.0, 3.0, -2.0], [-2.0, 3.0, -2.0]], [1.0, 1.0]);
    mesh.append_quad(1, [[2.0, 0.0, -2.0], [2.0, 0.0, 2.0], [2.0, 3.0, 2.0], [2.0, 3.0, -2.0]], [1.0, 1.0]);
    mesh
}

/// White pictures under an area lamp, a point light and a spot light: their levels, where a clamped colour or a lamp of too
/// few sides shows as a few per cent.
#[test]
fn mitsuba_sees_white_pictures_under_small_lamps_as_bright_as_they_are_here() {
    let camera = camera(SIZE, FOV_RAD, 1.0, Pupil::ThinLens);
    let pose = looking(DVec3::new(-0.8, 1.6, 1.9), 0.3, 0.5);
    let (inner_deg, outer_deg) = (34.5_f64, 35.0_f64);
    let lights = [
        ("area", serde_json::json!([]), serde_json::Value::Null),
        (
            "point",
            serde_json::json!([{"type": "point", "position_m": [0.3, 2.4, 0.5], "intensity": [100.0, 100.0, 100.0]}]),
            serde_json::json!({"type": "point", "intensity": 100}),
        ),
        (
            "spot",
            serde_json::json!([{"type": "spot", "position_m": [0.3, 2.4, 0.5], "target_m": [0.3, 0.0, 0.5],
                "intensity": [100.0, 100.0, 100.0], "inner_deg": inner_deg, "outer_deg": outer_deg}]),
            serde_json::json!({"type": "spot", "intensity": 100, "spot": {
                "innerConeAngle": inner_deg.to_radians(), "outerConeAngle": outer_deg.to_radians()}}),
        ),
    ];
    for (name, theirs, light) in lights {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("mitsuba_{name}"));
        std::fs::create_dir_all(&folder).unwrap();
        let mut mesh = white_corner();
        if light.is_null() {
            let glow = Material { emission: [9.0; 4], double_sided: false, ..Material::plain("lamp", [0.0; 3]) };
            mesh.materials.push(glow);
            let lamp = [[-0.4, 2.9, -0.4], [0.6, 2.9, -0.4], [0.6, 2.9, 0.6], [-0.4, 2.9, 0.6]];
            mesh.append_quad(2, lamp, [1.0, 1.0]);
        } else {
            // The ball that a file's light becomes, taken from a file.
            let ball = ball_of(&light, [0.3, 2.4, 0.5]);
            mesh.materials.push(ball.0);
            mesh.append(2, ball.1.clone(), &ball.2).unwrap();
        }
        let scene = Scene::new(name, mesh, [0.0; 4]).unwrap();
        let bake = scene.bake(&BakeSettings { grid_rays: 1024, ..BakeSettings::FINE }, &|_| {});
        let lit = scene.clone().lit_absolutely(&bake, DVec3::new(0.0, 1.0, 0.0), Illuminant::D65).unwrap();
        let photons = seen(&lit, &camera, pose, 2048).photons;
        let bytes: Vec<u8> = photons.values().iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.join("full0.f32"), bytes).unwrap();
        let description = serde_json::json!({
            "size": [SIZE.width_px, SIZE.height_px], "horizontal_fov_deg": FOV_RAD.to_degrees(), "views": [view(&pose)],
            "faces": export_faces(&scene, &folder), "lights": theirs, "photons_per_radiance": per_radiance(&camera),
        });
        std::fs::write(folder.join("scene.json"), description.to_string()).unwrap();
        let found = judged(&folder, 512);
        let ratio = found["full"]["ratio_of_means"].as_f64().unwrap();
        let median = found["full"]["bright_median_relative_error"].as_f64().unwrap();
        // 1 % is asked for. Edges of shadows and cones are as sharp as samples stand, 8 cm, so the median stands for the level; and it is
        // taken where light comes straight from the lamp, because what comes by walls alone is a few rays' for a spot light.
        assert!((ratio - 1.0).abs() < 0.01 && median < 0.01, "{name}: {found}");
    }
}

/// Four columns and a low box on a floor.
fn columns() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material::plain("grey", [0.5; 3]));
    mesh.append_quad(0, [[-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, -4.0]], [1.0, 1.0]);
    for x in [-1.2_f32, -0.4, 0.4, 1.2] {
        for corners_m in cube([x - 0.06, 0.0, -0.06], [x + 0.06, 1.1, 0.06], false) {
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
    }
    for corners_m in cube([-0.25, 0.0, 0.4], [0.25, 0.12, 0.7], false) {
        mesh.append_quad(0, corners_m, [1.0, 1.0]);
    }
    mesh
}

/// What the judge says of shadows, in pixels of 1 to 3 cm: with shadows traced ("full") and as baked ("default").
fn judged_shadows(name: &str, mesh: Mesh, pose: Pose, lights: &serde_json::Value) -> serde_json::Value {
    let size = Size { width_px: 160, height_px: 120 };
    let camera = camera(size, FOV_RAD, 1.0, Pupil::ThinLens);
    let scene = Scene::new(name, mesh, [0.0; 4]).unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("mitsuba_{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    let bake = scene.bake(&BakeSettings::ROOM, &|_| {});
    let lit = scene.clone().lit_absolutely(&bake, DVec3::new(0.0, 2.0, 0.0), Illuminant::D65).unwrap();
    for (name, lit) in [("full", lit.clone()), ("default", lit.with_baked_shadows())] {
        let photons = seen(&lit, &camera, pose, 256).photons;
        let bytes: Vec<u8> = photons.values().iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("{name}0.f32")), bytes).unwrap();
    }
    let description = serde_json::json!({
        "size": [size.width_px, size.height_px], "horizontal_fov_deg": FOV_RAD.to_degrees(), "views": [view(&pose)],
        "faces": export_faces(&scene, &folder), "lights": lights, "photons_per_radiance": per_radiance(&camera),
    });
    std::fs::write(folder.join("scene.json"), description.to_string()).unwrap();
    judged(&folder, 256)
}

/// The sun alone, a disc of 0.53 degrees: where its shadows lie.
#[test]
fn mitsuba_sees_the_suns_shadows_where_they_are_here() {
    let mut mesh = columns();
    let towards = DVec3::new(0.5, 0.7, -0.4).normalize();
    let direction = towards.to_array().map(f32_nearest);
    mesh.distant.push(Sun { direction, normal_irradiance: [1.0; 4] });
    let sun = serde_json::json!([{"type": "sun", "towards": towards.to_array(), "radius_rad": SUN_RADIUS,
        "irradiance": [1.0, 1.0, 1.0]}]);
    let found = judged_shadows("sun", mesh, looking(DVec3::new(0.0, 1.2, 2.0), 0.0, 0.6), &sun);
    let figure = |name: &str, figure: &str| found[name][figure].as_f64().unwrap();
    assert!((figure("full", "ratio_of_means") - 1.0).abs() < 0.01, "{found}");
    // What lies in the shade has the noise of 256 rays by way of the floor and the columns: a few per cent.
    assert!(figure("full", "median_relative_error") < 0.03, "{found}");
    assert!(figure("full", "share_beyond_20_per_cent") < 0.01, "{found}");
    assert!(figure("default", "share_beyond_20_per_cent") > 0.03, "the bake alone is as good: {found}");
}

/// A room with a table, things on it and on the floor and a shelf, under a panel of 0.3 m in the ceiling. The things are closed boxes, or
/// two-sided and open below.
fn table_room(is_open: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let one_sided = |name: &str, colour| Material { double_sided: false, ..Material::plain(name, colour) };
    mesh.materials.push(one_sided("wall", [0.6, 0.6, 0.55]));
    mesh.materials.push(Material { double_sided: is_open, ..one_sided("wood", [0.45, 0.35, 0.25]) });
    mesh.materials.push(Material { emission: [30.0; 4], ..one_sided("panel", [0.0; 3]) });
    let mut put = |material: u32, [least_m, greatest_m]: [[f32; 3]; 2], is_room: bool| {
        let faces = cube(least_m, greatest_m, is_room);
        let is_there = |face: &[[f32; 3]; 4]| is_room || !is_open || face.iter().any(|corner| corner[1] > least_m[1]);
        faces.into_iter().filter(is_there).for_each(|face| mesh.append_quad(material, face, [1.0, 1.0]));
    };
    put(0, [[-2.0, 0.0, -2.0], [2.0, 2.5, 2.0]], true);
    for x in [-0.55_f32, 0.5] {
        for z in [-0.85_f32, -0.3] {
            put(1, [[x, 0.0, z], [x + 0.05, 0.72, z + 0.05]], false);
        }
    }
    for wooden in [
        [[-0.6, 0.72, -0.9], [0.6, 0.76, -0.2]],
        [[-0.3, 0.76, -0.7], [-0.1, 0.9, -0.5]],
        [[0.2, 0.76, -0.6], [0.45, 0.79, -0.4]],
        [[-1.2, 0.0, 0.2], [-0.9, 0.4, 0.6]],
        [[0.5, 0.0, 0.3], [1.0, 0.12, 0.7]],
        [[-1.99, 1.0, -1.0], [-1.8, 1.03, 0.5]],
    ] {
        put(1, wooden, false);
    }
    let panel = [[-0.05, 2.48, -0.15], [0.25, 2.48, -0.15], [0.25, 2.48, 0.15], [-0.05, 2.48, 0.15]];
    mesh.append_quad(2, panel, [1.0; 2]);
    mesh
}

/// A lamp that is 7 to 12 degrees wide as seen from what it lights: shadows are sharp where things stand on one another.
#[test]
fn mitsuba_sees_the_shadows_of_wide_lamps_where_they_are_here() {
    let pose = looking(DVec3::new(-0.5, 0.9, 1.5), 0.4, 0.35);
    let found = judged_shadows("wide", table_room(false), pose, &serde_json::json!([]));
    let figure = |name: &str, figure: &str| found[name][figure].as_f64().unwrap();
    // 1 % and 3 % are asked for. Mitsuba's own noise with 256 paths is 1 to 2 % in a square of four pixels.
    assert!((figure("full", "ratio_of_means") - 1.0).abs() < 0.01, "{found}");
    assert!(figure("full", "median_relative_error") < 0.03, "{found}");
    assert!(figure("full", "share_beyond_20_per_cent") < 0.003, "{found}");
    assert!(figure("default", "share_beyond_20_per_cent") > 0.006, "the bake alone is as good: {found}");
}

/// Boxes without a bottom, whose dark inside must not show on the floor around them.
#[test]
fn mitsuba_sees_the_floor_beside_open_two_sided_boxes_as_bright_as_it_is_here() {
    let pose = looking(DVec3::new(-0.5, 0.9, 1.5), 0.4, 0.35);
    let found = judged_shadows("open", table_room(true), pose, &serde_json::json!([]));
    let figure = |name: &str, figure: &str| found[name][figure].as_f64().unwrap();
    assert!((figure("full", "ratio_of_means") - 1.0).abs() < 0.01, "{found}");
    assert!(figure("full", "median_relative_error") < 0.03, "{found}");
    assert!(figure("full", "share_beyond_20_per_cent") < 0.003, "{found}");
}

/// A white floor beside a mirror of 1.8 by 1.6 m that hangs on a wall, turned a little, and a crate between them; a lamp of 1 m^2 above.
fn mirror_room() -> Mesh {
    let mut mesh = Mesh::default();
    let one_sided = |name: &str, colour| Material { double_sided: false, ..Material::plain(name, colour) };
    mesh.materials.push(one_sided("white", [0.8; 3]));
    // All that it reflects: then Schlick's rise to 1 is the same in every model.
    mesh.materials.push(Material { metallic: 1.0, roughness: 0.0, ..one_sided("mirror", [1.0; 3]) });
    mesh.materials.push(Material { emission: [30.0; 4], ..one_sided("lamp", [0.0; 3]) });
    cube([-2.0, 0.0, -2.0], [2.0, 2.5, 2.0], true).into_iter().for_each(|face| mesh.append_quad(0, face, [1.0; 2]));
    cube([1.0, 0.0, -0.8], [1.3, 0.4, -0.5], false).into_iter().for_each(|face| mesh.append_quad(0, face, [1.0; 2]));
    mesh.append_quad(1, [[1.9, 0.3, 0.9], [1.7, 0.3, -0.9], [1.7, 1.9, -0.9], [1.9, 1.9, 0.9]], [1.0; 2]);
    mesh.append_quad(2, [[-1.0, 2.4, -0.5], [0.0, 2.4, -0.5], [0.0, 2.4, 0.5], [-1.0, 2.4, 0.5]], [1.0; 2]);
    mesh
}

/// The floor where a lamp shines straight and over a mirror, and the wall that the mirror throws the lamp's light on.
#[test]
fn mitsuba_sees_what_a_lamp_lights_over_a_mirror() {
    let pose = looking(DVec3::new(-1.6, 1.6, 1.6), 0.9, 0.6);
    let found = judged_shadows("mirror", mirror_room(), pose, &serde_json::json!([]));
    let figure = |name: &str, figure: &str| found[name][figure].as_f64().unwrap();
    assert!((figure("full", "ratio_of_means") - 1.0).abs() < 0.01, "{found}");
    assert!(figure("full", "median_relative_error") < 0.015, "{found}");
    assert!(figure("full", "share_beyond_20_per_cent") < 0.001, "{found}");
}

/// A wavy normal map: codes of the normals of a height field, of slopes up to 0.5, whose waves are an eighth of the picture long.
fn waves() -> Texture {
    const EDGE: u32 = 256;
    let slope = |at: u32| 0.5 * libm::sinf(f32_from_u32(at) / f32_from_u32(EDGE) * 16.0 * std::f32::consts::PI);
    let code = |value: f32| u8::try_from(u32_truncated_f32(127.5 * (value + 1.0) + 0.5)).unwrap();
    let codes: Vec<[u8; 3]> = (0..EDGE * EDGE)
        .map(|texel| {
            let [x, y] = [slope(texel % EDGE), slope(texel / EDGE)];
            let length = (x * x + y * y + 1.0).sqrt();
            [x / length, y / length, 1.0 / length].map(code)
        })
        .collect();
    Texture::from_linear(EDGE, EDGE, &codes, [Wrap::Clamp; 2])
}

/// Floor and wall with a normal map, under a point light, the sun and a glowing picture on the third wall.
#[test]
fn mitsuba_sees_normal_and_emission_maps_as_they_are_here() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mitsuba_maps");
    std::fs::create_dir_all(&folder).unwrap();
    let camera = camera(SIZE, FOV_RAD, 1.0, Pupil::ThinLens);
    let poses = [looking(DVec3::new(-0.8, 1.6, 1.9), 0.3, 0.5), looking(DVec3::new(0.3, 1.0, 0.5), 0.0, 0.9)];
    let mut mesh = white_corner();
    mesh.textures.push(waves());
    mesh.materials[0].maps = Maps { normal: Some((1, 1.0)), ..Maps::default() };
    mesh.materials[0].base_colour = [0.5; 4];
    // A picture of four colours, of which one is black.
    let glow = [[255, 0, 0], [0, 255, 0], [0, 0, 0], [255, 255, 255]];
    mesh.textures.push(Texture::from_srgb(2, 2, &glow, [Wrap::Clamp; 2]));
    let maps = Maps { emission: Some((2, [2.0; 4])), ..Maps::default() };
    let mean = [1.0, 1.0, 0.5, 1.0];
    mesh.materials.push(Material {
        texture: Some(0),
        emission: mean,
        maps,
        double_sided: false,
        ..Material::plain("picture", [0.2; 3])
    });
    mesh.append_quad(2, [[-2.0, 0.5, 0.0], [-2.0, 0.5, -1.0], [-2.0, 1.5, -1.0], [-2.0, 1.5, 0.0]], [1.0, 1.0]);
    let ball = ball_of(&serde_json::json!({"type": "point", "intensity": 20}), [0.3, 1.4, 0.5]);
    mesh.materials.push(ball.0);
    mesh.append(3, ball.1.clone(), &ball.2).unwrap();
    let towards = DVec3::new(0.3, 0.7, 0.5).normalize();
    mesh.distant.push(Sun { direction: towards.to_array().map(f32_nearest), normal_irradiance: [10.0; 4] });
    let scene = Scene::new("maps", mesh, [0.0; 4]).unwrap();
    let fine = BakeSettings { grid_rays: 1024, ..BakeSettings::FINE };
    for (name, settings) in [("direct", fine.direct()), ("full", fine)] {
        let bake = scene.bake(&settings, &|_| {});
        let lit = scene.clone().lit_absolutely(&bake, DVec3::new(0.0, 1.0, 0.0), Illuminant::D65).unwrap();
        for (number, pose) in poses.iter().enumerate() {
            let photons = seen(&lit, &camera, *pose, 512).photons;
            let bytes: Vec<u8> = photons.values().iter().flat_map(|value| value.to_le_bytes()).collect();
            std::fs::write(folder.join(format!("{name}{number}.f32")), bytes).unwrap();
        }
    }
    let lights = serde_json::json!([
        {"type": "point", "position_m": [0.3, 1.4, 0.5], "intensity": [20.0, 20.0, 20.0]},
        {"type": "sun", "towards": towards.to_array(), "radius_rad": SUN_RADIUS, "irradiance": [10.0, 10.0, 10.0]}
    ]);
    let description = serde_json::json!({
        "size": [SIZE.width_px, SIZE.height_px], "horizontal_fov_deg": FOV_RAD.to_degrees(),
        "views": poses.iter().map(view).collect::<Vec<_>>(),
        "faces": export_faces(&scene, &folder), "lights": lights, "photons_per_radiance": per_radiance(&camera),
    });
    std::fs::write(folder.join("scene.json"), description.to_string()).unwrap();
    let found = judged(&folder, 512);
    let figure = |name: &str, figure: &str| found[name][figure].as_f64().unwrap();
    // 1 % and 3 % are asked for. Bounces have the smooth normal here; Mitsuba drops those that the mapped one sends below the surface.
    for (name, mean, median) in [("direct", 0.01, 0.01), ("full", 0.02, 0.03)] {
        assert!((figure(name, "ratio_of_means") - 1.0).abs() < mean, "{name}: {found}");
        assert!(figure(name, "median_relative_error") < median, "{name}: {found}");
    }
}
