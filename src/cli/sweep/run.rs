//! `sensel sweep run`: the cells that are not finished, on all cores.
//!
//! Cells of one group share their photons. The first cell of each group whose photons are not stored runs on all cores; then all others
//! run beside each other, a cell a core.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use sensel::error::Error;
use sensel::files::photons::PhotonFiles;
use sensel::files::sweep::SweepFolder;
use sensel::run::probe::PictureId;
use sensel::run::{PhotonStore, Setup, Stopwatch};
use sensel::statistics::SequentialVerdict;
use sensel::sweep::Cell;
use sensel::sweep::record::CellCost;
use sensel::sweep::report::PointVerdict;
use sensel::units::FrameIndex;

use super::cell::Worker;
use super::loaded::Loaded;
use super::specs;
use crate::cli::args::{CommonOptions, SweepRunArguments};
use crate::cli::clocks::{ProcessorTime, ThreadWork, WallTime};
use crate::cli::progress::{self, StepsBar};
use crate::cli::{interrupt, words};

/// Cells of each undecided point that run between two looks at a sequential test, times the number of threads.
const LOOK_CELLS: usize = 2;

/// What the threads of a run share.
struct Running<'a> {
    loaded: &'a Loaded,
    folder: &'a SweepFolder,
    store: Option<Arc<PhotonFiles>>,
    interrupted: &'a AtomicBool,
    threads: usize,
    failed: AtomicUsize,
    /// Why cells failed: each reason is said once.
    reasons: Mutex<BTreeSet<String>>,
    done: AtomicUsize,
    /// What the cells that ran now cost.
    cost: Mutex<CellCost>,
    /// What ends the run: a disk that takes nothing.
    ended: Mutex<Option<Error>>,
}

pub fn main(own: &SweepRunArguments, loaded: &Loaded, shared: &CommonOptions) -> Result<(), Error> {
    let specifications = specs::parse(&own.spec)?;
    let stopwatch = WallTime::start();
    let interrupted = interrupt::watch();
    let chosen = chosen(own, loaded)?;
    let folder = SweepFolder::take(&loaded.target, own.shard.is_some() || own.cells.is_some())?;
    let mut found = super::loaded::found(loaded, &folder);
    found.records.retain(|_, record| record.error.is_none());
    let threads = match loaded.cells.shared().scenario.threads()? {
        0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        count => sensel::num::index(count),
    };
    let running = Running {
        loaded,
        folder: &folder,
        store: loaded.assets.photons().map(Arc::new),
        interrupted: &interrupted,
        threads,
        failed: AtomicUsize::new(0),
        reasons: Mutex::default(),
        done: AtomicUsize::new(0),
        cost: Mutex::new(CellCost::default()),
        ended: Mutex::new(None),
    };
    let missing = |cell: &&Cell| !found.records.contains_key(&cell.name);
    let remaining: Vec<&Cell> = chosen.iter().copied().filter(missing).collect();
    if own.until_decided {
        running.until_decided(&specifications, remaining, shared)?;
    } else {
        running.all(&remaining, shared)?;
    }
    if running.done.load(Ordering::Relaxed) > 0 {
        found = super::loaded::found(loaded, &folder);
    }
    let verdicts = specs::judged(&specifications, &loaded.cells, &found.records)?;
    running.summary(chosen.len(), &verdicts, stopwatch.now_s(), shared);
    match running.failed.load(Ordering::Relaxed) {
        0 => Ok(()),
        failed => {
            let first = found.records.values().find_map(|record| record.error.clone()).unwrap_or_default();
            Err(Error::SomeFailed(format!("{failed} of {} cells failed; one of them: {first}", chosen.len())))
        }
    }
}

/// The cells that this command is for, those of one group beside each other.
fn chosen<'a>(own: &SweepRunArguments, loaded: &'a Loaded) -> Result<Vec<&'a Cell>, Error> {
    let mut all: Vec<&Cell> = loaded.cells.cells.iter().collect();
    if let Some(file) = &own.cells {
        let text = sensel::files::read_text(file, 1 << 26)?;
        let asked: BTreeSet<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let known: BTreeSet<&str> = all.iter().map(|cell| cell.name.as_str()).collect();
        if let Some(stranger) = asked.difference(&known).next() {
            let reason = "is no cell of this sweep; 'sensel sweep plan FILE --json' lists them";
            return Err(Error::key("--cells", stranger, reason));
        }
        all.retain(|cell| asked.contains(cell.name.as_str()));
        return Ok(all);
    }
    // The order of the file stays within a group and between the first cells of groups.
    let mut first = std::collections::BTreeMap::new();
    for (at, cell) in all.iter().enumerate() {
        first.entry(cell.group.clone()).or_insert(at);
    }
    all.sort_by_key(|cell| first[&cell.group]);
    let Some(shard) = &own.shard else { return Ok(all) };
    let (number, count) = parts(shard)?;
    let (from, to) = (all.len() * (number - 1) / count, all.len() * number / count);
    Ok(all[from..to].to_vec())
}

/// 3 and 16 of "3/16".
fn parts(shard: &str) -> Result<(usize, usize), Error> {
    let refused = || Error::key("--shard", shard, "use I/N with I from 1 to N, as in 3/16");
    let (number, count) = shard.split_once('/').ok_or_else(refused)?;
    let (number, count) = (number.parse().map_err(|_| refused())?, count.parse().map_err(|_| refused())?);
    if number == 0 || number > count { Err(refused()) } else { Ok((number, count)) }
}

impl Running<'_> {
    /// Runs these cells.
    fn all(&self, cells: &[&Cell], shared: &CommonOptions) -> Result<(), Error> {
        let bar = progress::bar("cells", sensel::num::u64_from(cells.len()), shared.quiet);
        let setup = self.batch(cells, None, &bar);
        bar.finish();
        setup.map(|_| ())
    }

    /// Runs groups of cells of each undecided point, in the order of the file, and looks at the tests in between. What runs depends on
    /// figures and on the number of threads, never on times.
    fn until_decided(
        &self,
        specifications: &[sensel::sweep::specification::Specification],
        mut remaining: Vec<&Cell>,
        shared: &CommonOptions,
    ) -> Result<(), Error> {
        let bar = progress::bar("cells", sensel::num::u64_from(remaining.len()), shared.quiet);
        let mut setup = None;
        loop {
            let found = super::loaded::found(self.loaded, self.folder);
            let judged = specs::judged(specifications, &self.loaded.cells, &found.records)?;
            let is_open = |point: usize| {
                let mut own = judged.iter().filter(|one| one.point == point).peekable();
                own.peek().is_none() || own.any(|one| one.judgement.sequential == SequentialVerdict::Open)
            };
            remaining.retain(|cell| is_open(cell.point));
            let mut taken = std::collections::BTreeMap::new();
            let mut batch = Vec::new();
            remaining.retain(|&cell| {
                let count: &mut usize = taken.entry(cell.point).or_insert(0);
                *count += 1;
                let is_now = *count <= LOOK_CELLS * self.threads;
                if is_now {
                    batch.push(cell);
                }
                !is_now
            });
            if batch.is_empty() {
                bar.finish();
                return Ok(());
            }
            setup = self.batch(&batch, setup, &bar)?;
        }
    }

    /// Runs cells on all cores; the setup of the last one.
    fn batch(&self, cells: &[&Cell], setup: Option<Setup>, bar: &StepsBar) -> Result<Option<Setup>, Error> {
        let store = self.store.clone().map(|store| store as Arc<dyn PhotonStore>);
        let worker = |last: Option<Setup>| Worker::new(self.loaded, store.clone(), self.interrupted, last);
        let everywhere = self.pool(self.threads)?;
        let mut first = worker(setup);
        let (leaders, others) = self.leaders(cells, &mut first);
        let work = ProcessorTime::start();
        for cell in leaders {
            everywhere.install(|| self.one(&mut first, cell, &work, bar))?;
        }
        let (next, setup) = (AtomicUsize::new(0), first.setup());
        let threads = self.threads.min(others.len());
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    let stopwatch = ThreadWork::start();
                    let mut own = worker(setup.clone());
                    let run = || {
                        while let Some(cell) = others.get(next.fetch_add(1, Ordering::Relaxed)) {
                            self.one(&mut own, cell, &stopwatch, bar)?;
                        }
                        Ok(())
                    };
                    // A pool of one thread keeps a cell's own parallel work from taking up other cells.
                    if let Err(error) = self.pool(1).and_then(|pool| pool.install(run)) {
                        self.end(error);
                    }
                });
            }
        });
        match self.ended.lock().expect("no thread panics while it holds an error").take() {
            Some(Error::Interrupted) => Err(self.stopped()),
            Some(error) => Err(error),
            None => Ok(setup),
        }
    }

    fn pool(&self, threads: usize) -> Result<rayon::ThreadPool, Error> {
        let made = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        made.map_err(|error| Error::Run(format!("{threads} threads: {error}")))
    }

    /// The first cell of each group whose first photons are not stored, and all other cells.
    fn leaders<'c>(&self, cells: &[&'c Cell], worker: &mut Worker<'_>) -> (Vec<&'c Cell>, Vec<&'c Cell>) {
        let mut groups = BTreeSet::new();
        let is_leader = |cell: &&&Cell| {
            let is_first = groups.insert(cell.group.clone());
            is_first
                && self.threads > 1
                && self.store.as_ref().is_some_and(|store| !self.is_stored(cell, store, worker))
        };
        let (leaders, others): (Vec<&&Cell>, Vec<&&Cell>) = cells.iter().partition(is_leader);
        (leaders.into_iter().copied().collect(), others.into_iter().copied().collect())
    }

    fn is_stored(&self, cell: &Cell, store: &PhotonFiles, worker: &mut Worker<'_>) -> bool {
        let resolved = self.loaded.cells.resolve(cell);
        // A cell that cannot be prepared says so when it runs.
        let Ok(setup) = resolved.and_then(|resolved| worker.prepare(resolved)) else { return true };
        let keys = setup.photon_keys(PictureId { frame: FrameIndex(0), camera: 0 });
        worker.keep(setup);
        keys.iter().flatten().all(|key| store.has(key))
    }

    /// Runs one cell and writes its record.
    fn one(
        &self,
        worker: &mut Worker<'_>,
        cell: &Cell,
        stopwatch: &dyn Stopwatch,
        bar: &StepsBar,
    ) -> Result<(), Error> {
        if self.ended.lock().expect("no thread panics while it holds an error").is_some() {
            return Ok(());
        }
        let record = match worker.run(cell, stopwatch).inspect_err(|_| self.end(Error::Interrupted)) {
            Err(Error::Interrupted) => return Err(self.stopped()),
            other => other?,
        };
        if let Some(error) = &record.error {
            let cell = cell.described(&self.loaded.cells.factors);
            if self.reasons.lock().expect("no thread panics while it holds a reason").insert(error.clone()) {
                words::note(&format!("a cell failed ({cell}): {error}"));
            }
            self.failed.fetch_add(1, Ordering::Relaxed);
        }
        self.folder.write(&record)?;
        self.done.fetch_add(1, Ordering::Relaxed);
        add(&mut self.cost.lock().expect("no thread panics while it holds a cost"), &record.cost);
        bar.inc();
        Ok(())
    }

    /// Ends the run for the first reason.
    fn end(&self, error: Error) {
        let mut ended = self.ended.lock().expect("no thread panics while it holds an error");
        if ended.is_none() {
            *ended = Some(error);
        }
    }

    fn stopped(&self) -> Error {
        let done = self.done.load(Ordering::Relaxed);
        Error::Stopped(format!(
            "stopped; the {done} cells finished since the start are kept, and a new run goes on from there"
        ))
    }

    fn summary(&self, cells: usize, verdicts: &[PointVerdict], seconds: f64, shared: &CommonOptions) {
        let (done, failed) = (self.done.load(Ordering::Relaxed), self.failed.load(Ordering::Relaxed));
        let cost = self.cost.lock().expect("no thread panics while it holds a cost");
        let stages_s: f64 = cost.stages_s.values().sum();
        let ms_per_cell = |seconds: f64| 1e3 * seconds / sensel::num::f64_from_usize(done.max(1));
        let [all_ms, photons_ms, stages_ms] = [cost.cpu_s, cost.photons_s, stages_s].map(ms_per_cell);
        let photons = self.store.as_ref().map(|store| store.counts()).unwrap_or_default();
        if shared.json {
            let value = serde_json::json!({
                "cells": cells,
                "run": done,
                "failed": failed,
                "folder": self.folder.path().display().to_string(),
                "cpu_ms_per_cell": {"all": all_ms, "photons": photons_ms, "stages": stages_ms},
                "photons": {"found": photons.found, "rendered": photons.rendered, "damaged": photons.damaged},
                "specs": specs::as_json(verdicts),
            });
            outln!("{value}");
        } else if !shared.quiet {
            let folder = self.folder.path().display();
            outln!("{cells} cells, {done} of them run now in {seconds:.1} s, {failed} failed: {folder}");
            if done > 0 {
                outln!(
                    "a cell: {all_ms:.1} ms of processor time, of which {photons_ms:.1} ms for its photons and \
                     {stages_ms:.1} ms for sensor to tracker"
                );
            }
            if photons.found + photons.rendered > 0 {
                outln!("photons: {} exposures from the store, {} rendered", photons.found, photons.rendered);
            }
            specs::say(verdicts);
        }
    }
}

fn add(sum: &mut CellCost, cost: &CellCost) {
    sum.cpu_s += cost.cpu_s;
    sum.photons_s += cost.photons_s;
    for (stage, seconds) in &cost.stages_s {
        *sum.stages_s.entry(stage.clone()).or_default() += seconds;
    }
}
