//! Shares rendered exposures between frames that see the same light, without a copy.

use std::sync::Arc;

use super::rows::slot_lengths_clk;
use crate::optics::Exposure;
use crate::plane::Plane;
use crate::readout::Schedule;
use crate::units::FrameIndex;

/// An exposure that frames share.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Mean photons of each pixel.
    pub photons: Arc<Plane<f32>>,
    /// As the render claims it.
    pub render_variance_ratio: f64,
    /// Rays that were sent for this frame.
    pub rays: u64,
}

impl From<Exposure> for Seen {
    fn from(exposure: Exposure) -> Self {
        let Exposure { photons, render_variance_ratio, rays } = exposure;
        Self { photons: Arc::new(photons), render_variance_ratio, rays }
    }
}

/// Exposures of the frame before where nothing moves or flickers, one entry a camera, with the lengths of their rows by slot.
#[derive(Default)]
pub(super) struct Still(Vec<(Vec<Vec<u64>>, Vec<Seen>)>);

impl Still {
    /// What a camera sees in a frame whose rows are exposed for as long as in the one before: no ray is sent for it.
    pub fn again(&self, camera: usize, schedule: &Schedule, frame: FrameIndex) -> Option<Vec<Seen>> {
        let (lengths, seen) = self.0.get(camera)?;
        let alike = *lengths == slot_lengths_clk(schedule, frame);
        alike.then(|| seen.iter().map(|one| Seen { rays: 0, ..one.clone() }).collect())
    }

    /// Keeps what the cameras saw, unless it is kept for rows of these lengths already.
    pub fn keep(&mut self, schedules: &[Schedule], frame: FrameIndex, seen: &[Vec<Seen>]) {
        let lengths: Vec<_> = schedules.iter().map(|one| slot_lengths_clk(one, frame)).collect();
        if self.0.iter().map(|(kept, _)| kept).ne(&lengths) {
            self.0 = lengths.into_iter().zip(seen.iter().cloned()).collect();
        }
    }
}
