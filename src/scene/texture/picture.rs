//! Decodes PNG and JPEG pictures to sRGB texels with alpha. The size is read from the header and checked before anything is decoded.

use std::io::Cursor;

use image::{ImageFormat, ImageReader, Limits};

use super::jpeg::is_cut;
use super::{Texture, Wrap};

/// Edge of a picture at most.
const EDGE_PX_MAX: u32 = 8_192;
/// Texels of all pictures of a scene together at most: 270 MB as they are kept, coarser levels included.
const TEXELS_MAX: u64 = 1 << 25;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct TexturePicture {
    /// Width and height.
    pub size_px: [u32; 2],
    /// sRGB, row-major, the top row first.
    pub codes: Vec<[u8; 3]>,
    /// Coverage of each texel; 255 where the file has none.
    pub alpha: Vec<u8>,
}

/// Texels that pictures may still take.
#[derive(Clone, Copy, Debug)]
pub struct Budget(u64);

impl Default for Budget {
    fn default() -> Self {
        Self(TEXELS_MAX)
    }
}

impl Budget {
    /// Whether there is room for a picture; yes for what has no size, which decoding refuses.
    pub fn has_room(self, bytes: &[u8]) -> bool {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        let size = reader.ok().and_then(|reader| reader.into_dimensions().ok());
        size.is_none_or(|(width, height)| u64::from(width) * u64::from(height) <= self.0)
    }
}

impl TexturePicture {
    /// Decodes a picture. Fails on what is neither PNG nor JPEG, damaged, or too large: in words for its user.
    pub fn decoded(bytes: &[u8], budget: &mut Budget) -> Result<Self, String> {
        let reader = || {
            let reader =
                ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
            match reader.format() {
                Some(ImageFormat::Png | ImageFormat::Jpeg) => Ok(reader),
                _ if bytes.starts_with(b"\xabKTX 20") => Err("it is KTX2, neither PNG nor JPEG; convert it".to_owned()),
                Some(other) => Err(format!("it is {other:?}, neither PNG nor JPEG; convert it")),
                None => Err("it is neither PNG nor JPEG".to_owned()),
            }
        };
        let (width, height) = reader()?.into_dimensions().map_err(|error| error.to_string())?;
        let texels = u64::from(width) * u64::from(height);
        if width.max(height) > EDGE_PX_MAX || texels > budget.0 || width.min(height) == 0 {
            return Err(format!(
                "{width} x {height} px; use up to {EDGE_PX_MAX} an edge and {TEXELS_MAX} texels in all pictures"
            ));
        }
        if is_cut(bytes) {
            return Err("it ends before it is complete; copy it again".to_owned());
        }
        budget.0 -= texels;
        let mut decoder = reader()?;
        let mut limits = Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(EDGE_PX_MAX), Some(EDGE_PX_MAX));
        decoder.limits(limits);
        let picture = decoder.decode().map_err(|error| error.to_string())?;
        let size_px = [picture.width(), picture.height()];
        if !picture.color().has_alpha() {
            let codes: Vec<[u8; 3]> = picture.into_rgb8().pixels().map(|pixel| pixel.0).collect();
            return Ok(Self { size_px, alpha: vec![u8::MAX; codes.len()], codes });
        }
        let picture = picture.into_rgba8();
        let codes = picture.pixels().map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]).collect();
        let alpha = picture.pixels().map(|pixel| pixel.0[3]).collect();
        Ok(Self { size_px, codes, alpha })
    }

    /// The colours of texels that are holes become the mean of the others, so that coarser levels do not bleed invisible colours.
    #[must_use]
    pub fn bled(mut self, least: u8) -> Self {
        let mut sums = [0_u64; 4];
        for (code, _) in self.codes.iter().zip(&self.alpha).filter(|(_, alpha)| **alpha >= least) {
            for band in 0..3 {
                sums[band] += u64::from(code[band]);
            }
            sums[3] += 1;
        }
        if sums[3] > 0 {
            let mean = [0, 1, 2].map(|band| u8::try_from(sums[band] / sums[3]).expect("a mean of bytes is a byte"));
            for (code, _) in self.codes.iter_mut().zip(&self.alpha).filter(|(_, alpha)| **alpha < least) {
                *code = mean;
            }
        }
        self
    }

    /// As a texture.
    pub fn texture(&self, wrap: [Wrap; 2]) -> Texture {
        Texture::from_srgb(self.size_px[0], self.size_px[1], &self.codes, wrap)
    }

    /// As a texture of values that are no colours: 255 is 1.
    pub fn values(&self, wrap: [Wrap; 2]) -> Texture {
        Texture::from_linear(self.size_px[0], self.size_px[1], &self.codes, wrap)
    }

    /// Mean colour as linear light, from 0 to 1.
    pub fn mean(&self) -> [f32; 3] {
        self.mean_of(super::linear_from_srgb)
    }

    /// Mean of codes that are no colours: 255 is 1.
    pub fn mean_value(&self) -> [f32; 3] {
        self.mean_of(|code| f64::from(code) / 255.0)
    }

    fn mean_of(&self, value: impl Fn(u8) -> f64) -> [f32; 3] {
        let mut sums = [0.0_f64; 3];
        for code in &self.codes {
            for band in 0..3 {
                sums[band] += value(code[band]);
            }
        }
        sums.map(|sum| crate::num::f32_nearest(sum / crate::num::f64_from_usize(self.codes.len())))
    }
}
