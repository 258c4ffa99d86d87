//! The numeric hard cases of all stages by name, each against a reference better than the code under test: double-double, integers of 128
//! bits, a closed form, or the rung above. Errors are beside bounds that a comment derives; both sides of every seam are counted.
//!
//! `cargo test hard_cases` prints the table and compares it with docs/hard_cases.md; `SENSEL_UPDATE=1` writes that page's tables anew.

#![allow(clippy::unwrap_used)]

#[path = "hard_cases/adc.rs"]
mod adc;
#[path = "hard_cases/compute.rs"]
mod compute;
#[path = "hard_cases/double_double.rs"]
mod double_double;
#[path = "hard_cases/draw.rs"]
mod draw;
#[path = "hard_cases/elsewhere.rs"]
mod elsewhere;
#[path = "hard_cases/link.rs"]
mod link;
#[path = "hard_cases/motion.rs"]
mod motion;
#[path = "hard_cases/optics.rs"]
mod optics;
#[path = "hard_cases/pixel.rs"]
mod pixel;
#[path = "hard_cases/readout.rs"]
mod readout;
#[path = "hard_cases/report.rs"]
mod report;
#[path = "hard_cases/scene.rs"]
mod scene;
#[path = "hard_cases/table.rs"]
mod table;
#[path = "hard_cases/tracker.rs"]
mod tracker;

use table::Stage;

#[test]
fn hard_cases_of_the_scene_stay_within_their_bounds() {
    judged("scene", scene::run);
}

#[test]
fn hard_cases_of_the_motion_stay_within_their_bounds() {
    judged("motion", motion::scene);
}

#[test]
fn hard_cases_of_the_optics_stay_within_their_bounds() {
    judged("optics", optics::run);
}

#[test]
fn hard_cases_of_the_draws_stay_within_their_bounds() {
    judged("draw", draw::run);
}

#[test]
fn hard_cases_of_the_pixel_stay_within_their_bounds() {
    judged("pixel", pixel::run);
}

#[test]
fn hard_cases_of_the_converters_stay_within_their_bounds() {
    judged("adc", adc::run);
}

#[test]
fn hard_cases_of_the_readout_stay_within_their_bounds() {
    judged("readout", readout::run);
}

#[test]
fn hard_cases_of_the_extractor_stay_within_their_bounds() {
    judged("compute", compute::run);
}

#[test]
fn hard_cases_of_the_link_stay_within_their_bounds() {
    judged("link", link::run);
}

#[test]
fn hard_cases_of_the_energy_stay_within_their_bounds() {
    judged("energy", link::energy);
}

#[test]
fn hard_cases_of_the_rotations_stay_within_their_bounds() {
    judged("rotations", motion::tracker);
}

#[test]
fn hard_cases_of_the_tracker_stay_within_their_bounds() {
    judged("tracker", tracker::run);
}

#[test]
fn hard_cases_of_the_report_stay_within_their_bounds() {
    judged("report", report::run);
}

#[test]
fn hard_cases_elsewhere_are_where_the_page_says() {
    table::compare("elsewhere", &format!("| stage | case | test |\n|---|---|---|\n{}", elsewhere::lines()));
}

fn judged(name: &'static str, run: fn(&mut Stage)) {
    let mut stage = Stage::new(name);
    run(&mut stage);
    stage.judge();
}
