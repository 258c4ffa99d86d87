//! A synthetic stereo world: points on the walls of a room, keyed descriptors with flipped bits, noisy positions, missed and false
//! corners, and a lively hand. Everything is a function of its seed.

use glam::{DQuat, DVec2, DVec3};
use rand::seq::SliceRandom;
use sensel::compute::Feature;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_u64, low_u8, low_u32, u32_truncated, u64_from};
use sensel::optics::lens::{Intrinsics, Kb4, Lens, Mapping, Radtan};
use sensel::pose::Pose;
use sensel::so3;
use sensel::tracker::{CameraCalibration, FrameInput, RowClock};
use sensel::units::Size;
use sensel::words::{PositionPx, Turns};

/// Frames a second.
pub const RATE_HZ: f64 = 30.0;

/// What the world does to the tracker.
#[derive(Clone, Copy, Debug)]
pub struct Hardship {
    /// Standard deviation of a position per axis in pixels; the feature format's rounding comes on top.
    pub noise_px: f64,
    /// Share of descriptor bits flipped in each view.
    pub flipped: f64,
    /// Share of visible points that are not detected.
    pub missed: f64,
    /// False corners as a share of the true ones.
    pub spurious: f64,
}

/// Half a pixel, one bit in twelve, one point in five missed and one corner in six false.
pub const USUAL: Hardship = Hardship { noise_px: 0.5, flipped: 0.08, missed: 0.2, spurious: 0.2 };

/// A point with a look of its own.
#[derive(Clone, Copy, Debug)]
pub struct Landmark {
    pub position_m: DVec3,
    pub look: DrawKey,
}

/// Points, cameras and troubles.
pub struct World {
    pub seed: u64,
    pub landmarks: Vec<Landmark>,
    pub cameras: Vec<CameraCalibration>,
    pub hardship: Hardship,
    pub features_max: usize,
}

/// Time of a frame.
pub fn time_s(number: u64) -> f64 {
    f64_from_u64(number) / RATE_HZ
}

/// A normal number (Box-Muller).
pub fn normal(key: DrawKey) -> f64 {
    let (u, v) = (1.0 - key.with(0).uniform(), key.with(1).uniform());
    (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
}

/// Two VGA cameras 65 mm apart, slightly turned against each other, 90 degrees wide, mild barrel distortion.
pub fn stereo_rig() -> Vec<CameraCalibration> {
    let size = Size { width_px: 640, height_px: 480 };
    let camera = |x_m: f64, turn: DVec3, fx_px: f64| CameraCalibration {
        lens: Lens {
            intrinsics: Intrinsics { fx_px, fy_px: fx_px + 0.7, cx_px: 321.3, cy_px: 238.4 },
            mapping: Mapping::Radtan(Radtan { k1: -0.03, k2: 0.004, p1: 0.0003, p2: -0.0002, k3: 0.0 }),
        },
        size,
        body_from_camera: Pose::new(so3::exp(turn), DVec3::new(x_m, 0.002, 0.001)),
    };
    vec![
        camera(-0.0325, DVec3::new(0.003, 0.004, -0.002), 320.0),
        camera(0.0325, DVec3::new(-0.002, -0.006, 0.004), 321.5),
    ]
}

/// The first of these cameras alone, at the body's origin.
pub fn mono_rig() -> Vec<CameraCalibration> {
    let mut rig = stereo_rig();
    rig.truncate(1);
    rig[0].body_from_camera.translation_m = DVec3::ZERO;
    rig
}

/// The same poses of the cameras, with fisheyes of TUM-VI's shape that see some 120 degrees off the axis in the picture's corners.
pub fn fisheye_rig() -> Vec<CameraCalibration> {
    let coefficients = [0.003_482_389_4, 0.000_715_034_8, -0.002_053_236_1, 0.000_202_936_7];
    let mut rig = stereo_rig();
    for camera in &mut rig {
        camera.lens.mapping = Mapping::Kb4(Kb4::new(coefficients));
        (camera.lens.intrinsics.fx_px, camera.lens.intrinsics.fy_px) = (191.0, 190.9);
    }
    rig
}

/// Half extents of the room: 5 x 2.5 x 2.8 m, y down.
pub const ROOM_M: DVec3 = DVec3::new(2.5, 1.25, 1.4);

/// Points spread evenly over the six walls.
pub fn room(seed: u64, count: u64) -> Vec<Landmark> {
    let key = DrawKey::root(seed).with(1);
    let areas = [ROOM_M.y * ROOM_M.z, ROOM_M.x * ROOM_M.z, ROOM_M.x * ROOM_M.y];
    (0..count)
        .map(|number| {
            let key = key.with(number);
            let mut pick = key.with(0).uniform() * (areas[0] + areas[1] + areas[2]);
            let axis = if pick < areas[0] {
                0
            } else if pick < areas[0] + areas[1] {
                1
            } else {
                2
            };
            pick = key.with(1).uniform();
            let mut position = [2, 3, 4].map(|field| 2.0 * key.with(field).uniform() - 1.0);
            position[axis] = if pick < 0.5 { -1.0 } else { 1.0 };
            Landmark { position_m: DVec3::from_array(position) * ROOM_M, look: key.with(9) }
        })
        .collect()
}

/// A lively hand: up to 0.7 m/s and 130 degrees a second.
pub fn lively(t_s: f64) -> Pose {
    let wave = |rate: f64, phase: f64| libm::sin(rate * t_s + phase);
    let position_m = DVec3::new(
        0.7 * wave(0.55, 0.0) + 0.10 * wave(2.3, 1.0),
        0.15 * wave(1.4, 0.5) + 0.03 * wave(5.0, 0.0),
        0.3 * wave(0.9, 2.0) + 0.05 * wave(3.1, 0.2),
    );
    let yaw = so3::exp(DVec3::Y * (1.6 * wave(0.7, 0.0) + 0.5 * wave(2.4, 1.0)));
    let pitch = so3::exp(DVec3::X * (0.25 * wave(1.9, 0.3)));
    let roll = so3::exp(DVec3::Z * (0.2 * wave(1.5, 1.3)));
    Pose::new((yaw * pitch * roll).normalize(), position_m)
}

/// A body that turns on the spot, 60 degrees a second at most.
pub fn turning(t_s: f64) -> Pose {
    Pose::new(so3::exp(DVec3::Y * (1.2 * libm::sin(0.9 * t_s))), DVec3::ZERO)
}

/// A body at rest.
pub fn resting(_t_s: f64) -> Pose {
    Pose::new(DQuat::IDENTITY, DVec3::ZERO)
}

impl World {
    /// The usual world.
    pub fn usual(seed: u64) -> Self {
        Self { seed, landmarks: room(seed, 2_500), cameras: stereo_rig(), hardship: USUAL, features_max: 500 }
    }

    /// What both cameras send at a time.
    pub fn frame(&self, number: u64, world_from_body: &Pose) -> FrameInput {
        let camera = |camera: usize| self.picture((number, camera), &|_| *world_from_body);
        FrameInput { t_s: time_s(number), features: (0..self.cameras.len()).map(camera).collect(), clocks: Vec::new() }
    }

    /// The same with rows exposed one after the other around the frame's time.
    pub fn rolling_frame(&self, number: u64, motion: impl Fn(f64) -> Pose, row_time_s: f64) -> FrameInput {
        let clock = RowClock { offset_s: 0.0, row_time_s };
        let size = self.cameras[0].size;
        let of_row = |row_px: f64| motion(time_s(number) + clock.row_offset_s(row_px, size));
        let features = (0..self.cameras.len()).map(|camera| self.picture((number, camera), &of_row)).collect();
        FrameInput { t_s: time_s(number), features, clocks: vec![clock; self.cameras.len()] }
    }

    /// Position of a point on the row that sees it.
    fn position_px(&self, camera: usize, point_m: DVec3, of_row: &dyn Fn(f64) -> Pose) -> Option<DVec2> {
        let calibration = &self.cameras[camera];
        let mut row_px = 0.5 * f64::from(calibration.size.height_px - 1);
        let mut position_px = None;
        // Rows follow each other faster than a point crosses them: each round leaves a twentieth at 1,500 px/s and 33 us per row.
        for _ in 0..6 {
            let camera_from_world = of_row(row_px).then(&calibration.body_from_camera).inverse();
            let point_m = camera_from_world.point(point_m);
            // The polynomial of the lens folds far outside the picture; a fisheye knows its own domain.
            let is_flat = matches!(calibration.lens.mapping, Mapping::Radtan(_));
            let is_beside = point_m.z < 0.05 || point_m.x.abs() > 1.3 * point_m.z || point_m.y.abs() > 1.1 * point_m.z;
            if is_flat && is_beside {
                return None;
            }
            let found_px = calibration.lens.project(point_m)?;
            let done = (found_px.y - row_px).abs() < 1e-3;
            (row_px, position_px) = (found_px.y, Some(found_px));
            if done {
                break;
            }
        }
        position_px
    }

    fn picture(&self, (frame, camera): (u64, usize), of_row: &dyn Fn(f64) -> Pose) -> Vec<Feature> {
        let calibration = &self.cameras[camera];
        let key = DrawKey::root(self.seed).with(2).with(frame).with(u64_from(camera));
        let mut features = Vec::new();
        for (number, landmark) in self.landmarks.iter().enumerate() {
            let key = key.with(u64_from(number));
            let Some(position_px) = self.position_px(camera, landmark.position_m, of_row) else { continue };
            if key.with(0).uniform() < self.hardship.missed {
                continue;
            }
            let noise_px = DVec2::new(normal(key.with(1)), normal(key.with(2))) * self.hardship.noise_px;
            let descriptor = self.view_of(landmark.look, key.with(3));
            features.extend(corner(position_px + noise_px, calibration.size, descriptor));
        }
        for number in 0..u64::from(u32_truncated(f64_from_u64(u64_from(features.len())) * self.hardship.spurious)) {
            let key = key.with(1_000_000 + number);
            let position_px = DVec2::new(key.with(0).uniform() * 639.0, key.with(1).uniform() * 479.0);
            features.extend(corner(position_px, calibration.size, bits(key.with(2), |_| false)));
        }
        thin_out(features, self.features_max, key)
    }

    /// A landmark's descriptor with some bits flipped.
    fn view_of(&self, look: DrawKey, view: DrawKey) -> [u8; 32] {
        bits(look, |bit| view.with(bit).uniform() < self.hardship.flipped)
    }
}

/// 256 keyed bits, some flipped.
fn bits(look: DrawKey, flipped: impl Fn(u64) -> bool) -> [u8; 32] {
    let mut bytes = [0; 32];
    for (byte, at) in bytes.iter_mut().zip(0_u64..) {
        *byte = low_u8(low_u32(look.with(at).0));
        for bit in 0..8 {
            *byte ^= u8::from(flipped(8 * at + bit)) << bit;
        }
    }
    bytes
}

/// A corner in the sensor's format, where it lies on the picture: the one function that knows the format's coordinates.
pub fn corner(position_px: DVec2, size: Size, descriptor: [u8; 32]) -> Option<Feature> {
    let inside = position_px.x >= 0.0
        && position_px.y >= 0.0
        && position_px.x <= f64::from(size.width_px - 1)
        && position_px.y <= f64::from(size.height_px - 1);
    let (x, y) = (PositionPx::saturating_from_num(position_px.x), PositionPx::saturating_from_num(position_px.y));
    inside.then_some(Feature { x, y, score: 40, angle: Turns::ZERO, octave: 0, descriptor })
}

/// Keeps a keyed choice, in a keyed order, as an extractor's top-K would.
fn thin_out(mut features: Vec<Feature>, features_max: usize, key: DrawKey) -> Vec<Feature> {
    features.shuffle(&mut key.with(7).stream());
    features.truncate(features_max);
    features
}

/// How a run went.
#[derive(Debug, Default)]
pub struct Score {
    pub frames: u32,
    pub tracked: u32,
    pub relocalised: u32,
    pub keyframes: u32,
    /// Root mean square of the position error in metres, in the frame of the first pose, without any alignment.
    pub ate_m: f64,
    pub worst_m: f64,
    pub worst_rad: f64,
    pub prediction_m: f64,
    pub innovation_px: f64,
    pub features_min: u32,
}

/// Scores answers against the truth.
pub fn score(answers: &[(Pose, sensel::tracker::TrackedFrame)]) -> Score {
    let mut score = Score { features_min: u32::MAX, ..Score::default() };
    let Some((first, _)) = answers.iter().find(|(_, answer)| answer.world_from_body.is_some()) else { return score };
    let world_from_room = first.inverse();
    let (mut sum_m2, mut predicted_m2, mut predictions) = (0.0, 0.0, 0_u32);
    let mut innovations = Vec::new();
    for (truth, answer) in answers {
        score.frames += 1;
        score.keyframes += u32::from(answer.keyframe);
        let expected = world_from_room.then(truth);
        if let Some(predicted_m) = answer.predicted_position_m {
            predicted_m2 += (predicted_m - expected.translation_m).length_squared();
            predictions += 1;
        }
        innovations.extend(answer.innovation_px);
        let Some(pose) = answer.world_from_body else { continue };
        score.tracked += 1;
        score.relocalised += u32::from(answer.status == sensel::tracker::Status::Relocalised);
        score.features_min = score.features_min.min(answer.tracked_features);
        let error_m = (pose.translation_m - expected.translation_m).length();
        sum_m2 += error_m * error_m;
        score.worst_m = score.worst_m.max(error_m);
        score.worst_rad = score.worst_rad.max(pose.inverse().then(&expected).angle_rad());
    }
    score.ate_m = (sum_m2 / f64::from(score.tracked.max(1))).sqrt();
    score.prediction_m = (predicted_m2 / f64::from(predictions.max(1))).sqrt();
    innovations.sort_by(f64::total_cmp);
    score.innovation_px = innovations.get(innovations.len() / 2).copied().unwrap_or(0.0);
    score
}
