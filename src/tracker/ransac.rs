//! Keyed RANSAC over P3P samples: the pose that most measurements agree on. Equal keys give equal poses.

use glam::DVec3;
use rand::seq::IndexedRandom;

use crate::draw::DrawKey;
use crate::num::{f64_from_usize, index, u32_from};
use crate::pose::Pose;
use crate::tracker::p3p;
use crate::tracker::refine::{PointMeasurement, errors2};
use crate::tracker::rig::RigCamera;
use crate::tracker::row_motion::Moving;
use crate::units::CameraIndex;

/// Limits of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RansacSettings {
    /// Samples drawn at most.
    pub samples_max: u32,
    /// Wanted probability that one sample was free of outliers.
    pub confidence: f64,
    /// Squared error in sigmas up to which a measurement agrees.
    pub gate_sigmas2: f64,
}

/// The best pose found.
#[derive(Clone, Debug)]
pub struct Consensus {
    /// Pose of the body.
    pub body_from_world: Pose,
    /// Which measurements agree.
    pub agrees: Vec<bool>,
    /// Their number.
    pub agreeing: u32,
    /// Samples drawn.
    pub samples: u32,
}

/// Searches; `None` where no sample gave a pose. Samples are drawn within one camera, votes are counted over all.
pub fn search(
    cameras: &[RigCamera],
    (measurements, bearings): (&[PointMeasurement], &[DVec3]),
    key: DrawKey,
    limits: RansacSettings,
) -> Option<Consensus> {
    let of_camera = |camera: u32| -> Vec<usize> {
        (0..measurements.len()).filter(|&m| measurements[m].camera == CameraIndex(camera)).collect()
    };
    let groups: Vec<Vec<usize>> =
        (0..u32_from(cameras.len())).map(of_camera).filter(|group| group.len() >= 3).collect();
    if groups.is_empty() {
        return None;
    }
    let mut stream = key.stream();
    let mut best: Option<Consensus> = None;
    let (mut sample, mut needed) = (0, limits.samples_max);
    while sample < needed {
        let group = &groups[index(sample) % groups.len()];
        sample += 1;
        let triple: [usize; 3] = group.sample_array(&mut stream).expect("groups have three members or more");
        let camera = &cameras[index(measurements[triple[0]].camera.0)];
        let points_m = triple.map(|m| measurements[m].point_in_world_m);
        for camera_from_world in p3p::solve(&triple.map(|m| bearings[m]), &points_m) {
            let body_from_world = camera.calibration.body_from_camera.then(&camera_from_world);
            let errors2 = errors2(cameras, measurements, &Moving::resting(body_from_world));
            let agrees: Vec<bool> = errors2.iter().map(|&error2| error2 <= limits.gate_sigmas2).collect();
            let agreeing = u32_from(agrees.iter().filter(|&&agrees| agrees).count());
            if best.as_ref().is_none_or(|best| agreeing > best.agreeing) {
                let share = f64::from(agreeing) / f64_from_usize(measurements.len());
                needed = needed.min(samples_needed(share, limits));
                best = Some(Consensus { body_from_world, agrees, agreeing, samples: 0 });
            }
        }
    }
    best.map(|best| Consensus { samples: sample, ..best })
}

/// Samples after which one was free of outliers with the wanted probability.
fn samples_needed(inlier_share: f64, limits: RansacSettings) -> u32 {
    let good = inlier_share * inlier_share * inlier_share;
    if good >= 1.0 - 1e-9 {
        return 1;
    }
    let needed = libm::ceil(libm::log(1.0 - limits.confidence) / libm::log1p(-good));
    if needed < f64::from(limits.samples_max) { crate::num::u32_truncated(needed).max(1) } else { limits.samples_max }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::lie::{Twist, se3_exp};
    use glam::DVec2;

    const LIMITS: RansacSettings = RansacSettings { samples_max: 400, confidence: 0.999, gate_sigmas2: 9.21 };

    #[test]
    fn half_of_the_matches_wrong_still_gives_the_pose_and_equal_keys_give_equal_answers() {
        let cameras = [RigCamera::vga_pinhole([320.0, 240.0])];
        let truth = se3_exp(Twist::from_array([0.3, -0.2, 0.1, 0.2, -0.4, 0.9]));
        let number = |n: u32, k: u32| f64::from((n * 7_919 + k * 104_729) % 1_000) / 500.0 - 1.0;
        let (mut measurements, mut bearings) = (Vec::new(), Vec::new());
        for n in 0..100 {
            let in_body_m = DVec3::new(number(n, 1), number(n, 2), 2.5 + number(n, 3));
            let wrong_px = if n % 2 == 0 { 0.0 } else { 30.0 + 90.0 * number(n, 4).abs() };
            let position_px = cameras[0].project_with_jacobian(in_body_m).unwrap().0 + DVec2::new(wrong_px, -wrong_px);
            let point_in_world_m = truth.inverse().point(in_body_m);
            let (camera, inverse_sigma, offset_s) = (CameraIndex(0), 1.0, 0.0);
            measurements.push(PointMeasurement { camera, point_in_world_m, position_px, inverse_sigma, offset_s });
            bearings.push(cameras[0].calibration.lens.unproject(position_px).unwrap());
        }
        let found = |key| search(&cameras, (&measurements, &bearings), DrawKey(key), LIMITS).unwrap();
        let (first, again) = (found(5), found(5));
        assert_eq!((first.body_from_world, first.samples), (again.body_from_world, again.samples));
        // A clean sample is one in eight; 400 samples miss all of them once in 10^23.
        assert!(first.agreeing >= 50, "{} agree", first.agreeing);
        assert!((first.body_from_world.translation_m - truth.translation_m).length() < 1e-6);
        assert!(search(&cameras, (&measurements[..2], &bearings[..2]), DrawKey(1), LIMITS).is_none());
        assert!(search(&cameras, (&[], &[]), DrawKey(1), LIMITS).is_none());
    }
}
