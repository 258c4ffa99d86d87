//! `sensel sweep plan`: how many cells, what they share, and what they need, by what this machine measures.

use std::sync::atomic::AtomicBool;

use sensel::error::Error;
use sensel::files::photons::encode;
use sensel::files::sweep::SweepFolder;
use sensel::num::{f64_from_u64, f64_from_usize, u64_from};
use sensel::optics::Rounding;
use sensel::run::probe::PictureId;
use sensel::run::{Session, Stopwatch};
use sensel::sweep::CellRecord;
use sensel::units::FrameIndex;

use super::cell::Worker;
use super::loaded::Loaded;
use crate::cli::args::CommonOptions;
use crate::cli::clocks::ProcessorTime;

/// Frames that are simulated to measure what a frame costs.
const PILOT_FRAMES: u32 = 2;
/// Bytes of a cell's record with its entry in the folder.
const RECORD_BYTES: f64 = 8192.0;
/// Bytes of a gibibyte.
const GIB: f64 = 1_073_741_824.0;

/// What a cell needs.
struct Need {
    /// Processor seconds to render its photons.
    render_s: f64,
    /// Processor seconds of everything else.
    rest_s: f64,
    /// Bytes of its photons in the store.
    photon_bytes: f64,
}

/// Prints the plan.
pub fn main(loaded: &Loaded, shared: &CommonOptions) -> Result<(), Error> {
    let cells = &loaded.cells;
    let found =
        SweepFolder::read(&loaded.target).map(|folder| super::loaded::found(loaded, &folder)).unwrap_or_default();
    let finished: Vec<&CellRecord> = found.records.values().filter(|record| record.error.is_none()).collect();
    let remaining = cells.cells.iter().filter(|cell| finished.iter().all(|record| record.cell != cell.name));
    let remaining: Vec<_> = remaining.collect();
    let groups: std::collections::BTreeSet<&str> = remaining.iter().map(|cell| cell.group.as_str()).collect();
    let need = need(loaded)?;
    let measured = mean_rest_s(&finished);
    let rest_s = measured.unwrap_or(need.rest_s);
    let (count, distinct) = (f64_from_usize(remaining.len()), f64_from_usize(groups.len()));
    let hours = (count * rest_s + distinct * need.render_s) / 3600.0;
    let alone_hours = count * (rest_s + need.render_s) / 3600.0;
    let disk_gib = (f64_from_usize(cells.cells.len()) * RECORD_BYTES + distinct * need.photon_bytes) / GIB;
    let points = 1 + cells.cells.iter().map(|cell| cell.point).max().unwrap_or(0);
    if shared.json {
        let listed: Vec<_> = cells
            .cells
            .iter()
            .map(|cell| serde_json::json!({"cell": cell.name, "group": cell.group, "is": cell.described(&cells.factors)}))
            .collect();
        let plan = serde_json::json!({
            "cells": listed, "points": points, "finished": finished.len(), "groups": cells.groups(), "cpu_hours": hours,
            "cpu_hours_without_store": alone_hours, "disk_gib": disk_gib, "folder": loaded.target.display().to_string(),
        });
        outln!("{plan}");
        return Ok(());
    }
    let (all, factors) = (cells.cells.len(), cells.factors.join(" x "));
    outln!("{all} cells: {points} points ({factors}) with {} replicates each", all / points);
    outln!("  finished      {} cells in {}", finished.len(), loaded.target.display());
    let (sets, remaining) = (groups.len(), remaining.len());
    outln!("  photons       {sets} distinct sets for {remaining} cells; cells that differ behind the lens share them");
    let how = measured.map_or(format!("{PILOT_FRAMES} frames"), |_| format!("{} finished cells", finished.len()));
    let render_s = need.render_s;
    outln!(
        "  a cell        {rest_s:.2} s of processor time behind the lens (by {how}), {render_s:.2} s to render its photons once"
    );
    outln!("  all           {hours:.3} processor hours; {alone_hours:.3} if each cell rendered its own photons");
    outln!("  disk          {disk_gib:.3} GiB, of which the photon store may hold {} GiB", shared.photons_gib);
    Ok(())
}

fn mean_rest_s(finished: &[&CellRecord]) -> Option<f64> {
    let sum: f64 = finished.iter().map(|record| record.cost.cpu_s - record.cost.photons_s).sum();
    (!finished.is_empty()).then(|| sum / f64_from_usize(finished.len()))
}

/// Simulates two frames of the first cell.
fn need(loaded: &Loaded) -> Result<Need, Error> {
    let interrupted = AtomicBool::new(false);
    let mut worker = Worker::new(loaded, None, &interrupted, None);
    let Some(cell) = loaded.cells.cells.first() else {
        return Err(Error::key("factor", "", "the sweep has no cell"));
    };
    let setup = worker.prepare(loaded.cells.resolve(cell)?)?;
    let (frames, cameras) = (setup.frames, setup.cameras.len());
    let pilot = PILOT_FRAMES.min(frames);
    let exposures = setup.exposures_at(PictureId { frame: FrameIndex(0), camera: 0 })?;
    let rounding = Rounding::new(setup.fidelity.render.rounding_sigma);
    let bytes: usize = exposures.iter().map(|exposure| encode(exposure, rounding).len()).sum();
    let stopwatch = ProcessorTime::start();
    let is_still = setup.is_still();
    let mut session = Session::new(setup)?;
    session.leave_pictures_unhashed();
    let started_s = stopwatch.now_s();
    for _ in 0..pilot {
        session.step(&stopwatch)?;
    }
    let (whole_s, render_s) = (stopwatch.now_s() - started_s, session.stage_s("render"));
    let scale = f64::from(frames) / f64::from(pilot);
    // Frames of a still scene share one exposure.
    let rendered = if is_still { 1.0 } else { f64::from(frames) };
    Ok(Need {
        render_s: render_s * if is_still { 1.0 } else { scale },
        rest_s: (whole_s - render_s) * scale,
        photon_bytes: f64_from_u64(u64_from(bytes * cameras)) * rendered,
    })
}
