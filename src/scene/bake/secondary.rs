//! Secondary sources: small surfaces so bright that a few random rays find them, as the inside of a lampshade. Each such ray would show as
//! a bright flake on the walls around. Shadow rays go there instead, as they do to lamps, and random rays that meet one from afar do not
//! count.

use super::super::chance::in_chunks;
use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::luminance;
use super::super::tracer::{Packet, Stack, blocked_through};
use super::super::vectors::{area_m2, dot, sub, weighted};
use super::buried::cells;
use super::fan::{LIFT_M, Receiver};
use super::light_points::{END_SHARE, LightPoints, disc_form_factor};
use super::shadow_rays::shadow_ray_light;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index, u32_from};

/// Least exitance of a secondary source, as a multiple of the mean over all surfaces. Random rays find duller ones often enough.
const BRIGHT: f64 = 8.0;

/// Below this share of all light that is reflected once, secondary sources are not worth their rays.
const POWER_MIN: f64 = 0.01;

/// Random rays for each point that is aimed at.
const RAYS_A_POINT: usize = 8;

/// With fewer points than this, a sketch's, secondary sources are not worth the search for them.
const POINTS_MIN: usize = 4;

/// Points on lamps that direct light is estimated by, to find what is bright.
const LAMP_RAYS: usize = 16;

/// Samples of a unit of parallel work.
const CHUNK: usize = 128;

/// Points on secondary sources, for samples of one kind.
#[derive(Clone, Debug, Default)]
pub struct SecondarySources {
    points: Vec<Point>,
    /// Distance in metres from which on a random ray to each sample side does not count, infinite for sample sides that are no secondary
    /// source; empty without any.
    far_m: Vec<f32>,
}

/// A point that stands for a part of the secondary sources.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// The sample side whose light it has.
    sample_side: u32,
    position_m: [f32; 3],
    /// Of the side that is lit.
    normal: [f32; 3],
    area_m2: f64,
}

/// A third of a cell of samples, on one side.
struct Piece {
    point: Point,
    exitance: f64,
}

impl Piece {
    fn power(&self) -> f64 {
        self.exitance * self.point.area_m2
    }
}

impl SecondarySources {
    /// For samples with the given light points, those on vertices and those on grids.
    pub fn of(scene: &Scene, light_points: &[LightPoints; 2]) -> [Self; 2] {
        if light_points.iter().all(|light_points| light_points.fan.len() < POINTS_MIN * RAYS_A_POINT) {
            return Default::default();
        }
        let exitance = exitance(scene);
        let [mut power, mut area_m2, mut bright_power] = [0.0; 3];
        each_piece(scene, &exitance, |piece| {
            power += piece.power();
            area_m2 += piece.point.area_m2;
        });
        let mut bright = Vec::new();
        each_piece(scene, &exitance, |piece| {
            if piece.exitance * area_m2 > BRIGHT * power {
                bright_power += piece.power();
                bright.push(piece);
            }
        });
        if bright_power < POWER_MIN * power {
            bright.clear();
        }
        [0, 1].map(|kind| Self::drawn(&bright, light_points[kind].fan.len(), 2 * scene.layout.samples.len()))
    }

    /// Points in proportion to the pieces' power, in their order.
    fn drawn(pieces: &[Piece], rays: usize, sample_sides: usize) -> Self {
        let count = rays / RAYS_A_POINT;
        let power: f64 = pieces.iter().map(Piece::power).sum();
        if count == 0 || power <= 0.0 {
            return Self::default();
        }
        let mut drawn = Self { points: Vec::with_capacity(count), far_m: vec![f32::INFINITY; sample_sides] };
        let each = power / f64_from_usize(count);
        let mut sum = 0.0;
        for piece in pieces {
            let (point, area_m2) = (&piece.point, each / piece.exitance);
            // From here on the part that a point stands for gets less than one random ray.
            drawn.far_m[index(point.sample_side)] =
                f32_nearest((area_m2 * f64_from_usize(rays) / std::f64::consts::PI).sqrt());
            sum += piece.power();
            while drawn.points.len() < count && (f64_from_usize(drawn.points.len()) + 0.5) * each < sum {
                drawn.points.push(Point { area_m2, ..*point });
            }
        }
        drawn
    }

    /// Whether a random ray that met a sample side at a distance counts.
    #[inline(always)]
    pub fn counts(&self, sample_side: u32, distance_m: f32) -> bool {
        self.far_m.is_empty() || distance_m <= self.far_m[index(sample_side)]
    }

    /// The sample sides of these sources that both sides of a receiver see from afar, and the share of each one's exitance that is
    /// received.
    pub fn seen_from(&self, scene: &Scene, receiver: &Receiver, stack: &mut Stack) -> [Vec<(u32, f64)>; 2] {
        let mut seen = [Vec::new(), Vec::new()];
        for points in self.points.chunks(LANES) {
            let (mut packet, mut sent) = (Packet::idle(), [(0, 0.0); LANES]);
            for (lane, point) in points.iter().enumerate() {
                let side = usize::from(dot(sub(point.position_m, receiver.at_m), receiver.normal) < 0.0);
                let origin_m = receiver.lifted_m(side);
                let direction = sub(point.position_m, origin_m);
                let far_m = self.far_m[index(point.sample_side)];
                let share = disc_form_factor(receiver.normal, direction, point.normal, point.area_m2);
                if side < receiver.sides && share > 0.0 && dot(direction, direction) > far_m * far_m {
                    packet.set_ray(lane, origin_m, direction, END_SHARE);
                    sent[lane] = (side, share);
                }
            }
            if sent.iter().all(|&(_, share)| share == 0.0) {
                continue;
            }
            let shadowed = blocked_through(&scene.bvh, &scene.mesh, &packet, stack).bits();
            for (lane, point) in points.iter().enumerate() {
                let (side, share) = sent[lane];
                if share > 0.0 && shadowed & 1 << lane == 0 {
                    seen[side].push((point.sample_side, share));
                }
            }
        }
        seen
    }
}

/// Luminance that each sample side reflects of what comes straight from lamps and bright directions; none from glossy surfaces, which rays
/// go on from.
fn exitance(scene: &Scene) -> Vec<f64> {
    let light_points = LightPoints::new(scene, LAMP_RAYS, LANES);
    let samples = &scene.layout.samples;
    let chunks = in_chunks(samples.len(), CHUNK, |range| {
        let receivers: Vec<Receiver> = samples[range.clone()].iter().map(Receiver::of).collect();
        let light = shadow_ray_light(scene, &receivers, &light_points, &[]);
        let both = light.into_iter().zip(&samples[range]).flat_map(|(sides, sample)| {
            sides.map(|side| {
                side.all
                    .iter()
                    .map(|light| luminance([0, 1, 2, 3].map(|band| light[band] * f64::from(sample.albedo[band]))))
                    .sum()
            })
        });
        both.collect::<Vec<f64>>()
    });
    chunks.concat()
}

/// The thirds of all cells, one at each corner.
fn each_piece(scene: &Scene, exitance: &[f64], mut each: impl FnMut(Piece)) {
    for (number, shade) in scene.layout.triangles.iter().enumerate() {
        if scene.mesh.materials[index(shade.material)].is_mirror() {
            continue;
        }
        let steps = f64::from(f32_from_u32(shade.grid_steps.max(1)));
        let third_m2 = f64::from(area_m2(scene.mesh.corners_m(number))) / (3.0 * steps * steps);
        let sides = scene.layout.samples[index(shade.samples[0])].sides();
        cells(shade, |corners| {
            let corners_m = corners.map(|sample| scene.layout.samples[sample].position_m);
            for (corner, sample) in corners.into_iter().enumerate() {
                let weights = [0, 1, 2].map(|other| if other == corner { 2.0 / 3.0 } else { 1.0 / 6.0 });
                let at_m = weighted(corners_m, weights);
                for side in 0..sides {
                    let normal = if side == 0 { shade.normal } else { shade.normal.map(|along| -along) };
                    let position_m = [0, 1, 2].map(|axis| at_m[axis] + normal[axis] * LIFT_M);
                    let sample_side = 2 * sample + side;
                    let point = Point { sample_side: u32_from(sample_side), position_m, normal, area_m2: third_m2 };
                    each(Piece { point, exitance: exitance[sample_side] });
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::light::BANDS;
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::target::cube;
    use super::super::BakeSettings;
    use super::*;

    /// A room whose lamp shines on the ceiling 25 cm above it: all light below comes from there.
    fn uplighter() -> Scene {
        let mut mesh = Mesh::default();
        let one_sided = |name: &str, colour| Material { double_sided: false, ..Material::plain(name, colour) };
        mesh.materials.push(one_sided("room", [0.5; 3]));
        mesh.materials.push(Material { emission: [900.0; 4], ..one_sided("lamp", [0.0; 3]) });
        for face in cube([-2.0, 0.0, -1.5], [2.0, 2.5, 1.5], true) {
            mesh.append_quad(0, face, [1.0, 1.0]);
        }
        let lamp = [[-0.9, 2.25, 0.5], [-0.8, 2.25, 0.5], [-0.8, 2.25, 0.4], [-0.9, 2.25, 0.4]];
        mesh.append_quad(1, lamp, [1.0, 1.0]);
        Scene::new("uplighter", mesh, [0.0; BANDS]).unwrap()
    }

    #[test]
    fn a_bright_patch_of_the_ceiling_lights_a_room_without_flakes() {
        let scene = uplighter();
        let bake = scene.bake(&BakeSettings::ROOM, &|_| {});
        let few = LightPoints::of(&scene, &BakeSettings::ROOM);
        let many = LightPoints::new(&scene, 768, 16_384);
        let low = |sample: &&(usize, Receiver)| sample.1.at_m[1] < 1.5;
        let receivers: Vec<_> = scene.layout.samples.iter().map(Receiver::of).enumerate().collect();
        let [mut mean, mut baked2, mut random2, mut count] = [0.0; 4];
        for (sample, receiver) in receivers.iter().filter(low).step_by(17) {
            let by = |light_points: &LightPoints| {
                scene.light_at(receiver, light_points, [&bake.irradiance, &[]], 1.0, &[]).by_group[0][1]
            };
            let exact = by(&many);
            let baked = f64::from(bake.irradiance[2 * sample][1]) / exact - 1.0;
            let random = by(&few[1]) / exact - 1.0;
            (mean, baked2, random2, count) =
                (mean + baked, baked2 + baked * baked, random2 + random * random, count + 1.0);
        }
        let [baked, random] = [baked2, random2].map(|sum: f64| (sum / count).sqrt());
        assert!(count > 100.0 && (mean / count).abs() < 0.01, "{count} {}", mean / count);
        assert!(baked < 0.04 && random > 5.0 * baked, "{baked} {random}");
    }

    #[test]
    fn an_even_room_has_no_secondary_sources() {
        let mut scene = uplighter();
        let settings = BakeSettings::ROOM;
        let sources_of = |scene: &Scene| SecondarySources::of(scene, &LightPoints::of(scene, &settings));
        assert!(sources_of(&scene).iter().all(|kind| !kind.points.is_empty()));
        // The same lamp turned to the floor lights much of the room.
        let lamp = scene.mesh.triangles.len() - 2;
        scene.mesh.triangles[lamp..].iter_mut().for_each(|corners| corners.swap(1, 2));
        let mesh = std::mem::take(&mut scene.mesh);
        let turned = Scene::new("downlighter", mesh, [0.0; BANDS]).unwrap();
        assert!(sources_of(&turned).iter().all(|kind| kind.points.is_empty()));
    }
}
