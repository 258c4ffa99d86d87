//! The head of the page: what was simulated.

use maud::{Markup, html};

use crate::report::html::text::{digits, grouped, si};
use crate::report::record::Report;

pub(super) fn header(report: &Report) -> Markup {
    let scenario = &report.scenario;
    let summary = format!(
        "The rig follows {} through {}, lit to {} lux ({}, {}): {} frames in {}, {} of path.",
        scenario.motion,
        scenario.scene,
        digits(scenario.illuminance_lux),
        scenario.illuminant,
        scenario.light,
        grouped(f64::from(scenario.frames)),
        si(scenario.duration_s, "s"),
        si(scenario.path_m, "m"),
    );
    html! {
        header.top {
            p.kicker { "sensel \u{b7} from photons to pose" }
            h1 { (scenario.name) }
            p { (summary) }
            ul.chips { @for chip in chips(report) { li { (chip) } } }
        }
    }
}

fn chips(report: &Report) -> Vec<String> {
    let scenario = &report.scenario;
    let cameras = match scenario.cameras {
        1 => "one camera".to_owned(),
        2 => format!("stereo, {} mm apart", digits(scenario.baseline_mm)),
        more => format!("{more} cameras"),
    };
    let render = match scenario.render_variance_ratio {
        Some(ratio) => format!("render variance {} of photon variance", digits(ratio)),
        None => "render variance not measured".to_owned(),
    };
    let mut chips = vec![
        scenario.sensor.clone(),
        format!("{} \u{d7} {} px, {} bit", scenario.width_px, scenario.height_px, scenario.bits),
        format!("{} shutter, {} exposure", scenario.shutter, si(scenario.exposure_us * 1e-6, "s")),
        scenario.optics.clone(),
        cameras,
        format!("motion scaled by {}", digits(scenario.motion_scale)),
        format!("rung {}, {} samples per pixel", scenario.rung, digits(scenario.samples_per_pixel)),
        render,
        format!("seed {}", report.seed),
    ];
    chips.extend(scenario.motion_notes.iter().map(|note| format!("motion: {note}")));
    chips
}
