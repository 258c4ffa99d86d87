//! Maps of glTF materials beside the base colour, and panes.

use sensel::scene::texture::Footprint;
use sensel::scene::tracer::Holes;
use sensel::scene::{Illuminant, LitScene};

use super::file::{File, png};
use super::scene;

/// A square with two texels side by side as the texture of a slot of its material.
fn mapped(slot: &str, texels: [[u8; 4]; 2]) -> File {
    let mut file = File::square();
    file.picture(&png(2, 1, &texels));
    let pbr = file.json["materials"][0]["pbrMetallicRoughness"].take();
    file.json["materials"][0]["pbrMetallicRoughness"] = serde_json::json!({});
    let (parent, name) = slot.split_once('.').unwrap_or(("", slot));
    let material = &mut file.json["materials"][0];
    let holder = if parent.is_empty() { material } else { &mut material[parent] };
    holder[name] = pbr["baseColorTexture"].clone();
    file
}

/// Weights in the first triangle, corners (0, 0), (1, 0) and (1, 1) of the square, of a point at x in the lower quarter.
fn at(x: f32) -> [f32; 2] {
    [x - 0.1, 0.1]
}

fn lit(file: &File) -> LitScene {
    scene(file).evenly_lit(100.0, Illuminant::D65)
}

#[test]
fn emission_follows_its_picture_texel_by_texel() {
    let file = mapped("emissiveTexture", [[255, 0, 0, 255], [0, 0, 0, 255]]).edited(|file| {
        file.json["materials"][0]["emissiveFactor"] = serde_json::json!([1.0, 1.0, 0.5]);
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = serde_json::json!([0.0, 0.0, 0.0, 1.0]);
        file.json["materials"][0]["extensions"] =
            serde_json::json!({"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}});
    });
    let lit = lit(&file);
    assert_eq!(lit.scene().mesh.materials[0].emission[..3], [2.0, 0.0, 0.0], "the mean");
    // A target's radiances are scaled as its light is: a unit gives pi times 100 lux-equivalents. Nothing is reflected.
    for (x, red) in [(0.25, 400.0 * std::f32::consts::PI), (0.75, 0.0)] {
        let lux = lit.exitance_lux(0, at(x), [0.0, 0.0, -1.0], &Footprint::POINT, 1.0);
        assert!((lux[0] - red).abs() < 0.01 && lux[1] == 0.0, "{x}: {lux:?}");
    }
}

#[test]
fn roughness_and_metallic_follow_their_picture_texel_by_texel() {
    // Left a mirror of metal, right chalk.
    let file = mapped("pbrMetallicRoughness.metallicRoughnessTexture", [[0, 0, 255, 255], [0, 255, 0, 255]]);
    let lit = lit(&file);
    let material = &lit.scene().mesh.materials[0];
    assert_eq!([material.roughness, material.metallic], [0.5; 2], "the means");
    for all in [false, true] {
        assert!(lit.has_gloss(all));
        assert!(lit.facet(0, at(0.25), [0.0, 0.0, -1.0], all).is_some(), "{all}");
        assert!(lit.facet(0, at(0.75), [0.0, 0.0, -1.0], all).is_none(), "{all}");
    }
}

#[test]
fn a_mirror_with_a_normal_map_turns_rays_along_u_and_up_the_picture() {
    // Normals of (0.6, 0, 0.8) and (0, 0.6, 0.8): twice their angle for the ray. Half a code of 255 is 0.004.
    for scale in [1.0_f32, -1.0] {
        let file = mapped("normalTexture", [[204, 128, 230, 255], [128, 204, 230, 255]]).edited(|file| {
            file.json["materials"][0]["normalTexture"]["scale"] = scale.into();
            file.json["materials"][0]["pbrMetallicRoughness"] =
                serde_json::json!({"metallicFactor": 1.0, "roughnessFactor": 0.0});
        });
        let lit = lit(&file);
        for (from, side) in [([0.0, 0.0, -1.0], 1.0), ([0.0, 0.0, 1.0], -1.0_f32)] {
            for (x, axis) in [(0.25, 0), (0.75, 1)] {
                let facet = lit.facet(0, at(x), from, true).expect("a mirror");
                let (away, ..) = facet.reflected(from, || [0.5; 2]);
                // Seen from behind, the mapped normal is turned round, and sends the ray the other way.
                let mut expected = [0.0, 0.0, 0.28 * side];
                expected[axis] = 0.96 * scale * side;
                for axis in 0..3 {
                    assert!((away[axis] - expected[axis]).abs() < 0.02, "{x} {scale} {from:?}: {away:?}");
                }
            }
        }
    }
}

#[test]
fn a_map_that_lies_elsewhere_is_said_and_left_out() {
    let mut file = mapped("normalTexture", [[204, 128, 230, 255]; 2]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = serde_json::json!({"index": 0});
    assert!(scene(&file).mesh.materials[0].maps.normal.is_some());
    file.json["extensionsUsed"] = serde_json::json!(["KHR_texture_transform"]);
    file.json["materials"][0]["normalTexture"]["extensions"] =
        serde_json::json!({"KHR_texture_transform": {"scale": [2.0, 2.0]}});
    let scene = scene(&file);
    assert!(scene.mesh.materials[0].maps.normal.is_none());
    assert!(scene.notes.iter().any(|note| note.contains("'board'") && note.contains("normal")), "{:?}", scene.notes);
}

#[test]
fn a_pane_lets_pass_what_fresnel_leaves_of_its_transmission() {
    let pane = |factor: f32, colour: [f32; 4]| {
        File::square().edited(|file| {
            file.json["extensionsUsed"] = serde_json::json!(["KHR_materials_transmission"]);
            file.json["materials"][0]["pbrMetallicRoughness"] =
                serde_json::json!({"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.0});
            file.json["materials"][0]["extensions"] =
                serde_json::json!({"KHR_materials_transmission": {"transmissionFactor": factor}});
        })
    };
    let mut tried = 0;
    // Schlick: 0.04 straight on, 0.04 + 0.96 * 0.5^5 at 60 degrees.
    for (factor, grey, cos, share) in [(1.0, 1.0, 1.0, 0.96), (1.0, 1.0, 0.5, 0.93), (0.5, 0.8, 1.0, 0.384)] {
        let scene = scene(&pane(factor, [grey, grey, grey, 1.0]));
        let points = (0..10_000_u16).map(|number| [number % 100, number / 100].map(|at| (f32::from(at) + 0.5) / 200.0));
        let passed = points.filter(|&weights| scene.mesh.is_open(0, weights, &|| cos)).count();
        let found = f64::from(u32::try_from(passed).unwrap()) / 10_000.0;
        // Four standard errors of 10,000 draws.
        assert!((found - share).abs() <= 4.0 * (share * (1.0 - share) / 10_000.0_f64).sqrt(), "{found} of {share}");
        assert!(scene.notes.iter().any(|note| note.contains("'board' is a thin pane")), "{:?}", scene.notes);
        tried += 1;
    }
    assert_eq!(tried, 3);
    let notes = scene(&pane(1.0, [1.0, 0.2, 0.2, 1.0])).notes;
    assert!(notes.iter().any(|note| note.contains("its tint dims all colours alike")), "{notes:?}");
}

#[test]
fn glass_whose_metallic_is_a_picture_is_a_pane() {
    // The factor of metallic is 1 where a file says nothing; the picture says that there is none.
    let file = mapped("pbrMetallicRoughness.metallicRoughnessTexture", [[0, 0, 0, 255]; 2]).edited(|file| {
        file.json["extensionsUsed"] = serde_json::json!(["KHR_materials_transmission"]);
        file.json["materials"][0]["extensions"] =
            serde_json::json!({"KHR_materials_transmission": {"transmissionFactor": 1.0}});
    });
    assert_eq!(scene(&file).mesh.materials[0].transmission, 1.0);
}

#[test]
fn metal_that_glows_is_still_a_mirror() {
    let mut file = File::square();
    file.json["materials"][0]["pbrMetallicRoughness"] =
        serde_json::json!({"metallicFactor": 1.0, "roughnessFactor": 0.0});
    file.json["materials"][0]["emissiveFactor"] = serde_json::json!([0.0, 0.1, 0.1]);
    let material = &scene(&file).mesh.materials[0];
    assert!(material.is_emissive() && material.gloss().is_some_and(|gloss| gloss.at_normal[1] > 0.9));
}
