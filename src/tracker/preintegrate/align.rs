//! Aligns a mono map of unknown scale with preintegrated readings: gravity, scale in metres, velocities, and gyroscope bias.
//!
//! Linear least squares as Qin, Li and Shen (2018, "VINS-Mono", section V-B) have it: the bias from rotations, then
//! velocities, gravity and scale together, then again with gravity's length known. The accelerometer's bias is left
//! out: over some seconds it cannot be told from a tilt.

use glam::{DMat3, DVec3};

use super::{Bias, Preintegrated};
use crate::num::{f64_from_usize, greater};
use crate::pose::Pose;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::lie::so3_log;

/// A mono map brought to metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Metres in the map's unit of length.
    pub scale_m: f64,
    /// Gravity in the map's frame, of the known length.
    pub gravity_m_per_s2: DVec3,
    /// Velocity of the IMU at each frame, in the map's frame.
    pub velocities_m_per_s: Vec<DVec3>,
    /// Offset of the gyroscope.
    pub gyroscope_bias_rad_per_s: DVec3,
    /// Length that gravity came out with before it was set: far from the known one, nothing should be believed.
    pub free_gravity_m_per_s2: f64,
    /// Standard deviation of the scale as a share of it, from the residuals.
    pub scale_sigma: f64,
}

/// Why no alignment was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages name every field.
pub enum AlignError {
    #[error("{frames} frames; use 4 or more")]
    TooFew { frames: usize },
    #[error("the motion does not determine scale and gravity; record more acceleration")]
    Undetermined,
    #[error("gravity came out as {found_m_per_s2} m/s^2; it should be within a tenth of {known_m_per_s2}")]
    Gravity { found_m_per_s2: f64, known_m_per_s2: f64 },
}

/// Unknowns of a linear system, with what they are solved from.
struct System {
    n: usize,
    matrix: Vec<f64>,
    side: Vec<f64>,
    square: f64,
    rows: usize,
}

/// Aligns frames `map_from_camera` with the steps between neighbours (one less); `camera_from_imu` is the mounting in metres.
///
/// # Errors
/// Too few frames, or motion that does not separate scale from gravity.
pub fn align(
    frames: &[Pose],
    steps: &[Preintegrated],
    camera_from_imu: &Pose,
    gravity_length_m_per_s2: f64,
) -> Result<Alignment, AlignError> {
    if frames.len() < 4 || steps.len() + 1 != frames.len() {
        return Err(AlignError::TooFew { frames: frames.len() });
    }
    let turns: Vec<DMat3> =
        frames.iter().map(|frame| DMat3::from_quat((frame.rotation * camera_from_imu.rotation).normalize())).collect();
    let bias = gyroscope_bias(frames, steps, camera_from_imu).ok_or(AlignError::Undetermined)?;
    let free = [DVec3::X, DVec3::Y, DVec3::Z];
    let (solution, _) = solved(frames, (steps, &turns), &bias, (camera_from_imu, &free, DVec3::ZERO))?;
    let place = 3 * frames.len();
    let mut gravity = DVec3::new(solution[place], solution[place + 1], solution[place + 2]);
    let free_length = gravity.length();
    if !((free_length / gravity_length_m_per_s2 - 1.0).abs() < 0.1) {
        return Err(AlignError::Gravity { found_m_per_s2: free_length, known_m_per_s2: gravity_length_m_per_s2 });
    }
    let mut last = (Vec::new(), 0.0);
    // Gauss-Newton on the sphere; the first answer is within a few degrees.
    for _ in 0..5 {
        gravity = gravity.normalize() * gravity_length_m_per_s2;
        let (along, across) = gravity.normalize().any_orthonormal_pair();
        last = solved(frames, (steps, &turns), &bias, (camera_from_imu, &[along, across], gravity))?;
        gravity += along * last.0[place] + across * last.0[place + 1];
    }
    let (solution, scale_sigma) = last;
    let scale_m = solution[place + 2];
    if !(scale_m > 0.0) {
        return Err(AlignError::Undetermined);
    }
    let velocity = |k: usize| DVec3::new(solution[3 * k], solution[3 * k + 1], solution[3 * k + 2]);
    Ok(Alignment {
        scale_m,
        gravity_m_per_s2: gravity.normalize() * gravity_length_m_per_s2,
        velocities_m_per_s: (0..frames.len()).map(velocity).collect(),
        gyroscope_bias_rad_per_s: bias.gyroscope_rad_per_s,
        free_gravity_m_per_s2: free_length,
        scale_sigma: scale_sigma / scale_m,
    })
}

/// The bias under which the steps turn as the frames do.
fn gyroscope_bias(frames: &[Pose], steps: &[Preintegrated], camera_from_imu: &Pose) -> Option<Bias> {
    let mut bias = steps[0].bias;
    for _ in 0..3 {
        let (mut hessian, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
        for (pair, step) in frames.windows(2).zip(steps) {
            let turn = |frame: &Pose| frame.rotation * camera_from_imu.rotation;
            let (rotation, ..) = step.corrected(&bias);
            let miss = so3_log((rotation.conjugate() * (turn(&pair[0]).conjugate() * turn(&pair[1]))).normalize());
            let by_bias = step.rotation_by_gyroscope;
            hessian += by_bias.transpose() * by_bias;
            gradient += by_bias.transpose() * miss;
        }
        let by = hessian.inverse() * gradient;
        if !by.is_finite() {
            return None;
        }
        bias.gyroscope_rad_per_s += by;
    }
    Some(bias)
}

/// Velocities, gravity's free part over the given directions, and scale; with the scale's sigma.
fn solved(
    frames: &[Pose],
    (steps, turns): (&[Preintegrated], &[DMat3]),
    bias: &Bias,
    (camera_from_imu, directions, held_gravity): (&Pose, &[DVec3], DVec3),
) -> Result<(Vec<f64>, f64), AlignError> {
    let place = 3 * frames.len();
    let n = place + directions.len() + 1;
    let mut system = System { n, matrix: vec![0.0; n * n], side: vec![0.0; n], square: 0.0, rows: 0 };
    for (k, step) in steps.iter().enumerate() {
        let (_, velocity, position) = step.corrected(bias);
        let (back, dt) = (turns[k].transpose(), step.span_s);
        let lever =
            frames[k + 1].rotation * camera_from_imu.translation_m - frames[k].rotation * camera_from_imu.translation_m;
        let way = frames[k + 1].translation_m - frames[k].translation_m;
        // Positions in units of dt times a velocity, so that both kinds of rows weigh alike.
        let known_way = (position + back * (held_gravity * (0.5 * dt * dt) - lever)) / dt;
        let known_gain = velocity + back * (held_gravity * dt);
        for axis in 0..3 {
            let row_of = |x: DVec3| (back * x)[axis];
            let (mut by_way, mut by_gain) = (vec![0.0; n], vec![0.0; n]);
            for c in 0..3 {
                by_way[3 * k + c] = -row_of(DVec3::AXES[c]);
                by_gain[3 * k + c] = -row_of(DVec3::AXES[c]);
                by_gain[3 * k + 3 + c] = row_of(DVec3::AXES[c]);
            }
            for (d, direction) in directions.iter().enumerate() {
                by_way[place + d] = -0.5 * dt * row_of(*direction);
                by_gain[place + d] = -dt * row_of(*direction);
            }
            by_way[n - 1] = row_of(way) / dt;
            system.add(&by_way, known_way[axis]);
            system.add(&by_gain, known_gain[axis]);
        }
    }
    system.solve()
}

impl System {
    fn add(&mut self, row: &[f64], value: f64) {
        for (i, x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            self.side[i] += x * value;
            for (j, y) in row.iter().enumerate() {
                self.matrix[i * self.n + j] += x * y;
            }
        }
        self.square += value * value;
        self.rows += 1;
    }

    /// The solution, and the standard deviation of the last unknown as the residuals have it.
    fn solve(self) -> Result<(Vec<f64>, f64), AlignError> {
        let scale: Vec<f64> = (0..self.n).map(|k| self.matrix[k * (self.n + 1)].sqrt()).collect();
        if scale.iter().any(|&s| !(s > 0.0)) {
            return Err(AlignError::Undetermined);
        }
        let scaled: Vec<f64> =
            (0..self.n * self.n).map(|k| self.matrix[k] / (scale[k / self.n] * scale[k % self.n])).collect();
        let solve = |right: Vec<f64>| {
            let (mut matrix, mut right) = (scaled.clone(), right);
            let solved = solve_cholesky(&mut matrix, &mut right);
            solved.then(|| right.iter().zip(&scale).map(|(x, s)| x / s).collect::<Vec<f64>>())
        };
        let solution =
            solve(self.side.iter().zip(&scale).map(|(x, s)| x / s).collect()).ok_or(AlignError::Undetermined)?;
        let mut last = vec![0.0; self.n];
        last[self.n - 1] = 1.0 / scale[self.n - 1];
        let spread = solve(last).ok_or(AlignError::Undetermined)?[self.n - 1];
        let explained: f64 = solution.iter().zip(&self.side).map(|(x, b)| x * b).sum();
        let freedom = f64_from_usize(self.rows.saturating_sub(self.n).max(1));
        let variance = greater(self.square - explained, 0.0) / freedom;
        Ok((solution, (variance * spread).sqrt()))
    }
}
