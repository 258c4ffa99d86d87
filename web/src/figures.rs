//! Figures of the run so far, as the report has them, in the order in which the page shows them.

use sensel::error::Error;
use sensel::num::{f64_from_u64, f64_from_usize};
use sensel::report::trajectory_figures;
use sensel::run::session::STAGES;
use sensel::run::{Frame, Session as Run};
use serde_json::{Value, json};

/// This frame, and the run so far.
pub fn summary(run: &Run, frame: &Frame) -> Result<Value, Error> {
    let (setup, camera) = (run.setup(), &frame.cameras[0]);
    let (sensor, plan) = (&setup.sensor, &setup.plan);
    let report = run.report("page")?;
    let [photons, codes, features, energy, poses] = run.hashes();
    let tracked = &frame.tracked;
    let codes_sum: u64 = camera.codes.values().iter().map(|&code| u64::from(code)).sum();
    let pixels = f64_from_usize(sensor.size.pixel_count());
    let photon_sum: f64 = camera.photons.values().iter().map(|&value| f64::from(value)).sum();
    let saturated = camera.codes.values().iter().filter(|&&code| u32::from(code) == sensor.parameters.adc.code_max());
    let schedule = &sensor.schedule;
    let stages: Vec<Value> = STAGES.iter().map(|stage| json!([stage, 1e3 * run.stage_s(stage)])).collect();
    let omitted: Vec<Value> = report.plan.omitted.iter().map(|effect| json!([effect.name, effect.reason])).collect();
    Ok(json!({
        "frame": frame.frame.0,
        "t_s": frame.t_s,
        "features": camera.features.len(),
        "mean_code_dn": f64_from_u64(codes_sum) / pixels,
        "mean_photons": photon_sum / pixels,
        "saturated": f64_from_usize(saturated.count()) / pixels,
        "raw_bits": pixels * f64::from(sensor.bits()),
        "feature_bits": run.feature_bits_of(frame.frame, &camera.features_clk),
        "packet_bytes": camera.packets.len(),
        "cameras": setup.cameras.len(),
        "kept": plan.kept.iter().map(|effect| effect.name).collect::<Vec<_>>(),
        "omitted": omitted,
        "present": sensel::effects::build_all(&sensor.parameters).iter().map(|effect| effect.name()).collect::<Vec<_>>(),
        "hashes": {"photons": photons, "codes": codes, "features": features, "energy": energy, "poses": poses},
        "has_pose": tracked.world_from_body.is_some(),
        "keyframe": tracked.keyframe,
        "tracked_features": tracked.tracked_features,
        "exposure_us": 1e6 * schedule.exposure_s(),
        "exposure_lines": schedule.exposure_lines(),
        "line_us": 1e6 * schedule.line_time_s(),
        "frame_us": 1e6 * schedule.frame_time_s(),
        "fps": schedule.fps(),
        "hts": schedule.hts(),
        "vts": schedule.vts(),
        "rolling": setup.is_rolling(),
        "timing": report.timing,
        "bandwidth": report.bandwidth,
        "energy": {
            "blocks": report.energy.blocks,
            "blocks_interval": report.energy.blocks_interval,
            "rails": report.energy.rails,
            "total_pj": report.energy.total_pj_per_frame,
            "power_mw": report.energy.power_mw,
            "static_mw": report.energy.static_power_mw,
            "pj_per_pixel": report.energy.pj_per_pixel,
            "technology": report.energy.technology,
            "deciders": report.energy.deciders,
        },
        "tracking": report.tracking,
        "extractor": report.features,
        "render_variance_ratio": report.scenario.render_variance_ratio,
        "stages_ms": stages,
        "warnings": report.warnings,
        "not_measurable": report.not_measurable,
        "version": report.version,
        "config_hash": report.config_hash,
    }))
}

/// Time, true position, estimated position in the truth's frame, and error of each pose.
pub fn trajectory(run: &Run) -> Vec<f64> {
    let (truth, mut estimate) = (run.truth(), run.estimate());
    sensel::report::figures::bring_to_metres(&truth, &mut estimate, run.setup().cameras.len());
    let Ok(figures) = trajectory_figures(&truth, &estimate) else { return Vec::new() };
    let of = |error: &sensel::report::figures::PoseError| {
        let (truth_m, estimate_m) = (error.truth_m, error.estimate_m);
        [error.t_s, truth_m.x, truth_m.y, truth_m.z, estimate_m.x, estimate_m.y, estimate_m.z, error.error_m]
    };
    figures.errors.iter().flat_map(of).collect()
}
