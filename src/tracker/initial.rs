//! Two-view geometry for the start of a mono map: relative motion up to scale from pairs of bearings, the model that explains them, and
//! points in units of the baseline; or the reason why no map can start.
//!
//! Three models compete: general motion (five points), a plane (four), turning on the spot (two). Each is searched by
//! keyed RANSAC, refined, and judged by Torr's geometric information criterion (1998, "An assessment of information
//! criteria for motion model selection"), which charges a model for its freedom. Angles are radians; equal input and
//! key give equal bits.

pub mod five_point;
pub mod homography;
mod linear;
pub mod models;

use glam::{DMat3, DQuat, DVec3};
use rand::seq::IndexedRandom;

use crate::draw::DrawKey;
use crate::num::{f64_from_usize, greater, lesser};
use crate::pose::Pose;
use crate::tracker::refine::upper_median;
use linear::cofactors;
pub use models::BearingPair;
use models::{essential, from_essential, from_homography, from_rotation};

/// What explains two views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TwoViewModel {
    /// VelocityModel through a scene with depth.
    General,
    /// VelocityModel before a plane.
    Plane,
    /// Turning without (visible) motion: no depth can follow.
    Rotation,
}

/// Limits of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoViewSettings {
    /// Standard deviation of a bearing per axis in radians: that of a position in pixels over the focal length in pixels.
    pub sigma_rad: f64,
    /// Samples drawn at most for each model.
    pub samples_max: u32,
    /// Wanted probability that one sample was free of outliers.
    pub confidence: f64,
}

/// Two views hung together.
#[derive(Clone, Debug)]
pub struct TwoView {
    /// The model that explains the pairs at the least cost.
    pub model: TwoViewModel,
    /// VelocityModel with a baseline of length 1 (0 for [`TwoViewModel::Rotation`]).
    pub second_from_first: Pose,
    /// The other motion that explains a plane about as well, where there is one.
    pub alternative: Option<Pose>,
    /// Which pairs agree with the model.
    pub agrees: Vec<bool>,
    /// Points before both cameras in the first camera's frame, in baselines; `None` for pairs that disagree.
    pub points: Vec<Option<DVec3>>,
    /// Median angle between the rays of the agreeing pairs at their points.
    pub parallax_rad: f64,
    /// Torr's criterion of general motion, plane and rotation; the least wins.
    pub criteria: [f64; 3],
}

/// Why two views cannot start a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Too few pairs agree on anything.
    #[error("too few pairs agree with one motion")]
    TooFew,
    /// The camera turned on the spot.
    #[error("the camera turned without moving; move it")]
    PureRotation,
    /// Rays meet at too small an angle for depth.
    #[error("the rays meet at too small an angle; move the camera farther")]
    LowParallax,
    /// A plane, seen in a way that two motions explain.
    #[error("two motions explain this plane; add a third view")]
    TwoMotions,
}

/// Pairs that every model needs.
pub const PAIRS_MIN: usize = 8;
/// 95 % quantiles of chi2 with one and two degrees of freedom: gates of general motion, and of plane and rotation.
const GATES: [f64; 3] = [3.841, 5.991, 5.991];
/// Gates of a refinement's rounds over the final one: a sample's model is off by several sigmas, and a narrow gate
/// would keep it there.
const WIDENING: [f64; 4] = [16.0, 4.0, 1.0, 1.0];
/// Models that are refined: the sample of least cost is not always the one that leads to the least cost.
const REFINED: usize = 5;
/// What a pair costs that disagrees: the gate of general motion, and what its three dimensions are charged.
const OUTLIER_COST: f64 = 8.0;
/// A motion whose pairs miss by so much more in sigmas squared is refuted: the 99.9 % quantile of chi2 with one degree
/// of freedom.
const CLEARLY_WORSE: f64 = 10.8;
/// A motion that leaves this share of the best one's points before both cameras explains the plane as well.
const ALTERNATIVE_SHARE: f64 = 0.9;

/// Hangs two views together; `None` below [`PAIRS_MIN`] pairs or where no model gathers as many.
pub fn two_view(pairs: &[BearingPair], search: &TwoViewSettings, key: DrawKey) -> Option<TwoView> {
    if pairs.len() < PAIRS_MIN {
        return None;
    }
    let unit = 1.0 / (search.sigma_rad * search.sigma_rad);
    let general = general(pairs, search, key.with(0));
    let (plane, rotation) = (plane(pairs, search, key.with(1)), rotation(pairs, search, key.with(2)));
    let n = f64_from_usize(pairs.len());
    // lambda_1 = ln 4 a dimension of the manifold, lambda_2 = ln 4n a parameter. A pair that disagrees costs the same
    // under every model, else outliers would vote for the model that binds them least.
    let criterion = |distances2: Option<Vec<f64>>, (manifold, parameters): (f64, f64)| {
        distances2.map_or(f64::INFINITY, |distances2| {
            let bound = libm::log(4.0) * manifold;
            let miss: f64 = distances2.iter().map(|d| (d * unit + bound).clamp(0.0, OUTLIER_COST)).sum();
            miss + libm::log(4.0 * n) * parameters
        })
    };
    let of = |distance2: fn(&DMat3, &BearingPair) -> f64, model: Option<DMat3>| {
        model.map(|model| pairs.iter().map(|pair| distance2(&model, pair)).collect::<Vec<f64>>())
    };
    let all = [
        of(from_essential, general.map(|motion| essential(&motion))),
        of(from_homography, plane),
        of(from_rotation, rotation),
    ];
    let sizes = [(3.0, 5.0), (2.0, 8.0), (2.0, 3.0)];
    let criteria: [f64; 3] = std::array::from_fn(|k| criterion(all[k].clone(), sizes[k]));
    let best = (0..3).fold(0, |best, k| if criteria[k] < criteria[best] { k } else { best });
    let agrees: Vec<bool> = all[best].as_ref()?.iter().map(|d| d * unit <= GATES[best]).collect();
    if agrees.iter().filter(|&&agrees| agrees).count() < PAIRS_MIN {
        return None;
    }
    let agreeing: Vec<BearingPair> =
        pairs.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(pair, _)| *pair).collect();
    let (second_from_first, alternative) = match best {
        0 => (general?, None),
        1 => plane_motions(&plane?, (pairs, &agreeing), unit),
        _ => (Pose::new(DQuat::from_mat3(&rotation?).normalize(), DVec3::ZERO), None),
    };
    let model = [TwoViewModel::General, TwoViewModel::Plane, TwoViewModel::Rotation][best];
    Some(assembled(model, (second_from_first, alternative), (pairs, agrees), criteria))
}

/// The turn that explains most pairs, `second_from_first`; `None` where there are too few.
pub fn turn(pairs: &[BearingPair], search: &TwoViewSettings, key: DrawKey) -> Option<DQuat> {
    if pairs.len() < PAIRS_MIN {
        return None;
    }
    rotation(pairs, search, key).map(|turn| DQuat::from_mat3(&turn).normalize())
}

impl TwoView {
    /// Whether a map can start from these views. Fails with what stands against it.
    pub fn check(&self, points_min: usize, parallax_rad_min: f64) -> Result<(), Refusal> {
        if self.model == TwoViewModel::Rotation {
            return Err(Refusal::PureRotation);
        }
        if self.points.iter().flatten().count() < points_min {
            return Err(Refusal::TooFew);
        }
        if !(self.parallax_rad >= parallax_rad_min) {
            return Err(Refusal::LowParallax);
        }
        if self.alternative.is_some() { Err(Refusal::TwoMotions) } else { Ok(()) }
    }
}

/// General motion by five-point samples, each refined under a kernel that narrows; the one of least truncated cost.
fn general(pairs: &[BearingPair], search: &TwoViewSettings, key: DrawKey) -> Option<Pose> {
    let unit = 1.0 / (search.sigma_rad * search.sigma_rad);
    let found = sampled::<5, DMat3>(
        pairs,
        (search, key, GATES[0]),
        |s| five_point::solve(&s.map(|p| p.first), &s.map(|p| p.second)),
        from_essential,
    );
    let refined = |e: DMat3| {
        let agrees = |pair: &&BearingPair| from_essential(&e, pair) * unit <= GATES[0];
        let agreeing: Vec<BearingPair> = pairs.iter().filter(agrees).copied().collect();
        let start = before_both(&motions(&e), &agreeing).0;
        // Geman and McClure's kernel: smooth, so that no pair at the gate's edge holds the motion.
        let smooth = |motion: Pose, wide: &f64| {
            models::refined_motion(&motion, pairs, |d| {
                let share = 1.0 / (1.0 + d * unit / (wide * GATES[0]));
                (d * share, share * share)
            })
        };
        let motion = WIDENING.iter().fold(start, smooth);
        gated(&motion, pairs, unit)
    };
    found.into_iter().map(refined).reduce(|a, b| if b.1 < a.1 { b } else { a }).map(|best| best.0)
}

/// A motion refined by the pairs within the gate of general motion, and its truncated cost.
fn gated(motion: &Pose, pairs: &[BearingPair], unit: f64) -> (Pose, f64) {
    let gate = GATES[0] / unit;
    let motion = models::refined_motion(motion, pairs, |d| if d <= gate { (d, 1.0) } else { (gate, 0.0) });
    let e = essential(&motion);
    let cost = pairs.iter().map(|pair| lesser(from_essential(&e, pair) * unit, GATES[0])).sum::<f64>();
    (motion, cost)
}

/// The homography of least truncated cost among refined samples.
fn plane(pairs: &[BearingPair], search: &TwoViewSettings, key: DrawKey) -> Option<DMat3> {
    let found = sampled::<4, DMat3>(
        pairs,
        (search, key, GATES[1]),
        |s| homography::through(&s.map(|p| p.first), &s.map(|p| p.second)).into_iter().collect(),
        from_homography,
    );
    let unit = 1.0 / (search.sigma_rad * search.sigma_rad);
    let refined = |h: DMat3, wide: &f64| {
        let weight = |distance2: f64| if distance2 * unit <= wide * GATES[1] { 1.0 } else { 0.0 };
        models::refined_homography(h, pairs, weight).unwrap_or(h)
    };
    least(found.into_iter().map(|h| WIDENING.iter().fold(h, refined)), pairs, (from_homography, unit, GATES[1]))
}

/// The rotation of least truncated cost among refined samples.
fn rotation(pairs: &[BearingPair], search: &TwoViewSettings, key: DrawKey) -> Option<DMat3> {
    let found = sampled::<2, DMat3>(
        pairs,
        (search, key, GATES[2]),
        |s| models::rotation_through(s).into_iter().collect(),
        from_rotation,
    );
    let unit = 1.0 / (search.sigma_rad * search.sigma_rad);
    let refined = |r: DMat3, wide: &f64| {
        models::refined_rotation(r, pairs, |distance2| if distance2 * unit <= wide * GATES[2] { 1.0 } else { 0.0 })
    };
    least(found.into_iter().map(|r| WIDENING.iter().fold(r, refined)), pairs, (from_rotation, unit, GATES[2]))
}

/// The first of those with the least truncated cost.
fn least(
    models: impl Iterator<Item = DMat3>,
    pairs: &[BearingPair],
    (distance2, unit, gate): (fn(&DMat3, &BearingPair) -> f64, f64, f64),
) -> Option<DMat3> {
    let cost = |model: &DMat3| pairs.iter().map(|pair| lesser(distance2(model, pair) * unit, gate)).sum::<f64>();
    models.map(|model| (cost(&model), model)).reduce(|a, b| if b.0 < a.0 { b } else { a }).map(|best| best.1)
}

/// The four motions of an essential matrix (Horn 1990, "Recovering baseline and orientation from essential matrix").
pub fn motions(e: &DMat3) -> [Pose; 4] {
    let square = *e * e.transpose();
    let half = 0.5 * (square.x_axis.x + square.y_axis.y + square.z_axis.z);
    let outer = DMat3::from_diagonal(DVec3::splat(half)) - square;
    let columns = [outer.x_axis, outer.y_axis, outer.z_axis];
    let longest =
        columns.into_iter().fold(DVec3::ZERO, |a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let b = longest.normalize_or_zero() * half.sqrt();
    let turn = |b: DVec3| {
        let rotation = (cofactors(e) - crate::tracker::lie::skew(b) * *e) * (1.0 / half);
        DQuat::from_mat3(&rotation).normalize()
    };
    let (first, second, unit) = (turn(b), turn(-b), b.normalize_or_zero());
    [Pose::new(first, unit), Pose::new(first, -unit), Pose::new(second, unit), Pose::new(second, -unit)]
}

/// The motion that leaves most points before both cameras, with their number and the runner-up.
fn before_both(motions: &[Pose], pairs: &[BearingPair]) -> (Pose, usize, Option<(Pose, usize)>) {
    let mut best: (Pose, usize, Option<(Pose, usize)>) = (Pose::IDENTITY, 0, None);
    for (number, motion) in motions.iter().enumerate() {
        let count = pairs.iter().filter(|pair| triangulated(motion, pair).is_some()).count();
        if number == 0 || count > best.1 {
            let before = (number > 0).then_some((best.0, best.1));
            best = (*motion, count, before);
        } else if best.2.is_none_or(|(_, second)| count > second) {
            best.2 = Some((*motion, count));
        }
    }
    best
}

/// The motions that explain a homography, the better one first. Both are refined by the epipolar distance over all pairs: few
/// scenes are all plane, and points off the plane separate the two.
fn plane_motions(h: &DMat3, (pairs, agreeing): (&[BearingPair], &[BearingPair]), unit: f64) -> (Pose, Option<Pose>) {
    let before =
        |normal: DVec3| 2 * agreeing.iter().filter(|pair| normal.dot(pair.first) > 0.0).count() > agreeing.len();
    let possible: Vec<Pose> = homography::motions(h)
        .into_iter()
        .filter(|(_, t, normal)| before(*normal) && t.length() > 0.0)
        .map(|(rotation, t, _)| Pose::new(rotation, t.normalize()))
        .collect();
    let (best, count, second) = before_both(&possible, agreeing);
    let near = second.filter(|(_, n)| f64_from_usize(*n) >= ALTERNATIVE_SHARE * f64_from_usize(count));
    let first = gated(&best, pairs, unit);
    let Some(second) = near.map(|(motion, _)| gated(&motion, pairs, unit)) else { return (first.0, None) };
    let (better, other) = if second.1 < first.1 { (second, first) } else { (first, second) };
    let same = better.0.inverse().then(&other.0).angle_rad() < 1e-3
        && better.0.translation_m.dot(other.0.translation_m) > 1.0 - 1e-5;
    // False pairs fall into either motion's gate by chance, one in twenty; each then costs a gate less. Four sigmas of
    // their difference.
    let chance = 4.0 * GATES[0] * (0.1 * f64_from_usize(pairs.len() - agreeing.len())).sqrt();
    (better.0, (!same && other.1 < better.1 + CLEARLY_WORSE + chance).then_some(other.0))
}

/// The point of a pair in the first camera's frame, in baselines; `None` behind either camera, and for parallel rays.
pub fn triangulated(second_from_first: &Pose, pair: &BearingPair) -> Option<DVec3> {
    let (turned, t) = (second_from_first.rotation * pair.first, second_from_first.translation_m);
    let normal = pair.second.cross(turned);
    let sine2 = normal.length_squared();
    let (first, second) = (-pair.second.cross(t).dot(normal) / sine2, -turned.cross(t).dot(normal) / sine2);
    // Along the first ray; the rays miss each other by less than noise where the pair agrees.
    (first > 0.0 && second > 0.0 && first.is_finite()).then(|| pair.first * first)
}

fn assembled(
    model: TwoViewModel,
    (second_from_first, alternative): (Pose, Option<Pose>),
    (pairs, agrees): (&[BearingPair], Vec<bool>),
    criteria: [f64; 3],
) -> TwoView {
    let point =
        |(pair, agrees): (&BearingPair, &bool)| agrees.then(|| triangulated(&second_from_first, pair)).flatten();
    let points: Vec<Option<DVec3>> = pairs.iter().zip(&agrees).map(point).collect();
    // Rays that do not meet before both cameras are parallel to within noise: no parallax.
    let angle = |pair: &BearingPair| {
        let turned = second_from_first.rotation * pair.first;
        libm::atan2(turned.cross(pair.second).length(), turned.dot(pair.second))
    };
    let angles: Vec<f64> =
        pairs.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(pair, _)| angle(pair)).collect();
    let parallax_rad = upper_median(&angles).unwrap_or(0.0);
    TwoView { model, second_from_first, alternative, agrees, points, parallax_rad, criteria }
}

/// Models of least truncated cost among those that samples of `N` pairs give (MSAC, Torr and Zisserman 2000): the best
/// last, before it those that it outdid.
fn sampled<const N: usize, M: Copy>(
    pairs: &[BearingPair],
    (search, key, gate): (&TwoViewSettings, DrawKey, f64),
    solve: impl Fn(&[BearingPair; N]) -> Vec<M>,
    distance2: impl Fn(&M, &BearingPair) -> f64,
) -> Vec<M> {
    let mut stream = key.stream();
    let unit = 1.0 / (search.sigma_rad * search.sigma_rad);
    let mut best: Vec<(M, f64)> = Vec::new();
    let (mut sample, mut needed) = (0, search.samples_max);
    while sample < needed {
        sample += 1;
        let Some(drawn) = pairs.sample_array(&mut stream) else { break };
        for model in solve(&drawn) {
            let (mut cost, mut agreeing) = (0.0, 0_usize);
            let limit = best.last().map_or(f64::INFINITY, |(_, cost)| *cost);
            for pair in pairs {
                let error2 = distance2(&model, pair) * unit;
                agreeing += usize::from(error2 <= gate);
                cost += if error2 <= gate { error2 } else { gate };
                if !(cost < limit) {
                    break;
                }
            }
            if cost < limit {
                best.push((model, cost));
                let share = f64_from_usize(agreeing) / f64_from_usize(pairs.len());
                needed = needed.min(samples_needed(share, N, search));
            }
        }
    }
    best.split_off(best.len().saturating_sub(REFINED)).into_iter().map(|(model, _)| model).collect()
}

/// Samples after which one was free of outliers with the wanted probability, and not fewer than 100: a clean sample may
/// still be a poor one.
fn samples_needed(share: f64, size: usize, search: &TwoViewSettings) -> u32 {
    let good = (0..size).fold(1.0, |product, _| product * share);
    let needed = libm::log(1.0 - search.confidence) / libm::log1p(-lesser(good, 1.0 - 1e-9));
    crate::num::u32_truncated(greater(needed + 1.0, 100.0))
}
