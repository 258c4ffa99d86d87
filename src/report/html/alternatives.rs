//! What raw pixels, features and both cost, from one run: the question that a sensor with compute is built for.

use maud::{Markup, html};

use super::parts::Head::{Number, Text};
use super::parts::{Table, section};
use crate::report::alternatives_record::Alternative;
use crate::report::html::energy::factor_of;
use crate::report::html::text::{digits, digits_within, grouped, si};
use crate::report::record::Report;

pub(super) fn alternatives(report: &Report) -> Markup {
    let found = &report.alternatives;
    if found.rows.is_empty() {
        return Markup::default();
    }
    let factor = factor_of(report.energy.total_interval);
    let heads = [
        Text("what is sent"),
        Number("mW"),
        Number("analog"),
        Number("digital"),
        Number("port"),
        Number("Mbit/s"),
        Number("last bit"),
        Number("pose"),
        Number("host mJ per frame"),
        Text("keeps up"),
        Number("ATE"),
    ];
    let rows = html! { @for alternative in &found.rows { (row(alternative, factor)) } };
    let table = Table { label: Some("raw, features or both"), class: Some("alternatives"), heads: &heads, rows };
    let lead = format!(
        "One run\u{2019}s events under each way of sending, {} features per frame and camera, all sensors together. The host is {}; \
         times count from the middle of the exposure.",
        grouped(crate::num::f64_from_u64(found.features)),
        found.host
    );
    let content = html! {
        (table)
        @if !found.left_out.is_empty() {
            ul.note { @for left in &found.left_out { li { (left.name) " is not possible: " (left.reason) } } }
        }
    };
    section("Raw, features or both", &lead, content)
}

/// `factor`: by how much the powers may be off, either way.
fn row(row: &Alternative, factor: f64) -> Markup {
    let dash = || "\u{2013}".to_owned();
    let (class, keeps_up) = match row.keeps_up {
        Some(true) => ("kept", "yes"),
        Some(false) => ("left", "no"),
        None => ("soft", "\u{2013}"),
    };
    html! {
        tr class=[row.is_run.then_some("own")] {
            th scope="row" { (row.name) @if row.is_run { " " span.soft { "(this run)" } } }
            td.num { strong { (digits_within(row.power_mw, factor)) } }
            @for mw in [row.analog_mw, row.digital_mw, row.io_mw] { td.num { (digits_within(mw, factor)) } }
            td.num { (digits(row.link_mbit_per_s)) }
            td.num { (si(row.latency_us * 1e-6, "s")) }
            td.num { (row.pose_us.map_or_else(dash, |pose_us| si(pose_us * 1e-6, "s"))) }
            td.num { (row.host_mj_per_frame.map_or_else(dash, digits)) }
            td class=(class) { (keeps_up) }
            td.num { (row.ate_m.map_or_else(dash, |ate_m| si(ate_m, "m"))) }
        }
    }
}
