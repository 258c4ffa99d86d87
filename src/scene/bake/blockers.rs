//! Moving objects in the way of the rays of a receiver, where they are at one instant.

use glam::DVec3;

use super::super::geometry::Scene;
use super::super::lanes::{Floats, Mask, Vectors, dot3, splat3, unrolled};
use super::super::tracer::{Packet, Stack, closest_through};
use crate::num::f32_nearest;
use crate::pose::Pose;

/// An object where it is.
#[derive(Clone, Debug)]
pub struct Blocker<'a> {
    shape: &'a Scene,
    /// Axes of the world, then its origin, in the object's frame.
    axes: [[f32; 3]; 3],
    position_m: [f32; 3],
    /// Middle in the world and radius of a ball around it in metres.
    middle_m: [f32; 3],
    radius_m: f32,
}

impl<'a> Blocker<'a> {
    /// A shape that a ball encloses in its frame, at a pose.
    pub fn new(shape: &'a Scene, (middle_m, radius_m): (DVec3, f64), world_from_object: &Pose) -> Self {
        let back = world_from_object.inverse();
        let narrow = |v: DVec3| v.to_array().map(f32_nearest);
        Self {
            shape,
            axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| narrow(back.direction(axis))),
            position_m: narrow(back.translation_m),
            middle_m: narrow(world_from_object.point(middle_m)),
            // The poses above are rounded: far from the origin by more than the tree is padded.
            radius_m: f32_nearest(radius_m * 1.001 + 1e-4),
        }
    }

    fn turned(&self, v: &Vectors) -> Vectors {
        let [x, y, z] = self.axes.map(splat3);
        unrolled!(AXIS in 3 => x[AXIS] * v[0] + y[AXIS] * v[1] + z[AXIS] * v[2])
    }

    /// Rays that may meet it.
    fn may_meet(&self, packet: &Packet) -> Mask {
        let middle_m = splat3(self.middle_m);
        let way_m = unrolled!(AXIS in 3 => middle_m[AXIS] - packet.origin_m[AXIS]);
        let along = dot3(way_m, packet.direction);
        let beyond2 = dot3(way_m, way_m) - Floats::splat(self.radius_m * self.radius_m);
        let zero = Floats::splat(0.0);
        let is_near = (beyond2 * dot3(packet.direction, packet.direction)).at_most(along * along);
        is_near & (beyond2.at_most(zero) | zero.below(along)) & packet.t_min.at_most(packet.t_max)
    }
}

/// How far each ray goes to the nearest of some objects, in lengths of its direction; its end where nothing is nearer.
pub fn nearest(blockers: &[Blocker], packet: &Packet, stack: &mut Stack) -> Floats {
    let mut t = packet.t_max;
    for blocker in blockers {
        let lanes = blocker.may_meet(packet);
        if !lanes.any() {
            continue;
        }
        let turned = blocker.turned(&packet.origin_m);
        let origin_m = unrolled!(AXIS in 3 => turned[AXIS] + Floats::splat(blocker.position_m[AXIS]));
        let t_max = lanes.select(t, Floats::splat(-1.0));
        let own = Packet { origin_m, direction: blocker.turned(&packet.direction), t_min: packet.t_min, t_max };
        let Scene { bvh, mesh, .. } = blocker.shape;
        t = lanes.select(closest_through(bvh, mesh, &own, stack).t, t);
    }
    t
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::super::lanes::LANES;
    use super::super::super::light::BANDS;
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::target::cube;
    use super::*;

    #[test]
    fn rays_end_at_the_nearest_of_turned_boxes() {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("white", [0.5; 3]));
        for corners_m in cube([-0.5; 3], [0.5; 3], false) {
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
        let shape = Scene::new("box", mesh, [0.0; BANDS]).unwrap();
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let at = |x_m: f64| Blocker::new(&shape, (DVec3::ZERO, 0.867), &Pose::new(turn, DVec3::new(x_m, 0.0, 0.0)));
        let blockers = [at(5.0), at(3.0)];
        let mut packet = Packet::idle();
        // At the edge of the nearer one, past both, away from both, and an end before them; a direction of length 2.
        let rays = [([0.0; 3], 9.0), ([0.0, 0.8, 0.0], 9.0), ([9.0, 0.0, 0.0], 9.0), ([0.0; 3], 1.0)];
        for (lane, (origin_m, t_max)) in rays.into_iter().enumerate() {
            packet.set_ray(lane, origin_m, [2.0, 0.0, 0.0], t_max);
        }
        let found = nearest(&blockers, &packet, &mut Stack::new());
        // Half the diagonal of a side before the middle.
        let expected = [0.5 * (3.0 - 0.5 * std::f32::consts::SQRT_2), 9.0, 9.0, 1.0];
        for lane in 0..4 {
            assert!((found.0[lane] - expected[lane]).abs() < 1e-5, "{lane}: {}", found.0[lane]);
        }
        assert!(found.0[4..LANES].iter().all(|&t| t == -1.0));
        assert_eq!(nearest(&[], &packet, &mut Stack::new()), packet.t_max);
    }
}
