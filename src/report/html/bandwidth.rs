//! Bits that leave the sensors: pixels against features.

use maud::{Markup, html};

use super::parts::section;
use crate::report::html::bars::{Bar, bars};
use crate::report::html::text::{grouped, percent, si};
use crate::report::html::tiles::{factor_words, why_no_features};
use crate::report::record::Report;

pub(super) fn bandwidth(report: &Report) -> Markup {
    let bandwidth = &report.bandwidth;
    let bar = |label: &str, bits_per_s: f64| Bar::new(label, bits_per_s, si(bits_per_s, "bit/s"));
    let rate = |bits_per_frame: f64| bits_per_frame * report.timing.fps;
    let shown = [
        bar("raw pixels", rate(bandwidth.raw_bits_per_frame)),
        bar("in RAW containers", rate(bandwidth.container_bits_per_frame)),
        bar("features", rate(bandwidth.feature_bits_per_frame)),
        bar("sent, with headers", bandwidth.link_bits_per_s),
    ];
    let lead = match bandwidth.reduction {
        Some(factor) => format!("Features instead of pixels take {} bits.", factor_words(factor)),
        None => why_no_features(report),
    };
    section("Bandwidth", &lead, html! { (bars("All cameras of the rig", &shown)) (link(report)) })
}

fn link(report: &Report) -> Markup {
    let (bandwidth, link) = (&report.bandwidth, &report.link);
    let count = |count: u64| grouped(crate::num::f64_from_u64(count));
    let latency = link.feature_latency_us.map_or("no features sent".to_owned(), |us| si(us * 1e-6, "s"));
    let rows = [
        ("Link in use, mean", percent(bandwidth.link_utilisation)),
        ("Link in use while a line is sent", percent(bandwidth.link_utilisation_burst)),
        ("Last row to last feature byte, at most", latency),
        ("Frames that carried rows", count(link.frames_with_rows)),
        ("Rows in the FIFO, at most", count(link.fifo_rows_most.into())),
        ("Rows the readout stood still for", count(link.rows_stalled)),
        ("Readout stood still, a frame", si(link.stalled_us_per_frame * 1e-6, "s")),
        ("Packets", count(link.packets)),
        ("Bits flipped on the way", count(link.bits_flipped)),
        ("Headers corrected", count(link.headers_corrected)),
        ("Headers refused", count(link.headers_refused)),
        ("Payloads refused", count(link.payloads_refused)),
        ("Packets cut short", count(link.packets_cut_short)),
        ("Packets doubled", count(link.packets_doubled)),
        ("Rows lost", count(link.rows_lost)),
        ("Frames damaged", count(link.frames_damaged)),
    ];
    html! {
        table {
            caption { "The link" }
            tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td.num { (value) } } } }
        }
    }
}
