//! Figures in words, the same in every verb's answer.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use sensel::error::Error;
use sensel::report::Report;
use sensel::report::record::{ExtractorClocks, Tracking};
use sensel::text::sentence_shown;
use serde_json::json;

use super::args::CommonOptions;

/// Whether every line on stderr is one JSON object.
static AS_JSON: AtomicBool = AtomicBool::new(false);

/// From here on every line on stderr is one JSON object (`--json`).
pub fn use_json() {
    AS_JSON.store(true, Ordering::Relaxed);
}

pub fn is_json() -> bool {
    AS_JSON.load(Ordering::Relaxed)
}

/// Writes one line to stderr. Where stderr takes nothing, the program goes on: what counts stands in its exit code and files.
pub fn to_stderr(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Says one sentence on stderr.
pub fn note(text: &str) {
    if is_json() {
        to_stderr(&json!({"note": text}).to_string());
    } else {
        to_stderr(&format!("sensel: {}", sentence_shown(text)));
    }
}

/// Prints one line on stderr for each warning, and returns how many. `--quiet` does not silence them.
pub fn warn(texts: &[String]) -> usize {
    for text in texts {
        if is_json() {
            to_stderr(&json!({"warning": text}).to_string());
        } else {
            to_stderr(&format!("sensel: warning: {}", sentence_shown(text)));
        }
    }
    texts.len()
}

/// With `--strict`, refuses an extractor that does not keep up. Fails where it does not; the error says what lets it.
pub fn check_strict(shared: &CommonOptions, clocks: Option<&ExtractorClocks>) -> Result<(), Error> {
    match clocks {
        Some(clocks) if shared.strict && !clocks.keeps_up => {
            Err(Error::Run(format!("the extractor {}", clocks.verdict())))
        }
        _ => Ok(()),
    }
}

/// What features save on the link, where features were sent.
pub fn reduction(report: &Report) -> String {
    match report.bandwidth.reduction {
        Some(factor) if factor >= 1.0 => format!("features {factor:.1} times smaller than raw"),
        Some(factor) => format!("features {:.1} times larger than raw", 1.0 / factor),
        None => {
            let why = report.not_measurable.get("bandwidth.reduction").map_or("none was sent", String::as_str);
            format!("no features ({why})")
        }
    }
}

pub fn mm(value_m: f64) -> String {
    format!("{:.3} mm", 1e3 * value_m)
}

/// Second-difference sigma, of a rig that stands still without alignment and beside the share of frozen steps, and the single-picture
/// position sigma given the map.
pub fn jitter(tracking: &Tracking) -> String {
    let d2 = match (tracking.jitter_d2_m, tracking.jitter_still_m, tracking.still_steps_under_1um) {
        (Some(d2_m), ..) => mm(d2_m),
        (None, Some(d2_m), Some(frozen)) => {
            format!("{} without alignment, {:.1} % of steps under 1 um", mm(d2_m), 100.0 * frozen)
        }
        _ => return "not measurable".to_owned(),
    };
    tracking
        .single_picture_sigma_m
        .map_or(d2.clone(), |sigma_m| format!("{d2}, single-picture position sigma given the map {}", mm(sigma_m)))
}
