//! The scenes that come with the program: what code makes of them, and targets against their own numbers.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use std::path::{Path, PathBuf};

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::num::{f32_from_i32, f32_nearest};
use sensel::scene::mesh::{Mesh, area_m2};
use sensel::scene::target::{self, TargetRequest};
use sensel::scene::{BakeSettings, Illuminant, Scene, Surroundings, generated};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

fn made(name: &str) -> Scene {
    generated::scene(name, &Surroundings::default(), &|file| {
        let path = folder(name).join(file);
        std::fs::read(&path).map_err(|source| Error::Io { path: path.display().to_string(), source })
    })
    .unwrap()
}

/// Least and greatest corner of a mesh.
fn extent_m(mesh: &Mesh) -> [[f32; 3]; 2] {
    mesh.vertices.iter().fold([[f32::MAX; 3], [f32::MIN; 3]], |[least, greatest], vertex| {
        let at = vertex.position_m;
        [[0, 1, 2].map(|axis| least[axis].min(at[axis])), [0, 1, 2].map(|axis| greatest[axis].max(at[axis]))]
    })
}

#[test]
fn large_scenes_have_their_size_their_triangles_and_the_same_bits_every_time() {
    let mut made_of = 0;
    // The street's houses across its ends have roofs 4.5 m deep behind their fronts at 49 m and at 22 m.
    for (name, size_m) in [("hall", [30.0, 12.2, 60.0]), ("street", [53.0, 22.0, 107.0])] {
        let scene = made(name);
        let count = scene.mesh.triangles.len();
        println!("{name}: {count} triangles, {} samples of light", scene.layout.samples.len());
        assert!((20_000..150_000).contains(&count), "{name}: {count} triangles");
        // Both sides of a sample, four bands of f32, and 64 to 256 rays a side of 4 bytes: below a gigabyte.
        assert!(scene.layout.samples.len() < 800_000, "{name}: {} samples", scene.layout.samples.len());
        let [least, greatest] = extent_m(&scene.mesh);
        for axis in 0..3 {
            let found_m = greatest[axis] - least[axis];
            // Reveals and panes stand behind the walls' faces by up to 0.6 m on each side; chimneys differ from house to house.
            assert!((found_m - size_m[axis]).abs() < 3.0, "{name} axis {axis}: {found_m} m");
        }
        assert_eq!(scene.bake_key(&BakeSettings::DRAFT), made(name).bake_key(&BakeSettings::DRAFT));
        made_of += count;
    }
    assert!(made_of > 100_000, "{made_of} triangles in all");
}

#[test]
fn round_surfaces_of_the_hall_have_smooth_normals_of_unit_length() {
    let scene = made("hall");
    let marble = scene.mesh.materials.iter().position(|material| material.name == "marble").unwrap();
    let mut seen = 0;
    for (triangle, _) in
        scene.mesh.material_of.iter().enumerate().filter(|(_, of)| usize::try_from(**of).unwrap() == marble)
    {
        let normals =
            scene.mesh.triangles[triangle].map(|corner| scene.mesh.vertices[usize::try_from(corner).unwrap()].normal);
        for normal in normals {
            let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
            // Three roundings of f32.
            assert!((length - 1.0).abs() < 5e-7, "{normal:?}");
        }
        seen += usize::from(normals[0] != normals[1] || normals[1] != normals[2]);
    }
    // 22 shafts of 32 sides and 8 rings, two triangles each.
    assert!(seen >= 22 * 32 * 8 * 2, "{seen} triangles of marble are round");
}

#[test]
fn leaves_of_the_street_are_cut_out_and_let_light_through() {
    let scene = made("street");
    let told = |block: &sensel::scene::bvh::TriangleBlock| {
        let (bits, triangles) = (block.cut_out, block.triangle);
        triangles.into_iter().enumerate().filter(move |(slot, _)| bits >> slot & 1 == 1).map(|(_, triangle)| triangle)
    };
    let cut_out = scene.bvh.blocks.iter().flat_map(told).collect::<std::collections::BTreeSet<_>>().len();
    // Eleven or twelve trees of 170 squares.
    assert!(cut_out >= 11 * 170 * 2, "{cut_out} triangles are cut out");
    let total_m2: f32 = (0..scene.mesh.triangles.len()).map(|triangle| area_m2(scene.mesh.corners_m(triangle))).sum();
    assert!(total_m2 > 4_000.0, "{total_m2} m2");
}

#[test]
fn every_scenario_in_the_folder_of_scenes_resolves_and_names_files_that_are_there() {
    let mut read = 0;
    for entry in std::fs::read_dir(folder("")).unwrap() {
        let path = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(path.join("scene.toml")) else { continue };
        let resolved = Resolved::from_layers("scene.toml", &text, &[]).unwrap();
        let scenario = &resolved.scenario;
        scenario.scene.check_target_keys().unwrap();
        scenario.scene.surroundings.check().unwrap();
        if let Some(generator) = &scenario.scene.generator {
            assert!(generated::NAMES.contains(&generator.as_str()), "{generator}");
        }
        if let Some(target) = &scenario.scene.target {
            target::named(target, &scenario.scene.target_request()).unwrap();
        }
        for file in [&scenario.scene.file, &scenario.motion.file].into_iter().flatten() {
            // Files of a scenario stand in its own folder or in that of another scene.
            assert!(path.join(file).is_file() || folder("bathroom").join(file).is_file(), "{file}");
        }
        assert!(path.join("README.md").is_file(), "{}", path.display());
        read += 1;
    }
    assert!(read >= 11, "{read} scenarios were read");
}

#[test]
fn a_generator_and_a_target_that_are_not_known_are_refused_with_those_that_are() {
    let nothing = |file: &str| -> Result<Vec<u8>, Error> { panic!("{file} is read") };
    let text = generated::scene("castle", &Surroundings::default(), &nothing).unwrap_err().to_string();
    assert!(text.contains("castle") && generated::NAMES.iter().all(|name| text.contains(name)), "{text}");
    let text = target::named("moire", &request(&[])).unwrap_err().to_string();
    assert!(text.contains("moire") && target::NAMES.iter().all(|name| text.contains(name)), "{text}");
}

fn request(given: &[(&'static str, f64)]) -> TargetRequest {
    let keys = [
        "target_distance_m",
        "target_size_m",
        "target_angle_deg",
        "target_contrast",
        "target_steps",
        "target_square_m",
        "target_point_m",
        "target_point_cd",
    ];
    let value = |key: &str| given.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
    TargetRequest { reflectance: 0.18, illuminance_lux: 100.0, sizes: keys.map(|key| (key, value(key))).to_vec() }
}

/// Reflectance of the material at each triangle that touches a point of the board's plane, or nothing there.
fn reflectance_at(scene: &Scene, [x, y]: [f32; 2], z: f32) -> f32 {
    let inside = |triangle: &usize| {
        let [a, b, c] = scene.mesh.corners_m(*triangle);
        let side = |p: [f32; 3], q: [f32; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let sides = [side(a, b), side(b, c), side(c, a)];
        [a, b, c].iter().all(|corner| corner[2] == z)
            && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
    };
    let triangle = (0..scene.mesh.triangles.len()).find(inside).expect("a point of the board");
    scene.mesh.materials[usize::try_from(scene.mesh.material_of[triangle]).unwrap()].base_colour[1]
}

#[test]
fn the_slanted_edge_runs_through_the_middle_at_its_angle_and_contrast() {
    for angle_deg in [-5.0, 0.0, 5.0, 30.0] {
        let scene =
            target::named("slanted_edge", &request(&[("target_distance_m", 2.0), ("target_angle_deg", angle_deg)]))
                .unwrap();
        let mut tried = 0;
        for step in -9..=9_i32 {
            let y = 0.2 * f32_from_i32(step);
            let edge = -y * f32_nearest(libm::tan(f64::to_radians(angle_deg)));
            // 1e-5 m is 40 roundings of coordinates up to 2 m.
            let [light, dark] = [edge - 1e-5, edge + 1e-5].map(|x| reflectance_at(&scene, [x, y], 2.0));
            // A mean of 0.18 at 4:1 is 0.288 and 0.072.
            assert!((light - 0.288).abs() < 1e-6 && (dark - 0.072).abs() < 1e-6, "{angle_deg} at {y}: {light} {dark}");
            tried += 1;
        }
        assert_eq!(tried, 19);
    }
}

#[test]
fn the_wedge_falls_in_equal_steps_of_density() {
    let wedge = TargetRequest { reflectance: 0.8, ..request(&[("target_contrast", 100.0)]) };
    let scene = target::named("grey_wedge", &wedge).unwrap();
    for step in 0..12_i32 {
        let x = (f32_from_i32(step) + 0.5) / 6.0 - 1.0;
        let expected = 0.8 * libm::pow(100.0, -f64::from(step) / 11.0);
        let found = f64::from(reflectance_at(&scene, [x, 0.3], 1.0));
        assert!((found / expected - 1.0).abs() < 1e-6, "step {step}: {found}, expected {expected}");
    }
}

#[test]
fn squares_of_the_checkerboard_have_their_size_and_alternate() {
    let scene = target::named("checkerboard", &request(&[("target_size_m", 1.0), ("target_square_m", 0.15)])).unwrap();
    // Six whole squares of 0.15 m fit in 1 m.
    let mut squares = 0;
    for row in 0..6_i32 {
        for column in 0..6_i32 {
            let at = |number: i32, part: f32| 0.15 * (f32_from_i32(number) + part) - 0.45;
            let expected = if (row + column) % 2 == 0 { 10.0 } else { 1.0 } * 0.36 / 11.0;
            for part in [0.001, 0.999] {
                let found = reflectance_at(&scene, [at(column, part), at(row, part)], 1.0);
                assert!((found - expected).abs() < 1e-6, "{row} {column}: {found}, expected {expected}");
            }
            squares += 1;
        }
    }
    assert_eq!(squares, 36);
    assert!((reflectance_at(&scene, [0.47, 0.0], 1.0) - 0.18).abs() < 1e-6);
}

#[test]
fn a_point_source_has_its_candela_and_its_position() {
    let scene =
        target::named("point_sources", &request(&[("target_square_m", 0.5), ("target_point_cd", 0.2)])).unwrap();
    let glow = scene.mesh.materials.iter().position(|material| material.is_emissive()).unwrap();
    let emission = f64::from(scene.mesh.materials[glow].emission[1]);
    let discs: Vec<usize> = (0..scene.mesh.triangles.len())
        .filter(|&t| usize::try_from(scene.mesh.material_of[t]).unwrap() == glow)
        .collect();
    // 2 m hold four by four discs of 24 sides.
    assert_eq!(discs.len(), 16 * 24);
    let area_m2: f64 = discs.iter().map(|&t| f64::from(area_m2(scene.mesh.corners_m(t)))).sum::<f64>() / 16.0;
    let lit = scene.evenly_lit(100.0, Illuminant::D65);
    let exitance = lit.exitance_bounds().emitted[1];
    // Luminance is exitance over pi, intensity is luminance times area; corners of discs are rounded to 1e-7 of 1 m, radii are 5 mm.
    assert!((exitance / std::f64::consts::PI * area_m2 / 0.2 - 1.0).abs() < 1e-4, "{emission} {exitance} {area_m2}");
}

#[test]
fn keys_that_a_target_does_not_read_and_values_out_of_range_are_refused_by_name() {
    let cases: [(&str, &[(&'static str, f64)], &str); 9] = [
        ("flat", &[("target_size_m", 1.0)], "scene.target_size_m"),
        ("blank_wall", &[("target_angle_deg", 1.0)], "scene.target_angle_deg"),
        ("slanted_edge", &[("target_square_m", 1.0)], "scene.target_square_m"),
        ("slanted_edge", &[("target_angle_deg", 46.0)], "scene.target_angle_deg"),
        ("slanted_edge", &[("target_distance_m", 0.0)], "scene.target_distance_m"),
        ("slanted_edge", &[("target_contrast", f64::NAN)], "scene.target_contrast"),
        ("grey_wedge", &[("target_steps", 1.0)], "scene.target_steps"),
        ("checkerboard", &[("target_square_m", 1e-4)], "scene.target_square_m"),
        ("point_sources", &[("target_point_m", 1.0)], "scene.target_point_m"),
    ];
    let mut refused = 0;
    for (name, given, key) in cases {
        let text = target::named(name, &request(given)).unwrap_err().to_string();
        assert!(text.contains(key) && text.contains("use ") || text.contains("has no effect"), "{text}");
        refused += 1;
    }
    assert_eq!(refused, 9);
    let bright = TargetRequest { reflectance: 0.9, ..request(&[]) };
    assert!(target::named("slanted_edge", &bright).unwrap_err().to_string().contains("0.625"));
}

/// Edges of boards may leave slivers between them that vanish in single precision, or meet the board's corners.
#[test]
fn every_board_within_the_ranges_is_made() {
    const SEED: u64 = 20;
    let mut made = 0;
    let mut make = |name: &str, given: &[(&'static str, f64)]| {
        let scene = target::named(name, &request(given)).unwrap_or_else(|error| panic!("{name} {given:?}: {error}"));
        assert!(scene.mesh.triangles.len() > 10, "{name} {given:?}");
        made += 1;
    };
    for angle_deg in [-45.0, -44.999_999_99, 0.0, 44.999_999_99, 45.0] {
        for size_m in [0.001, 1.0, 10_000.0] {
            make("slanted_edge", &[("target_angle_deg", angle_deg), ("target_size_m", size_m)]);
        }
    }
    for square_m in [0.333_333_33, 1.0 / 3.0, 0.333_333_34, 0.1, 0.7, 1.0] {
        make("checkerboard", &[("target_size_m", 1.0), ("target_square_m", square_m)]);
        make("point_sources", &[("target_size_m", 1.0), ("target_square_m", square_m)]);
    }
    let unit =
        |number: u64| f64::from(u32::try_from(sensel::draw::mix(SEED ^ number) >> 32).unwrap()) / 4_294_967_296.0;
    let cases = crate::common::cases(200, 40);
    for case in 0..cases {
        let [distance_m, size_m] = [0, 1].map(|k| libm::pow(10.0, 7.0 * unit(4 * case + k) - 3.0).max(0.01));
        let square_m = size_m * (0.03 + 0.97 * unit(4 * case + 2));
        let extent = [("target_distance_m", distance_m), ("target_size_m", size_m)];
        println!("seed {SEED}, case {case}: {extent:?}, squares of {square_m} m");
        make("checkerboard", &[&extent[..], &[("target_square_m", square_m)]].concat());
        make("slanted_edge", &[&extent[..], &[("target_angle_deg", 90.0 * unit(4 * case + 3) - 45.0)]].concat());
        make("point_sources", &[&extent[..], &[("target_square_m", square_m)]].concat());
        make("grey_wedge", &extent);
    }
    assert_eq!(made, 15 + 12 + 4 * cases);
}

#[test]
fn a_reflectance_or_a_square_that_a_refusal_names_is_taken() {
    let mut tried = 0;
    for contrast in [1.0, 1.3, 4.0, 7.0, 33.3, 9_999.0] {
        for name in ["slanted_edge", "checkerboard"] {
            let given = [("target_contrast", contrast)];
            let most = (1.0 + contrast) / (2.0 * contrast);
            let Err(error) = target::named(name, &TargetRequest { reflectance: 1.0, ..request(&given) }) else {
                assert_eq!(contrast, 1.0);
                continue;
            };
            assert!(error.to_string().contains(&format!("use {most} or less")), "{error}");
            target::named(name, &TargetRequest { reflectance: most, ..request(&given) }).unwrap();
            tried += 1;
        }
    }
    for (name, least_m) in [("checkerboard", 80.0 / 500.0), ("point_sources", 80.0 / 50.0)] {
        let size = ("target_size_m", 80.0);
        let error = target::named(name, &request(&[size, ("target_square_m", 0.97 * least_m)])).unwrap_err();
        assert!(error.to_string().contains(&format!("use {least_m} or more")), "{error}");
        target::named(name, &request(&[size, ("target_square_m", least_m)])).unwrap();
        tried += 1;
    }
    assert_eq!(tried, 12);
}
