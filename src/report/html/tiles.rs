//! The key figures in large type, each with its unit and what it means.

use crate::report::html::energy::factor_of;
use crate::report::html::text::{digits, digits_within, escaped, grouped, percent, si, si_parts};
use crate::report::record::Report;

struct FigureTile {
    name: &'static str,
    /// Number and unit, or None where it could not be measured.
    value: Option<(String, String)>,
    meaning: String,
}

pub(super) fn tiles(report: &Report) -> String {
    let all = [pose_tiles(report), sensor_tiles(report)].concat();
    format!("<dl class=\"tiles\">{all}</dl>")
}

fn pose_tiles(report: &Report) -> String {
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
    [
        FigureTile {
            name: "Position error (ATE)",
            value: metres(tracking.ate_m),
            meaning: why("tracking.ate_m", &format!("RMS distance from the true path after {how}.")),
        },
        FigureTile {
            name: "Frame jitter (RPE over one frame)",
            value: metres(tracking.jitter_frame_m),
            meaning: why(
                "tracking.jitter_frame_m",
                &format!("RMS error of one frame\u{2019}s motion.{}", render_share(report)),
            ),
        },
        FigureTile {
            name: "Second-difference jitter (d2)",
            value: metres(d2_m),
            meaning: match (d2_m, tracking.jitter_d2_m) {
                (Some(_), Some(_)) => format!("Sigma of the position error per axis, blind to drift; {how}."),
                (Some(_), None) => "Sigma of the position per axis of a rig at rest; no alignment.".to_owned(),
                (None, _) => why("tracking.jitter_d2_m", "Sigma of the position error per axis, blind to drift."),
            },
        },
        FigureTile {
            name: "Drift over one second (RPE)",
            value: metres(tracking.rpe_m),
            meaning: why("tracking.rpe_m", "RMS error of the motion between poses one second apart."),
        },
        FigureTile {
            name: "Features tracked",
            value: report.features.median_tracked.map(|value| (digits(value), "per frame".to_owned())),
            meaning: tracked,
        },
    ]
    .iter()
    .map(tile)
    .collect()
}

fn sensor_tiles(report: &Report) -> String {
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
    let reduction = match bandwidth.reduction {
        Some(factor) => format!(
            "Feature packets instead: {}, {}.",
            rate(bandwidth.feature_bits_per_frame * fps),
            factor_words(factor)
        ),
        None => why_no_features(report),
    };
    [
        FigureTile {
            name: "Power",
            value: Some((digits_within(energy.power_mw, factor), "mW".to_owned())),
            meaning: range,
        },
        FigureTile {
            name: "Energy a pixel",
            value: Some((digits_within(energy.pj_per_pixel, factor), "pJ".to_owned())),
            meaning: "Per pixel and frame, from photodiode to the last byte on the link.".to_owned(),
        },
        FigureTile {
            name: "Raw pixels",
            value: Some(si_parts(bandwidth.raw_bits_per_frame * fps, "bit/s")),
            meaning: reduction,
        },
        FigureTile {
            name: "Latency",
            value: Some(si_parts(report.timing.latency_us * 1e-6, "s")),
            meaning: "From the middle of the exposure to the last bit of the frame\u{2019}s last packet on the lanes, \
                      the extractor included; the longest of the run."
                .to_owned(),
        },
    ]
    .iter()
    .map(tile)
    .collect()
}

/// Pixels over features, in words: features may need more.
pub(super) fn factor_words(factor: f64) -> String {
    if factor >= 1.0 {
        format!("{} times less", digits(factor))
    } else {
        format!("{} times more", digits(1.0 / factor))
    }
}

/// Why there is nothing to hold beside the pixels.
pub(super) fn why_no_features(report: &Report) -> String {
    let reason = report.not_measurable.get("bandwidth.reduction").map_or("no feature was sent", String::as_str);
    format!("Nothing to compare with: {reason}.")
}

fn rate(bits_per_s: f64) -> String {
    si(bits_per_s, "bit/s")
}

fn tile(tile: &FigureTile) -> String {
    let value = match &tile.value {
        Some((number, unit)) => format!("<p class=\"number\">{} <small>{}</small></p>", escaped(number), escaped(unit)),
        None => "<p class=\"none\">not measured</p>".to_owned(),
    };
    format!(
        "<div class=\"tile\"><dt>{}</dt><dd>{value}<p>{}</p></dd></div>",
        escaped(tile.name),
        escaped(&tile.meaning)
    )
}

/// Says so where the renderer's own noise stands above the photons', because then it stands in every error of the pose as well.
fn render_share(report: &Report) -> String {
    match report.scenario.render_variance_ratio {
        Some(ratio) if ratio > 1.0 => format!(
            " The render\u{2019}s variance is {} times the photons\u{2019}: much of this is the renderer\u{2019}s; \
             more samples a pixel would show the sensor.",
            digits(ratio)
        ),
        _ => String::new(),
    }
}
