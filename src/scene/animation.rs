//! Rigid animation of nodes by keys, as glTF 2.0 (section 3.11 and appendix C) has it: steps, lines, cubic splines. Computes the pose of a
//! chain of nodes at any time; an animation begins again when it is over.

use glam::DQuat;

use crate::num::{f64_from_usize, greater};
use crate::pose::Pose;

/// What counts between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The key before.
    Step,
    /// A line; of rotations, the shortest arc.
    Linear,
    /// A cubic Hermite spline with a tangent before and after each key.
    CubicSpline,
}

/// Keys of N numbers over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<const N: usize> {
    times_s: Vec<f64>,
    /// One a key, or with a cubic spline three: tangent before, value, tangent after.
    values: Vec<[f64; N]>,
    interpolation: Interpolation,
}

/// Instants between two keys at which a cubic spline's speed is looked at.
const LOOKS: usize = 16;

impl<const N: usize> Track<N> {
    /// From times and values. Fails on no key, times that are not finite, negative or do not rise, another number of values than the keys
    /// need, values that are not finite.
    pub fn new(times_s: Vec<f64>, values: Vec<[f64; N]>, interpolation: Interpolation) -> Result<Self, String> {
        let needed = times_s.len() * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if times_s.is_empty() {
            return Err("it has no keys".to_owned());
        }
        if values.len() != needed {
            let (keys, found) = (times_s.len(), values.len());
            return Err(format!("it has {keys} keys and {found} values; use {needed} values"));
        }
        if times_s.iter().any(|t_s| !(t_s.is_finite() && *t_s >= 0.0)) {
            return Err("a time of its keys is negative or not finite".to_owned());
        }
        if let Some(pair) = times_s.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(format!("its times go from {} s to {} s; use rising times", pair[0], pair[1]));
        }
        if values.iter().flatten().any(|value| !value.is_finite()) {
            return Err("a value of its keys is not finite".to_owned());
        }
        Ok(Self { times_s, values, interpolation })
    }

    /// The same with all values times a factor.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.values.iter_mut().flatten().for_each(|value| *value *= factor);
        self
    }

    /// Time of the last key.
    fn end_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    fn is_step(&self) -> bool {
        self.interpolation == Interpolation::Step
    }

    /// The keys around a time, and the share of the way between them; before the first and after the last key, that one.
    fn around(&self, t_s: f64) -> (usize, usize, f64) {
        let after = self.times_s.partition_point(|key_s| *key_s <= t_s);
        let last = self.times_s.len() - 1;
        if after == 0 || after > last {
            let key = after.min(last);
            return (key, key, 0.0);
        }
        let (before_s, after_s) = (self.times_s[after - 1], self.times_s[after]);
        (after - 1, after, (t_s - before_s) / (after_s - before_s))
    }

    fn at(&self, t_s: f64, line: impl Fn([f64; N], [f64; N], f64) -> [f64; N]) -> [f64; N] {
        let (before, after, share) = self.around(t_s);
        match self.interpolation {
            Interpolation::Step => self.values[before],
            Interpolation::Linear if before == after => self.values[before],
            Interpolation::Linear => line(self.values[before], self.values[after], share),
            Interpolation::CubicSpline => {
                let length_s = self.times_s[after] - self.times_s[before];
                let (square, cube) = (share * share, share * share * share);
                let [a, b] = [2.0 * cube - 3.0 * square + 1.0, length_s * (cube - 2.0 * square + share)];
                let [c, d] = [3.0 * square - 2.0 * cube, length_s * (cube - square)];
                let (value, leaves) = (self.values[3 * before + 1], self.values[3 * before + 2]);
                let (enters, next) = (self.values[3 * after], self.values[3 * after + 1]);
                std::array::from_fn(|n| a * value[n] + b * leaves[n] + c * next[n] + d * enters[n])
            }
        }
    }
}

/// Rotation between two, along the shortest arc (glTF 2.0, appendix C.4).
fn slerp(from: DQuat, to: DQuat, share: f64) -> DQuat {
    let cosine = from.dot(to);
    let to = if cosine < 0.0 { -to } else { to };
    let angle_rad = libm::acos(cosine.abs().min(1.0));
    let sine = libm::sin(angle_rad);
    if sine < 1e-9 {
        return (from * (1.0 - share) + to * share).normalize();
    }
    let weights = [(1.0 - share) * angle_rad, share * angle_rad].map(|angle_rad| libm::sin(angle_rad) / sine);
    (from * weights[0] + to * weights[1]).normalize()
}

/// What moves a node in its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Where it is without animation.
    pub rest: Pose,
    /// Metres.
    pub translation: Option<Track<3>>,
    /// Unit quaternions x y z w.
    pub rotation: Option<Track<4>>,
}

impl Joint {
    /// A joint that does not move.
    pub fn fixed(rest: Pose) -> Self {
        Self { rest, translation: None, rotation: None }
    }

    fn at(&self, t_s: f64) -> Pose {
        let line = |a: [f64; 3], b: [f64; 3], share: f64| std::array::from_fn(|n| a[n] + (b[n] - a[n]) * share);
        let translation_m =
            self.translation.as_ref().map_or(self.rest.translation_m, |track| track.at(t_s, line).into());
        let arc =
            |a: [f64; 4], b: [f64; 4], share: f64| slerp(DQuat::from_array(a), DQuat::from_array(b), share).to_array();
        let rotation = self.rotation.as_ref().map_or(self.rest.rotation, |track| {
            let turn = DQuat::from_array(track.at(t_s, arc));
            if turn.length_squared() > 1e-12 { turn.normalize() } else { self.rest.rotation }
        });
        Pose::new(rotation, translation_m)
    }

    fn end_s(&self) -> f64 {
        let ends = [self.translation.as_ref().map(Track::end_s), self.rotation.as_ref().map(Track::end_s)];
        ends.into_iter().flatten().fold(0.0, greater)
    }

    /// Times at which the joint is looked at: its keys and instants between them.
    fn looks_s(&self) -> Vec<f64> {
        let of = |times_s: &[f64]| -> Vec<f64> {
            let between = times_s.windows(2).flat_map(|pair| {
                (0..LOOKS).map(|look| pair[0] + (pair[1] - pair[0]) * f64_from_usize(look) / f64_from_usize(LOOKS))
            });
            between.chain(times_s.last().copied()).collect()
        };
        let mut all = self.translation.as_ref().map_or_else(Vec::new, |track| of(&track.times_s));
        all.extend(self.rotation.as_ref().map_or_else(Vec::new, |track| of(&track.times_s)));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

/// A chain of joints from the root of a file to a part that moves, the root first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointChain {
    /// The joints.
    pub joints: Vec<Joint>,
    /// Length of the animation, after which it begins again; 0: nothing moves.
    pub length_s: f64,
}

/// What a chain adds to a motion, at any time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChainLimits {
    /// Greatest distance of its end from its root.
    pub reach_m: f64,
    /// Greatest speed of its end.
    pub speed_m_per_s: f64,
    /// Greatest rate of turn.
    pub turn_rad_per_s: f64,
}

/// What the looks between keys may miss of a spline's speed.
const MISSED: f64 = 1.1;

impl JointChain {
    /// The same chain with one more joint at its end.
    #[must_use]
    pub fn with(&self, joint: Joint) -> Self {
        let mut longer = self.clone();
        longer.length_s = greater(longer.length_s, joint.end_s());
        longer.joints.push(joint);
        longer
    }

    /// `root_from_end` at a time. Times before 0 count from the animation's end.
    pub fn at(&self, t_s: f64) -> Pose {
        let own_s = if self.length_s > 0.0 { t_s - (t_s / self.length_s).floor() * self.length_s } else { 0.0 };
        self.joints.iter().fold(Pose::IDENTITY, |pose, joint| pose.then(&joint.at(own_s)))
    }

    /// Bounds on what it does to a point at a distance from its end. Jumps are no speed.
    pub fn limits(&self, radius_m: f64) -> ChainLimits {
        let mut limits = ChainLimits::default();
        // Speeds and turns of each joint, and what hangs below it.
        let mut below_m = radius_m;
        for joint in self.joints.iter().rev() {
            let poses: Vec<(f64, Pose)> = joint.looks_s().into_iter().map(|t_s| (t_s, joint.at(t_s))).collect();
            let (mut speed, mut turn, mut reach_m) = (0.0, 0.0, joint.rest.translation_m.length());
            for pair in poses.windows(2) {
                let [(from_s, from), (to_s, to)] = [pair[0], pair[1]];
                let length_s = to_s - from_s;
                if !joint.translation.as_ref().is_some_and(Track::is_step) {
                    speed = greater(speed, (to.translation_m - from.translation_m).length() / length_s);
                }
                if !joint.rotation.as_ref().is_some_and(Track::is_step) {
                    turn = greater(turn, from.inverse().then(&to).angle_rad() / length_s);
                }
            }
            poses.iter().for_each(|(_, pose)| reach_m = greater(reach_m, pose.translation_m.length()));
            limits.turn_rad_per_s += MISSED * turn;
            limits.speed_m_per_s += MISSED * (speed + turn * below_m);
            limits.reach_m += MISSED * reach_m;
            below_m += MISSED * reach_m;
        }
        limits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn turning(interpolation: Interpolation) -> Track<4> {
        let half = |angle_rad: f64| [0.0, libm::sin(0.5 * angle_rad), 0.0, libm::cos(0.5 * angle_rad)];
        let values = match interpolation {
            // Tangents of zero: it rests at its keys.
            Interpolation::CubicSpline => vec![[0.0; 4], half(0.0), [0.0; 4], [0.0; 4], half(1.0), [0.0; 4]],
            _ => vec![half(0.0), half(1.0)],
        };
        Track::new(vec![0.0, 2.0], values, interpolation).unwrap()
    }

    #[test]
    fn a_turn_goes_by_steps_by_even_arcs_or_by_a_spline_that_rests_at_its_keys() {
        let angle_rad = |interpolation: Interpolation, t_s: f64| {
            let joint = Joint { rotation: Some(turning(interpolation)), ..Joint::fixed(Pose::IDENTITY) };
            JointChain::default().with(joint).at(t_s).angle_rad()
        };
        let mut tried = 0;
        for step in 0..20 {
            let t_s = 0.1 * f64::from(step);
            assert!(angle_rad(Interpolation::Step, t_s) < 1e-12, "{t_s}");
            assert!((angle_rad(Interpolation::Linear, t_s) - 0.5 * t_s).abs() < 1e-12, "{t_s}");
            // The spline's quaternion, normalised, of smoothstep weights.
            let share = 0.5 * t_s;
            let weight = share * share * (3.0 - 2.0 * share);
            let (sine, cosine) = (weight * libm::sin(0.5), 1.0 - weight + weight * libm::cos(0.5));
            let expected = 2.0 * libm::atan2(sine, cosine);
            assert!((angle_rad(Interpolation::CubicSpline, t_s) - expected).abs() < 1e-12, "{t_s}");
            tried += 1;
        }
        // Two seconds later it is the same again.
        assert!((angle_rad(Interpolation::Linear, 3.0) - 0.5).abs() < 1e-12 && tried == 20);
    }

    #[test]
    fn the_limits_of_a_chain_hold_for_its_points_at_all_times() {
        let (rest, way) = ([0.0; 3], [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 0.2, 0.0]]);
        let values = vec![rest, rest, way[0], way[1], way[2], rest, rest, rest, rest];
        let slide = Track::new(vec![0.0, 0.4, 1.0], values, Interpolation::CubicSpline);
        let chain = JointChain::default()
            .with(Joint { translation: Some(slide.unwrap()), ..Joint::fixed(Pose::IDENTITY) })
            .with(Joint::fixed(Pose::new(DQuat::IDENTITY, DVec3::new(0.0, 0.7, 0.0))))
            .with(Joint { rotation: Some(turning(Interpolation::Linear)), ..Joint::fixed(Pose::IDENTITY) });
        assert_eq!(chain.length_s, 2.0);
        let point_m = DVec3::new(0.0, 0.0, 0.3);
        let limits = chain.limits(point_m.length());
        let (mut fastest, mut farthest) = (0.0, 0.0);
        for step in 0..2_000 {
            let at = |t_s: f64| chain.at(t_s).point(point_m);
            let t_s = 1e-3 * f64::from(step);
            // The animation jumps where it begins again.
            if t_s + 1e-6 < 2.0 {
                fastest = greater(fastest, (at(t_s + 1e-6) - at(t_s)).length() / 1e-6);
            }
            farthest = greater(farthest, at(t_s).length());
        }
        assert!(fastest < limits.speed_m_per_s && limits.speed_m_per_s < 2.0 * fastest, "{fastest} {limits:?}");
        assert!(farthest < limits.reach_m + 0.3 && limits.reach_m < 2.0 * farthest, "{farthest} {limits:?}");
    }

    #[test]
    fn keys_that_make_no_track_are_refused_in_words() {
        let linear = |times_s: &[f64], count: usize| {
            Track::<3>::new(times_s.to_vec(), vec![[0.0; 3]; count], Interpolation::Linear).unwrap_err()
        };
        assert!(linear(&[], 0).contains("no keys"));
        assert!(linear(&[0.0, 1.0, 0.5], 3).contains("1 s to 0.5 s"));
        assert!(linear(&[0.0, 1.0], 3).contains("use 2 values"));
        assert!(linear(&[-1.0, 1.0], 2).contains("negative"));
        assert!(linear(&[0.0, f64::NAN], 2).contains("not finite"));
        let endless = Track::new(vec![0.0], vec![[f64::INFINITY; 3]], Interpolation::Step);
        assert!(endless.unwrap_err().contains("not finite"));
    }
}
