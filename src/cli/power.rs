//! `sensel power`: energy and bandwidth by block, counted over some frames of the scenario.

use sensel::error::Error;
use sensel::run::{NoClock, Session};
use serde_json::json;

use super::args::{RunArguments, Shared};
use super::{listing, progress, run, words};

/// Frames that are counted unless the user says otherwise: features change slowly from frame to frame.
const FRAMES: u32 = 10;

/// `sensel power`.
pub fn main(arguments: &RunArguments, shared: &Shared) -> Result<(), Error> {
    let arguments = RunArguments {
        scenario: arguments.scenario.clone(),
        frames: Some(arguments.frames.unwrap_or(FRAMES)),
        rung: arguments.rung.clone(),
        effects: arguments.effects.clone(),
        keep: Vec::new(),
    };
    let located = run::located(&arguments, shared)?;
    let name = located.name.clone();
    let setup = run::prepare(located, shared)?;
    let frames = setup.frames;
    let mut session = Session::new(setup)?;
    let warned = words::warn(&session.warnings());
    let bar = progress::bar("frames", u64::from(frames), shared.quiet);
    for _ in 0..frames {
        session.step(&NoClock)?;
        bar.inc();
    }
    bar.finish();
    let report = session.report(&name)?;
    words::warn(&report.warnings[warned..]);
    if shared.json {
        let json = json!({"energy": report.energy, "bandwidth": report.bandwidth, "fps": report.timing.fps, "frames": frames,
                   "warnings": report.warnings});
        listing::print_json(&json);
        return Ok(());
    }
    let energy = &report.energy;
    outln!("{} over {frames} frames, technology {}", name, energy.technology);
    outln!("  {:<10} {:>14} {:>12} {:>24}", "block", "nJ a frame", "mW", "likely nJ a frame");
    for (block, &pj) in energy.blocks.iter() {
        let range = energy.blocks_interval.get(block).copied().unwrap_or_default();
        outln!(
            "  {block:<10} {:>14.2} {:>12.3} {:>11.2} .. {:>9.2}",
            pj * 1e-3,
            pj * 1e-9 * report.timing.fps,
            range.low_pj * 1e-3,
            range.high_pj * 1e-3
        );
    }
    outln!("  total      {:.3} mW, {:.1} pJ a pixel", energy.power_mw, energy.pj_per_pixel);
    let bandwidth = &report.bandwidth;
    outln!(
        "  raw        {:.3} Mbit a frame, {:.3} Mbit/s on the link",
        bandwidth.raw_bits_per_frame * 1e-6,
        bandwidth.link_bits_per_s * 1e-6
    );
    outln!("  features   {:.3} Mbit a frame, {}", bandwidth.feature_bits_per_frame * 1e-6, words::reduction(&report));
    outln!("decided by");
    for decider in energy.deciders.iter().take(5) {
        outln!(
            "  {:<24} {:>5.1} % of the energy, {:>5.1} % of its uncertainty",
            decider.name,
            100.0 * decider.energy_share,
            100.0 * decider.variance_share
        );
    }
    Ok(())
}
