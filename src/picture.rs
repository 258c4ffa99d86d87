//! Encodes and decodes named planes of `f32` as OpenEXR bytes. Touches no disk.
//!
//! Written losslessly (ZIP, 32-bit floats), read from any lossless layout (16- or 32-bit floats, scan lines or tiles).

use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, SmallVec,
    WritableImage, read,
};
use std::io::Cursor;

use crate::error::Error;
use crate::num::u32_from;
use crate::plane::Plane;
use crate::units::Size;

/// Side of a picture at most.
const EDGE_PX_MAX: usize = 16_384;

/// Numbers of a picture at most, all channels together: 2 GiB of `f32`.
const SAMPLES_MAX: usize = 1 << 29;

/// A channel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// "R", "G", "B", "Y", "Z", ... as OpenEXR names them.
    pub name: String,
    /// Row-major, the top row first.
    pub plane: Plane<f32>,
}

/// The bytes of an OpenEXR file with these channels, all of one size. Fails on planes of different sizes, or none.
pub fn to_exr(channels: &[Channel]) -> Result<Vec<u8>, Error> {
    let size = channels.first().map(|channel| channel.plane.size());
    let Some(size) = size.filter(|size| channels.iter().all(|channel| channel.plane.size() == *size)) else {
        return Err(Error::Run("a picture needs channels of one size".to_owned()));
    };
    let list: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
        .iter()
        .map(|channel| AnyChannel::new(channel.name.as_str(), FlatSamples::F32(channel.plane.values().to_vec())))
        .collect();
    let dimensions = (crate::num::index(size.width_px), crate::num::index(size.height_px));
    let layer = Layer::new(dimensions, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::new());
    let written = Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|error| Error::Run(format!("a picture could not be written as OpenEXR: {error}")))?;
    Ok(bytes.into_inner())
}

/// The channels of an OpenEXR file's first layer, by name. `name` is what the user calls the file. Fails on bytes that are no OpenEXR
/// file, or one that is cut off, too large (known from its header, before anything is decoded), or without channels.
pub fn from_exr(name: &str, bytes: &[u8]) -> Result<Vec<Channel>, Error> {
    let refused = |reason: String| Error::Content { file: name.to_owned(), reason };
    check_header(bytes).map_err(refused)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| refused(format!("it is not a whole OpenEXR file: {error}")))?;
    let layer = image.layer_data;
    let size = Size { width_px: u32_from(layer.size.width()), height_px: u32_from(layer.size.height()) };
    let mut channels = Vec::new();
    for channel in layer.channel_data.list {
        if channel.sampling != exr::math::Vec2(1, 1) {
            return Err(refused(format!("channel {} is subsampled; use one value per pixel", channel.name)));
        }
        let mut plane = Plane::filled(size, 0.0_f32);
        for (to, from) in plane.values_mut().iter_mut().zip(channel.sample_data.values_as_f32()) {
            *to = from;
        }
        channels.push(Channel { name: channel.name.to_string(), plane });
    }
    if channels.is_empty() {
        return Err(refused("it has no channel".to_owned()));
    }
    Ok(channels)
}

/// Looks at the sizes that a file claims, before anything of that size is made. Says what is wrong.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false);
    let meta = meta.map_err(|error| format!("it is not a whole OpenEXR file: {error}"))?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        if width == 0 || height == 0 || width > EDGE_PX_MAX || height > EDGE_PX_MAX {
            return Err(format!("{width} x {height} px; use up to {EDGE_PX_MAX} an edge"));
        }
        let channels = header.channels.list.len();
        if width * height > SAMPLES_MAX / channels.max(1) {
            return Err(format!("{width} x {height} px in {channels} channels; use up to {SAMPLES_MAX} numbers"));
        }
        // Every block has at least its entry in the file's table.
        if header.chunk_count > bytes.len() / 8 {
            return Err(format!("{} blocks in {} bytes; it is cut off", header.chunk_count, bytes.len()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file's bytes with the data and display windows that end at this pixel.
    fn claiming(bytes: &[u8], last_px: i32) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for name in [&b"dataWindow\0box2i\0"[..], &b"displayWindow\0box2i\0"[..]] {
            let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
            // Behind the name stand its length (4 bytes) and the window's first pixel (8 bytes).
            let ends = at + name.len() + 12;
            bytes[ends..ends + 4].copy_from_slice(&last_px.to_le_bytes());
            bytes[ends + 4..ends + 8].copy_from_slice(&last_px.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn sizes_that_a_small_file_cannot_hold_are_refused_from_the_header() {
        let plane = Plane::filled(Size { width_px: 3, height_px: 2 }, 1.0_f32);
        let channels: Vec<Channel> =
            ["A", "B", "G", "R"].map(|name| Channel { name: name.to_owned(), plane: plane.clone() }).to_vec();
        let bytes = to_exr(&channels).unwrap();
        let mut tried = 0;
        // 65,535 is beyond the edge; 16,384 in four channels are 2^30 numbers; 8,000 lie within both, in 500 blocks that 400 bytes
        // cannot name.
        for (side_px, words) in [(65_535, "up to 16384 an edge"), (16_384, "numbers"), (8_000, "cut off")] {
            let error = from_exr("sky.exr", &claiming(&bytes, side_px - 1)).unwrap_err().to_string();
            assert!(error.contains("sky.exr") && error.contains(words), "{side_px}: {error}");
            tried += 1;
        }
        assert!(from_exr("sky.exr", &claiming(&bytes, i32::MAX)).is_err());
        assert!(from_exr("sky.exr", &claiming(&bytes, -5)).is_err());
        assert_eq!(tried, 3);
    }

    #[test]
    fn channels_return_bit_for_bit_and_damage_is_refused() {
        let size = Size { width_px: 7, height_px: 5 };
        let mut plane = Plane::filled(size, 0.0_f32);
        for (number, value) in plane.values_mut().iter_mut().enumerate() {
            *value = crate::num::f32_nearest(crate::num::f64_from_usize(number) * 0.3 - 2.0);
        }
        plane.values_mut()[3] = f32::INFINITY;
        let channels =
            ["B", "G", "R", "Z"].map(|name| Channel { name: name.to_owned(), plane: plane.clone() }).to_vec();
        let bytes = to_exr(&channels).unwrap();
        assert_eq!(from_exr("a", &bytes).unwrap(), channels);
        for cut in [0, 3, 50, bytes.len() / 2] {
            assert!(from_exr("a", &bytes[..cut]).is_err(), "{cut}");
        }
        assert!(to_exr(&[]).is_err());
    }
}
