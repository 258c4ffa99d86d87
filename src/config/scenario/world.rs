//! What is looked at, and how the rig that looks moves: keys of `[scene]`, `[motion]` and `[rig]`.

use serde::{Deserialize, Serialize};

sections! {
    /// What is looked at: exactly one of `file`, `generator`, `target`.
    Scene {
        /// A glTF binary in the scenario's folder.
        file: Option<String>,
        /// A scene made by code: "box".
        generator: Option<String>,
        /// A calibration target: "flat".
        target: Option<String>,
        /// On a horizontal plane at the camera's start; for targets, on the target's plane. Above 0, to 200,000.
        illuminance_lux: f64,
        /// "D65", "A", "E", "FL11", "LED-B3", "D55", "FL2", "LED-B4", "LED-B5".
        illuminant: Option<String>,
        /// Instead of `illuminant`: a black body of this temperature in kelvin, 1000 to 20000.
        blackbody_k: Option<f64>,
        /// "scaled": all light by one factor, so that it gives `illuminance_lux`. "absolute": as lamps and sky state it, in lumens and lux.
        light_level: String,
        /// Light from all around: an equirectangular OpenEXR picture in the scenario's folder; its middle column lies towards -z.
        environment: Option<String>,
        /// Turns the picture about the vertical, to the right as seen from inside, -360 to 360.
        environment_yaw_deg: f64,
        /// Sun and sky by code, instead of a picture.
        sky: Sky,
        /// Lamps beside those that the scene has.
        lamp: Vec<crate::scene::Lamp>,
        /// How lamps flicker.
        flicker: FlickerKeys,
        /// "full": light after all bounces. "direct": only what lamps and sky send straight, in a fraction of the time.
        bake: String,
        /// A bake that takes more rays than this is refused beforehand, 1e6 to 1e13.
        bake_rays_max: f64,
        /// A bake that holds more than this many megabytes at once is refused beforehand, 16 to 1,000,000.
        bake_memory_mb_max: f64,
        /// Of targets, 0 to 1.
        reflectance: f64,
        /// Light that a geometry file does not hold: sky, lamps' strength, glowing panels.
        surroundings: crate::scene::Surroundings,
    }
    /// Sun and sky by code.
    Sky {
        /// "none", "overcast" or "clear" (with a sun).
        kind: String,
        /// Of the sun above the horizon, 1 to 90. It decides how bright an overcast sky is as well.
        sun_elevation_deg: f64,
        /// Clockwise from -z as seen from above (90: +x), -360 to 360.
        sun_azimuth_deg: f64,
        /// Pattern of the sky, one of the CIE's fifteen types; 0: type 1 for "overcast", 12 for "clear".
        cie_type: u32,
        /// Share of the light that the ground beyond the scene sends back up, 0 to 0.9.
        ground_reflectance: f64,
    }
    /// How lamps flicker.
    FlickerKeys {
        /// "none", "sine", "rectified_sine" or "pwm".
        waveform: String,
        /// Periods of the light in a second (100 on a mains of 50 Hz), 0.01 to 10,000,000.
        frequency_hz: f64,
        /// Share of the light that follows the waveform, 0 to 1.
        modulation: f64,
        /// Share of the period in which "pwm" is on, above 0 to 1.
        duty: f64,
        /// Place in the period at time 0, -360 to 360.
        phase_deg: f64,
        /// Whether the scene's own lamps (glowing surfaces of its file or code; panels of the surroundings never) flicker as well.
        own_lamps: bool,
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
