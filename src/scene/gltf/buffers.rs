//! Reads the bytes of each buffer view from the binary chunk, `data:` URIs or files in the scene's folder. A URI that points anywhere else
//! is refused by name.

use std::borrow::Cow;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::buffer::{Source, View};

use super::super::source::Read;

pub struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    pub fn of(document: &gltf::Document, binary: &'a [u8], read: Read<'_>) -> Result<Self, String> {
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let number = buffer.index();
            buffers.push(match buffer.source() {
                Source::Bin if number == 0 => Cow::Borrowed(binary),
                Source::Bin => {
                    return Err(format!("buffer {number} has no uri; only the first may lie in the file itself"));
                }
                Source::Uri(uri) => {
                    Cow::Owned(fetched(uri, read).map_err(|reason| format!("buffer {number}: {reason}"))?)
                }
            });
        }
        Ok(Self { buffers })
    }

    pub fn view(&self, view: &View<'_>) -> Result<&[u8], String> {
        let buffer = &self.buffers[view.buffer().index()];
        let end = view.offset().checked_add(view.length()).filter(|&end| end <= buffer.len());
        let end = end.ok_or_else(|| {
            let (from, length) = (view.offset(), view.length());
            format!("buffer view {} takes {length} bytes from {from}, of {}", view.index(), buffer.len())
        })?;
        Ok(&buffer[view.offset()..end])
    }
}

/// The bytes that a URI names: embedded, or of a file in the scene's folder.
pub fn fetched(uri: &str, read: Read<'_>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, encoded) = data.split_once(',').ok_or("a data: uri has a comma")?;
        if !kind.ends_with(";base64") {
            return Err("a data: uri that is not base64; use one that is".to_owned());
        }
        return STANDARD.decode(encoded).map_err(|error| format!("its data: uri is not base64: {error}"));
    }
    read(&inside(uri)?).map_err(|error| error.to_string())
}

/// The path that a relative URI names, percent-decoded.
fn inside(uri: &str) -> Result<String, String> {
    let refuse = || format!("the uri '{uri}' leads out of the scene's folder; use a file in it");
    let mut bytes = Vec::new();
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let digits = [rest.next(), rest.next()].map(|digit| digit.and_then(|digit| char::from(digit).to_digit(16)));
        let [Some(high), Some(low)] = digits else { return Err(refuse()) };
        bytes.push(u8::try_from(16 * high + low).expect("two hexadecimal digits"));
    }
    let path = String::from_utf8(bytes).map_err(|_| refuse())?;
    if path.contains([':', '\\', '\0']) {
        return Err(refuse());
    }
    // Dots as RFC 3986 resolves them (5.2.4), but never above the folder.
    let mut parts = Vec::new();
    for part in path.split('/') {
        match part {
            "" => return Err(refuse()),
            "." => {}
            ".." => drop(parts.pop().ok_or_else(refuse)?),
            part => parts.push(part),
        }
    }
    if parts.is_empty() { Err(refuse()) } else { Ok(parts.join("/")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_relative_paths_downwards_are_followed() {
        for (uri, path) in [("a.bin", "a.bin"), ("b/c%20d.png", "b/c d.png"), ("./a", "a"), ("b/../c/./d", "c/d")] {
            assert_eq!(inside(uri).unwrap(), path);
        }
        let mut refused = 0;
        for uri in [
            "../a",
            "b/../../a",
            "%2e%2e/a",
            "/etc/passwd",
            "file:///a",
            "http://a/b",
            "C:\\a",
            "a\\b",
            "",
            "b//c",
            "%zz",
            "%ff",
        ] {
            assert!(inside(uri).unwrap_err().contains("leads out"), "{uri}");
            refused += 1;
        }
        assert_eq!(refused, 12);
    }
}
