//! `sensel timing`: the clocks of a sensor; needs no scene.

use sensel::error::Error;
use sensel::run::{self, SensorSetup};
use sensel::units::{FrameIndex, RowIndex};
use serde_json::json;

use super::args::{ScenarioArguments, Shared};
use super::{listing, place};

/// `sensel timing`.
pub fn main(arguments: &ScenarioArguments, shared: &Shared) -> Result<(), Error> {
    let located = place::locate(arguments.scenario.as_deref(), shared, &[])?;
    let resolved = &located.resolved;
    let sensor = SensorSetup::new(resolved)?;
    let expected_features = u64::from(resolved.scenario.compute.top_k);
    let timing = run::timing_record(&sensor, expected_features)?;
    let readout = &resolved.scenario.sensor.readout;
    let traffic = sensor.link.traffic(sensor.size, sensor.parameters.adc.bits, expected_features)?;
    let utilisation = sensor.link.mean_utilisation(&traffic, sensor.schedule.frame_time_s());
    let burst = run::burst_utilisation(&sensor)?;
    let exposure_us = 1e6 * sensor.schedule.exposure(FrameIndex(0), RowIndex(0)).length_s();
    if shared.json {
        listing::print_json(&json!({
            "hts": readout.hts,
            "vts": readout.vts,
            "line_time_us": timing.line_time_us,
            "frame_time_us": timing.frame_time_us,
            "fps": timing.fps,
            "exposure_max_lines": sensor.schedule.exposure_lines_max(),
            "exposure_us": exposure_us,
            "latency_us": timing.latency_us,
            "link_utilisation": utilisation,
            "link_utilisation_burst": burst,
            "line": timing.line,
            "frame": timing.frame,
        }));
        return Ok(());
    }
    outln!("line        {:.3} us: HTS {} at {} Hz", timing.line_time_us, readout.hts, readout.pixel_rate_hz);
    outln!("frame       {:.3} us: VTS {}, {:.3} fps", timing.frame_time_us, readout.vts, timing.fps);
    outln!(
        "exposure    {exposure_us:.3} us ({} shutter), at most {} lines",
        readout.shutter,
        sensor.schedule.exposure_lines_max()
    );
    outln!("latency     {:.1} us from the middle of the exposure to the frame's last byte", timing.latency_us);
    outln!("link        {:.1} % of a frame, {:.1} % of a line", 100.0 * utilisation, 100.0 * burst);
    outln!("within a line");
    for phase in &timing.line {
        outln!("  {:<8} {:<14} {:8.3} to {:8.3} us", phase.lane, phase.name, phase.start_us, phase.end_us);
    }
    Ok(())
}
