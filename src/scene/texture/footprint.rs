//! Footprint of a sample on a texture: the ellipse of texels that a look-up averages over, from ray differentials.
//!
//! A sample of N stands for a share f = 1 / sqrt(N) of the pixel's width, of its height and of the motion over the exposure. The
//! offset of its look-up from the middle of all three is multiplied by c = sqrt(1 - f^2), so that the spread of the samples' positions
//! and that of their filters sum to the pixel's own: to second order nothing is blurred twice, at any N. The step of a sharp edge is
//! rounded by f / 8 of its contrast at most.

use super::super::lanes::Floats;
use super::super::vectors::dot;
use super::{Footprint, TAPS_MAX};
use crate::num::{f32_from_u32, u32_truncated_f32};

/// Where the look-ups of a packet's samples go.
#[derive(Clone, Copy, Debug)]
pub enum Look {
    /// Towards the middle, as far as shares say: where in the pixel and in the exposure each sample lies, from -1/2 to 1/2.
    Inwards([Floats; 3]),
    /// Pixels to the right, and down.
    By([Floats; 2]),
}

/// A look-up averages over this many pixels of the motion at most, because its number of taps is bounded: beyond, the share of the motion
/// that a sample stands for falls as the motion grows.
const TRAVEL_PX_MAX: f32 = 5.0;

/// Cosines below this count as this: a surface seen edge-on has no end.
const COS_MIN: f32 = 0.02;

/// Texels that a look-up may be moved by.
const SHIFT_TEXELS_MAX: f32 = 1e5;

/// What of its pixel's width and height, and of the motion over the exposure, a sample stands for.
#[derive(Clone, Copy, Debug)]
pub struct SampleShare {
    /// Of the width and of the height.
    pub pixel: f32,
    /// How much nearer to the pixel's middle the look-up is moved.
    to_pixel: f32,
    /// Of the exposure.
    exposure: f32,
    /// Whether a share of a motion that is too long for one look-up is as much of it as one takes, and not that share of what one
    /// takes. Sobol' points that lie evenly over the moving surface have no gaps of time to see through; halves of other samples do, and
    /// would agree better than two renders.
    is_wide: bool,
}

impl SampleShare {
    /// Shares of the pixel's width and of the exposure.
    #[inline(always)]
    pub fn new(pixel: f32, exposure: f32) -> Self {
        Self { pixel, to_pixel: to_middle(pixel), exposure, is_wide: false }
    }

    /// The same share of the pixel and of the exposure, for samples that lie evenly over the moving surface.
    #[inline(always)]
    pub fn over_motion(share: f32) -> Self {
        Self { is_wide: true, ..Self::new(share, share) }
    }
}

#[inline(always)]
fn to_middle(share: f32) -> f32 {
    1.0 - (1.0 - share * share).sqrt()
}

/// How near to a mip level one level serves. The wrong one's variance is off by 1.2 of this at most in units of the look-up's own,
/// which is share^2 of the pixel's: under 4 % of the pixel's at any number of samples, and one level is half of a look-up's cost.
#[inline(always)]
fn snap(share: f32) -> f32 {
    let wanted = 1.0 / (32.0 * share * share);
    if wanted < 0.5 { wanted } else { 0.5 }
}

/// Ray differentials where a ray meets a plane (Igehy 1999).
pub struct Differentials {
    /// Unit normal of the plane, either way.
    pub normal: [f32; 3],
    /// Texels along u, then along v, for a metre in the world.
    pub slopes: [[f32; 3]; 2],
    /// Direction of the ray.
    pub direction: [f32; 3],
    /// How far the ray's end goes in metres for a pixel to the right, a pixel down, and over the whole exposure.
    pub steps_m: [[f32; 3]; 3],
    /// A pixel's width at the hit in metres.
    pub pixel_m: f32,
}

impl Differentials {
    /// How far the hit goes in texels for each step: the ray's end follows the surface's plane along the ray.
    #[inline(always)]
    fn steps_texels(&self) -> [[f32; 2]; 3] {
        let Self { normal, slopes, direction, steps_m, .. } = *self;
        let cos = dot(normal, direction);
        let bounded = if cos.abs() < COS_MIN { if cos < 0.0 { -COS_MIN } else { COS_MIN } } else { cos };
        let per_cos = 1.0 / bounded;
        let mut steps_texels = [[0.0; 2]; 3];
        for step in 0..3 {
            let behind = dot(normal, steps_m[step]) * per_cos;
            for axis in 0..2 {
                steps_texels[step][axis] = dot(slopes[axis], steps_m[step]) - dot(slopes[axis], direction) * behind;
            }
        }
        steps_texels
    }

    /// Share of the motion over the exposure that a look-up averages over.
    #[inline(always)]
    fn share_of_motion(&self, shares: &SampleShare) -> f32 {
        // Only what crosses the ray is seen as motion.
        let [_, _, travel_m] = self.steps_m;
        let forward = dot(travel_m, self.direction);
        let across2 = dot(travel_m, travel_m) - forward * forward;
        let longest_m = self.pixel_m * TRAVEL_PX_MAX;
        let fits = if across2 > longest_m * longest_m { longest_m / across2.sqrt() } else { 1.0 };
        if !shares.is_wide {
            shares.exposure * fits
        } else if shares.exposure < fits {
            shares.exposure
        } else {
            fits
        }
    }
}

/// The footprint of a ray, for all rays that meet its triangle with it, and how far each lane's is moved.
#[inline(always)]
pub fn footprint(ray: &Differentials, look: &Look, shares: &SampleShare) -> (Footprint, [Floats; 2]) {
    let [right, down, travel] = ray.steps_texels();
    let (share, share_t) = (shares.pixel, ray.share_of_motion(shares));
    let to_middle = to_middle(share_t);
    let mut shift_texels = [Floats::splat(0.0); 2];
    for axis in 0..2 {
        let shift = match look {
            Look::Inwards([x, y, t]) => {
                let right = Floats::splat(-shares.to_pixel * right[axis]);
                let down = Floats::splat(-shares.to_pixel * down[axis]);
                let travel = Floats::splat(-to_middle * travel[axis]);
                *x * right + *y * down + *t * travel
            }
            Look::By([x, y]) => *x * Floats::splat(right[axis]) + *y * Floats::splat(down[axis]),
        };
        let is_sound = shift.abs().below(Floats::splat(SHIFT_TEXELS_MAX));
        shift_texels[axis] = is_sound.select(shift, Floats::splat(0.0));
    }
    let (step_u, step_v, taps, area_texels2) = ellipse(right, down, travel, share * share, share_t * share_t);
    let footprint = Footprint {
        shift_texels: [0.0; 2],
        step_texels: [step_u, step_v],
        taps: u32_truncated_f32(taps),
        area_texels2,
        snap: snap(share),
    };
    (footprint, shift_texels)
}

/// Square of the texels of their level that taps stand apart at most: 1.4 texels, or two, where samples are so many that what two give
/// too much of one texel and too little of the next differs from sample to sample. Whole pixels' look-ups all lie at one point.
#[inline(always)]
fn tap2(share2: f32) -> f32 {
    if share2 > MANY { 2.0 } else { 4.0 }
}

/// Square of the share of the pixel from which on samples are many: that of sixteen, and a rounding.
const MANY: f32 = 0.07;

/// Taps along the longer axis and the texels' area of the mip level, so that the variances of the look-up (mip, then taps) are
/// those of boxes along the three steps. A box of width w has variance w^2 / 12. A mip level of texels s wide, looked up
/// bilinearly, has (s^2 - 1) / 4 more than the picture itself, and K taps d apart add d^2 (K^2 - 1) / 12.
#[inline(always)]
fn ellipse(right: [f32; 2], down: [f32; 2], travel: [f32; 2], share2: f32, share2_t: f32) -> (f32, f32, f32, f32) {
    let uu = share2 * (right[0] * right[0] + down[0] * down[0]) + share2_t * travel[0] * travel[0];
    let vv = share2 * (right[1] * right[1] + down[1] * down[1]) + share2_t * travel[1] * travel[1];
    let uv = share2 * (right[0] * right[1] + down[0] * down[1]) + share2_t * travel[0] * travel[1];
    let (mean, half) = (0.5 * (uu + vv), 0.5 * (uu - vv));
    let difference = (half * half + uv * uv).sqrt();
    let minor = if mean > difference { mean - difference } else { 0.0 };
    let area = 1.0 + minor * (1.0 / 3.0);
    // What the longer axis has more than the shorter one.
    let longer = 2.0 * difference;
    let most = f32_from_u32(TAPS_MAX);
    let tap2 = tap2(share2);
    let wanted = longer / (tap2 * area);
    let counted = f32_from_u32(u32_truncated_f32((1.0 + wanted).sqrt())) + 1.0;
    // An ellipse that is nearly round is a circle of its mean width.
    let is_round = !(longer >= 2.0 * area);
    let taps = if is_round {
        1.0
    } else if counted > most {
        most
    } else {
        counted
    };
    let widened = longer / (tap2 * (most * most - 1.0));
    let area_of_taps = if widened > area { widened } else { area };
    let area = if is_round { area + longer * (1.0 / 6.0) } else { area_of_taps };
    let spread2 = if is_round { 0.0 } else { longer / (taps * taps - 1.0) };
    // The longer axis's direction, from whichever form does not cancel.
    let (a, b) = if half > 0.0 { (half + difference, uv) } else { (uv, difference - half) };
    let length2 = a * a + b * b;
    let scale = if length2 > 0.0 { (spread2 / length2).sqrt() } else { 0.0 };
    (a * scale, b * scale, taps, area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_look_up_has_the_variance_of_the_three_boxes() {
        let mut tried = [0; 2];
        for (right, down, travel) in [
            ([4.0, 0.0], [0.0, 4.0], [0.0, 0.0]),
            ([4.0, 0.0], [0.0, 4.0], [12.0, 5.0]),
            ([9.0, 3.0], [-0.5, 2.0], [0.0, 0.0]),
            ([0.3, 0.0], [0.0, 0.3], [3.0, -7.0]),
            ([0.0, 2.0], [2.0, 0.0], [0.0, 9.0]),
        ] {
            let widths =
                |axis: usize| right[axis] * right[axis] + down[axis] * down[axis] + 0.25 * travel[axis] * travel[axis];
            // One sample of a pixel, and one of sixteen of a pixel that is four times as wide.
            for (share2, times) in [(1.0, 1.0), (0.0625, 4.0)] {
                let [right, down] = [right, down].map(|step| step.map(|texels: f32| texels * times));
                let (u, v, taps, area) = ellipse(right, down, travel, share2, 0.25);
                let extra = (taps * taps - 1.0) / 12.0;
                let found = [0, 1].map(|axis| (area - 1.0) / 4.0 + extra * if axis == 0 { u * u } else { v * v });
                // Sums of squares of a few texels with some ten roundings of 2^-24 each.
                for axis in 0..2 {
                    let expected = widths(axis) / 12.0;
                    let difference = (found[axis] - expected).abs();
                    assert!(difference < 1e-4 * (1.0 + expected), "{found:?} for {expected} on {axis}");
                }
                assert!(u * u + v * v <= 1.0001 * tap2(share2) * area, "{u} {v} of {area}");
                tried[usize::from(taps > 1.0)] += 1;
            }
        }
        assert_eq!(tried, [2, 8]);
    }
}
