//! Writes the tracker's landmarks (metres, or the map's own unit) as a PLY point cloud (Turk, "The PLY Polygon File Format", 1994).

use std::fmt::Write as _;

use crate::tracker::Landmark;

/// The landmarks as ASCII PLY: position in the tracker's world, the number of the landmark, frames that found it, keyframes that saw it.
pub fn ply(landmarks: &[Landmark]) -> String {
    let mut text = String::from("ply\nformat ascii 1.0\ncomment landmarks of a tracker, in its own world\n");
    let _ = writeln!(text, "element vertex {}", landmarks.len());
    text.push_str("property double x\nproperty double y\nproperty double z\n");
    text.push_str("property uint landmark\nproperty uint frames_found\nproperty uint keyframes\nend_header\n");
    for landmark in landmarks {
        let [x_m, y_m, z_m] = landmark.position_m.to_array();
        let (id, found, keyframes) = (landmark.id, landmark.found, landmark.keyframe_count());
        // Shortest decimals that give the same bits back.
        let _ = writeln!(text, "{x_m} {y_m} {z_m} {id} {found} {keyframes}");
    }
    text
}
