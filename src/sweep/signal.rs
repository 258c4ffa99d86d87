//! Mean signal of a run as a share of the converter's full scale, from mean photons: the same at every depth.

use crate::num::{f64_from_u64, lesser, u64_from};
use crate::plane::Plane;
use crate::run::Setup;
use crate::run::session::Frame;

/// Sums that run beside each other.
const LANES: usize = 8;

/// Sums over all pixels of a run, of each frame's longest exposure. Dark charge is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SignalSum {
    electrons_per_photon: f64,
    /// Electrons that the converter's full scale stands for.
    full_scale_e: f64,
    /// Electrons above which nothing changes any more: full well or full scale, whichever is less. It does not depend on the depth.
    saturation_e: f64,
    sum_e: f64,
    saturated: u64,
    pixels: u64,
}

impl SignalSum {
    /// For the sensors of a run, at the gain that its configuration states.
    pub fn new(setup: &Setup) -> Self {
        let parameters = &setup.sensor.parameters;
        let (pixel, adc) = (&parameters.pixel, &parameters.adc);
        let electrons_per_photon = setup.sensor.electrons_per_photon();
        let full_scale_e = adc.full_scale_uv / adc.gain / pixel.conversion_gain_uv_per_e;
        let saturation_e = lesser(full_scale_e, pixel.full_well_e);
        Self { electrons_per_photon, full_scale_e, saturation_e, ..Self::default() }
    }

    /// Adds a frame of all cameras.
    pub fn add(&mut self, frame: &Frame) {
        frame.cameras.iter().for_each(|camera| self.add_plane(&camera.photons));
    }

    fn add_plane(&mut self, photons: &Plane<f32>) {
        // One sum a lane: a single one would wait for every addition.
        let (mut sums_e, mut saturated) = ([0.0; LANES], [0_u64; LANES]);
        for part in photons.values().chunks(LANES) {
            for ((sum_e, saturated), &photons) in sums_e.iter_mut().zip(&mut saturated).zip(part) {
                let signal_e = f64::from(photons) * self.electrons_per_photon;
                *sum_e += lesser(signal_e, self.saturation_e);
                *saturated += u64::from(signal_e >= self.saturation_e);
            }
        }
        self.sum_e += sums_e.iter().sum::<f64>();
        self.saturated += saturated.iter().sum::<u64>();
        self.pixels += u64_from(photons.values().len());
    }

    fn per_pixel(&self, value: f64) -> Option<f64> {
        (self.pixels > 0).then(|| value / f64_from_u64(self.pixels))
    }

    /// Mean electrons of a pixel that the converter can tell apart.
    pub fn mean_e(&self) -> Option<f64> {
        self.per_pixel(self.sum_e)
    }

    /// The same over the electrons of the full scale; none of a sensor that sees no light.
    pub fn mean_share(&self) -> Option<f64> {
        self.mean_e().map(|mean_e| mean_e / self.full_scale_e).filter(|share| share.is_finite())
    }

    /// Share of the pixels whose mean signal saturates.
    pub fn saturated_share(&self) -> Option<f64> {
        self.per_pixel(f64_from_u64(self.saturated))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    #[test]
    fn the_mean_is_cut_at_saturation_and_divided_by_full_scale() {
        let mut sum =
            SignalSum { electrons_per_photon: 0.5, full_scale_e: 100.0, saturation_e: 80.0, ..SignalSum::default() };
        assert_eq!(sum.mean_e(), None);
        let size = Size { width_px: 2, height_px: 2 };
        sum.add_plane(&Plane::from_values(size, vec![20.0, 40.0, 100.0, 1000.0]));
        // 10, 20, 50 and 80 of 100 electrons.
        assert_eq!(sum.mean_e(), Some(40.0));
        assert_eq!(sum.mean_share(), Some(0.4));
        assert_eq!(sum.saturated_share(), Some(0.25));
    }
}
