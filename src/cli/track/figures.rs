//! What `sensel track` says of its trajectory where the folder has the truth. Enters: true and estimated poses. Leaves: the figures of
//! docs/tracker.md, in words and as JSON.

use std::fmt;

use sensel::pose::TimedPose;
use sensel::report::figures::{Figure, unit_m};
use sensel::report::{TrajectoryFigures, trajectory_figures};
use serde_json::{Map, Value, json};

/// Figures of a trajectory, in metres.
pub struct Figures {
    figures: TrajectoryFigures,
    /// Metres in the unit of a path that one camera made.
    unit_m: Option<f64>,
}

impl Figures {
    /// Figures of an estimate; none where too few poses agree in time. The path of one camera is brought to metres first.
    pub fn of(truth: &[TimedPose], estimate: &[TimedPose], is_one_camera: bool) -> Option<Self> {
        let unit_m = if is_one_camera { unit_m(truth, estimate) } else { None };
        let mut in_metres = estimate.to_vec();
        for pose in &mut in_metres {
            pose.world_from_body.translation_m *= unit_m.unwrap_or(1.0);
        }
        Some(Self { figures: trajectory_figures(truth, &in_metres).ok()?, unit_m })
    }

    /// Every figure under its name; null where it is not measurable.
    pub fn json(figures: Option<&Self>) -> Map<String, Value> {
        let figure = |pick: &dyn Fn(&TrajectoryFigures) -> Option<f64>| figures.and_then(|all| pick(&all.figures));
        let known = |value: &Figure| value.as_ref().ok().copied();
        let named = [
            ("ate_m", figure(&|all| Some(all.se3.as_ref().ok()?.ate_m))),
            ("ate_sim3_m", figure(&|all| Some(all.sim3.as_ref().ok()?.ate_m))),
            (
                "scale_sim3",
                figure(&|all| Some(all.sim3.as_ref().ok()?.alignment.scale))
                    .map(|scale| scale * figures.and_then(|all| all.unit_m).unwrap_or(1.0)),
            ),
            // Relative errors do not depend on a rigid alignment.
            ("rpe_m", figure(&|all| known(&all.unaligned.rpe_m))),
            ("jitter_frame_m", figure(&|all| Some(all.unaligned.jitter_frame_m))),
            ("jitter_d2_m", figure(&|all| known(&all.se3.as_ref().ok()?.jitter_d2_m))),
            ("jitter_still_m", figure(&|all| known(&all.still.jitter_d2_m))),
            ("still_steps_under_1um", figure(&|all| Some(all.still.steps_under_1um))),
        ];
        named.into_iter().map(|(name, value)| (name.to_owned(), json!(value))).collect()
    }
}

impl fmt::Display for Figures {
    /// Position error and jitter; of a rig that stands still, what can be said without alignment.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |value_m: &f64| format!("{:.3} mm", 1e3 * value_m);
        let figure = |value: &Figure| value.as_ref().map_or_else(ToString::to_string, mm);
        match &self.figures.se3 {
            Ok(aligned) => {
                let how = if self.unit_m.is_some() { " (scale aligned)" } else { "" };
                write!(f, "ATE {}{how}, RPE over 1 s {}", mm(&aligned.ate_m), figure(&aligned.rpe_m))?;
                write!(f, ", jitter (d2) {}", figure(&aligned.jitter_d2_m))
            }
            Err(reason) => {
                let still = &self.figures.still;
                write!(f, "jitter (d2) {} without alignment", figure(&still.jitter_d2_m))?;
                write!(f, ", {:.1} % of steps under 1 um; no ATE: {reason}", 100.0 * still.steps_under_1um)
            }
        }
    }
}
