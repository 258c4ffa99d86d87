//! Shares rendered exposures between frames that see the same light, without a copy.

use std::sync::Arc;

use super::row_times::slot_lengths_clk;
use crate::optics::Exposure;
use crate::plane::Plane;
use crate::readout::Schedule;
use crate::units::FrameIndex;

/// An exposure that frames share.
#[derive(Clone, Debug)]
pub struct SharedExposure {
    /// Mean photons of each pixel.
    pub photons: Arc<Plane<f32>>,
    /// Render variance over photon variance, by the render's own estimate.
    pub render_variance_ratio: f64,
    /// Rays that were sent for this frame.
    pub rays: u64,
}

impl From<Exposure> for SharedExposure {
    fn from(exposure: Exposure) -> Self {
        let Exposure { photons, render_variance_ratio, rays } = exposure;
        Self { photons: Arc::new(photons), render_variance_ratio, rays }
    }
}

/// Exposures of the frame before where nothing moves or flickers, one entry a camera, with the lengths of their rows by slot.
#[derive(Default)]
pub(super) struct StillExposures(Vec<(Vec<Vec<u64>>, Vec<SharedExposure>)>);

impl StillExposures {
    /// A camera's exposures in a frame with the same row exposures as the one before; sends no ray.
    pub fn again(&self, camera: usize, schedule: &Schedule, frame: FrameIndex) -> Option<Vec<SharedExposure>> {
        let (lengths, seen) = self.0.get(camera)?;
        let alike = *lengths == slot_lengths_clk(schedule, frame);
        alike.then(|| seen.iter().map(|one| SharedExposure { rays: 0, ..one.clone() }).collect())
    }

    /// Keeps what the cameras saw, unless it is kept for rows of these lengths already.
    pub fn keep(&mut self, schedules: &[Schedule], frame: FrameIndex, seen: &[Vec<SharedExposure>]) {
        let lengths: Vec<_> = schedules.iter().map(|one| slot_lengths_clk(one, frame)).collect();
        if self.0.iter().map(|(kept, _)| kept).ne(&lengths) {
            self.0 = lengths.into_iter().zip(seen.iter().cloned()).collect();
        }
    }
}
