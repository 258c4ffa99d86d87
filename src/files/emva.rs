//! Writes the folder that EMVA 1288 tools read: `frames/*.raw` (row-major, u16 little-endian above 8 bits, else u8, black level not
//! removed), the descriptor `emva1288.txt`, and `truth.json`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::emva_reader::DESCRIPTOR;
use super::{make_folder, write};
use crate::characterize::{ChannelTruth, PlannedShot, Set};
use crate::error::Error;
use crate::num::low_u8;
use crate::plane::Plane;

/// Why writing into a `String` is expected to work.
const TEXT: &str = "writing to a string cannot fail";

/// A folder under construction.
pub struct EmvaWriter {
    folder: PathBuf,
    bits: u32,
    descriptor: String,
}

impl EmvaWriter {
    /// Starts `folder`, which exists.
    pub fn create(folder: &Path, set: &Set) -> Result<Self, Error> {
        make_folder(&folder.join("frames"))?;
        let (width, height) = (set.size.width_px, set.size.height_px);
        let descriptor = format!("v 4.0\nn {} {width} {height}\n", set.bits);
        Ok(Self { folder: folder.to_owned(), bits: set.bits, descriptor })
    }

    /// Writes one frame and its line. Frames come in the order of `Set::shots`.
    pub fn frame(&mut self, shot: &PlannedShot, codes: &Plane<u16>) -> Result<(), Error> {
        let exposure_ns = shot.exposure.exposure_ns;
        // Floats are printed with all the digits they need to come back as they were.
        match (shot.is_first, shot.is_lit) {
            (true, true) => writeln!(self.descriptor, "b {exposure_ns} {}", shot.exposure.photons).expect(TEXT),
            (true, false) => writeln!(self.descriptor, "d {exposure_ns}").expect(TEXT),
            (false, _) => {}
        }
        let name = format!("frames/f{:05}.raw", shot.frame.0);
        writeln!(self.descriptor, "i {name}").expect(TEXT);
        write(&self.folder.join(name), raw(codes, self.bits))
    }

    /// Writes descriptor and truth. A truth without any figure is not written: there is nothing to judge.
    pub fn finish(self, truth: &ChannelTruth) -> Result<(), Error> {
        write(&self.folder.join(DESCRIPTOR), &self.descriptor)?;
        if truth.wants.is_empty() { Ok(()) } else { write(&self.folder.join("truth.json"), truth.to_json()) }
    }
}

fn raw(codes: &Plane<u16>, bits: u32) -> Vec<u8> {
    if bits > 8 {
        return codes.values().iter().flat_map(|code| code.to_le_bytes()).collect();
    }
    codes.values().iter().map(|&code| low_u8(code.into())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    #[test]
    fn samples_are_little_endian_words_above_eight_bits_and_bytes_below() {
        let codes = Plane::from_values(Size { width_px: 2, height_px: 1 }, vec![0x0102, 7]);
        assert_eq!(raw(&codes, 10), [2, 1, 7, 0]);
        let codes = Plane::from_values(Size { width_px: 2, height_px: 1 }, vec![255, 7]);
        assert_eq!(raw(&codes, 8), [255, 7]);
    }
}
