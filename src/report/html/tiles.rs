//! The key figures in large type, each with its unit and what it means.

use maud::{Markup, html};

use crate::report::html::energy::factor_of;
use crate::report::html::text::{digits, digits_within, grouped, percent, si, si_parts};
use crate::report::html::verdict::RENDER_MAX;
use crate::report::record::Report;

pub(super) fn tiles(report: &Report) -> Markup {
    html! { dl.tiles { (pose_tiles(report)) (sensor_tiles(report)) } }
}

fn pose_tiles(report: &Report) -> Markup {
    let tracking = &report.tracking;
    let metres = |value: Option<f64>| value.map(|value| si_parts(value, "m"));
    let why =
        |path: &str, meaning: &str| report.not_measurable.get(path).cloned().unwrap_or_else(|| meaning.to_owned());
    // A rig that stands still has no alignment, and needs none.
    let d2_m = tracking.jitter_d2_m.or(tracking.jitter_still_m);
    let how = if report.scenario.cameras == 1 { "alignment with scale" } else { "rigid alignment" };
    let tracked = format!(
        "Median landmarks of a frame's pose; {} of {} frames have a pose.",
        percent(tracking.tracked_fraction),
        grouped(f64::from(report.scenario.frames))
    );
    let d2_meaning = match (d2_m, tracking.jitter_d2_m) {
        (Some(_), Some(_)) => format!("Sigma of the position error per axis, blind to drift; {how}."),
        (Some(_), None) => "Sigma of the position per axis of a rig at rest; no alignment.".to_owned(),
        (None, _) => why("tracking.jitter_d2_m", "Sigma of the position error per axis, blind to drift."),
    };
    let ate_meaning = why("tracking.ate_m", &format!("RMS distance from the true path after {how}."));
    let frame_meaning = format!("RMS error of one frame\u{2019}s motion.{}", render_share(report));
    let frame_meaning = why("tracking.jitter_frame_m", &frame_meaning);
    let rpe_meaning = why("tracking.rpe_m", "RMS error of the motion between poses one second apart.");
    let median = report.features.median_tracked.map(|value| (digits(value), "per frame".to_owned()));
    html! {
        (tile("Position error (ATE)", metres(tracking.ate_m), &ate_meaning))
        (tile("Frame jitter (RPE over one frame)", metres(tracking.jitter_frame_m), &frame_meaning))
        (tile("Second-difference jitter (d2)", metres(d2_m), &d2_meaning))
        (tile("Drift over one second (RPE)", metres(tracking.rpe_m), &rpe_meaning))
        (tile("Features tracked", median, &tracked))
    }
}

fn sensor_tiles(report: &Report) -> Markup {
    let (energy, bandwidth, fps) = (&report.energy, &report.bandwidth, report.timing.fps);
    // A sensor that sleeps between frames has another mean than its frame rate says.
    let mw_per_pj = if energy.total_pj_per_frame > 0.0 { energy.power_mw / energy.total_pj_per_frame } else { 0.0 };
    let factor = factor_of(energy.total_interval);
    let interval_mw = |end_pj: f64| digits_within(end_pj * mw_per_pj, factor);
    let range = format!(
        "All sensors of the rig; likely {} to {} mW, for the constants are that uncertain.",
        interval_mw(energy.total_interval.low_pj),
        interval_mw(energy.total_interval.high_pj)
    );
    let feature_rate = si(bandwidth.feature_bits_per_frame * fps, "bit/s");
    let reduction = match bandwidth.reduction {
        Some(factor) => format!("Feature packets instead: {feature_rate}, {}.", factor_words(factor)),
        None => why_no_features(report),
    };
    let within = |value: f64, unit: &str| Some((digits_within(value, factor), unit.to_owned()));
    let energy_meaning = "Per pixel and frame, from photodiode to the last byte on the link.";
    let latency_meaning = "From the middle of the exposure to the last bit of the frame\u{2019}s last packet on the lanes, the extractor \
                   included; the longest of the run.";
    html! {
        (tile("Power", within(energy.power_mw, "mW"), &range))
        (tile("Energy per pixel", within(energy.pj_per_pixel, "pJ"), energy_meaning))
        (tile("Raw pixels", Some(si_parts(bandwidth.raw_bits_per_frame * fps, "bit/s")), &reduction))
        (tile("Latency", Some(si_parts(report.timing.latency_us * 1e-6, "s")), latency_meaning))
    }
}

/// Pixels over features, in words: features may need more.
pub(super) fn factor_words(factor: f64) -> String {
    let (factor, than) = if factor >= 1.0 { (factor, "less") } else { (1.0 / factor, "more") };
    format!("{} times {than}", digits(factor))
}

/// Why there is nothing to hold beside the pixels.
pub(super) fn why_no_features(report: &Report) -> String {
    let reason = report.not_measurable.get("bandwidth.reduction").map_or("no feature was sent", String::as_str);
    format!("Nothing to compare with: {reason}.")
}

/// `value` is number and unit, none where it could not be measured.
fn tile(name: &str, value: Option<(String, String)>, meaning: &str) -> Markup {
    html! {
        div.tile {
            dt { (name) }
            dd {
                @if let Some((number, unit)) = value {
                    p.number { (number) " " small { (unit) } }
                } @else {
                    p.none { "not measured" }
                }
                p { (meaning) }
            }
        }
    }
}

/// Says so where the renderer's own noise is no small part of the photons', because it is in every error of the pose as well.
fn render_share(report: &Report) -> String {
    match report.scenario.render_variance_ratio {
        Some(ratio) if ratio > RENDER_MAX => format!(
            " The render\u{2019}s variance is {} times the photons\u{2019}: much of this is the renderer\u{2019}s; \
             use a lower run.render_tolerance.",
            digits(ratio)
        ),
        _ => String::new(),
    }
}
