//! Keys that say something about a mode that is off. Enters: a resolved scenario. Leaves: an error for the first of them that the
//! user changed, because a value without effect is a misunderstanding.

use super::Resolved;
use crate::error::Error;

/// Refuses a key that the user changed and that nothing reads.
///
/// # Errors
/// The first such key, with what would make it act.
pub fn check(resolved: &Resolved) -> Result<(), Error> {
    let sensor = &resolved.scenario.sensor;
    let readout = &sensor.readout;
    let rolls = readout.shutter == "rolling";
    let groups: [(bool, &str, &[&str]); 6] = [
        (
            readout.hdr != "dual_gain",
            "sensor.readout.hdr = \"dual_gain\"",
            &["pixel.low_conversion_gain_uv_per_e", "pixel.overflow_capacity_e"],
        ),
        (
            readout.hdr != "multi_exposure",
            "sensor.readout.hdr = \"multi_exposure\"",
            &["readout.hdr_exposures", "readout.hdr_exposure_ratio"],
        ),
        (readout.hdr == "none", "an hdr other than none", &["readout.hdr_bits"]),
        (
            readout.exposure != "auto",
            "sensor.readout.exposure = \"auto\"",
            &["readout.target_mean", "readout.gain_max", "readout.exposure_lines_max", "readout.delay_frames"],
        ),
        (
            rolls,
            "a global shutter",
            &["pixel.storage_dark_e_per_s", "pixel.storage_leakage_per_s", "pixel.parasitic_light"],
        ),
        (readout.binning == 1, "sensor.readout.binning = 2", &["readout.binning_mode"]),
    ];
    for (is_off, would_do, keys) in groups {
        for key in keys.iter().map(|key| format!("sensor.{key}")) {
            refuse_idle(resolved, is_off, would_do, &key)?;
        }
    }
    let run = &resolved.scenario.run;
    let merges = run.sampling == "subframes";
    let is_fixed = run.render_tolerance == 0.0;
    for (is_off, would_do, key) in [
        (!merges, "run.sampling = \"subframes\"", "run.subframes"),
        (merges && !is_fixed, "run.sampling = \"stratified\"", "run.render_tolerance"),
        (merges || is_fixed, "a run.render_tolerance above 0 with run.sampling = \"stratified\"", "run.samples_max"),
    ] {
        refuse_idle(resolved, is_off, would_do, key)?;
    }
    Ok(())
}

fn refuse_idle(resolved: &Resolved, is_off: bool, would_do: &str, key: &str) -> Result<(), Error> {
    if is_off && resolved.is_changed(key) {
        return Err(Error::key(key, "", format!("has no effect here; {would_do}, or leaving it out, would do")));
    }
    Ok(())
}
