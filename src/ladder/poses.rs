//! Measures each setting's position error and jitter, and the cost of link and tracker.
//!
//! Settings that see the same photons share one rendering of the run, so that a knob behind the lens costs next to nothing.

use super::clocks::MeasuredCost;
use super::knobs::Setting;
use super::measure::LadderBench;
use crate::error::Error;
use crate::num::{f64_from_usize, lesser};
use crate::report::Report;
use crate::run::Session;

/// Stages behind the extractor, by the names of a run's report.
pub const LATER_STAGES: [&str; 3] = ["link", "host_link", "tracker"];

/// What a run of one setting showed.
#[derive(Clone, Debug, Default)]
pub struct Poses {
    pub ate_m: Option<f64>,
    pub jitter_d2_m: Option<f64>,
    pub tracked_fraction: f64,
    /// Why there is no position error.
    pub reason: Option<String>,
    /// Of `LATER_STAGES`, per frame of the rig.
    pub later: [MeasuredCost; LATER_STAGES.len()],
}

/// Runs every setting for the given number of frames, one entry each.
pub fn poses_of(bench: &LadderBench<'_>, settings: &[Setting], frames: u32) -> Result<Vec<Poses>, Error> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (at, setting) in settings.iter().enumerate() {
        match groups.iter_mut().find(|group| settings[group[0]].renders_as(setting)) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    let mut all = vec![Poses::default(); settings.len()];
    let count = f64_from_usize(groups.len());
    for (done, group) in groups.iter().enumerate() {
        let start = f64_from_usize(done) / count;
        let told = |share: f64| bench.progress.at("poses", start + share / count);
        let wanted: Vec<&Setting> = group.iter().map(|&at| &settings[at]).collect();
        for (&at, poses) in group.iter().zip(run_together(bench, &wanted, frames, &told)?) {
            all[at] = poses;
        }
    }
    Ok(all)
}

fn run_together(
    bench: &LadderBench<'_>,
    settings: &[&Setting],
    frames: u32,
    told: &dyn Fn(f64),
) -> Result<Vec<Poses>, Error> {
    let mut sessions = Vec::with_capacity(settings.len());
    for setting in settings {
        sessions.push(Session::new(bench.setup_of(setting)?)?);
    }
    // An automatic exposure follows each session's own codes, so what its lens sees is its own.
    let shares = bench.setup.sensor.schedule.params().auto.is_none();
    for frame in 0..frames {
        told(f64::from(frame) / f64::from(frames));
        let shared = if shares { Some(sessions[0].next_exposures()?) } else { None };
        for session in &mut sessions {
            let exposures = match &shared {
                Some(shared) => shared.clone(),
                None => session.next_exposures()?,
            };
            // Link and tracker run on one thread, so that processor time is their wall time on a machine that does nothing else; what
            // other programs take is in the wall time alone.
            session.step_with(exposures, bench.clocks.work)?;
        }
    }
    sessions.iter().map(|session| session.report("ladder").map(|report| poses(&report))).collect()
}

fn poses(report: &Report) -> Poses {
    let tracking = &report.tracking;
    let later = LATER_STAGES.map(|stage| {
        let ms = report.cost.get(stage).map_or(0.0, |cost| cost.ms_per_frame);
        MeasuredCost { work_ms: ms, wall_ms: ms }
    });
    Poses {
        ate_m: tracking.ate_m,
        jitter_d2_m: tracking.jitter_d2_m,
        tracked_fraction: tracking.tracked_fraction,
        reason: report.not_measurable.get("tracking.ate_m").cloned(),
        later,
    }
}

/// Frames of pose runs: as many as asked for, and as the run has.
pub fn frames_of(bench: &LadderBench<'_>, asked: u32) -> u32 {
    let tracked = bench.setup.cameras.len() == 2;
    let most = if tracked { bench.setup.frames } else { 0 };
    crate::num::u32_truncated(lesser(f64::from(asked), f64::from(most)))
}
