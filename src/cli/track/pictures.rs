//! Runs the host's extractor on the pictures of a recording, frame by frame: an EuRoC folder of any number of cameras,
//! or a TUM folder of one.
//!
//! Files hold 8 or 16 bits, whatever the sensor had. Where the lower bits of all codes are zero, the sensor had fewer
//! bits, and the extractor is configured for that depth.

use sensel::compute::{AlwaysReady, AtOnce, Extractor, ExtractorParams, Feature, Pixels, Records};
use sensel::error::Error;
use sensel::events::Events;
use sensel::files::content_error;
use sensel::files::euroc::FrameEntry;
use sensel::files::grey::{self, Grey};
use sensel::num::u32_from;
use sensel::plane::Plane;
use sensel::tracker::CameraCalibration;

use super::rig_frame::RigFrame;

/// Pictures of two cameras this near in time are one frame of the rig.
const PAIR_NS_MAX: u64 = 1_000_000;

/// Pictures of all cameras, in rising time.
pub struct PictureStream<'a> {
    cameras: &'a [CameraCalibration],
    frames: &'a [Vec<FrameEntry>],
    together: std::vec::IntoIter<Vec<usize>>,
    extractors: Vec<Extractor>,
    /// Bits that some code of a camera has had so far, as a mask of the files' codes.
    ever_set: Vec<u16>,
}

impl<'a> PictureStream<'a> {
    /// Those that belong together; no picture is read yet.
    pub fn new(cameras: &'a [CameraCalibration], frames: &'a [Vec<FrameEntry>], extractor: &ExtractorParams) -> Self {
        let extractors = vec![Extractor::new(extractor); cameras.len()];
        let ever_set = vec![0; cameras.len()];
        Self { cameras, frames, together: together(frames).into_iter(), extractors, ever_set }
    }

    pub fn rig_frames(&self) -> usize {
        self.together.len()
    }

    fn next_frame(&mut self, indices: &[usize]) -> Result<RigFrame, Error> {
        let mut features: Vec<Vec<Feature>> = Vec::new();
        for (camera, &frame) in indices.iter().enumerate() {
            let (codes, bits) = self.load(camera, frame)?;
            let (codes, bits) = without_idle_bits((codes, bits), &mut self.ever_set[camera]);
            let io = (&mut AtOnce as &mut dyn Pixels, &mut AlwaysReady as &mut dyn Records);
            let extractor = &mut self.extractors[camera];
            features.push(extractor.frame(&codes, bits, (1, 1), io, &mut Events::default())?.features);
        }
        // Recordings do not say when their rows were exposed.
        let timestamp_ns = self.frames[0][indices[0]].timestamp_ns;
        Ok(RigFrame { number: u32_from(indices[0]), timestamp_ns, features, clocks: Vec::new() })
    }

    fn load(&self, camera: usize, frame: usize) -> Result<(Plane<u16>, u32), Error> {
        let entry = &self.frames[camera][frame];
        let Grey { codes, bits, .. } = grey::read(&entry.path)?;
        let (found, wanted) = (codes.size(), self.cameras[camera].size);
        if found == wanted {
            return Ok((codes, bits));
        }
        let [found, wanted] = [found, wanted].map(|size| format!("{}x{}", size.width_px, size.height_px));
        Err(content_error(&entry.path, format!("is {found}; the camera's pictures are {wanted}")))
    }
}

impl Iterator for PictureStream<'_> {
    type Item = Result<RigFrame, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let indices = self.together.next()?;
        Some(self.next_frame(&indices))
    }
}

/// The codes without their lower bits that none has had set so far, and the bits that are left; black pictures stay as they are.
fn without_idle_bits((codes, bits): (Plane<u16>, u32), ever_set: &mut u16) -> (Plane<u16>, u32) {
    *ever_set = codes.values().iter().fold(*ever_set, |all, &code| all | code);
    let idle = ever_set.trailing_zeros();
    if idle == 0 || idle >= bits { (codes, bits) } else { (codes.map(|code| code >> idle), bits - idle) }
}

/// Indices of pictures that belong together, one a camera, in rising time.
fn together(all_frames: &[Vec<FrameEntry>]) -> Vec<Vec<usize>> {
    let mut at = vec![0; all_frames.len()];
    let mut all = Vec::new();
    for (first, frame) in all_frames[0].iter().enumerate() {
        let mut indices = vec![first];
        for (camera, frames) in all_frames.iter().enumerate().skip(1) {
            let next = &mut at[camera];
            while *next < frames.len() && frames[*next].timestamp_ns + PAIR_NS_MAX < frame.timestamp_ns {
                *next += 1;
            }
            let is_near = |other: &FrameEntry| other.timestamp_ns.abs_diff(frame.timestamp_ns) <= PAIR_NS_MAX;
            indices.extend(frames.get(*next).filter(|other| is_near(other)).map(|_| *next));
        }
        if indices.len() == all_frames.len() {
            all.push(indices);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use sensel::units::Size;

    use super::*;

    #[test]
    fn bits_that_were_never_set_are_none_of_the_sensors() {
        let plane = |codes: [u16; 3]| Plane::from_values(Size { width_px: 3, height_px: 1 }, codes.to_vec());
        let mut ever_set = 0;
        let mut show = |codes| {
            let (codes, bits) = without_idle_bits((plane(codes), 8), &mut ever_set);
            (codes.values().to_vec(), bits)
        };
        assert_eq!(show([0, 0, 0]), (vec![0, 0, 0], 8));
        assert_eq!(show([0, 64, 192]), (vec![0, 1, 3], 2));
        // The word is as long as the longest so far.
        assert_eq!(show([0, 128, 16]), (vec![0, 8, 1], 4));
        assert_eq!(show([0, 64, 128]), (vec![0, 4, 8], 4));
        assert_eq!(show([255, 64, 128]), (vec![255, 64, 128], 8));
        assert_eq!(show([0, 64, 128]), (vec![0, 64, 128], 8));
    }
}
