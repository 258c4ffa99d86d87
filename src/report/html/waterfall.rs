//! Latency as a waterfall: each step from the middle of the exposure to the pose as a bar at its time.

use super::parts::{section, table};
use crate::num::greater;
use crate::report::html::text::{escaped, si};
use crate::report::latency_record::LatencyStep;
use crate::report::record::Report;

pub(super) fn waterfall(report: &Report) -> String {
    let latency = &report.timing.waterfall;
    let end = |steps: &[LatencyStep]| steps.iter().map(|step| step.end_us).fold(0.0, greater);
    let full_us = greater(end(&latency.frame), end(&latency.first_feature));
    if !(full_us > 0.0) {
        return String::new();
    }
    let parts = format!(
        "<div class=\"pair\"><div>{}</div><div>{}</div></div>",
        steps("The frame", &latency.frame, full_us),
        steps("Its first feature", &latency.first_feature, full_us)
    );
    let lead = match latency.pose_us {
        Some(pose_us) => {
            let measured = latency.measured_host_us.map_or_else(String::new, |host_us| {
                format!(" This machine took {} for decoding and tracking.", si(host_us * 1e-6, "s"))
            });
            format!(
                "The pose is there {} after the middle of the exposure, on {}.{measured}",
                si(pose_us * 1e-6, "s"),
                latency.host
            )
        }
        None => {
            let last = si(full_us * 1e-6, "s");
            format!("The last bit arrives {last} after the middle of the exposure; no host is modelled.")
        }
    };
    section("When is the pose there?", &lead, &parts)
}

fn steps(heading: &str, steps: &[LatencyStep], full_us: f64) -> String {
    if steps.is_empty() {
        return format!("<h3>{heading}</h3><p class=\"note\">No feature is sent.</p>");
    }
    let row = |step: &LatencyStep| {
        let share = |time_us: f64| 100.0 * (time_us / full_us).clamp(0.0, 1.0);
        let slack = match step.slack_us {
            Some(slack_us) if slack_us < 0.0 => {
                format!("<span class=\"left\">{} late</span>", si(-slack_us * 1e-6, "s"))
            }
            Some(slack_us) => si(slack_us * 1e-6, "s"),
            None => "\u{2013}".to_owned(),
        };
        format!(
            "<tr><th scope=\"row\">{}</th><td><div class=\"bar\"><i style=\"left:{:.2}%;width:{:.2}%\"></i></div></td>\
             <td class=\"num\">{}</td><td class=\"num\">{}</td><td class=\"num\">{slack}</td></tr>",
            escaped(&step.step),
            share(step.start_us),
            share(step.end_us) - share(step.start_us),
            si((step.end_us - step.start_us) * 1e-6, "s"),
            si(step.end_us * 1e-6, "s")
        )
    };
    let rows: String = steps.iter().map(row).collect();
    format!("<h3>{heading}</h3>{}", table("", "bars waterfall", "step||#takes|#until|#slack", &rows))
}
