//! Sums over the codes of a frame.

use super::setup::Setup;
use crate::num::{f64_from_u64, lesser, u64_from};
use crate::plane::Plane;

/// Codes of 16 bits whose sum fits 32.
pub(super) const SUMMED: usize = 1 << 15;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CodeSums {
    pub pixels: u64,
    pub sum_dn: u64,
    pub saturated: u64,
}

impl CodeSums {
    /// Of one picture whose codes are saturated from `saturated_dn` on.
    pub fn of(codes: &Plane<u16>, saturated_dn: u32) -> Self {
        let sum = |codes: &[u16]| u64::from(codes.iter().map(|&code| u32::from(code)).sum::<u32>());
        let values = codes.values();
        Self {
            pixels: u64_from(values.len()),
            sum_dn: values.chunks(SUMMED).map(sum).sum(),
            saturated: u64_from(values.iter().filter(|&&code| u32::from(code) >= saturated_dn).count()),
        }
    }

    pub fn add(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.sum_dn += other.sum_dn;
        self.saturated += other.saturated;
    }

    pub fn mean_dn(&self) -> f64 {
        f64_from_u64(self.sum_dn) / f64_from_u64(self.pixels.max(1))
    }
}

/// The code from which on a pixel says nothing about its light: the greatest, or that of a full well at a gain of the ramp.
pub(super) fn saturated_dn(setup: &Setup, gain: f64) -> u32 {
    let greatest = (1_u32 << setup.sensor.bits()) - 1;
    if setup.sensor.merge.is_some() {
        return greatest;
    }
    let (adc, pixel) = (&setup.sensor.parameters.adc, &setup.sensor.parameters.pixel);
    let lsb_uv = adc.lsb_uv() * adc.gain / gain;
    let well_dn = WELL_SHARE * pixel.full_well_e * pixel.conversion_gain_uv_per_e / lsb_uv;
    let full_dn = lesser(f64::from(adc.black_level_dn) + well_dn, f64::from(greatest));
    crate::num::u32_truncated(full_dn)
}

/// Where a pixel's charge ends its code counts as saturated from this share of the well on: response, offsets and noise differ by less.
pub(super) const WELL_SHARE: f64 = 0.97;
