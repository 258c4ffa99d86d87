//! Corrects the rotation of a predicted pose by a vote: the rotation under which most landmarks of the previous frame meet a matching
//! keypoint.
//!
//! A prediction's error is mostly a rotation, which shifts the whole picture. Repetitive texture offers a landmark several
//! equal matches. True matches agree on the shift; false ones do not, since the period in pixels varies with depth and slant.
//! So the shift is voted on before single matches are chosen.

use glam::{DMat3, DVec2, DVec3};

use super::answer::TrackerWork;
use super::localiser::Localiser;
use crate::num::{index, u32_from, u64_from};
use crate::pose::Pose;
use crate::so3;
use crate::tracker::matching::Distances;
use crate::tracker::row_motion::Moving;

/// Edge of a bin of shifts, and bins on each side of none.
const BIN_PX: f64 = 2.0;
const REACH_BINS: u32 = 16;
const SIDE_BINS: u32 = 2 * REACH_BINS + 1;
/// Least number of votes in a bin and its neighbours, and least share of all votes (one in this many), for a clear result.
const VOTES_MIN: u32 = 20;
const VOTES_SHARE: u32 = 4;

/// The prediction turned by the shift that most landmarks of the frame before vote for; `None` where the vote is not clear.
pub fn turned(frame: &Localiser<'_>, predicted: &Moving, work: &mut TrackerWork) -> Option<Moving> {
    let rotation = DMat3::from_quat(predicted.body_from_world.rotation);
    let recent: Vec<usize> =
        (0..frame.map.landmarks.len()).filter(|&l| frame.map.landmarks[l].last_frame + 1 >= frame.number).collect();
    let mut best: Option<(u32, usize, DVec2)> = None;
    let (mut near, mut distances) = (Vec::new(), Vec::new());
    for (camera, view) in frame.views.iter().enumerate() {
        let mut votes = vec![0_u32; index(SIDE_BINS * SIDE_BINS)];
        let mut cast = 0;
        for &number in &recent {
            let landmark = &frame.map.landmarks[number];
            let in_body_m = rotation * landmark.position_m + predicted.body_from_world.translation_m;
            work.projections += 1;
            let Some(position_px) = view.project(&frame.cameras[camera], in_body_m, predicted) else { continue };
            near.clear();
            near.extend(view.near(position_px, BIN_PX * f64::from(REACH_BINS)));
            let others = near.iter().map(|&keypoint: &usize| &view.keypoints[keypoint].descriptor);
            Distances { own: &landmark.descriptors, others, least: &mut distances }.fill();
            work.descriptors_compared += u64_from(distances.len() * landmark.descriptors.len());
            let Some(&least) = distances.iter().min() else { continue };
            if least > frame.params.distance_bits_max {
                continue;
            }
            cast += 1;
            // Equals to within noise vote alike.
            for (&keypoint, _) in near.iter().zip(&distances).filter(|(_, distance)| **distance <= least + EQUAL_BITS) {
                let shift_px = view.keypoints[keypoint].position_px - position_px;
                bin(shift_px).into_iter().for_each(|bin| votes[bin] += 1);
            }
        }
        let Some((count, shift_px)) = peak(&votes) else { continue };
        if count >= VOTES_MIN && VOTES_SHARE * count >= cast && best.is_none_or(|(most, ..)| count > most) {
            best = Some((count, camera, shift_px));
        }
    }
    let (_, camera, shift_px) = best?;
    let camera = &frame.cameras[camera];
    // A turn about the camera's y moves the picture along x, one about its x along y.
    let angles = DVec3::new(-shift_px.y, shift_px.x, 0.0) / camera.focal_px;
    let turn = Pose::new(so3::exp(angles), DVec3::ZERO);
    let in_body = camera.calibration.body_from_camera.then(&turn).then(&camera.camera_from_body);
    Some(Moving { body_from_world: in_body.then(&predicted.body_from_world), ..*predicted })
}

/// Distances that differ by no more than this count as equal: two standard deviations of 256 bits at one in twelve.
const EQUAL_BITS: u32 = 9;

fn bin(shift_px: DVec2) -> Option<usize> {
    let of = |value_px: f64| {
        let bin = crate::num::i64_half_even(value_px / BIN_PX) + i64::from(REACH_BINS);
        u32::try_from(bin).ok().filter(|&bin| bin < SIDE_BINS)
    };
    Some(index(of(shift_px.y)? * SIDE_BINS + of(shift_px.x)?))
}

/// The bin with most votes, its neighbours included, and their number. Ties go to the smaller shift.
fn peak(votes: &[u32]) -> Option<(u32, DVec2)> {
    let side = index(SIDE_BINS);
    let mut best: Option<(u32, u32, DVec2)> = None;
    for row in 1..side - 1 {
        for column in 1..side - 1 {
            let around = (row - 1..=row + 1).flat_map(|r| votes[r * side + column - 1..=r * side + column + 1].iter());
            let count: u32 = around.sum();
            let [x, y] = [column, row].map(|bin| u32_from(bin).abs_diff(REACH_BINS));
            let away = x * x + y * y;
            if best.is_none_or(|(most, least, _)| count > most || (count == most && away < least)) {
                let centre = |k: usize| BIN_PX * (f64::from(u32_from(k)) - f64::from(REACH_BINS));
                best = Some((count, away, DVec2::new(centre(column), centre(row))));
            }
        }
    }
    best.map(|(count, _, shift_px)| (count, shift_px))
}
