//! Footprint of a sample on a texture: the ellipse of texels that a look-up averages over, from ray differentials.
//!
//! A sample of N stands for a share f = 1 / sqrt(N) of the pixel's width, of its height and of the motion over the exposure. Its
//! look-up is moved towards the middle of all three by the factor c = sqrt(1 - f^2), so that the spread of the samples' places and
//! that of their filters sum to the pixel's own: to second order nothing is blurred twice, at any N. The step of a sharp edge is
//! rounded by f / 8 of its contrast at most.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use crate::num::{f32_from_u32, u32_truncated_f32};
use crate::scene::lanes::Floats;
use crate::scene::texture::{Footprint, TAPS_MAX};

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
    /// takes. Nets that lie evenly over the moving surface have no gaps of time to see through; halves of other samples do, and would
    /// agree better than two renders.
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

/// How one step moves a hit, in texels: the ray's end follows the surface's plane along the ray.
#[inline(always)]
fn moved(normal: [f32; 3], slopes: [[f32; 3]; 2], along: [f32; 2], per_cos: f32, step: [f32; 3]) -> [f32; 2] {
    let behind = dot(normal, step) * per_cos;
    [dot(slopes[0], step) - along[0] * behind, dot(slopes[1], step) - along[1] * behind]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// How near to a mip level one level serves. The wrong one's variance is off by 1.2 of this at most in units of the look-up's own,
/// which is share^2 of the pixel's: under 4 % of the pixel's at any number of samples, and one level is half of a look-up's cost.
#[inline(always)]
fn snap(share: f32) -> f32 {
    let wanted = 1.0 / (32.0 * share * share);
    if wanted < 0.5 { wanted } else { 0.5 }
}

/// What one sample stands for on its texture, in texels.
struct Form {
    /// For a pixel to the right, a pixel down, and over the whole exposure.
    right: [f32; 2],
    down: [f32; 2],
    travel: [f32; 2],
    /// How much nearer to the pixel's middle, and to the exposure's, the look-up is moved.
    to_pixel: f32,
    to_middle: f32,
    /// The look-up's row of places and the area of its level's texels.
    step: [f32; 2],
    taps: f32,
    area: f32,
}

impl Form {
    /// Of a ray that meets a plane; `steps_m` and `pixel_m` as in `Differentials`.
    #[inline(always)]
    fn of(
        normal: [f32; 3],
        slopes: [[f32; 3]; 2],
        direction: [f32; 3],
        steps_m: [[f32; 3]; 3],
        pixel_m: f32,
        shares: &SampleShare,
    ) -> Self {
        let cos = dot(normal, direction);
        let bounded = if cos.abs() < COS_MIN { if cos < 0.0 { -COS_MIN } else { COS_MIN } } else { cos };
        let per_cos = 1.0 / bounded;
        let along = [dot(slopes[0], direction), dot(slopes[1], direction)];
        let right = moved(normal, slopes, along, per_cos, steps_m[0]);
        let down = moved(normal, slopes, along, per_cos, steps_m[1]);
        let travel_m = steps_m[2];
        let travel = moved(normal, slopes, along, per_cos, travel_m);
        // Only what crosses the ray is seen as motion.
        let forward = dot(travel_m, direction);
        let across2 = dot(travel_m, travel_m) - forward * forward;
        let (share, exposure) = (shares.pixel, shares.exposure);
        let pixel_m = pixel_m * TRAVEL_PX_MAX;
        let fits = if across2 > pixel_m * pixel_m { pixel_m / across2.sqrt() } else { 1.0 };
        let is_least = shares.is_wide && exposure < fits;
        let share_t = if is_least {
            exposure
        } else if shares.is_wide {
            fits
        } else {
            exposure * fits
        };
        let (step_u, step_v, taps, area) = ellipse(right, down, travel, share * share, share_t * share_t);
        let step = [step_u, step_v];
        Self { right, down, travel, to_pixel: shares.to_pixel, to_middle: to_middle(share_t), step, taps, area }
    }
}

/// Ray differentials where a ray meets a plane (Igehy 1999).
pub struct Differentials {
    /// Unit normal of the plane, either way.
    pub normal: [f32; 3],
    /// Texels along u, then along v, for a metre in the world.
    pub slopes: [[f32; 3]; 2],
    /// Its direction.
    pub direction: [f32; 3],
    /// How far the ray's end goes in metres for a pixel to the right, a pixel down, and over the whole exposure.
    pub steps_m: [[f32; 3]; 3],
    /// A pixel's width at the hit in metres.
    pub pixel_m: f32,
}

/// The footprint of a ray, for all rays that meet its triangle with it, and how far each lane's is moved.
#[inline(always)]
pub fn footprint(ray: &Differentials, look: &Look, shares: &SampleShare) -> (Footprint, [Floats; 2]) {
    let form = Form::of(ray.normal, ray.slopes, ray.direction, ray.steps_m, ray.pixel_m, shares);
    let mut shift_texels = [Floats::splat(0.0); 2];
    for axis in 0..2 {
        let shift = match look {
            Look::Inwards([x, y, t]) => {
                let right = Floats::splat(-form.to_pixel * form.right[axis]);
                let down = Floats::splat(-form.to_pixel * form.down[axis]);
                let travel = Floats::splat(-form.to_middle * form.travel[axis]);
                *x * right + *y * down + *t * travel
            }
            Look::By([x, y]) => *x * Floats::splat(form.right[axis]) + *y * Floats::splat(form.down[axis]),
        };
        let is_sound = shift.abs().below(Floats::splat(SHIFT_TEXELS_MAX));
        shift_texels[axis] = is_sound.select(shift, Floats::splat(0.0));
    }
    let footprint = Footprint {
        shift_texels: [0.0; 2],
        step_texels: form.step,
        taps: u32_truncated_f32(form.taps),
        area_texels2: form.area,
        snap: snap(shares.pixel),
    };
    (footprint, shift_texels)
}

/// Square of the texels of their level that taps stand apart at most: 1.4 texels, or two, where samples are so many that what two give
/// too much of one texel and too little of the next differs from sample to sample. Whole pixels' look-ups all have one place.
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
