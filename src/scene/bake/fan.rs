//! Fans of rays over a sample, and the two groups in which their light is kept.

use super::super::chance::{cosine_direction, pair};
use super::super::lanes::LANES;
use super::super::light::BANDS;
use super::super::samples::IrradianceSample;
use crate::draw::DrawKey;
use crate::num::{f64_from_usize, u64_from};

/// Rays start this far above their surface in metres: above the rounding of coordinates up to 1 km (6e-5 m), below what
/// furniture is made of.
pub const LIFT_M: f32 = 2e-4;

/// Light is kept apart in two groups: what is steady, and what flickers.
pub const GROUPS: usize = 2;
pub const STEADY: usize = 0;
pub(super) const FLICKERING: usize = 1;

/// One number a group and band.
pub type ByGroup<T> = [[T; BANDS]; GROUPS];

/// Stratified cosine-weighted directions around +z. Every sample uses the same, so that neighbours on a wall see the same points a
/// little shifted, and what is left of the error is smooth instead of mottled.
pub fn fan(rays: usize) -> Vec<[f32; 3]> {
    assert!(rays > 0 && rays.is_multiple_of(LANES), "bounces go in full packets");
    let (rings, sectors) = strata(rays);
    let key = DrawKey::root(BOUNCE_DRAWS);
    let direction = |ray: usize| {
        // Sixteen neighbours of the list are a few rings by four sectors, so that rays of one receiver stay close together.
        let (block, lane) = (ray / LANES, ray % LANES);
        let ring = PACKET_RINGS * (block / (sectors / 4)) + lane / 4;
        let sector = 4 * (block % (sectors / 4)) + lane % 4;
        let [a, b] = pair(key, u64_from(ring * sectors + sector));
        let ring = (f64_from_usize(ring) + a) / f64_from_usize(rings);
        cosine_direction([ring, (f64_from_usize(sector) + b) / f64_from_usize(sectors)])
    };
    (0..rays).map(direction).collect()
}

/// A point on a surface whose irradiance is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    pub at_m: [f32; 3],
    /// Unit normal of the first side.
    pub normal: [f32; 3],
    /// Sides that are lit.
    pub sides: usize,
}

impl Receiver {
    /// Of a sample.
    pub fn of(sample: &IrradianceSample) -> Self {
        Self { at_m: sample.position_m, normal: sample.normal, sides: sample.sides() }
    }

    /// Unit normal of a side.
    pub fn normal_of(&self, side: usize) -> [f32; 3] {
        if side == 0 { self.normal } else { self.normal.map(|x| -x) }
    }

    /// Where rays of a side start: just above the surface.
    pub fn lifted_m(&self, side: usize) -> [f32; 3] {
        let lift_m = if side == 0 { LIFT_M } else { -LIFT_M };
        [0, 1, 2].map(|axis| self.at_m[axis] + self.normal[axis] * lift_m)
    }
}

/// Number of the bounces' draws: the seed of their key.
pub(super) const BOUNCE_DRAWS: u64 = 0x626F_756E;

/// Rings of a packet of bounces.
pub(super) const PACKET_RINGS: usize = LANES / 4;

/// Rings and sectors whose product is the count: sectors a multiple of 4, rings one of `PACKET_RINGS`.
pub(super) fn strata(rays: usize) -> (usize, usize) {
    let mut rings = PACKET_RINGS;
    while 4 * rings * rings <= rays && rays.is_multiple_of(rings * 8) {
        rings *= 2;
    }
    (rings, rays / rings)
}
