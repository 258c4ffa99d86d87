//! Decodes one picture, PNG (8 or 16 bits) or OpenEXR, to linear light a pixel, 1.0 being white, and to depth in metres where the file
//! holds it.
//!
//! Grey pictures have all bands alike. Near infrared is like the red unless an OpenEXR channel N or NIR holds it.

use std::io::Cursor;

use image::{ColorType, DynamicImage, ImageFormat, ImageReader};

use crate::error::Error;
use crate::num::{f32_nearest, f64_from_usize, greater, index, lesser};
use crate::plane::Plane;
use crate::scene::light::BANDS;
use crate::scene::texture::linear_from_srgb_share;
use crate::units::Size;

/// Side of a picture at most.
pub const EDGE_PX_MAX: u32 = 16_384;

/// Pixels of a picture at most: 8K, which is 512 MiB of four bands.
pub const PIXELS_MAX: u64 = 1 << 25;

/// How codes become light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferCurve {
    /// IEC 61966-2-1.
    Srgb,
    /// Codes are light.
    Linear,
}

impl TransferCurve {
    /// All that are known, by the one name in configs; "auto" is sRGB in PNG files and linear in OpenEXR files.
    pub const ALL: [(&'static str, Option<Self>); 3] =
        [("auto", None), ("srgb", Some(Self::Srgb)), ("linear", Some(Self::Linear))];
}

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    size: Size,
    /// 1 (all bands), 3 (red, green, blue) or 4 (and near infrared) values per pixel.
    channels: usize,
    values: Vec<f32>,
    /// Share of the values at the greatest code; 0 for floats.
    pub(super) clipped_share: f64,
    /// Distance along the axis; infinite where nothing is seen.
    pub(super) depth_m: Option<Plane<f32>>,
}

/// What a file is, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PictureFormat {
    Png,
    Exr,
}

impl PictureFormat {
    fn of(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => Ok(Self::Png),
            [0x76, 0x2f, 0x31, 0x01, ..] => Ok(Self::Exr),
            _ => Err(Error::content(name, "is neither PNG nor OpenEXR; use one of these")),
        }
    }
}

fn check_size(name: &str, width_px: u64, height_px: u64) -> Result<(), Error> {
    let edges = 1..=u64::from(EDGE_PX_MAX);
    if edges.contains(&width_px) && edges.contains(&height_px) && width_px * height_px <= PIXELS_MAX {
        return Ok(());
    }
    let reason = format!("has {width_px} x {height_px} px; use up to {EDGE_PX_MAX} an edge and {PIXELS_MAX} in all");
    Err(Error::content(name, reason))
}

impl Picture {
    /// Decodes a file. `name` is what the user calls it; `transfer` none: by the kind of file. Fails on what is neither PNG nor OpenEXR;
    /// cut off, too large, transparent, without channels that are known; values that are no light.
    pub fn decode(name: &str, bytes: &[u8], transfer: Option<TransferCurve>) -> Result<Self, Error> {
        match PictureFormat::of(name, bytes)? {
            PictureFormat::Png => Self::from_png(name, bytes, transfer.unwrap_or(TransferCurve::Srgb)),
            PictureFormat::Exr => Self::from_exr(name, bytes, transfer.unwrap_or(TransferCurve::Linear)),
        }
    }

    fn from_png(name: &str, bytes: &[u8], transfer: TransferCurve) -> Result<Self, Error> {
        let picture = png(name, bytes)?;
        let size = Size { width_px: picture.width(), height_px: picture.height() };
        let is_clear = match picture.color() {
            ColorType::La8 | ColorType::Rgba8 => picture.to_rgba8().pixels().any(|pixel| pixel.0[3] != u8::MAX),
            ColorType::La16 | ColorType::Rgba16 => picture.to_rgba16().pixels().any(|pixel| pixel.0[3] != u16::MAX),
            _ => false,
        };
        if is_clear {
            return Err(Error::content(name, "is transparent in places; use a picture without alpha"));
        }
        let (channels, codes, end): (usize, Vec<u16>, u16) = match picture.color() {
            ColorType::L8 | ColorType::La8 => (1, widened(picture.into_luma8().into_raw()), 255),
            ColorType::L16 | ColorType::La16 => (1, picture.into_luma16().into_raw(), u16::MAX),
            ColorType::Rgb16 | ColorType::Rgba16 => (3, picture.into_rgb16().into_raw(), u16::MAX),
            _ => (3, widened(picture.into_rgb8().into_raw()), 255),
        };
        let light: Vec<f32> = (0..=end).map(|code| linear(f64::from(code) / f64::from(end), transfer)).collect();
        let clipped = codes.iter().filter(|&&code| code == end).count();
        let clipped_share = f64_from_usize(clipped) / f64_from_usize(codes.len());
        let values = codes.into_iter().map(|code| light[usize::from(code)]).collect();
        Ok(Self { size, channels, values, clipped_share, depth_m: None })
    }

    #[cfg(feature = "exr")]
    fn from_exr(name: &str, bytes: &[u8], transfer: TransferCurve) -> Result<Self, Error> {
        let found = exr_channels(name, bytes)?;
        let named = |wanted: &[&str]| found.iter().find(|channel| wanted.contains(&channel.name.as_str()));
        let infrared = named(&["N", "NIR"]);
        let planes: Vec<_> = match (named(&["R"]), named(&["G"]), named(&["B"]), named(&["Y"])) {
            (Some(red), Some(green), Some(blue), _) => {
                [Some(red), Some(green), Some(blue), infrared].into_iter().flatten().collect()
            }
            (None, None, None, Some(grey)) if infrared.is_none() => vec![grey],
            _ => {
                let names = found.iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(", ");
                let reason = format!("has the channels {names}; use R, G and B (and N or NIR), or Y alone");
                return Err(Error::content(name, reason));
            }
        };
        let (size, channels) = (planes[0].plane.size(), planes.len());
        let mut values = vec![0.0; size.pixel_count() * channels];
        for (number, channel) in planes.iter().enumerate() {
            for (at, &value) in channel.plane.values().iter().enumerate() {
                if !(value.is_finite() && value >= 0.0) {
                    let (x, y) = (at % index(size.width_px), at / index(size.width_px));
                    let pixel = format!("channel {} at column {x}, row {y}", channel.name);
                    let reason = format!("holds {value} in {pixel}; use finite light of at least 0");
                    return Err(Error::content(name, reason));
                }
                values[at * channels + number] = match transfer {
                    TransferCurve::Linear => value,
                    TransferCurve::Srgb => linear(f64::from(value), transfer),
                };
            }
        }
        let depth = named(&["Z"]).map(|channel| depth_checked(name, &channel.plane)).transpose()?;
        Ok(Self { size, channels, values, clipped_share: 0.0, depth_m: depth })
    }

    #[cfg(not(feature = "exr"))]
    fn from_exr(name: &str, _: &[u8], _: TransferCurve) -> Result<Self, Error> {
        Err(Error::content(name, "is OpenEXR, which this build does not read; use PNG"))
    }

    /// The same picture with a separate depth. Fails on a depth of another size.
    pub fn with_depth(self, name: &str, depth_m: Plane<f32>) -> Result<Self, Error> {
        if depth_m.size() != self.size {
            return Err(Error::content(name, "has another size than its picture; use the same size"));
        }
        Ok(Self { depth_m: Some(depth_m), ..self })
    }

    /// Columns and rows.
    pub fn size(&self) -> Size {
        self.size
    }

    /// 1 (all bands alike), 3 (red, green, blue; near infrared like red) or 4 values per pixel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The pixels of a row, channel by channel within each.
    #[inline(always)]
    pub fn row(&self, y_px: usize) -> &[f32] {
        let stride = index(self.size.width_px) * self.channels;
        &self.values[y_px * stride..(y_px + 1) * stride]
    }

    /// What each channel weighs where the bands weigh so much.
    pub fn channel_weights(&self, [red, green, blue, infrared]: [f64; BANDS]) -> [f64; BANDS] {
        match self.channels {
            1 => [red + green + blue + infrared, 0.0, 0.0, 0.0],
            3 => [red + infrared, green, blue, 0.0],
            _ => [red, green, blue, infrared],
        }
    }

    /// Least and greatest value of each band.
    pub fn range(&self) -> [[f64; BANDS]; 2] {
        let mut range = [[f64::MAX; BANDS], [0.0; BANDS]];
        for pixel in self.values.chunks_exact(self.channels) {
            for (channel, &value) in pixel.iter().enumerate() {
                range[0][channel] = lesser(range[0][channel], f64::from(value));
                range[1][channel] = greater(range[1][channel], f64::from(value));
            }
        }
        range.map(|corner| match self.channels {
            1 => [corner[0]; BANDS],
            3 => [corner[0], corner[1], corner[2], corner[0]],
            _ => corner,
        })
    }
}

fn widened(codes: Vec<u8>) -> Vec<u16> {
    codes.into_iter().map(u16::from).collect()
}

/// A PNG file whose size was judged before it was decoded.
fn png(name: &str, bytes: &[u8]) -> Result<DynamicImage, Error> {
    let reader = || ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let damaged = |error: image::ImageError| Error::content(name, format!("is not a complete PNG file: {error}"));
    let (width_px, height_px) = reader().into_dimensions().map_err(damaged)?;
    check_size(name, width_px.into(), height_px.into())?;
    reader().decode().map_err(damaged)
}

/// The channels of an OpenEXR file whose size was judged before memory was taken for it.
#[cfg(feature = "exr")]
fn exr_channels(name: &str, bytes: &[u8]) -> Result<Vec<crate::picture::Channel>, Error> {
    let header = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| Error::content(name, format!("is not a complete OpenEXR file: {error}")))?;
    for layer in &header.headers {
        let [width_px, height_px] = [layer.layer_size.width(), layer.layer_size.height()].map(crate::num::u64_from);
        check_size(name, width_px, height_px)?;
    }
    crate::picture::from_exr(name, bytes)
}

/// Depth from a separate file: a grey 16-bit PNG with the given steps per metre (0: nothing seen), or channel Z or Y of an OpenEXR file in
/// metres. Fails on a file that is damaged, or holds something else.
pub fn depth_m(name: &str, bytes: &[u8], steps_per_m: f64) -> Result<Plane<f32>, Error> {
    match PictureFormat::of(name, bytes)? {
        PictureFormat::Png => {
            let DynamicImage::ImageLuma16(picture) = png(name, bytes)? else {
                return Err(Error::content(name, "is not a depth picture; use a grey 16-bit PNG"));
            };
            let size = Size { width_px: picture.width(), height_px: picture.height() };
            let metres = |code: u16| if code == 0 { f32::INFINITY } else { f32_nearest(f64::from(code) / steps_per_m) };
            Ok(Plane::from_values(size, picture.into_raw().into_iter().map(metres).collect()))
        }
        PictureFormat::Exr => exr_depth(name, bytes),
    }
}

#[cfg(feature = "exr")]
fn exr_depth(name: &str, bytes: &[u8]) -> Result<Plane<f32>, Error> {
    let channels = exr_channels(name, bytes)?;
    let found = ["Z", "Y"].iter().find_map(|wanted| channels.iter().find(|channel| channel.name == *wanted));
    let found = found.ok_or_else(|| Error::content(name, "has no depth; use channel Z (or Y) in metres"))?;
    depth_checked(name, &found.plane)
}

#[cfg(not(feature = "exr"))]
fn exr_depth(name: &str, _: &[u8]) -> Result<Plane<f32>, Error> {
    Err(Error::content(name, "is OpenEXR, which this build does not read; use a grey 16-bit PNG"))
}

/// Depths of 0 and below, and infinite ones, mean that nothing is seen; NaN is refused.
#[cfg(feature = "exr")]
fn depth_checked(name: &str, plane: &Plane<f32>) -> Result<Plane<f32>, Error> {
    if plane.values().iter().any(|depth_m| depth_m.is_nan()) {
        let reason = "holds a depth that is not a number; use metres, or infinity where nothing is seen";
        return Err(Error::content(name, reason));
    }
    Ok(plane.map(|depth_m| if depth_m > 0.0 { depth_m } else { f32::INFINITY }))
}

/// Value of a code of a file in 0..=1, as light.
pub(super) fn linear(share: f64, transfer: TransferCurve) -> f32 {
    f32_nearest(match transfer {
        TransferCurve::Srgb => linear_from_srgb_share(share),
        TransferCurve::Linear => share,
    })
}
