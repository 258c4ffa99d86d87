//! Runs every design with every seed, and compares neighbours in the list.

use std::collections::BTreeMap;

use rayon::prelude::*;
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::num::f64_from_usize;
use sensel::report::compare::{FinishedRun, Verdict, compare, compare_replicates};
use sensel::run::{NoClock, NoFiles, NoProgress, Session, Setup, SharedExposure};

use super::designs::{Design, ROOM};

/// The difference of one figure in one pair with one seed.
#[derive(Clone, Copy)]
struct One {
    difference: f64,
    interval: [f64; 2],
    verdict: Verdict,
}

/// How often intervals of a figure held what the mean of all seeds says.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    /// Pairs in which the figure varies from seed to seed.
    pub pairs: usize,
    /// Intervals, and those that held.
    pub intervals: usize,
    /// As above.
    pub held: usize,
    /// The least and the greatest share of a pair.
    pub range: [f64; 2],
    /// Of a design against itself with another seed: verdicts, and how many said that there is no difference.
    pub same: usize,
    /// As above.
    pub no_difference: usize,
}

/// The runs of one design, by seed.
pub type Runs = Vec<Vec<FinishedRun>>;

/// Runs all designs with seeds from 1 on. Photons are rendered once.
///
/// # Errors
/// As a run's.
pub fn all(designs: &[Design], seeds: usize) -> Result<Runs, Error> {
    let first = setup(&designs[0], 1, None)?;
    let frames = first.frames;
    // Photons do not depend on what the designs change.
    let mut session = Session::new(first)?;
    let mut photons = Vec::new();
    for _ in 0..frames {
        let seen = session.next_exposures()?;
        session.step_with(seen.clone(), &NoClock)?;
        photons.push(seen);
    }
    let base = session.into_setup();
    let run = |design: &Design, seed: usize| finished(setup(design, seed, Some(&base))?, &photons);
    designs.iter().map(|design| (1..=seeds).into_par_iter().map(|seed| run(design, seed)).collect()).collect()
}

fn setup(design: &Design, seed: usize, beside: Option<&Setup>) -> Result<Setup, Error> {
    let mut keys = design.clone();
    keys.push(format!("seed={seed}"));
    let resolved = Resolved::from_layers("room.toml", ROOM, &keys)?;
    match beside {
        Some(base) => base.beside(resolved, &NoFiles, &NoProgress),
        None => Setup::new(resolved, &NoFiles, &NoProgress),
    }
}

fn finished(setup: Setup, photons: &[Vec<Vec<SharedExposure>>]) -> Result<FinishedRun, Error> {
    let mut session = Session::new(setup)?;
    session.leave_pictures_unhashed();
    for seen in photons {
        session.step_with(seen.clone(), &NoClock)?;
    }
    let report = session.report("room")?;
    let (truth, estimate) = (session.truth(), session.estimate());
    Ok(FinishedRun { folder: "room".to_owned(), report, truth, estimate, cameras_alone: None })
}

/// Coverage by figure, of intervals over the frames of one run of each design or over so many runs.
///
/// # Errors
/// As `compare`.
pub fn coverage(designs: &[Design], runs: &Runs, replicates: usize) -> Result<BTreeMap<String, Coverage>, Error> {
    let mut all: BTreeMap<String, Coverage> = BTreeMap::new();
    for pair in 0..designs.len() - 1 {
        let mut by_figure: BTreeMap<String, Vec<One>> = BTreeMap::new();
        for (a, b) in runs[pair].chunks_exact(replicates).zip(runs[pair + 1].chunks_exact(replicates)) {
            collect(a, b, &mut by_figure)?;
        }
        for (key, ones) in by_figure {
            add_pair(all.entry(key).or_default(), &ones);
        }
        // The design against itself: each seed, or group of seeds, beside the next.
        let mut same: BTreeMap<String, Vec<One>> = BTreeMap::new();
        for seeds in runs[pair].chunks_exact(2 * replicates) {
            let (one, next) = seeds.split_at(replicates);
            collect(one, next, &mut same)?;
        }
        for (key, ones) in same {
            let of = all.entry(key).or_default();
            of.same += ones.len();
            of.no_difference += ones.iter().filter(|one| one.verdict == Verdict::NoDifference).count();
        }
    }
    all.retain(|_, of| of.pairs > 0);
    Ok(all)
}

fn collect(a: &[FinishedRun], b: &[FinishedRun], all: &mut BTreeMap<String, Vec<One>>) -> Result<(), Error> {
    let compared = match (a, b) {
        ([a], [b]) => compare(&[a.clone(), b.clone()])?,
        _ => compare_replicates(a, b)?,
    };
    for figure in &compared.others[0].figures {
        let (Some(difference), Some(interval)) = (figure.difference, figure.interval) else { continue };
        all.entry(figure.key.clone()).or_default().push(One { difference, interval, verdict: figure.verdict });
    }
    Ok(())
}

fn add_pair(of: &mut Coverage, ones: &[One]) {
    let mean = ones.iter().map(|one| one.difference).sum::<f64>() / f64_from_usize(ones.len());
    // What the design alone decides does not vary: its intervals have no width.
    if ones.iter().all(|one| one.difference == ones[0].difference) {
        return;
    }
    let held = ones.iter().filter(|one| (one.interval[0]..=one.interval[1]).contains(&mean)).count();
    let share = f64_from_usize(held) / f64_from_usize(ones.len());
    of.range = if of.pairs == 0 { [share; 2] } else { [of.range[0].min(share), of.range[1].max(share)] };
    of.pairs += 1;
    of.intervals += ones.len();
    of.held += held;
}
