//! One cell: from its configuration to its figures, with photons from the store where they are there.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::fidelity::Rung;
use sensel::run::session::STAGES;
use sensel::run::{NoProgress, PhotonStore, Session, Setup, Stopwatch};
use sensel::sweep::record::CellCost;
use sensel::sweep::signal::SignalSum;
use sensel::sweep::{Cell, CellRecord};

use super::loaded::Loaded;

/// The second tracker among the costs of a report.
const ALONE: &str = "tracker_cameras_alone";

/// What runs cells one after the other and keeps what they have in common.
pub struct Worker<'a> {
    loaded: &'a Loaded,
    store: Option<Arc<dyn PhotonStore>>,
    interrupted: &'a AtomicBool,
    /// Of the last cell.
    last: Option<Setup>,
}

impl<'a> Worker<'a> {
    /// Starts from the setup of another cell, if there is one.
    pub fn new(
        loaded: &'a Loaded,
        store: Option<Arc<dyn PhotonStore>>,
        interrupted: &'a AtomicBool,
        last: Option<Setup>,
    ) -> Self {
        Self { loaded, store, interrupted, last }
    }

    /// The setup of the last cell, for another worker.
    pub fn setup(&self) -> Option<Setup> {
        self.last.clone()
    }

    /// Keeps a setup that was prepared and not run.
    pub fn keep(&mut self, setup: Setup) {
        self.last = Some(setup);
    }

    /// Everything that a cell needs, checked.
    pub fn prepare(&mut self, resolved: Resolved) -> Result<Setup, Error> {
        if resolved.scenario.run.rung == Rung::Expected.name() {
            let reason = "ends at the image and has no figures of features or poses; use sampled";
            return Err(resolved.tree.locate(Error::key("run.rung", "expected", reason)));
        }
        let assets = &self.loaded.assets;
        let mut setup = match &self.last {
            Some(last) => last.beside(resolved, assets, &NoProgress)?,
            None => Setup::new(resolved, assets, &NoProgress)?,
        };
        if let Some(store) = &self.store {
            setup.keep_photons_in(Arc::clone(store));
        }
        Ok(setup)
    }

    /// Runs a cell. A cell that fails has a record too. Fails where the user asked to stop.
    pub fn run(&mut self, cell: &Cell, stopwatch: &dyn Stopwatch) -> Result<CellRecord, Error> {
        match self.figures(cell, stopwatch) {
            Err(error @ Error::Interrupted) => Err(error),
            Err(error) => Ok(CellRecord::of_error(&cell.name, error.to_string())),
            Ok(record) => Ok(record),
        }
    }

    fn figures(&mut self, cell: &Cell, stopwatch: &dyn Stopwatch) -> Result<CellRecord, Error> {
        let started_s = stopwatch.now_s();
        let setup = self.prepare(self.loaded.cells.resolve(cell)?)?;
        let frames = setup.frames;
        let mut session = Session::new(setup)?;
        session.leave_pictures_unhashed();
        if self.loaded.sweep.cameras_alone {
            session.track_cameras_alone()?;
        }
        let mut signal = SignalSum::new(session.setup());
        for _ in 0..frames {
            if self.interrupted.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            signal.add(&session.step(stopwatch)?);
        }
        let report = session.report(&cell.name)?;
        let mut stages_s: BTreeMap<String, f64> =
            STAGES[1..].iter().map(|&stage| (stage.to_owned(), session.stage_s(stage))).collect();
        if let Some(cost) = report.cost.get(ALONE) {
            stages_s.insert(ALONE.to_owned(), 1e-3 * cost.ms_per_frame * f64::from(frames));
        }
        let photons_s = session.stage_s(STAGES[0]);
        self.last = Some(session.into_setup());
        let cost = CellCost { cpu_s: stopwatch.now_s() - started_s, photons_s, stages_s };
        Ok(CellRecord::of_report(&cell.name, &report, &signal, cost))
    }
}
