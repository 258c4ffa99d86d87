//! Plan of the street: widths, surfaces and its draws.

use super::super::build::Surface;
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, low_u32, u32_truncated_f32};

/// Half of the length of the rows of houses.
pub(super) const HALF_LENGTH_M: f32 = 42.0;
/// Where the houses across the ends stand.
pub(super) const END_M: f32 = 49.0;
/// Where the streets across the ends are closed.
pub(super) const SIDE_M: f32 = 22.0;
/// From the middle to the kerb.
pub(super) const KERB_M: f32 = 3.6;
pub(super) const PAVEMENT_M: f32 = 0.12;
/// From the middle to the fronts.
pub(super) const FRONT_M: f32 = 6.2;

pub(super) struct StreetMaterials {
    pub(super) fronts: Vec<Surface>,
    pub(super) trim: Surface,
    pub(super) plinth: Surface,
    pub(super) glass: Surface,
    pub(super) frame: Surface,
    pub(super) doors: [Surface; 2],
    pub(super) shutters: [Surface; 3],
    pub(super) roofs: [Surface; 2],
    pub(super) awnings: [Surface; 2],
    pub(super) iron: Surface,
    pub(super) lantern: Surface,
    pub(super) asphalt: Surface,
    pub(super) paint: Surface,
    pub(super) flags: Surface,
    pub(super) kerb: Surface,
    pub(super) bark: Surface,
    pub(super) leaves: [Surface; 2],
}

/// A draw of 0..limit.
pub(super) fn draw(key: DrawKey, number: u64, limit: u32) -> u32 {
    low_u32(key.with(number).0 >> 16) % limit.max(1)
}

/// A draw between two numbers, in 1024 steps.
pub(super) fn between(key: DrawKey, number: u64, low: f32, high: f32) -> f32 {
    low + (high - low) * f32_from_u32(draw(key, number, 1025)) / 1024.0
}

/// How often a length fits, at least once.
pub(super) fn fits(length_m: f32, each_m: f32) -> u32 {
    u32_truncated_f32((length_m / each_m).round_ties_even()).max(1)
}
