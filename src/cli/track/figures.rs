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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};
    use sensel::pose::Pose;

    fn path(position_m: impl Fn(f64) -> DVec3) -> Vec<TimedPose> {
        let pose = |number: u32| {
            let t_s = f64::from(number) / 30.0;
            TimedPose { t_s, world_from_body: Pose::new(DQuat::IDENTITY, position_m(t_s)) }
        };
        (0..60).map(pose).collect()
    }

    fn curve(t_s: f64) -> DVec3 {
        DVec3::new(libm::sin(t_s), libm::cos(2.0 * t_s), 0.3 * t_s)
    }

    #[test]
    fn the_path_of_one_camera_is_brought_to_metres_and_that_of_two_is_not() {
        let (truth, half) = (path(curve), path(|t_s| 0.5 * curve(t_s)));
        let one = Figures::of(&truth, &half, true).unwrap();
        let json = Figures::json(Some(&one));
        assert!((json["scale_sim3"].as_f64().unwrap() - 2.0).abs() < 1e-12, "{json:?}");
        for key in ["ate_m", "ate_sim3_m", "rpe_m", "jitter_frame_m", "jitter_d2_m"] {
            assert!(json[key].as_f64().unwrap() < 1e-12, "{key}: {json:?}");
        }
        assert!(one.to_string().contains("(scale aligned)"), "{one}");
        let two = Figures::of(&truth, &half, false).unwrap();
        let json = Figures::json(Some(&two));
        assert!(json["ate_m"].as_f64().unwrap() > 0.1 && json["ate_sim3_m"].as_f64().unwrap() < 1e-12, "{json:?}");
        assert!(!two.to_string().contains("scale aligned"), "{two}");
    }

    #[test]
    fn a_rig_at_rest_has_its_jitter_and_no_position_error() {
        let (truth, shaken) = (path(|_| DVec3::ONE), path(|t_s| DVec3::new(1e-3 * libm::sin(700.0 * t_s), 0.0, 0.0)));
        let figures = Figures::of(&truth, &shaken, false).unwrap();
        let json = Figures::json(Some(&figures));
        assert!(json["ate_m"].is_null() && json["jitter_still_m"].as_f64().unwrap() > 1e-4, "{json:?}");
        assert!(figures.to_string().starts_with("jitter (d2) 0."), "{figures}");
        assert!(Figures::json(None).values().all(Value::is_null));
    }
}
