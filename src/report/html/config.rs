//! What it takes to get the same bytes again: hashes, seed, version and the effective configuration.

use maud::{Markup, html};

use super::parts::section;
use crate::report::record::Report;

pub(super) fn hashes(report: &Report) -> Markup {
    let hashes = &report.hashes;
    let seed = report.seed.to_string();
    let rows = [
        ("version", report.version.as_str()),
        ("seed", &seed),
        ("config", &report.config_hash),
        ("photons", &hashes.photons),
        ("codes", &hashes.codes),
        ("features", &hashes.features),
        ("energy", &hashes.energy),
        ("poses", &hashes.poses),
    ];
    let table = html! {
        table { tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td { code.hash { (value) } } } } } }
    };
    let lead = "One config, seed and version give these bytes on any machine, with any number of threads.";
    section("Identity", lead, table)
}

pub(super) fn config(report: &Report) -> Markup {
    html! {
        section {
            h2 { "Configuration" }
            details {
                summary { "The effective configuration of this run" }
                pre tabindex="0" { (toml::to_string(&report.config).unwrap_or_default()) }
            }
        }
    }
}
