//! Light of lamps and bright directions over plane mirrors. Few random rays that a mirror reflects meet a lamp, and each would be a speck
//! of light; so shadow rays go from a receiver to the mirror and on to the lamp.

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::BANDS;
use super::super::plane_mirrors::PlaneMirror;
use super::super::tracer::{Packet, Stack, blocked_through, closest_through};
use super::super::vectors::{dot, mirrored, unit};
use super::blockers::{Blocker, nearest};
use super::fan::{LIFT_M, Receiver};
use super::light_points::{LightPoints, ShadowRay, ShadowRayLight, shadow_ray_to};
use crate::num::index;

/// Rays over a mirror that wait until a packet is full.
struct ReflectedRays<'a> {
    scene: &'a Scene,
    blockers: &'a [Blocker<'a>],
    mirror: usize,
    stack: Stack,
    to_mirror: Packet,
    to_source: Packet,
    /// Of each lane.
    waiting: Vec<Waiting>,
}

/// What a lane adds, if nothing is in its way.
#[derive(Clone, Copy)]
struct Waiting {
    receiver: usize,
    ray: ShadowRay,
    /// Unit direction.
    to_mirror: [f32; 3],
}

/// Adds what plane mirrors send to the first or to both sides of receivers.
pub fn add_reflected(
    scene: &Scene,
    receivers: &[Receiver],
    light_points: &LightPoints,
    blockers: &[Blocker],
    light: &mut [[ShadowRayLight; 2]],
) {
    for (mirror, plane) in scene.mirrors.all.iter().enumerate() {
        let image = |(number, receiver): (usize, &Receiver)| {
            let plane = plane.facing(receiver.at_m)?;
            let at_m = along(receiver.at_m, -2.0 * plane.height_m(receiver.at_m), plane.normal);
            Some((
                number,
                plane,
                Receiver { at_m, normal: mirrored(receiver.normal, plane.normal), sides: receiver.sides },
            ))
        };
        let images: Vec<_> = receivers.iter().enumerate().filter_map(image).collect();
        let (stack, waiting) = (Stack::new(), Vec::with_capacity(LANES));
        let [to_mirror, to_source] = [Packet::idle(); 2];
        let mut rays = ReflectedRays { scene, blockers, mirror, stack, to_mirror, to_source, waiting };
        for number in 0..light_points.count() {
            for (receiver, plane, image) in &images {
                if let Some(ray) = shadow_ray_to(scene, image, light_points, number).filter(|ray| ray.cone > 0.0) {
                    rays.push(plane, *receiver, ray, light);
                }
            }
        }
        rays.flush(light);
    }
}

fn along(from_m: [f32; 3], way: f32, direction: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| from_m[axis] + way * direction[axis])
}

impl ReflectedRays<'_> {
    /// Adds the ray from a receiver whose image sends the given one, if it comes near the mirror.
    fn push(&mut self, plane: &PlaneMirror, receiver: usize, ray: ShadowRay, light: &mut [[ShadowRayLight; 2]]) {
        let ShadowRay { origin_m, direction, t_max, .. } = ray;
        // The image is as far behind the mirror as the receiver is in front.
        let (behind_m, rise) = (-plane.height_m(origin_m), dot(direction, plane.normal));
        let t = behind_m / rise;
        let at_m = along(origin_m, t, direction);
        let to_mirror =
            unit(mirrored(direction, plane.normal)).filter(|_| rise > 0.0 && t < t_max && plane.is_around(at_m));
        let Some(to_mirror) = to_mirror else { return };
        let lane = self.waiting.len();
        self.to_mirror.set_ray(lane, along(origin_m, 2.0 * behind_m, plane.normal), to_mirror, f32::MAX);
        self.to_source.set_ray(lane, along(at_m, LIFT_M, plane.normal), direction, t_max - t);
        self.waiting.push(Waiting { receiver, ray, to_mirror });
        if self.waiting.len() == LANES {
            self.flush(light);
        }
    }

    fn flush(&mut self, light: &mut [[ShadowRayLight; 2]]) {
        if self.waiting.is_empty() {
            return;
        }
        let Self { scene, blockers, stack, .. } = self;
        let met = closest_through(&scene.bvh, &scene.mesh, &self.to_mirror, stack);
        let objects = nearest(blockers, &Packet { t_max: met.t, ..self.to_mirror }, stack);
        let is_shown = |lane: usize| {
            scene.mirrors.of_triangle(met.triangle[lane]) == Some(self.mirror) && objects.0[lane] >= met.t.0[lane]
        };
        let shown: Vec<(usize, Waiting)> =
            self.waiting.drain(..).enumerate().filter(|&(lane, _)| is_shown(lane)).collect();
        if !shown.is_empty() {
            let shadowed = blocked_through(&scene.bvh, &scene.mesh, &self.to_source, stack);
            let (objects, t_max) = (nearest(blockers, &self.to_source, stack), self.to_source.t_max);
            for (lane, Waiting { receiver, ray, to_mirror }) in shown {
                if shadowed.0[lane] == 0 && objects.0[lane] >= t_max.0[lane] {
                    let sent = &mut light[receiver][ray.side].all[ray.group];
                    let shade = &scene.layout.triangles[index(met.triangle[lane])];
                    let gloss = scene.mesh.materials[index(shade.material)].gloss();
                    let kept =
                        gloss.map_or([0.0; BANDS], |gloss| gloss.reflectance(dot(shade.normal, to_mirror).abs()));
                    for band in 0..BANDS {
                        sent[band] += ray.sent[band] * f64::from(ray.cone * kept[band]);
                    }
                }
            }
        }
        (self.to_mirror, self.to_source) = (Packet::idle(), Packet::idle());
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::environment::DistantLight;
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::target::cube;
    use super::super::fan::STEADY;
    use super::*;

    /// Light of points on a black floor beside a mirror of 0.6 m by 1 m in the plane x = 0, at a height of 1 m, with and without a post
    /// 0.3 m before it between two heights.
    fn patch(light: &DistantLight, points_m: &[[f32; 2]], post_m: Option<[f32; 2]>) -> Vec<[f64; BANDS]> {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("floor", [0.0; 3]));
        let mirror =
            Material { metallic: 1.0, roughness: 0.0, double_sided: false, ..Material::plain("mirror", [0.9; 3]) };
        mesh.materials.push(mirror);
        mesh.append_quad(0, [[-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, -4.0]], [1.0; 2]);
        mesh.append_quad(1, [[0.0, 1.0, 0.3], [0.0, 1.0, -0.3], [0.0, 2.0, -0.3], [0.0, 2.0, 0.3]], [1.0; 2]);
        if let Some([low_m, high_m]) = post_m {
            cube([0.3, low_m, -0.01], [0.32, high_m, 0.01], false)
                .into_iter()
                .for_each(|face| mesh.append_quad(0, face, [1.0; 2]));
        }
        let scene = Scene::new("patch", mesh, [0.0; BANDS]).unwrap();
        let light_points = LightPoints { distant: vec![*light], ..LightPoints::new(&scene, 4, LANES) };
        let receiver = |&[x_m, z_m]: &[f32; 2]| Receiver { at_m: [x_m, 0.0, z_m], normal: [0.0, 1.0, 0.0], sides: 1 };
        let receivers: Vec<Receiver> = points_m.iter().map(receiver).collect();
        let mut light = vec![[ShadowRayLight::NONE; 2]; receivers.len()];
        add_reflected(&scene, &receivers, &light_points, &[], &mut light);
        light.iter().map(|[above, _]| above.all[STEADY]).collect()
    }

    #[test]
    fn the_sun_over_a_mirror_lights_a_patch_of_its_outline() {
        // 45 degrees high: the mirror from 1 to 2 m lights the floor from 1 to 2 m before it.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let sun = DistantLight { direction: [half, half, 0.0], normal_irradiance: [4.0, 3.0, 2.0, 1.0] };
        let points_m = [[0.99, 0.0], [1.01, 0.0], [1.99, 0.29], [1.99, 0.31], [2.01, 0.0], [1.5, -0.29], [-1.5, 0.0]];
        let lit = [false, true, true, false, false, true, false];
        // Schlick's rise at 45 degrees: (1 - cos)^5.
        let short = 1.0 - f64::from(half);
        let kept = 0.9 + 0.1 * short * short * short * short * short;
        for (light, lit) in patch(&sun, &points_m, None).iter().zip(lit) {
            for (light, sent) in light.iter().zip([4.0, 3.0, 2.0, 1.0]) {
                let expected = if lit { sent * f64::from(half) * kept } else { 0.0 };
                assert!((light - expected).abs() < 1e-5 * sent, "{light} {expected}");
            }
        }
        // At 1.2 m light comes down past the post at 1.5 m and goes on past it at 0.9 m.
        for (post_m, lit) in [([1.4, 1.6], false), ([0.8, 1.0], false), ([1.1, 1.3], true)] {
            let [behind, beside] = [0.0, 0.1].map(|z_m| patch(&sun, &[[1.2, z_m]], Some(post_m))[0][0] > 2.0);
            assert!(beside && behind == lit, "{post_m:?}");
        }
    }
}
