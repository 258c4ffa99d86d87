//! What `sensel track` says of its trajectory where the folder has the truth: the figures of a report
//! (docs/tracker.md) from true and estimated poses and the frames' single-picture sigmas, in words and as JSON.

use std::collections::BTreeMap;
use std::fmt;

use sensel::pose::TimedPose;
use sensel::report::figures::bring_to_metres;
use sensel::report::record::Tracking;
use sensel::report::{Report, trajectory_figures};
use serde_json::{Map, Value, json};

use crate::cli::words;

/// Figures of a trajectory.
pub struct TrackFigures {
    tracking: Tracking,
    is_one_camera: bool,
    /// Why there is no position error.
    without_ate: Option<String>,
    /// Why a figure has no value, by its name.
    not_measurable: BTreeMap<String, String>,
}

/// Those of a report that two trajectories and the frames' sigmas tell.
const NAMES: [&str; 11] = [
    "ate_m",
    "ate_interval_m",
    "rpe_m",
    "jitter_frame_m",
    "jitter_d2_m",
    "jitter_d2_interval_m",
    "single_picture_sigma_m",
    "ate_sim3_m",
    "scale_sim3",
    "jitter_still_m",
    "still_steps_under_1um",
];

impl TrackFigures {
    /// Figures of an estimate as a run's report has them; without the truth there is nothing but the sigma.
    pub fn of(
        truth: Option<&[TimedPose]>,
        mut estimate: Vec<TimedPose>,
        sigmas: &[f64],
        (cameras, seed): (usize, u64),
    ) -> Self {
        let mut report = Report { seed, ..Report::default() };
        let truth = truth.unwrap_or(&[]);
        let unit_m = bring_to_metres(truth, &mut estimate, cameras);
        report.set_trajectory(trajectory_figures(truth, &estimate), unit_m);
        report.set_single_picture_sigma(sigmas.iter().map(|sigma| sigma * unit_m));
        let without_ate = report.not_measurable.get("tracking.ate_m").cloned();
        let own = |(path, reason): (String, String)| Some((path.strip_prefix("tracking.")?.to_owned(), reason));
        let not_measurable = report.not_measurable.into_iter().filter_map(own).collect();
        Self { tracking: report.tracking, is_one_camera: cameras == 1, without_ate, not_measurable }
    }

    /// Every figure under its name in a report; null where it is not measurable.
    pub fn json(&self) -> Map<String, Value> {
        let all = json!(self.tracking);
        NAMES.iter().map(|&name| (name.to_owned(), all[name].clone())).collect()
    }

    /// Why figures are null, by their names.
    pub fn reasons(&self) -> Map<String, Value> {
        let named = |(name, reason): (&String, &String)| {
            NAMES.contains(&name.as_str()).then(|| (name.clone(), Value::from(reason.clone())))
        };
        self.not_measurable.iter().filter_map(named).collect()
    }
}

impl fmt::Display for TrackFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |value_m: Option<f64>| value_m.map_or("not measurable".to_owned(), words::mm);
        let how = if self.is_one_camera { " (scale aligned)" } else { "" };
        match &self.without_ate {
            None => write!(f, "ATE {}{how}, ", mm(self.tracking.ate_m))?,
            Some(reason) => write!(f, "no ATE ({reason}), ")?,
        }
        write!(f, "RPE over 1 s {}, ", mm(self.tracking.rpe_m))?;
        let frame = mm(self.tracking.jitter_frame_m);
        write!(f, "jitter frame {frame}, jitter d2 {}", words::jitter(&self.tracking))
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
        let one = TrackFigures::of(Some(&truth), half.clone(), &[0.003, 0.004], (1, 1));
        let json = one.json();
        assert!((json["scale_sim3"].as_f64().unwrap() - 2.0).abs() < 1e-12, "{json:?}");
        // sqrt((3^2 + 4^2) / 2) mm of a map whose unit is 2 m.
        assert!((json["single_picture_sigma_m"].as_f64().unwrap() - 2e-3 * 12.5_f64.sqrt()).abs() < 1e-12, "{json:?}");
        for key in ["ate_m", "ate_sim3_m", "rpe_m", "jitter_frame_m", "jitter_d2_m"] {
            assert!(json[key].as_f64().unwrap() < 1e-12, "{key}: {json:?}");
        }
        assert!(
            one.to_string().contains("(scale aligned)") && one.to_string().contains("given the map 7.071 mm"),
            "{one}"
        );
        let two = TrackFigures::of(Some(&truth), half, &[], (2, 1));
        let json = two.json();
        assert!(json["ate_m"].as_f64().unwrap() > 0.1 && json["ate_sim3_m"].as_f64().unwrap() < 1e-12, "{json:?}");
        assert!(json["single_picture_sigma_m"].is_null() && !two.to_string().contains("scale aligned"), "{two}");
    }

    #[test]
    fn a_rig_at_rest_has_its_jitter_and_no_position_error() {
        let (truth, shaken) = (path(|_| DVec3::ONE), path(|t_s| DVec3::new(1e-3 * libm::sin(700.0 * t_s), 0.0, 0.0)));
        let figures = TrackFigures::of(Some(&truth), shaken, &[], (2, 1));
        let json = figures.json();
        assert!(json["ate_m"].is_null() && json["jitter_still_m"].as_f64().unwrap() > 1e-4, "{json:?}");
        assert!(figures.to_string().contains("without alignment, 0.0 % of steps under 1 um"), "{figures}");
        let unknown = TrackFigures::of(None, path(curve), &[], (2, 1)).json();
        assert!(unknown.values().all(Value::is_null), "{unknown:?}");
        let reasons = TrackFigures::of(None, path(curve), &[], (2, 1)).reasons();
        assert!(unknown.keys().all(|name| reasons.contains_key(name)), "a null without a reason: {reasons:?}");
    }
}
