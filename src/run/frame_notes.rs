//! What the report needs to know of each frame at the end.

use super::code_sums::{CodeSums, saturated_dn};
use super::state::{Frame, Session};
pub(super) use super::totals::FrameNotes;
use crate::num::{f64_from_u64, f64_from_u128, u32_from, u64_from};
use crate::pose::{Pose, TimedPose};
use crate::readout::Schedule;

impl Session {
    pub(super) fn note(&mut self, frame: &Frame, schedule: &Schedule) {
        let (mut sums, saturated_dn) = (CodeSums::default(), saturated_dn(&self.setup, self.gain));
        for camera in &frame.cameras {
            if self.hashes_pictures {
                self.totals.hashes.add(&camera.photons, &camera.codes);
            }
            self.totals.hashes.add_features(&camera.features);
            self.totals.feature_count += u64_from(camera.features.len());
            sums.add(CodeSums::of(&camera.codes, saturated_dn));
        }
        self.totals.codes.add(sums);
        let tracked = frame.tracked.as_ref();
        tracked.iter().for_each(|tracked| self.totals.hashes.add_pose(tracked));
        let predicted = tracked.and_then(|tracked| tracked.predicted_position_m).map(|translation_m| TimedPose {
            t_s: frame.t_s,
            world_from_body: Pose { translation_m, ..Pose::IDENTITY },
        });
        let mean_code_dn = sums.mean_dn();
        self.setup.exposure.after_frame(frame.frame, mean_code_dn);
        self.notes.push(FrameNotes {
            truth: TimedPose { t_s: frame.t_s, world_from_body: frame.truth },
            estimate: tracked.and_then(|tracked| tracked.world_from_body),
            predicted,
            mean_code_dn,
            exposure_us: 1e6 * schedule.exposure_s(),
            gain: self.gain,
            found: frame.cameras.iter().map(|camera| u32_from(camera.features.len())).collect(),
            tracked: tracked.map_or(0, |tracked| tracked.tracked_features),
            innovation_px: tracked.and_then(|tracked| tracked.innovation_px),
            single_picture_sigma_m: tracked.and_then(|tracked| tracked.single_picture_sigma_m),
            status: tracked.map(|tracked| tracked.status),
            loop_closed: tracked.is_some_and(|tracked| tracked.loop_closed),
            link_bits: 0.0,
            energy_pj: 0.0,
            latency_us: 1e6 * self.totals.link.frame_latency_s,
        });
        self.note_own_costs();
    }

    /// Bits and energy of the last frame alone.
    fn note_own_costs(&mut self) {
        let (energy_aj, link_bytes) = (self.energy().total_aj(), self.totals.link.traffic.link_bytes);
        let spent_aj = energy_aj.saturating_sub(self.totals.energy_before_aj);
        let sent = link_bytes.saturating_sub(self.totals.link_bytes_before);
        (self.totals.energy_before_aj, self.totals.link_bytes_before) = (energy_aj, link_bytes);
        let note = self.notes.last_mut().expect("a frame was noted");
        note.energy_pj = 1e-6 * f64_from_u128(spent_aj);
        note.link_bits = 8.0 * f64_from_u64(sent);
    }
}
