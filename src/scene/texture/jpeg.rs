//! Whether a JPEG file is whole. Decoders fill what is missing with grey and say nothing.

const START_OF_IMAGE: u8 = 0xD8;
const END_OF_IMAGE: u8 = 0xD9;
const START_OF_SCAN: u8 = 0xDA;

/// Whether a JPEG file ends before its end marker (ITU T.81, B.1.1). False for what is no JPEG file.
pub(crate) fn is_cut(bytes: &[u8]) -> bool {
    if !bytes.starts_with(&[0xFF, START_OF_IMAGE]) {
        return false;
    }
    let mut at = 2;
    loop {
        // Coded data of a scan and fill bytes lie before a marker: 0xFF with neither a stuffed 0 nor a restart behind it.
        let Some(found) = bytes[at..].windows(2).position(|pair| pair[0] == 0xFF && is_marker(pair[1])) else {
            return true;
        };
        let marker = bytes[at + found + 1];
        at += found + 2;
        if marker == END_OF_IMAGE {
            return false;
        }
        // Every other marker has a segment with its length; coded data follow that of a scan.
        let Some(length) = bytes.get(at..at + 2).map(|pair| usize::from(u16::from_be_bytes([pair[0], pair[1]]))) else {
            return true;
        };
        at += length.max(2);
        if at >= bytes.len() || (marker != START_OF_SCAN && bytes[at] != 0xFF) {
            return true;
        }
    }
}

fn is_marker(code: u8) -> bool {
    // 0x01 and the restarts stand alone; 0xFF is a fill byte.
    !matches!(code, 0 | 1 | 0xD0..=0xD8 | 0xFF)
}

#[cfg(test)]
mod tests {
    use super::is_cut;
    use crate::num::low_u8;

    #[test]
    fn a_file_is_cut_where_its_end_marker_is_missing() {
        let picture = image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([low_u8(7 * x), low_u8(11 * y), 99]));
        let mut bytes = Vec::new();
        let mut cursor = std::io::Cursor::new(&mut bytes);
        picture.write_to(&mut cursor, image::ImageFormat::Jpeg).expect("a picture in memory");
        assert!(!is_cut(&bytes) && !is_cut(b"\x89PNG"));
        for length in 2..bytes.len() - 1 {
            assert!(is_cut(&bytes[..length]), "{length} of {}", bytes.len());
        }
        // Data that others append do not matter.
        assert!(!is_cut(&[&bytes[..], b"more"].concat()));
    }
}
