//! Latency as a waterfall: each step from the middle of the exposure to the pose as a bar at its time.

use maud::{Markup, Render, html};

use super::parts::Head::{Nameless, Number, Text};
use super::parts::{Table, pair, section};
use crate::num::greater;
use crate::report::html::text::si;
use crate::report::latency_record::LatencyStep;
use crate::report::record::Report;

pub(super) fn waterfall(report: &Report) -> Markup {
    let latency = &report.timing.waterfall;
    let end = |steps: &[LatencyStep]| steps.iter().map(|step| step.end_us).fold(0.0, greater);
    let full_us = greater(end(&latency.frame), end(&latency.first_feature));
    if !(full_us > 0.0) {
        return Markup::default();
    }
    let [frame, feature] = [("The frame", &latency.frame), ("Its first feature", &latency.first_feature)]
        .map(|(heading, found)| html! { div { h3 { (heading) } (steps(found, full_us)) } });
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
    section("When is the pose there?", &lead, pair(frame, feature))
}

fn steps(steps: &[LatencyStep], full_us: f64) -> Markup {
    if steps.is_empty() {
        return html! { p.note { "No feature is sent." } };
    }
    let heads = [Text("step"), Nameless, Number("takes"), Number("until"), Number("slack")];
    let rows = html! { @for step in steps { (row(step, full_us)) } };
    Table { label: None, class: Some("bars waterfall"), heads: &heads, rows }.render()
}

fn row(step: &LatencyStep, full_us: f64) -> Markup {
    let share = |time_us: f64| 100.0 * (time_us / full_us).clamp(0.0, 1.0);
    let (left, right) = (share(step.start_us), share(step.end_us));
    html! {
        tr {
            th scope="row" { (step.step) }
            td { div.bar { i style=(format!("left:{left:.2}%;width:{:.2}%", right - left)) {} } }
            td.num { (si((step.end_us - step.start_us) * 1e-6, "s")) }
            td.num { (si(step.end_us * 1e-6, "s")) }
            td.num {
                @match step.slack_us {
                    Some(slack_us) if slack_us < 0.0 => span.left { (si(-slack_us * 1e-6, "s")) " late" },
                    Some(slack_us) => (si(slack_us * 1e-6, "s")),
                    None => "\u{2013}",
                }
            }
        }
    }
}
