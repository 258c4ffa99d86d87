//! What it takes to get the same bytes again: hashes, seed, version and the effective configuration.

use super::parts::section;
use crate::report::html::text::escaped;
use crate::report::record::Report;

pub(super) fn hashes(report: &Report) -> String {
    let hashes = &report.hashes;
    let row = |(name, value): (&str, &str)| {
        format!("<tr><th scope=\"row\">{name}</th><td><code class=\"hash\">{}</code></td></tr>", escaped(value))
    };
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
    let table = format!("<table><tbody>{}</tbody></table>", rows.map(row).concat());
    let lead = "One config, seed and version give these bytes on any machine, with any number of threads.";
    section("Identity", lead, &table)
}

pub(super) fn config(report: &Report) -> String {
    format!(
        "<section><h2>Configuration</h2><details><summary>The effective configuration of this run</summary>\
         <pre tabindex=\"0\">{}</pre></details></section>",
        escaped(&toml::to_string(&report.config).unwrap_or_default())
    )
}
