//! Grey pictures from PNG, JPEG and TIFF files, in their own depth, and PNG files of codes.

use std::fs::File;
use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageBuffer, ImageReader};

use super::errors::io_error;
use super::open::{open_input, read_opened};
use crate::error::Error;
use crate::plane::Plane;
use crate::scene::texture::jpeg::is_cut;
use crate::units::Size;

/// Longest side that is decoded; the size is read from the header before anything is allocated.
const SIDE_PX_MAX: u32 = 16_384;

/// Most pixels that are decoded.
const PIXELS_MAX: u64 = 100_000_000;

/// Longest file that is read: more than all pixels take uncompressed.
const BYTES_MAX: u64 = 1 << 30;

/// Reads a picture as grey values and their depth, 8 or 16 bits. Colour becomes luma by the `image` crate's weights (Rec. 709). Fails on
/// a file that is not there or no picture, or one beyond the size that is decoded.
pub fn read_grey(file: &Path) -> Result<(Plane<u16>, u32), Error> {
    read_grey_of(open_input(file).map_err(absent(file))?, file)
}

/// A file that is not there, as a picture's own error.
pub(super) fn absent(file: &Path) -> impl FnOnce(Error) -> Error {
    let file = file.display().to_string();
    move |error| match error {
        Error::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            Error::Content { file, reason: "is not there".to_owned() }
        }
        other => other,
    }
}

/// The same of an opened file; `file` is its name.
pub(super) fn read_grey_of(stream: File, file: &Path) -> Result<(Plane<u16>, u32), Error> {
    grey_of(&read_opened(stream, file, BYTES_MAX)?, &file.display().to_string())
}

/// The same of a file's bytes; `name` is its name in messages.
pub(super) fn grey_of(bytes: &[u8], name: &str) -> Result<(Plane<u16>, u32), Error> {
    let refused = |reason: String| Error::Content { file: name.to_owned(), reason };
    let open = || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(io_error(Path::new(name)));
    let (width_px, height_px) =
        open()?.into_dimensions().map_err(|error| refused(format!("is no picture: {error}")))?;
    let pixels = u64::from(width_px) * u64::from(height_px);
    if width_px > SIDE_PX_MAX || height_px > SIDE_PX_MAX || pixels > PIXELS_MAX || pixels == 0 {
        let most = format!("use up to {SIDE_PX_MAX} a side and {PIXELS_MAX} in all");
        return Err(refused(format!("has {width_px} x {height_px} pixels; {most}")));
    }
    if is_cut(bytes) {
        return Err(refused("is damaged: it ends before it is complete".to_owned()));
    }
    let picture = open()?.decode().map_err(|error| refused(format!("is damaged: {error}")))?;
    let size = Size { width_px, height_px };
    Ok(match picture.color() {
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            (Plane::from_values(size, picture.into_luma16().into_raw()), 16)
        }
        _ => {
            let values = picture.into_luma8().into_raw().into_iter().map(u16::from).collect();
            (Plane::from_values(size, values), 8)
        }
    })
}

/// Writes 16-bit values as a grey PNG.
pub fn write_grey_16(file: &Path, values: &Plane<u16>) -> Result<(), Error> {
    let size = values.size();
    let buffer = ImageBuffer::from_raw(size.width_px, size.height_px, values.values().to_vec());
    save(file, &DynamicImage::ImageLuma16(buffer.expect("a plane has width times height values")))
}

/// Writes 8-bit values as a grey PNG.
pub(super) fn write_grey_8(file: &Path, values: &Plane<u8>) -> Result<(), Error> {
    let size = values.size();
    let buffer = ImageBuffer::from_raw(size.width_px, size.height_px, values.values().to_vec());
    save(file, &DynamicImage::ImageLuma8(buffer.expect("a plane has width times height values")))
}

pub(super) fn save(file: &Path, picture: &DynamicImage) -> Result<(), Error> {
    picture.save(file).map_err(|error| match error {
        image::ImageError::IoError(source) => io_error(file)(source),
        other => Error::Run(format!("{}: {other}", file.display())),
    })
}
