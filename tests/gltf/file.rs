//! glTF files made by tests: valid except for what the test changes.

use std::collections::BTreeMap;

/// A file under construction: JSON parts and the binary chunk that they point into.
pub struct File {
    pub json: serde_json::Value,
    pub binary: Vec<u8>,
}

impl File {
    /// Two triangles of a square of 1 m at z = 0 facing +z, under a node at (0, 0, 5) that has a child of scale 2, lit by nothing.
    pub fn square() -> Self {
        let json = serde_json::json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1], "translation": [0, 0, 5]}, {"mesh": 0, "scale": [2, 2, 2]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
            "materials": [{"name": "board", "doubleSided": true}],
            "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
        });
        let mut file = Self { json, binary: Vec::new() };
        let corners: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(file.floats("VEC3", corners.as_flattened()), 0);
        assert_eq!(file.shorts(&[0, 1, 2, 0, 2, 3]), 1);
        file.json["accessors"][0]["min"] = serde_json::json!([0, 0, 0]);
        file.json["accessors"][0]["max"] = serde_json::json!([1, 1, 0]);
        file
    }

    pub fn bytes(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = serde_json::json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        self.binary.extend(bytes);
        self.json["buffers"][0]["byteLength"] = self.binary.len().into();
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        views.len() - 1
    }

    pub fn accessor(&mut self, accessor: serde_json::Value) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    pub fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let width = BTreeMap::from([("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4)])[kind];
        let view = self.bytes(&bytes);
        let count = numbers.len() / width;
        self.accessor(serde_json::json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind}))
    }

    pub fn shorts(&mut self, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let view = self.bytes(&bytes);
        let count = numbers.len();
        self.accessor(serde_json::json!({"bufferView": view, "componentType": 5123, "count": count, "type": "SCALAR"}))
    }

    /// Gives the board a picture.
    pub fn picture(&mut self, encoded: &[u8]) {
        let view = self.bytes(encoded);
        self.json["images"] = serde_json::json!([{"bufferView": view, "mimeType": "image/png"}]);
        self.json["textures"] = serde_json::json!([{"source": 0}]);
        self.json["materials"][0]["pbrMetallicRoughness"] = serde_json::json!({"baseColorTexture": {"index": 0}});
        let uvs = self.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        self.attributes()["TEXCOORD_0"] = uvs.into();
    }

    pub fn attributes(&mut self) -> &mut serde_json::Value {
        &mut self.json["meshes"][0]["primitives"][0]["attributes"]
    }

    pub fn edited(mut self, edit: impl FnOnce(&mut Self)) -> Self {
        edit(&mut self);
        self
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(self.json.to_string().as_bytes(), &self.binary)
    }
}

pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, binary) = (padded(json, b' '), padded(binary, 0));
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

pub fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(width, height, texels.as_flattened().to_vec()).unwrap();
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A PNG whose header says this size, with its checksum right, and nothing after it.
pub fn png_of_size(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 2, 0, 0, 0]);
    let crc = header.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    });
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    file.extend(&header);
    file.extend((!crc).to_be_bytes());
    file.extend([0, 0, 0, 0]);
    file.extend(b"IDAT\x35\xaf\x06\x1e");
    file
}

/// A JPEG whose frame header says this size.
pub fn jpeg_of_size(width: u16, height: u16) -> Vec<u8> {
    let mut file = vec![0xFF, 0xD8, 0xFF, 0xC0, 0, 11, 8];
    file.extend(height.to_be_bytes());
    file.extend(width.to_be_bytes());
    file.extend([1, 1, 0x11, 0, 0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0, 0, 0xFF, 0xD9]);
    file
}
