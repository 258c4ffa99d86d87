//! Hostile and odd files.

use super::super::Scene;
use crate::error::Error;

/// A file of one triangle. `edit` may change its JSON, `numbers` are positions, `corners` indices.
fn glb(edit: impl Fn(String) -> String, numbers: [f32; 9], corners: [u16; 3]) -> Vec<u8> {
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"children":[1],"translation":[0,0,5]},{"mesh":0,"scale":[2,2,2]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
            {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
        "buffers":[{"byteLength":44}]}"#;
    let mut json = edit(json.to_owned()).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    binary.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
    binary.resize(44, 0);
    let word = |value: usize| u32::try_from(value).unwrap().to_le_bytes();
    let mut file = b"glTF".to_vec();
    file.extend(word(2));
    file.extend(word(12 + 8 + json.len() + 8 + binary.len()));
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        file.extend(word(chunk.len()));
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

const SOUND: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn refusal(bytes: &[u8]) -> String {
    let error = Scene::from_glb("odd.glb", bytes).unwrap_err();
    assert!(matches!(error, Error::Content { .. }), "{error:?}");
    let text = error.to_string();
    assert!(text.starts_with("odd.glb: "), "{text}");
    text
}

#[test]
fn nested_transforms_apply_from_the_outside_in() {
    let scene = Scene::from_glb("a.glb", &glb(|json| json, SOUND, [0, 1, 2])).unwrap();
    assert_eq!(scene.mesh.corners_m(0), [[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.0, 2.0, 5.0]]);
    // Without normals in the file they come from the winding.
    assert_eq!(scene.mesh.vertices[0].normal, [0.0, 0.0, 1.0]);
}

#[test]
fn a_file_cut_off_anywhere_is_refused_and_never_panics() {
    let whole = glb(|json| json, SOUND, [0, 1, 2]);
    for length in 0..whole.len() {
        refusal(&whole[..length]);
    }
}

#[test]
fn damaged_bytes_never_panic() {
    let whole = glb(|json| json, SOUND, [0, 1, 2]);
    let (mut refused, mut taken) = (0, 0);
    for at in 0..whole.len() {
        for value in [0, 0x7F, 0xFF, b'9'] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            match Scene::from_glb("odd.glb", &bytes) {
                Ok(_) => taken += 1,
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 1_000 && taken > 100, "{refused} refused, {taken} taken");
}

#[test]
fn hostile_files_are_refused_with_the_reason() {
    let edit = |from: &'static str, to: &'static str| {
        let bytes = glb(|json| json.replace(from, to), SOUND, [0, 1, 2]);
        move || bytes.clone()
    };
    let mut not_finite = SOUND;
    not_finite[4] = f32::NAN;
    let cases: [(&str, Vec<u8>); 10] = [
        ("starts with 'glTF'", b"PK\x03\x04 a zip".to_vec()),
        ("vertex 1", glb(|json| json, not_finite, [0, 1, 2])),
        ("names vertex 7 of 3", glb(|json| json, SOUND, [0, 1, 7])),
        ("no triangle with an area", glb(|json| json, SOUND, [0, 1, 1])),
        ("accessor 0 needs", edit("\"count\":3,\"type\":\"VEC3\"", "\"count\":3000,\"type\":\"VEC3\"")()),
        ("accessor 0 needs", edit("\"count\":3,\"type\":\"VEC3\"", "\"count\":9007199254740993,\"type\":\"VEC3\"")()),
        ("buffer view 0 takes", edit("\"byteLength\":36", "\"byteLength\":3600")()),
        ("nested deeper", edit("\"mesh\":0,\"scale\":[2,2,2]", "\"mesh\":0,\"children\":[0]")()),
        ("triangles would do", edit("\"indices\":1", "\"indices\":1,\"mode\":1")()),
        ("not glTF 2.0", edit("\"nodes\":[0]", "\"nodes\":[55]")()),
    ];
    for (reason, bytes) in cases {
        let text = refusal(&bytes);
        assert!(text.contains(reason), "expected '{reason}' in: {text}");
    }
}
