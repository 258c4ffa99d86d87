//! Figures in words, the same in every verb's answer.

use sensel::report::record::Tracking;

/// Metres as millimetres.
pub fn mm(value_m: f64) -> String {
    format!("{:.3} mm", 1e3 * value_m)
}

/// Second-difference sigma, of a rig that stands still without alignment and beside the share of frozen steps, and its Cramer-Rao bound.
pub fn jitter(tracking: &Tracking) -> String {
    let d2 = match (tracking.jitter_d2_m, tracking.jitter_still_m, tracking.still_steps_under_1um) {
        (Some(d2_m), ..) => mm(d2_m),
        (None, Some(d2_m), Some(frozen)) => {
            format!("{} without alignment, {:.1} % of steps under 1 um", mm(d2_m), 100.0 * frozen)
        }
        _ => return "not measurable".to_owned(),
    };
    tracking.jitter_bound_m.map_or(d2.clone(), |bound_m| format!("{d2}, Cramer-Rao bound {}", mm(bound_m)))
}
