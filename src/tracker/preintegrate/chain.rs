//! IMU factors between the keyframes of a window: preintegrated steps, with velocities eliminated, as a prior on the poses. The filter
//! supplies biases, gravity and scale.
//!
//! The steps bind neighbours (Forster et al. 2017, section VI), not the window to the world: what the map has wrong since long the window
//! may still mend. Biases, gravity and unit are shared by the window and known as the filter knows them.

use nalgebra::{Matrix6, SMatrix};

use super::super::problem::Prior;
use super::ImuState;
pub use super::state::KeyframeStep;
use super::state::{GRAVITY, GYROSCOPE, ImuFilter, Knowledge, UNIT, VELOCITY};
use crate::num::index;
use crate::pose::Pose;
use crate::tracker::lie::se3_adjoint;
use glam::DVec3;

/// A keyframe of a window.
#[derive(Clone, Copy, Debug)]
pub struct WindowKeyframe {
    /// Its number in the map.
    pub keyframe: u32,
    /// Its pose.
    pub body_from_world: Pose,
    /// Its number in the adjustment; `None` where it is held.
    pub free: Option<u32>,
}

/// Links kept: those of the longest window.
const LINKS_MAX: usize = 50;
/// Gravity must be known to this share, else the chain says nothing.
const GRAVITY_SHARE_MAX: f64 = 0.02;
/// The filter's velocity is not taken for better than this, in m/s.
const VELOCITY_SIGMA: f64 = 0.005;
/// Unknowns that the window shares: two biases, gravity, logarithm of the map's unit.
const SHARED: usize = 10;
/// Their variance's floor: a unit known by definition must leave the matrix regular.
const VARIANCE_FLOOR: f64 = 1e-12;

/// Information over poses, velocities and shared unknowns, dense.
struct System {
    n: usize,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

/// A link's residual and its derivatives by both poses, both velocities and what is shared, each with the column of its unknown; rows
/// rotation, velocity, position.
struct StepDerivatives {
    columns: Vec<(usize, SMatrix<f64, 9, 1>)>,
    residual: SMatrix<f64, 9, 1>,
}

impl StepDerivatives {
    /// Derivatives by neighbouring unknowns, of which the first has this column.
    fn push<const C: usize>(&mut self, column: usize, by: &SMatrix<f64, 9, C>) {
        self.columns.extend((0..C).map(|k| (column + k, by.column(k).into_owned())));
    }
}

impl ImuFilter {
    /// Takes the step between two keyframes, each with its number and time; without all readings nothing.
    pub fn link(&mut self, (from, from_s): (u32, f64), (to, to_s): (u32, f64)) {
        let Some(now) = &self.now else { return };
        let Some(step) = self.step((from_s, to_s), now.state.bias) else { return };
        let variance =
            (0..3).map(|k| now.covariance[(VELOCITY + k, VELOCITY + k)]).sum::<f64>() / (3.0 * now.unit * now.unit);
        let later = (now.state.velocity_m_per_s / now.unit, variance);
        self.links.push_back(KeyframeStep { from, to, step, later });
        if self.links.len() > LINKS_MAX {
            self.links.pop_front();
        }
    }

    /// What the steps say of a window; `None` where too little is known, or no step lies in it.
    pub fn chain(&self, nodes: &[WindowKeyframe]) -> Option<Prior> {
        let now = self.now.as_ref()?;
        let (_, gravity_share) = self.gravity()?;
        if !(gravity_share < GRAVITY_SHARE_MAX && self.knows_unit()) {
            return None;
        }
        let of = |keyframe: u32| nodes.iter().find(|node| node.keyframe == keyframe);
        let used: Vec<(&KeyframeStep, &WindowKeyframe, &WindowKeyframe)> = self
            .links
            .iter()
            .filter_map(|link| Some((link, of(link.from)?, of(link.to)?)))
            .filter(|(_, from, to)| from.free.is_some() || to.free.is_some())
            .collect();
        if used.is_empty() {
            return None;
        }
        let poses = nodes.iter().filter_map(|node| node.free).map(|free| index(free) + 1).max()?;
        let mut system = System::new(6 * poses + 6 * used.len() + SHARED);
        let velocities = self.velocities(now, &used);
        // Links that meet share a velocity: each has two of its own, of which the later is the next one's earlier.
        let mut column = 6 * poses;
        for (k, &(link, from, to)) in used.iter().enumerate() {
            let rows = self.rows(now, link, (from, to), velocities[k], [column, system.n - SHARED]);
            system.add(&rows, link)?;
            column += if used.get(k + 1).is_some_and(|(next, ..)| next.from == link.to) { 3 } else { 6 };
        }
        // Where the first step starts, the filter knew the velocity from all that was before.
        if let Some(before) = used.first().and_then(|(first, ..)| self.links.iter().find(|link| link.to == first.from))
        {
            system.hold_velocity(6 * poses, (velocities[0].0, before.later));
        }
        system.hold_shared(now)?;
        let first: Vec<(u32, Pose)> = nodes.iter().filter_map(|n| Some((n.free?, n.body_from_world))).collect();
        Prior::of_information(first, 6 * poses, (system.matrix, system.rhs))
    }

    /// The body's position and the IMU's axes at a keyframe, in metres.
    fn metric(&self, unit: f64, node: &WindowKeyframe) -> Pose {
        let pose = node.body_from_world.inverse().then(&self.axes());
        Pose { translation_m: pose.translation_m / unit, ..pose }
    }

    /// Velocities at both ends of each link that fit its way. All is linear in them, so any near ones suffice, as long as links that
    /// meet have the same.
    fn velocities(
        &self,
        now: &Knowledge,
        used: &[(&KeyframeStep, &WindowKeyframe, &WindowKeyframe)],
    ) -> Vec<(DVec3, DVec3)> {
        let gravity = now.gravity / now.unit;
        let of = |&(link, from, to): &(&KeyframeStep, &WindowKeyframe, &WindowKeyframe)| {
            let (a, b, dt) = (self.metric(now.unit, from), self.metric(now.unit, to), link.step.span_s);
            let (_, gain, way) = link.step.corrected(&now.state.bias);
            let start = (b.translation_m - a.translation_m - a.rotation * way) / dt - gravity * (0.5 * dt);
            (start, start + gravity * dt + a.rotation * gain)
        };
        let mut velocities: Vec<(DVec3, DVec3)> = used.iter().map(of).collect();
        for k in 1..used.len() {
            if used[k].0.from == used[k - 1].0.to {
                velocities[k - 1].1 = velocities[k].0;
            }
        }
        velocities
    }

    /// Residual and derivatives of one link, in metres.
    fn rows(
        &self,
        now: &Knowledge,
        link: &KeyframeStep,
        (from, to): (&WindowKeyframe, &WindowKeyframe),
        (start, end): (DVec3, DVec3),
        [column, shared]: [usize; 2],
    ) -> StepDerivatives {
        let (unit, step, dt) = (now.unit, &link.step, link.step.span_s);
        let gravity = now.gravity / unit;
        let (a, b) = (self.metric(unit, from), self.metric(unit, to));
        let state =
            |world_from_imu, velocity_m_per_s| ImuState { world_from_imu, velocity_m_per_s, bias: now.state.bias };
        let states = (&state(a, start), &state(b, end));
        let residual = step.residual(states, gravity);
        let (by_from, by_to) = step.jacobians(states, gravity);
        // A left twist d of body_from_world is -Ad^-1 d on the right of world_from_imu, whose lengths are the map's.
        let back: Matrix6<f64> = -se3_adjoint(&self.axes().inverse());
        let to_metres = |mut by: SMatrix<f64, 9, 6>| {
            by.fixed_columns_mut::<3>(0).scale_mut(1.0 / unit);
            by * back
        };
        let mut derivatives =
            StepDerivatives { columns: Vec::new(), residual: residual.fixed_rows::<9>(0).into_owned() };
        for (node, by) in [(from, &by_from), (to, &by_to)] {
            if let Some(free) = node.free {
                derivatives.push(6 * index(free), &to_metres(by.fixed_view::<9, 6>(0, 0).into_owned()));
            }
        }
        derivatives.push(column, &by_from.fixed_view::<9, 3>(0, 6).into_owned());
        derivatives.push(column + 3, &by_to.fixed_view::<9, 3>(0, 6).into_owned());
        let turn_back = a.rotation.conjugate();
        let mut by_shared = SMatrix::<f64, 9, SHARED>::zeros();
        by_shared.fixed_view_mut::<9, 6>(0, 0).copy_from(&by_from.fixed_view::<9, 6>(0, 9));
        let by_unit = turn_back * ((b.translation_m - a.translation_m) * -1.0);
        for axis in 0..3 {
            let by_gravity = turn_back * DVec3::AXES[axis];
            for k in 0..3 {
                by_shared[(3 + k, 6 + axis)] = -dt * by_gravity[k];
                by_shared[(6 + k, 6 + axis)] = -0.5 * dt * dt * by_gravity[k];
            }
            by_shared[(6 + axis, 9)] = by_unit[axis];
        }
        derivatives.push(shared, &by_shared);
        derivatives
    }
}

impl System {
    fn new(n: usize) -> Self {
        Self { n, matrix: vec![0.0; n * n], rhs: vec![0.0; n] }
    }

    /// Adds a link; `None` where its covariance is singular.
    fn add(&mut self, rows: &StepDerivatives, link: &KeyframeStep) -> Option<()> {
        let weight = link.step.covariance.try_inverse()?;
        for (i, by) in &rows.columns {
            let weighted = weight * by;
            self.rhs[*i] -= weighted.dot(&rows.residual);
            for (j, other) in &rows.columns {
                self.matrix[i * self.n + j] += weighted.dot(other);
            }
        }
        Some(())
    }

    /// A velocity that is known beside the steps.
    fn hold_velocity(&mut self, column: usize, (at, (known, variance)): (DVec3, (DVec3, f64))) {
        let weight = 1.0 / (variance + VELOCITY_SIGMA * VELOCITY_SIGMA);
        for axis in 0..3 {
            self.matrix[(column + axis) * (self.n + 1)] += weight;
            self.rhs[column + axis] += weight * (known - at)[axis];
        }
    }

    /// What the filter knows of the shared unknowns, in metres.
    fn hold_shared(&mut self, now: &Knowledge) -> Option<()> {
        let own = now.covariance.fixed_view::<SHARED, SHARED>(GYROSCOPE, GYROSCOPE).into_owned();
        let mut metric = SMatrix::<f64, SHARED, SHARED>::identity();
        for axis in 0..3 {
            let (k, unit) = (GRAVITY - GYROSCOPE + axis, UNIT - GYROSCOPE);
            metric[(k, k)] = 1.0 / now.unit;
            metric[(k, unit)] = -now.gravity[axis] / (now.unit * now.unit);
            metric[(unit, unit)] = 1.0 / now.unit;
        }
        let floor = SMatrix::<f64, SHARED, SHARED>::identity() * VARIANCE_FLOOR;
        let information = (metric * own * metric.transpose() + floor).try_inverse()?;
        let first = self.n - SHARED;
        for i in 0..SHARED {
            for j in 0..SHARED {
                self.matrix[(first + i) * self.n + first + j] += information[(i, j)];
            }
        }
        Some(())
    }
}
