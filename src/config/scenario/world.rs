//! What is looked at, and how the rig that looks moves: keys of `[scene]`, `[motion]` and `[rig]`.

use serde::{Deserialize, Serialize};

sections! {
    /// What is looked at: exactly one of `file`, `generator`, `target`, `images`.
    Scene {
        /// A glTF file (.glb or .gltf) in the scenario's folder.
        file: Option<String>,
        /// Metres of a unit of the file, 1e-6 to 1e6: glTF says metres, a file in centimetres needs 0.01.
        scale: f64,
        /// Axis of the file that points up: "y", as glTF says, or "z".
        up: String,
        /// A scene made by code: "box", "columns", "hall", "photo_box", "street".
        generator: Option<String>,
        /// A calibration target: "flat", "blank_wall", "slanted_edge", "grey_wedge", "checkerboard", "point_sources".
        target: Option<String>,
        /// Pictures from elsewhere: a folder in the scenario's folder, or a list of folders with one for each camera.
        images: Option<Folders>,
        /// What camera the pictures were made with; without it, `K.txt` in their folder or beside it.
        images_camera: Option<ImagesCamera>,
        /// Pictures a second, by the numbers at the end of their names, else by their order; 0.001 to 1,000,000. Without it, a list of
        /// times in their folder: `times.csv`, `times.txt`, `rgb.txt` (TUM), `data.csv` (EuRoC).
        images_fps: Option<f64>,
        /// Time of the pictures at which the run starts, counted from the first of them.
        images_start_s: f64,
        /// What counts between two pictures: "nearest" or "linear" (a mixture).
        images_blend: String,
        /// How values become light: "auto" (sRGB in PNG, linear in OpenEXR), "srgb", "linear".
        images_transfer: String,
        /// A folder in that of the pictures with their depth, one file a picture: grey 16-bit PNG or channel Z of OpenEXR. Without it,
        /// channel Z of the pictures.
        images_depth: Option<String>,
        /// Codes a metre in PNG files of depth (1000: a code is a millimetre; TUM has 5000), 1 to 1,000,000.
        images_depth_per_m: f64,
        /// Illuminance in lux on a horizontal plane at the camera's start; for targets, on the target's plane. Above 0, to 200,000.
        illuminance_lux: f64,
        /// Spectrum of the light: "D65", "A", "E", "FL11", "LED-B3", "D55", "FL2", "LED-B4", "LED-B5".
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
        /// Rigid objects that move, up to 256 with the parts that animations move. They receive light and shade themselves, each other and
        /// (not with `shadows = "baked"`) the static scene. They send no light onto the static scene.
        object: Vec<SceneObject>,
        /// How lamps flicker.
        flicker: FlickerKeys,
        /// "full": light after all bounces. "draft": the same by few rays, for a first look. "sketch": by a quarter of those. "direct":
        /// only what lamps and sky send straight, in a fraction of the time.
        bake: String,
        /// "traced": by rays, edges of shadows of small lamps and the sun, and shadows of objects. "baked": edges as sharp as the bake's
        /// samples, and no shadows of objects, in less time.
        shadows: String,
        /// A bake that takes more rays than this is refused beforehand, 1e6 to 1e13.
        bake_rays_max: f64,
        /// A bake that holds more than this many megabytes at once is refused beforehand, 16 to 1,000,000.
        bake_memory_mb_max: f64,
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
        /// Share of the period in which "pwm" is on, 1e-6 to 1.
        duty: f64,
        /// Phase of the period at time 0, -360 to 360.
        phase_deg: f64,
        /// Whether the scene's own lamps (glowing surfaces of its file or code; panels of the surroundings never) flicker as well.
        own_lamps: bool,
    }
    /// A camera that made pictures: `fx_px`, `fy_px`, `cx_px` and `cy_px`, or `horizontal_fov_deg`.
    ImagesCamera {
        /// Horizontal focal length, 1 to 1,000,000.
        fx_px: Option<f64>,
        /// Vertical focal length, 1 to 1,000,000.
        fy_px: Option<f64>,
        /// Column of the principal point; the first column's centre is 0.
        cx_px: Option<f64>,
        /// Row of the principal point; the first row's centre is 0.
        cy_px: Option<f64>,
        /// Across the whole width, before distortion, 1 to 170; the axis is in the picture's middle.
        horizontal_fov_deg: Option<f64>,
        /// Radial distortion, r^2; 0 where it is not written.
        k1: Option<f64>,
        /// Radial distortion, r^4.
        k2: Option<f64>,
        /// Tangential distortion.
        p1: Option<f64>,
        /// Tangential distortion.
        p2: Option<f64>,
    }
    /// How the rig moves: a `file`, a `kind`, or a file of control poses (`kind = "spline"`).
    Motion {
        /// A TUM trajectory or a EuRoC ground-truth table in the scenario's folder, followed by a smooth spline.
        file: Option<String>,
        /// Without a file: "still", "sway" (a smooth generated motion), "walk", "run", "spin", or "spline" (on the poses of
        /// `[[motion.pose]]`; with a file, on the file's poses).
        kind: Option<String>,
        /// Time in the trajectory at which the run starts, counted from its first pose. 0 to 10,000.
        start_s: f64,
        /// Factor on the translation of a file, of control poses and of the sway, 1e-9 to 100. Walk, run and oscillation are in
        /// metres already.
        scale: f64,
        /// Position of the trajectory's first pose of the run (or of a still rig) in the scene.
        offset_m: [f64; 3],
        /// Rotation from the trajectory's world into the scene's, quaternion x y z w.
        world_from_motion: [f64; 4],
        /// Gaps of a file up to this length are bridged by the path of least acceleration, and the report says so; 0 to 2. (Pauses up
        /// to 0.1 are no gaps.)
        bridge_gaps_s: f64,
        /// Control poses of `kind = "spline"`, evenly spaced in time.
        pose: Option<Vec<MotionPose>>,
        /// Where "walk" and "run" lead: "line", "circle" (to the left) or "loop" (a figure of eight).
        path: String,
        /// Radius of the circle, or of a circle around the loop, in metres, 0.1 to 10,000.
        radius_m: f64,
        /// Speed of "walk" and "run" in m/s, above 0 to 20; not given: 1.4 walking, 3.0 running.
        speed_m_per_s: Option<f64>,
        /// Mean steps a second of "walk" and "run", 0.5 to 4; not given: 2.0 walking, 2.7 running.
        step_rate_hz: Option<f64>,
        /// Standard deviation of the step rate from step to step, 0 to 0.3.
        step_rate_sd_hz: f64,
        /// Names the draws of "walk" and "run": another number, another walk.
        seed: u64,
        /// Rate of "spin" in degrees a second, to the right; -1,800 to 1,800.
        rate_deg_per_s: f64,
        /// Amplitude in millimetres of a sine along which a still rig oscillates, 0 to 1,000; 0: none.
        oscillation_mm: f64,
        /// Frequency of that oscillation in Hz, 0.01 to 50.
        oscillation_hz: f64,
        /// Axis of that oscillation in the still body's frame: "x", "y" or "z".
        oscillation_axis: String,
    }
    /// A rigid object that moves.
    SceneObject {
        /// A glTF file (.glb or .gltf) in the scenario's folder. A model stands with y up and looks along +z, as glTF says.
        file: String,
        /// As reports call it; the file's name if not given.
        name: Option<String>,
        /// Metres of a unit of the file, 1e-6 to 1e6; not given: 1.
        scale: Option<f64>,
        /// Axis of the file that points up: "y" (also if not given) or "z".
        up: Option<String>,
        /// How it moves; not given: it stands.
        motion: Option<ObjectMotion>,
    }
    /// How an object moves, by the keys of `[motion]`, whose defaults hold where one is not given. `offset_m` is the position of the
    /// model's origin at the start. "walk", "run", "spin", "sway" and control poses lead the model's front ahead; a file's poses are
    /// those of the model.
    ObjectMotion {
        /// As `motion.file`.
        file: Option<String>,
        /// As `motion.kind`.
        kind: Option<String>,
        /// As `motion.start_s`.
        start_s: Option<f64>,
        /// As `motion.scale`.
        scale: Option<f64>,
        /// As `motion.offset_m`.
        offset_m: Option<[f64; 3]>,
        /// As `motion.world_from_motion`.
        world_from_motion: Option<[f64; 4]>,
        /// As `motion.bridge_gaps_s`.
        bridge_gaps_s: Option<f64>,
        /// As `[[motion.pose]]`.
        pose: Option<Vec<MotionPose>>,
        /// As `motion.path`.
        path: Option<String>,
        /// As `motion.radius_m`.
        radius_m: Option<f64>,
        /// As `motion.speed_m_per_s`.
        speed_m_per_s: Option<f64>,
        /// As `motion.step_rate_hz`.
        step_rate_hz: Option<f64>,
        /// As `motion.step_rate_sd_hz`.
        step_rate_sd_hz: Option<f64>,
        /// As `motion.seed`.
        seed: Option<u64>,
        /// As `motion.rate_deg_per_s`.
        rate_deg_per_s: Option<f64>,
        /// As `motion.oscillation_mm`.
        oscillation_mm: Option<f64>,
        /// As `motion.oscillation_hz`.
        oscillation_hz: Option<f64>,
        /// As `motion.oscillation_axis`.
        oscillation_axis: Option<String>,
    }
    /// A control pose. Without an orientation the body looks level along the trajectory world's -z.
    MotionPose {
        /// Time in the trajectory.
        t_s: f64,
        /// In the trajectory's world.
        position_m: [f64; 3],
        /// Of the body in the trajectory's world, quaternion x y z w.
        orientation: Option<[f64; 4]>,
        /// Or: of a rig (x right, y down, z forward) in a world with y up, turned from looking along -z to the right, then
        /// nose up, then clockwise.
        yaw_pitch_roll_deg: Option<[f64; 3]>,
    }
    /// Cameras and IMU on the body.
    Rig {
        /// Distance between the two cameras; 0: one camera. 0 to 10,000.
        baseline_mm: Option<f64>,
        /// Instead: any number of cameras, 1 to 16. The lens is common to all of them.
        camera: Option<Vec<RigCamera>>,
        /// Rotation from the rig (x right, y down, z forward) into the body that the trajectory describes, quaternion x y z w.
        body_from_rig: [f64; 4],
        /// Preset of the IMU: "mems_phone", "adis16448", "ideal" (no noise) or "none".
        imu: String,
        /// Readings a second, 1 to 10,000.
        imu_rate_hz: f64,
        /// Position of the IMU in the rig, each within 10,000; its axes are the body's.
        imu_position_mm: [f64; 3],
    }
    /// A camera of the rig. Without an orientation it looks along the rig's z axis.
    RigCamera {
        /// In the rig (x right, y down, z forward), each within 10,000.
        position_mm: [f64; 3],
        /// Rotation from the camera (x right, y down, z forward) into the rig, quaternion x y z w.
        orientation: Option<[f64; 4]>,
        /// Or: turned from the rig's to the right, then nose up, then clockwise.
        yaw_pitch_roll_deg: Option<[f64; 3]>,
    }
}

/// One folder, or one for each camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a folder, or a list of folders with one for each camera")]
pub enum Folders {
    /// Of the only camera.
    One(String),
    /// In the order of the cameras.
    Each(Vec<String>),
}

impl Folders {
    /// The folders in the order of the cameras.
    pub fn list(&self) -> &[String] {
        match self {
            Self::One(folder) => std::slice::from_ref(folder),
            Self::Each(folders) => folders,
        }
    }
}

impl Scene {
    /// Whether the scenario says what is looked at.
    pub fn is_named(&self) -> bool {
        self.file.is_some() || self.generator.is_some() || self.target.is_some() || self.images.is_some()
    }
}
