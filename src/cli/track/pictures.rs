//! A recording's pictures through the extractor on the host. Enters: an EuRoC folder of any number of cameras, or a TUM one of one. Leaves:
//! the features of one frame of the rig after the other.

use sensel::compute::{AlwaysReady, AtOnce, Extractor, ExtractorParams, Feature, Pixels, Records};
use sensel::error::Error;
use sensel::events::Events;
use sensel::files::euroc::FrameEntry;
use sensel::files::grey::{self, Grey};
use sensel::plane::Plane;
use sensel::tracker::CameraCalibration;

use super::Brought;

/// Pictures of two cameras this near in time are one frame of the rig.
const PAIR_NS_MAX: u64 = 1_000_000;

/// Pictures of all cameras, in rising time.
pub struct Pictures<'a> {
    cameras: &'a [CameraCalibration],
    frames: &'a [Vec<FrameEntry>],
    together: std::vec::IntoIter<Vec<usize>>,
    extractors: Vec<Extractor>,
}

impl<'a> Pictures<'a> {
    /// Those that belong together; no picture is read yet.
    pub fn new(cameras: &'a [CameraCalibration], frames: &'a [Vec<FrameEntry>], extractor: &ExtractorParams) -> Self {
        let extractors = vec![Extractor::new(extractor); cameras.len()];
        Self { cameras, frames, together: together(frames).into_iter(), extractors }
    }

    /// Frames of the rig.
    pub fn rig_frames(&self) -> usize {
        self.together.len()
    }

    fn bring(&mut self, indices: &[usize]) -> Result<Brought, Error> {
        let mut features: Vec<Vec<Feature>> = Vec::new();
        for (camera, &frame) in indices.iter().enumerate() {
            let (codes, bits) = self.load(camera, frame)?;
            let io = (&mut AtOnce as &mut dyn Pixels, &mut AlwaysReady as &mut dyn Records);
            let extractor = &mut self.extractors[camera];
            features.push(extractor.frame(&codes, bits, (1, 1), io, &mut Events::default())?.features);
        }
        // Recordings do not say when their rows were exposed.
        Ok(Brought { timestamp_ns: self.frames[0][indices[0]].timestamp_ns, features, clocks: Vec::new() })
    }

    fn load(&self, camera: usize, frame: usize) -> Result<(Plane<u16>, u32), Error> {
        let entry = &self.frames[camera][frame];
        let Grey { codes, bits, .. } = grey::read(&entry.path)?;
        let (found, wanted) = (codes.size(), self.cameras[camera].size);
        if found == wanted {
            return Ok((codes, bits));
        }
        let reason = format!(
            "is {}x{}; the camera's pictures are {}x{}",
            found.width_px, found.height_px, wanted.width_px, wanted.height_px
        );
        Err(Error::Content { file: entry.path.display().to_string(), reason })
    }
}

impl Iterator for Pictures<'_> {
    type Item = Result<Brought, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let indices = self.together.next()?;
        Some(self.bring(&indices))
    }
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
