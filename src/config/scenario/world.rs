//! What is looked at, and how the rig that looks moves: keys of `[scene]`, `[motion]` and `[rig]`.

use serde::{Deserialize, Serialize};

sections! {
    /// What is looked at: exactly one of `file`, `generator`, `target`.
    Scene {
        /// A glTF binary in the scenario's folder.
        file: Option<String>,
        /// A scene made by code: "box", "hall", "photo_box", "street".
        generator: Option<String>,
        /// A calibration target: "flat", "blank_wall", "slanted_edge", "grey_wedge", "checkerboard", "point_sources".
        target: Option<String>,
        /// On a horizontal plane at the camera's start; for targets, on the target's plane. Above 0, to 200,000.
        illuminance_lux: f64,
        /// "D65", "A", "E", "FL11", "LED-B3".
        illuminant: String,
        /// Of targets, 0 to 1: the mean of light and dark; of a grey wedge, its lightest step.
        reflectance: f64,
        /// From the rig's origin to a target's board; 0.01 to 10,000, not given: 1.
        target_distance_m: Option<f64>,
        /// Edge of a target's board; 0.001 to 10,000, not given: twice the distance.
        target_size_m: Option<f64>,
        /// Of a slanted edge, from the vertical; -45 to 45, not given: 5.
        target_angle_deg: Option<f64>,
        /// Light over dark; 1 to 10,000, not given: 4 (slanted edge, as ISO 12233:2017), 10 (checkerboard), 40 (wedge, first over last).
        target_contrast: Option<f64>,
        /// Steps of a grey wedge, equal in density; 2 to 64, not given: 12, as ISO 14524.
        target_steps: Option<f64>,
        /// Edge of a checkerboard's squares, distance between point sources; not given: an eighth of the board.
        target_square_m: Option<f64>,
        /// Diameter of point sources; not given: a fiftieth of their distance.
        target_point_m: Option<f64>,
        /// Luminous intensity of each point source, straight ahead; 0 to 1,000,000, not given: 0.01.
        target_point_cd: Option<f64>,
        /// Light that a geometry file does not hold: sky, lamps' strength, glowing panels.
        surroundings: crate::scene::Surroundings,
    }
    /// How the rig moves.
    Motion {
        /// A TUM trajectory in the scenario's folder, followed by a smooth spline.
        file: Option<String>,
        /// Without a file: "still" or "sway" (a smooth generated motion).
        kind: String,
        /// Time in the trajectory at which the run starts, counted from its first pose.
        start_s: f64,
        /// Factor on the trajectory's translation, above 0.
        scale: f64,
        /// Place of the trajectory's first pose of the run (or of a still rig) in the scene.
        offset_m: [f64; 3],
        /// Rotation from the trajectory's world into the scene's, quaternion x y z w.
        world_from_motion: [f64; 4],
    }
    /// Cameras and IMU on the body.
    Rig {
        /// Distance between the two cameras; 0: one camera.
        baseline_mm: f64,
        /// Rotation from the rig (x right, y down, z forward) into the body that the trajectory describes, quaternion x y z w.
        body_from_rig: [f64; 4],
        /// Preset of the inertial unit: "mems_phone" or "none".
        imu: String,
    }
}
