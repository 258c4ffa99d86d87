//! Writes `report.html` from a report and pictures of frames: one self-contained page without network or outside fonts.
//! Every number on it is in the report as well.

mod alternatives;
mod bandwidth;
mod bars;
pub mod compare;
mod config;
mod cost;
mod energy;
mod features;
mod frames;
mod gates;
mod header;
mod ladder;
mod ladder_charts;
mod parts;
mod plan;
mod power_strip;
mod pose_axes;
mod pose_error;
mod text;
mod tiles;
mod timing;
mod trajectory;
mod verdict;
mod warnings;
mod waterfall;

use maud::{Markup, html};

use crate::report::ladder_record::LadderRecord;
use crate::report::record::Report;
pub(crate) use frames::png_uri;
pub use parts::{FramePicture, FramePictures, Mark};
pub(crate) use parts::{document, pair, script, section, style};

/// The whole page.
pub fn html(report: &Report, pictures: &FramePictures) -> String {
    let body = html! {
        (header::header(report))
        main {
            (verdict::verdict(report))
            (alternatives::alternatives(report))
            (warnings::warnings(report))
            (waterfall::waterfall(report))
            (tiles::tiles(report))
            (frames::frames(pictures))
            (trajectory::trajectory(report))
            (pose_axes::pose_axes(report))
            (pose_axes::fused_and_alone(report))
            (pair(pose_error::pose_error(report), features::features(report)))
            (energy::energy(report))
            (gates::gates(report))
            (pair(bandwidth::bandwidth(report), timing::timing(report, pictures.waves.as_deref())))
            (plan::plan(report))
            (pair(cost::cost(report), config::hashes(report)))
            @if let Some(record) = &report.ladder { (ladder::ladder(record)) }
            (config::config(report))
        }
        footer {
            "sensel " (report.version) " \u{b7} report schema " (report.schema_version)
            " \u{b7} every number on this page stands in report.json"
        }
    };
    page(&format!("{} \u{b7} sensel report", report.scenario.name), body)
}

/// The page of a ladder alone.
pub fn ladder_html(record: &LadderRecord) -> String {
    let name = &record.scenario;
    let body = html! {
        header.top { h1 { (name) ": what accuracy costs in time" } }
        main { (ladder::ladder(record)) }
        footer { "sensel " (record.version) " \u{b7} every number on this page stands in ladder.json" }
    };
    page(&format!("{name} \u{b7} sensel ladder"), body)
}

/// A page whose charts zoom.
fn page(title: &str, body: Markup) -> String {
    // uPlot stands in the page once, and only where a chart zooms.
    let zooms = body.0.contains("<figure class=\"chart\" data-zooms>");
    let body = html! {
        (body)
        @if zooms {
            (style(include_str!("html/uplot.min.css")))
            (script(include_str!("html/uplot.min.js")))
            (script(include_str!("html/zoom.js")))
        }
    };
    document(title, body).into_string()
}
