//! Every figure of two runs, its difference and the verdict.

use serde::{Deserialize, Serialize};

use super::finished::FinishedRun;
use super::replicates;
use crate::pose::TimedPose;
use crate::report::bootstrap::{Difference, Statistic, VALUES_MIN, mean, paired, unpaired};
use crate::report::pose_series::{PoseSeries, pose_series};
use crate::report::record::FrameRecord;

/// What the interval of a difference says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// The interval excludes zero, and B is on the good side.
    #[serde(rename = "better")]
    Better,
    /// The interval excludes zero, and B is on the bad side.
    #[serde(rename = "worse")]
    Worse,
    /// The interval excludes zero; neither side of this figure is good by itself.
    #[serde(rename = "higher")]
    Higher,
    /// As `Higher`, on the other side.
    #[serde(rename = "lower")]
    Lower,
    /// The interval includes zero.
    #[serde(rename = "no difference")]
    NoDifference,
    /// The runs are too few for an interval over runs.
    #[serde(rename = "too few runs")]
    TooFewRuns,
    /// The frames are too few for an interval.
    #[serde(rename = "too few frames")]
    TooFewFrames,
    /// One of the runs lacks the figure.
    #[default]
    #[serde(rename = "not measured")]
    NotMeasured,
}

impl Verdict {
    /// As people and files read it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::Higher => "higher",
            Self::Lower => "lower",
            Self::NoDifference => "no difference",
            Self::TooFewRuns => "too few runs",
            Self::TooFewFrames => "too few frames",
            Self::NotMeasured => "not measured",
        }
    }
}

/// One figure of two runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FigureDifference {
    /// Name, with its unit at the end.
    pub key: String,
    /// For a person.
    pub name: String,
    /// SI unit or a word; empty for a pure number.
    pub unit: String,
    /// Figure of the base, over the frames that count for both.
    pub a: Option<f64>,
    /// Figure of the other run, over the same frames where they are paired.
    pub b: Option<f64>,
    /// b - a.
    pub difference: Option<f64>,
    /// 95 % interval of the difference.
    pub interval: Option<[f64; 2]>,
    /// Frames of a block of the bootstrap.
    pub block_frames: Option<u32>,
    /// Frames that count, of each run; paired runs have as many.
    pub frames: [u32; 2],
    /// What the interval says.
    pub verdict: Verdict,
}

#[derive(Clone, Copy)]
enum Good {
    Low,
    High,
    Neither,
}

/// What a figure is called and which side of it is good.
struct Kind {
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    good: Good,
    statistic: Statistic,
    /// Whether its values lie between 0 and 1.
    is_share: bool,
}

impl Kind {
    fn unmeasured(&self) -> FigureDifference {
        let [key, name, unit] = [self.key, self.name, self.unit].map(str::to_owned);
        FigureDifference { key, name, unit, ..FigureDifference::default() }
    }
}

const fn kind(key: &'static str, name: &'static str, unit: &'static str, good: Good, statistic: Statistic) -> Kind {
    Kind { key, name, unit, good, statistic, is_share: false }
}

/// A run's values by frame, figure by figure.
struct RunValues<'a> {
    run: &'a FinishedRun,
    poses: PoseSeries,
    alone: Option<PoseSeries>,
}

impl<'a> RunValues<'a> {
    fn of(run: &'a FinishedRun, frames: usize) -> Self {
        let (cameras, fps) = (run.report.scenario.cameras, run.report.timing.fps);
        // Frames that the other run lacks take no part in the alignment either.
        let truth = &run.truth[..frames];
        let end_s = truth.last().map_or(f64::NEG_INFINITY, |last| last.t_s + 1e-6);
        let cut = |poses: &[TimedPose]| poses.iter().filter(|pose| pose.t_s <= end_s).copied().collect::<Vec<_>>();
        let series = |poses: &[TimedPose]| pose_series(truth, &cut(poses), cameras, fps);
        Self { run, poses: series(&run.estimate), alone: run.cameras_alone.as_deref().map(series) }
    }

    fn frames(&self, value: impl Fn(&FrameRecord) -> Option<f64>) -> Vec<Option<f64>> {
        self.run.report.frames[..self.poses.is_tracked.len()].iter().map(value).collect()
    }

    /// The values of each figure, in the order of `KINDS`.
    fn all(&self) -> Vec<Vec<Option<f64>>> {
        let report = &self.run.report;
        let alone = |pick: &dyn Fn(&PoseSeries) -> Vec<Option<f64>>| {
            self.alone.as_ref().map_or_else(|| vec![None; self.poses.is_tracked.len()], pick)
        };
        let energy = &report.energy;
        let per_pj =
            |figure: f64| if energy.total_pj_per_frame > 0.0 { figure / energy.total_pj_per_frame } else { 0.0 };
        let scaled = |factor: f64| self.frames(move |frame| frame.energy_pj.map(|energy_pj| factor * energy_pj));
        let cameras = f64::from(report.scenario.cameras.max(1));
        vec![
            self.poses.error_m2(),
            self.poses.second_m2.clone(),
            self.poses.step_m2.clone(),
            self.poses.d2_m2.clone(),
            self.poses.orientation_deg2.clone(),
            alone(&PoseSeries::error_m2),
            alone(&|poses| poses.d2_m2.clone()),
            self.poses.is_tracked.iter().map(|&tracked| Some(f64::from(u8::from(tracked)))).collect(),
            self.frames(|frame| Some(f64::from(frame.found) / cameras)),
            self.frames(|frame| Some(f64::from(frame.tracked))),
            self.frames(|frame| frame.innovation_px),
            scaled(1e-3 * per_pj(energy.power_mw)),
            scaled(1e-12 * per_pj(energy.pj_per_pixel)),
            self.frames(|frame| frame.link_bits.map(|bits| bits * report.timing.fps)),
            self.frames(|_| Some(report.bandwidth.raw_bits_per_frame * report.timing.fps)),
            self.frames(|frame| frame.latency_us.map(|latency_us| 1e-6 * latency_us)),
            self.frames(|_| Some(report.timing.fps)),
        ]
    }
}

const KINDS: [Kind; 17] = [
    kind("ate_m", "position error (ATE)", "m", Good::Low, Statistic::RootMean),
    kind("rpe_m", "drift over one second (RPE)", "m", Good::Low, Statistic::RootMean),
    kind("jitter_frame_m", "frame jitter (RPE over one frame)", "m", Good::Low, Statistic::RootMean),
    kind("jitter_d2_m", "second-difference jitter (d2)", "m", Good::Low, Statistic::RootMean),
    kind("orientation_deg", "orientation error", "deg", Good::Low, Statistic::RootMean),
    kind("cameras_alone_ate_m", "position error, cameras alone", "m", Good::Low, Statistic::RootMean),
    kind("cameras_alone_jitter_d2_m", "d2 jitter, cameras alone", "m", Good::Low, Statistic::RootMean),
    Kind { is_share: true, ..kind("tracked_fraction", "share of frames tracked", "", Good::High, Statistic::Mean) },
    kind("features_found", "features found a camera", "", Good::Neither, Statistic::Mean),
    kind("features_tracked", "features tracked", "", Good::High, Statistic::Mean),
    kind("innovation_px", "innovation", "px", Good::Neither, Statistic::Mean),
    kind("power_w", "power of the sensors", "W", Good::Low, Statistic::Mean),
    kind("energy_per_pixel_j", "energy per pixel", "J", Good::Low, Statistic::Mean),
    kind("link_bits_per_s", "bits on the link", "bit/s", Good::Low, Statistic::Mean),
    kind("raw_bits_per_s", "bits of raw pixels", "bit/s", Good::Neither, Statistic::Mean),
    kind("latency_s", "latency to the last bit", "s", Good::Low, Statistic::Mean),
    kind("fps_hz", "frame rate", "Hz", Good::Neither, Statistic::Mean),
];

/// The difference of every figure that one of the runs has.
pub fn differences(a: &FinishedRun, b: &FinishedRun, pairs: &[(usize, usize)]) -> Vec<FigureDifference> {
    let is_paired = !pairs.is_empty();
    let count = |run: &FinishedRun| if is_paired { pairs.len() } else { run.truth.len() };
    let values = [RunValues::of(a, count(a)).all(), RunValues::of(b, count(b)).all()];
    assert!(values.iter().all(|all| all.len() == KINDS.len()), "every figure has its values");
    let figure = |(at, kind): (usize, &Kind)| {
        let [of_a, of_b] = [&values[0][at], &values[1][at]];
        (!is_empty(of_a) || !is_empty(of_b)).then(|| difference(kind, of_a, of_b, is_paired))
    };
    KINDS.iter().enumerate().filter_map(figure).collect()
}

fn is_empty(values: &[Option<f64>]) -> bool {
    values.iter().all(Option::is_none)
}

fn difference(kind: &Kind, a: &[Option<f64>], b: &[Option<f64>], is_paired: bool) -> FigureDifference {
    let all = |values: &[Option<f64>]| values.iter().filter_map(|value| *value).collect::<Vec<f64>>();
    let (a, b) = match is_paired && !is_empty(a) && !is_empty(b) {
        true => a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?))).unzip(),
        false => (all(a), all(b)),
    };
    let found =
        if is_paired && a.len() == b.len() { paired(&a, &b, kind.statistic) } else { unpaired(&a, &b, kind.statistic) };
    let (of_a, of_b) = (kind.statistic.of(&a), kind.statistic.of(&b));
    let difference = of_a.zip(of_b).map(|(a, b)| b - a);
    FigureDifference {
        a: of_a,
        b: of_b,
        difference,
        interval: found.map(|found| found.interval),
        block_frames: found.map(|found| crate::num::u32_from(found.block_frames)),
        frames: [a.len(), b.len()].map(crate::num::u32_from),
        verdict: verdict(kind, found, difference, a.len().min(b.len())),
        ..kind.unmeasured()
    }
}

fn verdict(kind: &Kind, found: Option<Difference>, difference: Option<f64>, frames: usize) -> Verdict {
    match (found, difference) {
        (Some(found), _) => side(kind.good, found.interval),
        (None, None) => Verdict::NotMeasured,
        (None, Some(_)) => {
            assert!(frames < VALUES_MIN, "only few frames lack an interval");
            Verdict::TooFewFrames
        }
    }
}

/// On which side of zero an interval lies.
fn side(good: Good, interval: [f64; 2]) -> Verdict {
    let (is_higher, is_lower) = (interval[0] > 0.0, interval[1] < 0.0);
    match (good, is_higher, is_lower) {
        (_, false, false) | (_, true, true) => Verdict::NoDifference,
        (Good::Low, true, false) | (Good::High, false, true) => Verdict::Worse,
        (Good::Low, false, true) | (Good::High, true, false) => Verdict::Better,
        (Good::Neither, true, false) => Verdict::Higher,
        (Good::Neither, false, true) => Verdict::Lower,
    }
}

/// The same figures over pairs of runs: means, and intervals of the mean difference from how it varies between pairs.
pub(super) fn over_pairs(pairs: &[Vec<FigureDifference>]) -> Vec<FigureDifference> {
    let figure = |kind: &Kind| {
        let of = |figures: &Vec<FigureDifference>| figures.iter().find(|figure| figure.key == kind.key).cloned();
        let found: Vec<FigureDifference> = pairs.iter().filter_map(of).collect();
        (!found.is_empty()).then(|| over_pairs_of(kind, &found))
    };
    KINDS.iter().filter_map(figure).collect()
}

fn over_pairs_of(kind: &Kind, found: &[FigureDifference]) -> FigureDifference {
    let all = |value: &dyn Fn(&FigureDifference) -> Option<f64>| found.iter().filter_map(value).collect::<Vec<f64>>();
    let mean_of = |values: &[f64]| (!values.is_empty()).then(|| mean(values));
    let differences = all(&|figure| figure.difference);
    let interval = replicates::interval(&differences, kind.is_share);
    let verdict = match (interval, differences.len()) {
        (Some(interval), _) => side(kind.good, interval),
        (None, 0) => Verdict::NotMeasured,
        (None, _) => Verdict::TooFewRuns,
    };
    let frames = |run: usize| found.iter().map(|figure| figure.frames[run]).sum();
    FigureDifference {
        a: mean_of(&all(&|figure| figure.a)),
        b: mean_of(&all(&|figure| figure.b)),
        difference: mean_of(&differences),
        interval,
        frames: [frames(0), frames(1)],
        verdict,
        ..kind.unmeasured()
    }
}
