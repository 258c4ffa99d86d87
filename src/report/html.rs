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

use crate::report::ladder_record::LadderRecord;
use crate::report::record::Report;
pub use parts::{FramePicture, FramePictures, Mark};
use text::escaped;

/// The whole page.
pub fn html(report: &Report, pictures: &FramePictures) -> String {
    let title = format!("{} \u{b7} sensel report", escaped(&report.scenario.name));
    let body = [
        header::header(report),
        "<main>".to_owned(),
        verdict::verdict(report),
        alternatives::alternatives(report),
        warnings::warnings(report),
        waterfall::waterfall(report),
        tiles::tiles(report),
        frames::frames(pictures),
        trajectory::trajectory(report),
        pose_axes::pose_axes(report),
        pose_axes::fused_and_alone(report),
        pair(&pose_error::pose_error(report), &features::features(report)),
        energy::energy(report),
        gates::gates(report),
        pair(&bandwidth::bandwidth(report), &timing::timing(report, pictures.waves.as_deref())),
        plan::plan(report),
        pair(&cost::cost(report), &config::hashes(report)),
        report.ladder.as_ref().map_or_else(String::new, ladder::ladder),
        config::config(report),
        "</main>".to_owned(),
        footer(report),
    ];
    page(&title, &body.join("\n"))
}

/// The page of a ladder alone.
pub fn ladder_html(record: &LadderRecord) -> String {
    let name = escaped(&record.scenario);
    let head = format!("<header class=\"top\"><h1>{name}: what accuracy costs in time</h1></header>");
    let foot = format!(
        "<footer>sensel {} \u{b7} every number on this page stands in ladder.json</footer>",
        escaped(&record.version)
    );
    let title = format!("{name} \u{b7} sensel ladder");
    page(&title, &format!("{head}<main>{}</main>{foot}", ladder::ladder(record)))
}

/// Title and body, both safe already, in one file.
fn page(title: &str, body: &str) -> String {
    let style = include_str!("html/style.css");
    let head = "<meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">";
    // uPlot stands in the page once, and only where a chart zooms.
    let zoom = if body.contains("<figure class=\"chart\" data-zooms>") {
        let [style, plot, own] =
            [include_str!("html/uplot.min.css"), include_str!("html/uplot.min.js"), include_str!("html/zoom.js")];
        format!("<style>{style}</style>\n<script>{plot}</script>\n<script>\n{own}</script>\n")
    } else {
        String::new()
    };
    format!(
        "<!doctype html>\n<html lang=\"en\"><head>{head}<title>{title}</title>\n<style>\n{style}</style></head>\n\
         <body>\n{body}\n{zoom}</body></html>\n"
    )
}

/// Two sections side by side where the screen is wide enough.
fn pair(left: &str, right: &str) -> String {
    format!("<div class=\"pair\">{left}{right}</div>")
}

fn footer(report: &Report) -> String {
    format!(
        "<footer>sensel {} \u{b7} report schema {} \u{b7} every number on this page stands in report.json</footer>",
        escaped(&report.version),
        report.schema_version
    )
}
