//! Surfaces of glTF files: colours, coverage, backs, and what is said of the rest.

use glam::{DQuat, DVec3};
use sensel::pose::Pose;
use sensel::scene::Illuminant;
use sensel::scene::mesh::BackfaceCulled;
use sensel::scene::texture::Footprint;
use sensel::scene::tracer::{Holes, MISS, Stack, closest_through};
use sensel::scene::views::packet_of;

use super::file::{File, png};
use super::{refusal, scene};

#[test]
fn colours_of_vertices_are_interpolated_between_them() {
    let colours = [[1.0_f32, 0.0, 0.25], [0.5, 1.0, 0.25], [0.0, 0.5, 0.75], [1.0, 1.0, 1.0]];
    let mut tried = 0;
    for has_normals in [false, true] {
        let mut file = File::square();
        let colours_at = file.floats("VEC3", colours.as_flattened());
        file.attributes()["COLOR_0"] = colours_at.into();
        if has_normals {
            let normals = file.floats("VEC3", &[0.0_f32, 0.0, 1.0].repeat(4));
            file.attributes()["NORMAL"] = normals.into();
        }
        file.json["materials"][0]["pbrMetallicRoughness"] =
            serde_json::json!({"baseColorFactor": [0.5, 0.5, 0.5, 1.0]});
        let lit = scene(&file).evenly_lit(100.0, Illuminant::D65);
        for (triangle, corners) in [(0_u32, [0, 1, 2]), (1, [0, 2, 3])] {
            for [u, v] in [[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.25, 0.125]] {
                let found = lit.exitance_lux(triangle, [u, v], [0.0, 0.0, -1.0], &Footprint::POINT, 1.0);
                let [a, b, c] = corners.map(|corner| colours[corner]);
                for band in 0..3 {
                    // Half the light, times the colour between the corners. A few roundings of f32.
                    let expected = 50.0 * (a[band] * (1.0 - u - v) + b[band] * u + c[band] * v);
                    assert!((found[band] - expected).abs() < 1e-4, "{triangle} {u} {v}: {found:?} {expected}");
                    tried += 1;
                }
            }
        }
    }
    assert_eq!(tried, 60);
}

#[test]
fn blended_surfaces_stop_as_large_a_share_of_rays_as_alpha_says() {
    let plain = |alpha: f32| {
        let factor = serde_json::json!({"baseColorFactor": [1.0, 1.0, 1.0, alpha]});
        File::square().edited(|file| file.json["materials"][0]["pbrMetallicRoughness"] = factor)
    };
    let picture = |code: u8, alpha: f32| {
        let mut file = File::square();
        file.picture(&png(1, 1, &[[255, 255, 255, code]]));
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] =
            serde_json::json!([1.0, 1.0, 1.0, alpha]);
        file
    };
    let cases =
        [(plain(0.3), 0.3), (plain(0.9), 0.9), (picture(51, 1.0), 0.2), (picture(51, 0.5), 0.1), (plain(1.0), 1.0)];
    let mut tried = 0;
    for (mut file, share) in cases {
        file.json["materials"][0]["alphaMode"] = "BLEND".into();
        let scene = scene(&file);
        let points = (0..10_000_u16).map(|number| [number % 100, number / 100].map(|at| (f32::from(at) + 0.5) / 200.0));
        let stopped = points.filter(|weights| !scene.mesh.is_open(0, *weights, &|| 1.0)).count();
        let found = f64::from(u32::try_from(stopped).unwrap()) / 10_000.0;
        // Four standard errors of 10,000 draws; whole cover is exact.
        let error = 4.0 * (share * (1.0 - share) / 10_000.0_f64).sqrt();
        assert!((found - share).abs() <= error, "{found} of {share}");
        tried += 1;
    }
    assert_eq!(tried, 5);
}

#[test]
fn cameras_look_through_backs_that_are_culled_and_light_does_not() {
    for (double_sided, seen_from_behind) in [(true, 2), (false, MISS)] {
        let file = File::square().edited(|file| file.json["materials"][0]["doubleSided"] = double_sided.into());
        let scene = scene(&file);
        let turned = DQuat::from_rotation_y(std::f64::consts::PI);
        for (z, rotation, expected) in [(0.0, DQuat::IDENTITY, seen_from_behind), (10.0, turned, 2)] {
            let packet = packet_of(&Pose::new(rotation, DVec3::new(1.5, 0.5, z)), |_| DVec3::Z);
            let seen =
                closest_through(&scene.bvh, &BackfaceCulled(&scene.mesh), &packet, &mut Stack::new()).triangle[0];
            assert_eq!(seen == MISS, expected == MISS, "{double_sided} {z}");
            let met = closest_through(&scene.bvh, &scene.mesh, &packet, &mut Stack::new()).triangle[0];
            assert!(met != MISS, "{double_sided} {z}");
        }
    }
}

#[test]
fn backs_within_a_closed_shape_are_not_lit_and_those_of_an_open_one_are() {
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0_u16, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    for (count, has_lit_backs) in [(4, false), (3, true)] {
        let mut file = File::square();
        let (positions, indices) =
            (file.floats("VEC3", corners.as_flattened()), file.shorts(faces[..count].as_flattened()));
        file.json["accessors"][positions]["min"] = serde_json::json!([0, 0, 0]);
        file.json["accessors"][positions]["max"] = serde_json::json!([1, 1, 1]);
        file.attributes()["POSITION"] = positions.into();
        file.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
        let lit = scene(&file).evenly_lit(100.0, Illuminant::D65);
        let seen = |z: f32| lit.exitance_lux(0, [0.25, 0.25], [0.0, 0.0, z], &Footprint::POINT, 1.0)[0];
        assert!(seen(1.0) > 99.0, "{count}: front {}", seen(1.0));
        assert_eq!(seen(-1.0) > 0.0, has_lit_backs, "{count}: back {}", seen(-1.0));
        assert!(scene(&file).mesh.materials.iter().all(|material| !material.culled), "{count}");
    }
}

#[test]
fn what_is_not_read_is_said_by_name() {
    let mut file = File::square();
    file.picture(&png(1, 1, &[[255; 4]]));
    let material = &mut file.json["materials"][0];
    material["extensions"] = serde_json::json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1}});
    // It only adds to the look.
    file.json["extensionsRequired"] = serde_json::json!(["KHR_materials_clearcoat"]);
    file.json["extensionsUsed"] = serde_json::json!(["KHR_materials_clearcoat", "KHR_materials_variants"]);
    file.json["meshes"][0]["primitives"][0]["targets"] = serde_json::json!([{"POSITION": 0}]);
    file.json["nodes"][1]["name"] = "robot\u{7}".into();
    file.json["nodes"][1]["skin"] = 0.into();
    file.json["skins"] = serde_json::json!([{"joints": [0]}]);
    file.json["animations"] = serde_json::json!(
        ["stand", "walk"].map(|name| serde_json::json!({"name": name, "channels": [], "samplers": []}))
    );
    file.json["cameras"] =
        serde_json::json!([{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}]);
    file.json["nodes"][0]["camera"] = 0.into();
    let notes = scene(&file).notes;
    for wanted in [
        "material 'board': extensions not read: KHR_materials_clearcoat",
        "the extension KHR_materials_variants is not read",
        r"'robot\u{7}': its skin is not read",
        r"'robot\u{7}': its morph targets are not read",
        "animation 'walk' is not read: the first one plays",
        "camera 'camera' has no perspective",
    ] {
        assert!(notes.iter().any(|note| note.contains(wanted)), "expected '{wanted}' in {notes:?}");
    }
}

#[test]
fn files_in_a_form_that_is_not_read_are_refused_with_a_remedy() {
    let picture = |extension: &str| {
        let mut file = File::square();
        file.picture(&png(1, 1, &[[255; 4]]));
        file.json["textures"] = serde_json::json!([{"extensions": {extension: {"source": 0}}}]);
        file.json["extensionsUsed"] = serde_json::json!([extension]);
        file
    };
    let packed = File::square().edited(|file| {
        let draco = "KHR_draco_mesh_compression";
        file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        file.json["meshes"][0]["primitives"][0]["extensions"] =
            serde_json::json!({draco: {"bufferView": 0, "attributes": {"POSITION": 0}}});
        file.json["extensionsUsed"] = serde_json::json!([draco]);
    });
    let cases = [
        (picture("KHR_texture_basisu"), "KHR_texture_basisu", "PNG or JPEG"),
        (picture("EXT_texture_webp"), "EXT_texture_webp", "PNG or JPEG"),
        (packed, "KHR_draco_mesh_compression", "without mesh compression"),
    ];
    for (file, name, remedy) in cases {
        let text = refusal(&file.glb());
        assert!(text.contains(name) && text.contains(remedy), "{text}");
    }
}
