//! Refuses keys that the user changed although their mode is off. A value without effect is a misunderstanding.

use super::resolved::Resolved;
use crate::error::Error;

/// Refuses a key that the user changed and that nothing reads. Fails with the first such key, with what would make it act.
pub fn check(resolved: &Resolved) -> Result<(), Error> {
    super::optics::check_idle(resolved)?;
    super::images::check_idle(resolved)?;
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
    let sensor = groups.into_iter().map(|group| ("sensor", group));
    let scene = light(&resolved.scenario.scene).map(|group| ("scene", group));
    let run = sampling(&resolved.scenario.run).map(|group| ("run", group));
    let link = link(&resolved.scenario.link).map(|group| ("link", group));
    let all = sensor.chain(scene).chain(run).chain(link);
    for (section, (is_off, would_do, keys)) in all {
        for key in keys {
            resolved.check_idle(is_off, &format!("{section}.{key}"), would_do)?;
        }
    }
    super::motion::check_idle(resolved)
}

/// Keys of `[run]` that say something about a way of sampling that is not taken.
fn sampling(run: &super::scenario::Run) -> [(bool, &'static str, &'static [&'static str]); 4] {
    let merges = run.sampling == "subframes";
    let is_fixed = run.samples_per_pixel.is_some();
    [
        (!merges, "run.sampling = \"subframes\"", &["subframes"]),
        (merges, "run.sampling = \"stratified\"", &["render_tolerance"]),
        (merges || is_fixed, "a run.render_tolerance with run.sampling = \"stratified\"", &["samples_max"]),
        (run.reflections == 0, "run.reflections above 0", &["gloss"]),
    ]
}

/// Keys of `[link]` that say something about rows where none are sent.
fn link(link: &super::scenario::Link) -> [(bool, &'static str, &'static [&'static str]); 1] {
    let no_rows = link.mode == "features";
    [(no_rows, "link.mode = \"frames\" or \"both\"", &["format", "line_sync", "fifo_rows", "when_full"])]
}

/// Keys of `[scene]` that say something about light that is not there.
fn light(scene: &super::scenario::Scene) -> [(bool, &'static str, &'static [&'static str]); 7] {
    let flickers = scene.flicker.waveform != "none";
    [
        (scene.file.is_none(), "scene.file", &["scale", "up"]),
        (
            scene.sky.kind == "none",
            "scene.sky.kind = \"overcast\" or \"clear\"",
            &["sky.sun_elevation_deg", "sky.sun_azimuth_deg", "sky.cie_type", "sky.ground_reflectance"],
        ),
        (scene.environment.is_none(), "scene.environment", &["environment_yaw_deg"]),
        (
            !flickers,
            "scene.flicker.waveform other than none",
            &["flicker.frequency_hz", "flicker.modulation", "flicker.phase_deg", "flicker.own_lamps"],
        ),
        (scene.flicker.waveform != "pwm", "scene.flicker.waveform = \"pwm\"", &["flicker.duty"]),
        (scene.light_level == "absolute", "scene.light_level = \"scaled\"", &["illuminance_lux"]),
        (
            scene.target.is_some(),
            "a scene with geometry",
            &[
                "environment",
                "sky.kind",
                "lamp",
                "light_level",
                "bake",
                "shadows",
                "bake_rays_max",
                "flicker.own_lamps",
            ],
        ),
    ]
}
