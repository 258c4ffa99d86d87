//! What raw pixels, features and both cost: the question that a sensor with compute is built for.

use crate::report::html::section;
use crate::report::html::text::{escaped, percent, si};
use crate::report::record::Report;

pub(super) fn alternatives(report: &Report) -> String {
    let bandwidth = &report.bandwidth;
    let rate = |bits_per_frame: f64| si(bits_per_frame * report.timing.fps, "bit/s");
    let features = if bandwidth.feature_bits_per_frame > 0.0 {
        rate(bandwidth.feature_bits_per_frame)
    } else {
        "none were sent".to_owned()
    };
    let against_raw = |bits: f64| match bandwidth.container_bits_per_frame {
        raw if raw > 0.0 => percent(bits / raw),
        _ => "\u{2013}".to_owned(),
    };
    let rows = [
        ("raw pixels", rate(bandwidth.raw_bits_per_frame), against_raw(bandwidth.raw_bits_per_frame)),
        ("features", features, against_raw(bandwidth.feature_bits_per_frame)),
        ("sent in this run", si(bandwidth.link_bits_per_s, "bit/s"), percent(bandwidth.link_utilisation)),
    ];
    let row = |(name, rate, share): &(&str, String, String)| {
        format!(
            "<tr><th scope=\"row\">{name}</th><td class=\"num\">{}</td><td class=\"num\">{}</td></tr>",
            escaped(rate),
            escaped(share)
        )
    };
    let table = format!(
        "<table><thead><tr><th scope=\"col\">what leaves the sensors</th><th scope=\"col\" class=\"num\">rate</th>\
         <th scope=\"col\" class=\"num\">of the RAW container; in the last row of the link</th></tr></thead><tbody>{}</tbody></table>",
        rows.iter().map(row).collect::<String>()
    );
    section("Raw, features or both", "What the link carries for each choice of this run.", &table)
}
