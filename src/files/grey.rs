//! Reads a PNG, JPEG or OpenEXR file as grey codes for the extractor, with their bit depth and a note on the conversion.

use std::path::Path;

use super::errors::io_error;
use super::open::{open_input, read_opened};
use super::picture;
use crate::error::Error;
use crate::num::{greater, low_u16, low_u32, u64_half_even};
use crate::picture::{Channel, from_exr};
use crate::plane::Plane;

/// First bytes of an OpenEXR file.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// Longest OpenEXR file that is read.
const BYTES_MAX: u64 = 1 << 31;
/// Rec. 709's weights of linear red, green and blue.
const LUMA: [(&str, f64); 3] = [("R", 0.2126), ("G", 0.7152), ("B", 0.0722)];

/// A picture's codes.
pub struct Grey {
    /// Codes.
    pub codes: Plane<u16>,
    /// Their depth.
    pub bits: u32,
    /// The linear value that became the greatest code, where the file holds linear values; codes are in proportion to it.
    pub full_scale: Option<f64>,
}

/// Reads a picture as grey codes: PNG and JPEG in their own depth; OpenEXR in 16 bits, in proportion to its brightest pixel. Fails on a
/// file that is not there, is no picture, or is too large; linear values that are negative or no numbers, or all black.
pub fn read(file: &Path) -> Result<Grey, Error> {
    use std::io::{Read as _, Seek as _};
    let name = file.display().to_string();
    let mut stream = open_input(file).map_err(picture::absent(file))?;
    let mut magic = [0; 4];
    let is_exr = stream.read_exact(&mut magic).is_ok() && magic == EXR_MAGIC;
    stream.rewind().map_err(io_error(file))?;
    if !is_exr {
        let (codes, bits) = picture::read_grey_of(stream, file)?;
        return Ok(Grey { codes, bits, full_scale: None });
    }
    let bytes = read_opened(stream, file, BYTES_MAX)?;
    let channels = from_exr(&name, &bytes)?;
    from_linear(&channels).map_err(|reason| Error::Content { file: name, reason })
}

fn from_linear(channels: &[Channel]) -> Result<Grey, String> {
    let named = |name: &str| channels.iter().find(|channel| channel.name == name).map(|channel| &channel.plane);
    let weighed: Vec<(&Plane<f32>, f64)> = match named("Y") {
        Some(luma) => vec![(luma, 1.0)],
        None => LUMA.iter().filter_map(|&(name, weight)| Some((named(name)?, weight))).collect(),
    };
    if weighed.len() != 1 && weighed.len() != LUMA.len() {
        return Err("has neither a channel Y nor channels R, G and B".to_owned());
    }
    let size = weighed[0].0.size();
    let sum = |i: usize| weighed.iter().fold(0.0, |sum, (plane, weight)| sum + weight * f64::from(plane.values()[i]));
    let linear: Vec<f64> = (0..size.pixel_count()).map(sum).collect();
    if let Some(bad) = linear.iter().find(|value| !(0.0..=f64::MAX).contains(*value)) {
        return Err(format!("has a value of {bad}; use finite values from 0"));
    }
    let brightest = linear.iter().fold(0.0, |most, &value| greater(most, value));
    if brightest == 0.0 {
        return Err("is black all over".to_owned());
    }
    let code = |value: &f64| low_u16(low_u32(u64_half_even(value / brightest * f64::from(u16::MAX))));
    let codes = Plane::from_values(size, linear.iter().map(code).collect());
    Ok(Grey { codes, bits: 16, full_scale: Some(brightest) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    fn channel(name: &str, values: [f32; 2]) -> Channel {
        let plane = Plane::from_values(Size { width_px: 2, height_px: 1 }, values.to_vec());
        Channel { name: name.to_owned(), plane }
    }

    #[test]
    fn linear_values_become_codes_in_proportion_to_the_brightest() {
        let grey = from_linear(&[channel("Y", [0.5, 2.0])]).unwrap();
        assert_eq!((grey.codes.values(), grey.bits, grey.full_scale), (&[16_384, 65_535][..], 16, Some(2.0)));
        let colour = [channel("B", [0.0, 1.0]), channel("G", [0.0, 1.0]), channel("R", [1.0, 1.0])];
        let grey = from_linear(&colour).unwrap();
        // 0.2126 * 65535 = 13932.7.
        assert_eq!(grey.codes.values(), [13_933, 65_535]);
    }

    #[test]
    fn what_is_no_light_is_refused_in_words() {
        for (channels, part) in [
            (vec![channel("Z", [1.0, 2.0])], "neither a channel Y"),
            (vec![channel("Y", [-0.5, 2.0])], "-0.5"),
            (vec![channel("Y", [f32::NAN, 2.0])], "NaN"),
            (vec![channel("Y", [0.0, 0.0])], "black"),
        ] {
            let refused = from_linear(&channels).err().unwrap();
            assert!(refused.contains(part), "{refused}");
        }
    }
}
