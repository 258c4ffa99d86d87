//! Fits a [`Spline`] to timed poses without gaps, by least squares.
//!
//! Positions are linear in their control points: one banded solve. Rotations are refined: the residuals' rotation vectors
//! are fitted by the same equations and turned into the control rotations, until nothing moves. Where a gap is bridged on
//! request, the control points within it are those of least second differences: the path of least acceleration.

use glam::{DQuat, DVec3};

use super::band::NormalEquations;
use super::limits::{GAP_S_MAX, MotionError};
use super::spline::{Basis, Spline};
use crate::num;
use crate::pose::TimedPose;
use crate::so3;
use crate::units::Span;

/// Rotation passes end when no control rotation moves by more than this.
const STEP_RAD_MIN: f64 = 1e-13;
/// Each pass leaves about a hundredth of the error; ten pass 1e-13 rad from any start.
const PASSES_MAX: u32 = 12;
/// Within a bridged gap a pass leaves about the angle between neighbouring knots in radians of it, some tenths at most.
const BRIDGING_PASSES_MAX: u32 = 60;

/// Weight of the control points' second differences against one sample's. It determines the points of an interval
/// without samples (a pause below [`GAP_S_MAX`], or a bridged gap) and moves the others by some 1e-8 of an acceleration times knot^2.
const STIFFNESS: f64 = 1e-6;

/// The same in and beside a bridged gap, where the end's slopes would otherwise be those of the last samples' noise: about the
/// noise's variance over that of what is natural between knots, (0.1 mm)^2 / (1 m/s^2 knot^2)^2 (for turns 1 mrad, 10 rad/s^2).
const BRIDGE_STIFFNESS: f64 = 1.6e-3;
/// Knots on either side of a gap that count as beside it: as far as one control point reaches.
const BESIDE_KNOTS: f64 = 2.0;

impl Spline {
    /// The spline with knots every `knot_s` seconds that follows the samples most closely. It is defined from the first
    /// sample to the last. Fails on fewer than four samples, times that do not rise, a gap longer than [`GAP_S_MAX`], values that are not
    /// finite, or a knot spacing outside 5 ms .. 1 s.
    pub fn fit(samples: &[TimedPose], knot_s: f64) -> Result<Self, MotionError> {
        Self::fit_over_gaps(samples, knot_s, GAP_S_MAX)
    }

    /// As [`Spline::fit`], with gaps up to `gap_s_max` bridged by the path of least acceleration.
    pub fn fit_over_gaps(samples: &[TimedPose], knot_s: f64, gap_s_max: f64) -> Result<Self, MotionError> {
        check(samples, knot_s, gap_s_max)?;
        let bridges = samples.windows(2).any(|pair| pair[1].t_s - pair[0].t_s > GAP_S_MAX);
        let (start_s, end_s) = (samples[0].t_s, samples[samples.len() - 1].t_s);
        // The spacing shrinks a little so that a whole number of intervals ends at the last sample.
        let intervals = num::u32_truncated(((end_s - start_s) / knot_s).ceil()).max(1);
        let knot_s = (end_s - start_s) / f64::from(intervals);
        let unknowns = num::index(intervals) + 3;

        let mut spline = Self {
            start_s,
            knot_s,
            positions_m: vec![DVec3::ZERO; unknowns],
            rotations: first_guess(samples, start_s, knot_s, unknowns),
        };
        let row = |sample: &TimedPose| {
            let knots = num::lesser((sample.t_s - start_s) / knot_s, f64::from(intervals));
            let interval = num::index(num::u32_truncated(knots).min(intervals - 1));
            (interval, Basis::at(knots - num::f64_from_usize(interval)))
        };
        let rows: Vec<(usize, Basis)> = samples.iter().map(row).collect();
        let mut equations = NormalEquations::new(unknowns);
        for (first, basis) in &rows {
            equations.add(*first, &basis.value, 1.0);
        }
        let stiffness = stiffness(samples, start_s, knot_s, unknowns - 2);
        for (first, weight) in stiffness.iter().enumerate() {
            equations.add(first, &[1.0, -2.0, 1.0, 0.0], *weight);
        }
        let factor = equations.factor().ok_or(MotionError::TooFewSamples { count: samples.len() })?;

        gather(&rows, &mut spline.positions_m, |k| samples[k].world_from_body.translation_m);
        factor.solve(&mut spline.positions_m);
        for _ in 0..if bridges { BRIDGING_PASSES_MAX } else { PASSES_MAX } {
            let mut turns_rad = vec![DVec3::ZERO; unknowns];
            gather(&rows, &mut turns_rad, |k| {
                let fitted = spline.rotation_at(rows[k].0, &rows[k].1).rotation;
                so3::log(fitted.conjugate() * samples[k].world_from_body.rotation)
            });
            if bridges {
                straighten(&spline.rotations, &stiffness, &mut turns_rad);
            }
            factor.solve(&mut turns_rad);
            let mut largest_rad = 0.0;
            for (rotation, turn_rad) in spline.rotations.iter_mut().zip(&turns_rad) {
                *rotation = (*rotation * so3::exp(*turn_rad)).normalize();
                largest_rad = num::greater(largest_rad, turn_rad.length());
            }
            if largest_rad < STEP_RAD_MIN {
                break;
            }
        }
        Ok(spline)
    }
}

/// The longest run of samples around `asked` without a gap above `gap_s_max`, so that what is fitted does not depend on how
/// much of it a run uses. Gives [`MotionError::OutsideSpan`] where the samples do not cover `asked`, [`MotionError::Gap`] where a gap
/// lies within it.
pub fn without_gaps(samples: &[TimedPose], asked: Span, gap_s_max: f64) -> Result<&[TimedPose], MotionError> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(MotionError::TooFewSamples { count: 0 });
    };
    for t_s in [asked.start_s, asked.end_s] {
        if !(t_s >= first.t_s && t_s <= last.t_s) {
            return Err(MotionError::OutsideSpan { t_s, start_s: first.t_s, end_s: last.t_s });
        }
    }
    let (mut from, mut to) = (0, samples.len());
    for (index, pair) in samples.windows(2).enumerate() {
        let [before, after] = [pair[0].t_s, pair[1].t_s];
        if after - before > gap_s_max {
            if after <= asked.start_s {
                from = index + 1;
            } else if before >= asked.end_s {
                to = index + 1;
                break;
            } else {
                return Err(MotionError::Gap { at_s: before, length_s: after - before });
            }
        }
    }
    Ok(&samples[from..to])
}

/// The gaps above [`GAP_S_MAX`] within a span: where they start and how long they are, in seconds.
pub fn gaps_within(samples: &[TimedPose], span: Span) -> Vec<(f64, f64)> {
    let gap = |pair: &[TimedPose]| (pair[0].t_s, pair[1].t_s - pair[0].t_s);
    let is_gap =
        |&(at_s, length_s): &(f64, f64)| length_s > GAP_S_MAX && at_s < span.end_s && at_s + length_s > span.start_s;
    samples.windows(2).map(gap).filter(is_gap).collect()
}

/// The weight of each second difference, the first about the time of the first sample.
fn stiffness(samples: &[TimedPose], start_s: f64, knot_s: f64, count: usize) -> Vec<f64> {
    let mut weights = vec![STIFFNESS; count];
    let whole = Span { start_s, end_s: f64::INFINITY };
    for (at_s, length_s) in gaps_within(samples, whole) {
        let knots = |t_s: f64| (t_s - start_s) / knot_s;
        let first = (knots(at_s) - BESIDE_KNOTS).ceil();
        let last = (knots(at_s + length_s) + BESIDE_KNOTS).floor();
        let (first, last) = (num::u32_truncated(num::greater(first, 0.0)), num::u32_truncated(last));
        for index in num::index(first)..(num::index(last) + 1).min(count) {
            weights[index] = BRIDGE_STIFFNESS;
        }
    }
    weights
}

/// Adds to the right side what takes the second differences of the control rotations to zero, each at its weight.
fn straighten(rotations: &[DQuat], stiffness: &[f64], right: &mut [DVec3]) {
    let step_rad = |index: usize| so3::log(rotations[index].conjugate() * rotations[index + 1]);
    let mut before_rad = step_rad(0);
    for (first, stiffness) in stiffness.iter().enumerate() {
        let after_rad = step_rad(first + 1);
        let bend_rad = after_rad - before_rad;
        for (offset, weight) in [1.0, -2.0, 1.0].into_iter().enumerate() {
            right[first + offset] -= bend_rad * (weight * stiffness);
        }
        before_rad = after_rad;
    }
}

fn check(samples: &[TimedPose], knot_s: f64, gap_s_max: f64) -> Result<(), MotionError> {
    if !(0.005..=1.0).contains(&knot_s) {
        return Err(MotionError::KnotSpacing { knot_s });
    }
    if samples.len() < 4 {
        return Err(MotionError::TooFewSamples { count: samples.len() });
    }
    for sample in samples {
        let pose = sample.world_from_body;
        if !(sample.t_s.is_finite() && pose.translation_m.is_finite() && pose.rotation.is_finite()) {
            return Err(MotionError::NotFinite { t_s: sample.t_s });
        }
    }
    for pair in samples.windows(2) {
        let length_s = pair[1].t_s - pair[0].t_s;
        if length_s <= 0.0 {
            return Err(MotionError::TimeStandsStill { t_s: pair[1].t_s });
        }
        if length_s > gap_s_max {
            return Err(MotionError::Gap { at_s: pair[0].t_s, length_s });
        }
    }
    Ok(())
}

/// The sample nearest in time to each control point; within a gap an even turn between its ends.
fn first_guess(samples: &[TimedPose], start_s: f64, knot_s: f64, unknowns: usize) -> Vec<DQuat> {
    let (mut nearest, mut after) = (0, 0);
    (0..unknowns)
        .map(|index| {
            let t_s = start_s + (num::f64_from_usize(index) - 1.0) * knot_s;
            while nearest + 1 < samples.len()
                && (samples[nearest + 1].t_s - t_s).abs() <= (samples[nearest].t_s - t_s).abs()
            {
                nearest += 1;
            }
            while after < samples.len() && samples[after].t_s <= t_s {
                after += 1;
            }
            if (1..samples.len()).contains(&after) && samples[after].t_s - samples[after - 1].t_s > GAP_S_MAX {
                let [from, to] = [&samples[after - 1], &samples[after]];
                let rotation = from.world_from_body.rotation;
                let turn_rad = so3::log(rotation.conjugate() * to.world_from_body.rotation);
                return (rotation * so3::exp(turn_rad * ((t_s - from.t_s) / (to.t_s - from.t_s)))).normalize();
            }
            samples[nearest].world_from_body.rotation
        })
        .collect()
}

/// The right side of the normal equations.
fn gather(rows: &[(usize, Basis)], right: &mut [DVec3], value: impl Fn(usize) -> DVec3) {
    for (k, (first, basis)) in rows.iter().enumerate() {
        let value = value(k);
        for (j, weight) in basis.value.iter().enumerate() {
            right[first + j] += value * *weight;
        }
    }
}
