//! Motion-aligned sampling: maps points of the unit cube to positions in the pixel and instants of the exposure, so that the first two
//! coordinates alone decide which point of a moving surface is met.
//!
//! A surface point that passes the pixel at v pixels an exposure is met by all samples of equal u = (x + v_x t, y + v_y t), so an edge
//! that cuts the cube of (x, y, t) in a plane is a line in u. Uniform x, y and t give u_x the density of a box of width 1 convolved with
//! one of |v_x|: a trapezoid, whose quantile is a root. Given u_x the time is uniform between two bounds, so u_y is again such a sum, and
//! given both the time is uniform. The map preserves volume for any v: a wrong v costs variance and adds no bias.

use crate::num::f32_from_u32;
use crate::scene::lanes::{Floats, LANES};

/// Motion below this many pixels an exposure is none: the bounds of time would lose their digits.
const LEAST_PX: f32 = 1e-3;

/// Clamps a share to 0..1 (1 excluded): the rounding of a sum may have pushed it to 1 or below 0.
#[inline(always)]
fn bounded(share: f32) -> f32 {
    // The largest number below 1, so that nothing lies in the next pixel or piece of time.
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
    if !(share > 0.0) {
        0.0
    } else if share < BELOW_ONE {
        share
    } else {
        BELOW_ONE
    }
}

/// Quantiles of the sum of a uniform number of 0..1 and one of 0..`width`, and the bounds of the second one's
/// share.
#[inline(always)]
fn sums_of_boxes(p: Floats, width: Floats) -> (Floats, [Floats; 2]) {
    let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
    let (mut sum, mut from, mut to) = (zero, zero, zero);
    for lane in 0..LANES {
        let (p, width) = (p.0[lane], width.0[lane]);
        let least = if width < 1.0 { width } else { 1.0 };
        let most = if width < 1.0 { 1.0 } else { width };
        let ramp_share = 0.5 * least / most;
        let rising = (2.0 * least * most * p).sqrt();
        let falling = 1.0 + width - (2.0 * least * most * (1.0 - p)).sqrt();
        let middle = p * most + 0.5 * least;
        let beyond = if p > 1.0 - ramp_share { falling } else { middle };
        sum.0[lane] = if p < ramp_share { rising } else { beyond };
        from.0[lane] = (sum.0[lane] - 1.0) / width;
        to.0[lane] = sum.0[lane] / width;
    }
    let is_still = width.below(Floats::splat(LEAST_PX));
    let [from, to] = [zero.below(from).select(from, zero), to.below(one).select(to, one)];
    (is_still.select(p, sum), [is_still.select(zero, from), is_still.select(one, to)])
}

/// Where samples lie, lane by lane.
pub struct ShearedSamples {
    /// Positions x, y in the pixel and instants t, each in 0..1.
    pub coordinates: [Floats; 3],
    /// How far the look-ups of `count` samples go towards the middle of what the pixel passes, in pixels to the right and down, so that
    /// the spread of positions and that of filters as wide as a sample's share sum to what the pixel sees.
    pub inwards: [Floats; 2],
}

/// Samples of points of the unit cube, of which there are `count`.
#[inline(always)]
pub fn sheared_lanes([p, q, w]: [Floats; 3], velocity_px: [f32; 2], count: u32) -> ShearedSamples {
    let (zero, one, half) = (Floats::splat(0.0), Floats::splat(1.0), Floats::splat(0.5));
    // What filters leave of the variance to positions.
    let by = Floats::splat(1.0 - (1.0 - 1.0 / f32_from_u32(count)).sqrt());
    if velocity_px == [0.0; 2] {
        return ShearedSamples { coordinates: [p, q, w], inwards: [by * (half - p), by * (half - q)] };
    }
    let (x_turned, y_turned) = (velocity_px[0] < 0.0, velocity_px[1] < 0.0);
    let (width_x, width_y) = (Floats::splat(velocity_px[0].abs()), Floats::splat(velocity_px[1].abs()));
    let (u, [from, to]) = sums_of_boxes(if x_turned { one - p } else { p }, width_x);
    let length = to - from;
    let height = width_y * length;
    let (v, [least, most]) = sums_of_boxes(if y_turned { one - q } else { q }, height);
    let share = least + (most - least) * w;
    let t = from + length * share;
    let least_px = Floats::splat(LEAST_PX);
    let x = u - least_px.at_most(width_x).select(width_x * t, zero);
    let y = v - least_px.at_most(height).select(height * share, zero);
    let mut coordinates = [if x_turned { one - x } else { x }, if y_turned { one - y } else { y }, t];
    for axis in 0..3 {
        for lane in 0..LANES {
            coordinates[axis].0[lane] = bounded(coordinates[axis].0[lane]);
        }
    }
    let (to_x, to_y) = (half * (one + width_x) - u, half * (one + height) - v);
    ShearedSamples {
        coordinates,
        inwards: [by * if x_turned { zero - to_x } else { to_x }, by * if y_turned { zero - to_y } else { to_y }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, f64_from_u64, f64_from_usize, index, low_u32, u32_truncated_f32, u64_from};

    // One sample after another, as the textbook has it.

    /// `sums_of_boxes` of one lane.
    fn sum_of_boxes(p: f32, width: f32) -> (f32, [f32; 2]) {
        if width < LEAST_PX {
            return (p, [0.0, 1.0]);
        }
        let (least, most) = if width < 1.0 { (width, 1.0) } else { (1.0, width) };
        let ramp_share = 0.5 * least / most;
        let sum = if p < ramp_share {
            (2.0 * least * most * p).sqrt()
        } else if p > 1.0 - ramp_share {
            1.0 + width - (2.0 * least * most * (1.0 - p)).sqrt()
        } else {
            p * most + 0.5 * least
        };
        let (from, to) = ((sum - 1.0) / width, sum / width);
        (sum, [if from > 0.0 { from } else { 0.0 }, if to < 1.0 { to } else { 1.0 }])
    }

    /// Position (x, y) in the pixel and instant t, each in 0..1, of a point of the unit cube.
    fn sheared([p, q, w]: [f32; 3], velocity_px: [f32; 2]) -> [f32; 3] {
        // A pixel that goes left is one that goes right in a mirror.
        let [x_turned, y_turned] = velocity_px.map(|velocity| velocity < 0.0);
        let [width_x, width_y] = velocity_px.map(f32::abs);
        let (u, [from, to]) = sum_of_boxes(if x_turned { 1.0 - p } else { p }, width_x);
        let length = to - from;
        let (v, [least, most]) = sum_of_boxes(if y_turned { 1.0 - q } else { q }, width_y * length);
        let share = least + (most - least) * w;
        let t = from + length * share;
        let x = if width_x < LEAST_PX { u } else { u - width_x * t };
        let y = if width_y * length < LEAST_PX { v } else { v - width_y * length * share };
        let turned = |is_turned: bool, share: f32| bounded(if is_turned { 1.0 - share } else { share });
        [turned(x_turned, x), turned(y_turned, y), bounded(t)]
    }

    const VELOCITIES_PX: [[f32; 2]; 7] =
        [[0.0, 0.0], [0.3, 0.0], [0.0, -0.7], [1.0, 1.0], [-3.0, 0.5], [11.0, -0.2], [-6.0, -9.0]];

    #[test]
    fn positions_and_instants_stay_even_whatever_the_motion() {
        const CELLS: usize = 6;
        const COUNT: u64 = 40_000;
        let mut tried = 0;
        for velocity in VELOCITIES_PX {
            let mut counts = vec![0_usize; CELLS * CELLS * CELLS];
            for number in 0..COUNT {
                let bits = |axis: u64| DrawKey::root(5).with(number).with(axis).0 >> 40;
                let point = [0, 1, 2].map(|axis| f32_nearest(f64_from_u64(bits(axis)) / 16_777_216.0));
                let sample = sheared(point, velocity);
                assert!(sample.iter().all(|share| (0.0..1.0).contains(share)), "{point:?} {velocity:?}: {sample:?}");
                let cell = sample.map(|share| index(u32_truncated_f32(share * 6.0)));
                counts[(cell[0] * CELLS + cell[1]) * CELLS + cell[2]] += 1;
            }
            let expected = f64_from_usize(usize::try_from(COUNT).unwrap()) / f64_from_usize(counts.len());
            let square = |count: &usize| (f64_from_usize(*count) - expected) * (f64_from_usize(*count) - expected);
            let chi2 = counts.iter().map(square).sum::<f64>() / expected;
            // Chi squared of 215 degrees of freedom: mean 215, sigma 20.7. Five sigma either way: even, and not too even.
            assert!((chi2 - 215.0).abs() < 5.0 * 20.7, "{velocity:?}: {chi2}");
            tried += 1;
        }
        assert_eq!(tried, 7);
    }

    #[test]
    fn two_numbers_say_which_point_is_met() {
        let mut tried = 0;
        for velocity in VELOCITIES_PX {
            for step in 0..400_u16 {
                let (p, q) = (f32::from(step % 20) / 20.0 + 0.02, f32::from(step / 20) / 20.0 + 0.02);
                let met = [0.01, 0.5, 0.99].map(|w| {
                    let [x, y, t] = sheared([p, q, w], velocity);
                    [x + velocity[0] * t, y + velocity[1] * t]
                });
                for other in &met[1..] {
                    for axis in 0..2 {
                        // Some six roundings of numbers up to 12; the motion that is taken for none is 0.001 px.
                        let difference = (other[axis] - met[0][axis]).abs();
                        assert!(difference < 6.0 * 12.0 * 6e-8 + LEAST_PX, "{velocity:?} at {p}, {q}: {difference}");
                        tried += 1;
                    }
                }
            }
        }
        assert_eq!(tried, 7 * 400 * 4);
    }

    /// Mean and variance of where look-ups of many even samples go about the middle of what the pixel passes along an axis.
    fn looked_at(velocity_px: [f32; 2], count: u32, axis: usize) -> [f64; 2] {
        const STEPS: u32 = 1 << 12;
        let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
        for step in 0..STEPS {
            let mut point = [0.3, 0.3, 0.6];
            point[axis] = (f32_from_u32(step) + 0.5) / f32_from_u32(STEPS);
            let ShearedSamples { coordinates, inwards } = sheared_lanes(point.map(Floats::splat), velocity_px, count);
            let [position, t] = [coordinates[axis], coordinates[2]].map(|lanes| lanes.0[0]);
            let met = position + velocity_px[axis] * t + inwards[axis].0[0];
            let difference = f64::from(met - 0.5 * (1.0 + velocity_px[axis]));
            sum += difference;
            squares += difference * difference;
        }
        let mean = sum / f64::from(STEPS);
        [mean, squares / f64::from(STEPS) - mean * mean]
    }

    #[test]
    fn look_ups_and_their_filters_spread_as_what_the_pixel_passes() {
        let mut tried = 0;
        for speed in [0.0, 0.3, -0.7, 1.0, -6.0, 20.0] {
            for count in [16, 32, 64, 1_024] {
                for axis in 0..2 {
                    let mut velocity_px = [0.0; 2];
                    velocity_px[axis] = speed;
                    let [mean, variance] = looked_at(velocity_px, count, axis);
                    let whole = (1.0 + f64::from(speed * speed)) / 12.0;
                    let ratio = (variance + whole / f64::from(count)) / whole;
                    // 4,096 even numbers and some roundings of numbers up to 21.
                    assert!((ratio - 1.0).abs() < 1e-4, "{speed} px, {count}, axis {axis}: {ratio}");
                    assert!(mean.abs() < 1e-4 * (1.0 + f64::from(speed.abs())), "{speed} px, {count}: {mean}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 48);
    }

    #[test]
    fn lanes_side_by_side_are_as_one_by_one_in_every_bit() {
        let mut tried = 0;
        for velocity_px in VELOCITIES_PX.into_iter().chain([[1e-4, 0.5], [-0.5, 9e-4], [2.0, -1.0]]) {
            for number in 0..200_u64 {
                let key = |axis: u64, lane: usize| DrawKey::root(6).with(number).with(axis).with(u64_from(lane)).0;
                let share = |axis: u64, lane: usize| f32_from_u32(low_u32(key(axis, lane)) >> 8) / 16_777_216.0;
                let point = [0, 1, 2].map(|axis| Floats(std::array::from_fn(|lane| share(axis, lane))));
                let samples = sheared_lanes(point, velocity_px, 16).coordinates;
                for lane in 0..LANES {
                    let sample = sheared(point.map(|axis| axis.0[lane]), velocity_px);
                    assert_eq!(samples.map(|axis| axis.0[lane].to_bits()), sample.map(f32::to_bits), "{velocity_px:?}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 10 * 200 * LANES);
    }

    #[test]
    fn what_stands_still_keeps_its_numbers() {
        for point in [[0.0, 0.25, 0.5], [0.999, 0.001, 0.75]] {
            assert_eq!(sheared(point, [0.0, 0.0]), point);
        }
    }
}
