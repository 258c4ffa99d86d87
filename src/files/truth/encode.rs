//! Encodes ground-truth planes (metres, pixels) and poses as PNG in the benchmarks' units, and as CSV.

use std::fmt::Write as _;
use std::path::Path;

use image::{DynamicImage, ImageBuffer};

use super::super::picture::save;
use crate::error::Error;
use crate::num::{f64_from_u64, low_u16, u32_truncated, u64_half_even};
use crate::optics::truth::{Matches, TruthView};
use crate::plane::Plane;

/// Steps a metre of kept depth: the TUM RGB-D benchmark's, so that 65,535 is 13.1 m.
pub(super) const DEPTH_STEPS_PER_M: f32 = 5000.0;

/// Steps a pixel of flow, and the step of no flow: the KITTI benchmark's, so that -512 to 511.98 px can be said.
pub(super) const FLOW_STEPS_PER_PX: f64 = 64.0;
pub(super) const FLOW_ZERO_STEPS: f64 = 32_768.0;

/// Depth along the axis in steps of 0.2 mm; 0 where nothing is hit, beyond 13.1 m, and beside or behind the camera.
pub(super) fn depth_steps(depth_m: &Plane<f32>) -> Plane<u16> {
    depth_m.map(|depth_m| {
        let steps = f64::from(depth_m * DEPTH_STEPS_PER_M) + 0.5;
        if steps < f64_from_u64(65_536) { low_u16(u32_truncated(steps)) } else { 0 }
    })
}

/// KITTI's flow: red is the column's displacement, green the row's, blue 1 where there is one that the steps can say.
pub(super) fn flow_steps(found: &Matches) -> Vec<u16> {
    let step = |shift_px: f32| {
        let steps = f64::from(shift_px) * FLOW_STEPS_PER_PX + FLOW_ZERO_STEPS;
        (0.0..=65_535.0).contains(&steps).then(|| u16::try_from(u64_half_even(steps)).expect("compared above"))
    };
    let both = found.dx_px.values().iter().zip(found.dy_px.values());
    both.flat_map(|(&dx_px, &dy_px)| match (step(dx_px), step(dy_px)) {
        (Some(u), Some(v)) => [u, v, 1],
        _ => [0; 3],
    })
    .collect()
}

pub(super) fn write_flow_16(file: &Path, found: &Matches) -> Result<(), Error> {
    let size = found.dx_px.size();
    let buffer = ImageBuffer::from_raw(size.width_px, size.height_px, flow_steps(found));
    save(file, &DynamicImage::ImageRgb16(buffer.expect("three numbers per pixel")))
}

/// One line a row: time and `world_from_camera` at the middle of its exposure, in digits that return to the same bits.
pub(super) fn pose_table(view: &TruthView<'_>) -> String {
    let mut text = String::from("row,t_s,px_m,py_m,pz_m,qx,qy,qz,qw\n");
    for (row, (t_s, pose)) in view.row_times_s().iter().zip(view.row_poses()).enumerate() {
        let (p, q) = (pose.translation_m, pose.rotation);
        writeln!(text, "{row},{t_s},{},{},{},{},{},{},{}", p.x, p.y, p.z, q.x, q.y, q.z, q.w)
            .expect("writing to a string cannot fail");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::f32_nearest;
    use crate::optics::truth::Visibility;
    use crate::units::Size;

    #[test]
    fn steps_of_depth_and_flow_are_those_of_the_benchmarks() {
        let size = Size { width_px: 7, height_px: 1 };
        let depth_m = [0.0, -2.0, 1.0, 0.000_11, 13.107, 13.2, f32::INFINITY];
        let steps = depth_steps(&Plane::from_values(size, depth_m.to_vec()));
        assert_eq!(steps.values(), [0, 0, 5000, 1, 65_535, 0, 0]);
        let dx_px = [0.0, 1.0, -512.0, 511.984_375, 512.0, f32::NAN, -3.25];
        let dy_px = [0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.25];
        let planes =
            [dx_px, dy_px].map(|values| Plane::from_values(size, values.map(|v| f32_nearest(v.into())).to_vec()));
        let [dx_px, dy_px] = planes;
        let found = Matches { dx_px, dy_px, seen: Plane::filled(size, Visibility::Visible) };
        let steps = flow_steps(&found);
        let expected = [
            [32_768, 32_768, 1],
            [32_832, 32_800, 1],
            [0, 32_768, 1],
            [65_535, 32_768, 1],
            [0; 3],
            [0; 3],
            [32_560, 32_784, 1],
        ];
        assert_eq!(steps, expected.concat());
    }
}
