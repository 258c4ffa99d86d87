//! Light of rays among moving objects: the kernel that traces and shades them, and the tiles that may see any.

use super::super::motion::{Timeline, Turns};
use super::objects::{ObjectInView, Objects};
use super::settings::{COLUMNS, ROWS};
use super::view::{Aim, Filter, NearestHits, PacketPixels, Traced, View};
use crate::num::{index, u32_from};
use crate::scene::lanes::{Floats, LANES, Mask, Vectors, unrolled};
use crate::scene::light::BANDS;
use crate::scene::mesh::BackfaceCulled;
use crate::scene::tracer::{MISS, Packet, Stack, closest_through};
use crate::simd::Kernel;

/// The tiles of each group of rows in which an object or its shadow may be seen, by any ray of the exposure. `timelines` are the camera's.
pub fn tiles_in_view(objects: &[ObjectInView], view: &View, timelines: &[Timeline]) -> Vec<Vec<bool>> {
    let camera = view.camera;
    let [width, height] = [camera.size.width_px, camera.size.height_px].map(index);
    let of_group = |group: usize| {
        let mut stack = Stack::new();
        let mut is_in_view = |tile: usize| {
            let mut pixels = PacketPixels::NONE;
            for lane in 0..LANES {
                let x = (tile * COLUMNS + lane % COLUMNS).min(width - 1);
                let y = (group * ROWS + lane / COLUMNS).min(height - 1);
                pixels.set(lane..lane + 1, camera, [x, y], &[0.0; BANDS]);
            }
            objects.iter().any(|object| object.may_be_near(group, &pixels.corners[0], pixels.spread))
                || view.may_show_shadow(objects, (group, &timelines[group]), &pixels, &mut stack)
        };
        (0..width.div_ceil(COLUMNS)).map(&mut is_in_view).collect()
    };
    let tiles: Vec<Vec<bool>> = crate::parallel::collected(height.div_ceil(ROWS), of_group);
    // A pixel may show a sliver of a surface that the ray through its corner passed by: then a neighbour shows more of it.
    let beside = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let grown = |group: usize| {
        let is_near = |tile: usize| {
            beside(group, tiles.len()).any(|group| beside(tile, tiles[group].len()).any(|tile| tiles[group][tile]))
        };
        (0..tiles[group].len()).map(is_near).collect()
    };
    (0..tiles.len()).map(grown).collect()
}

impl View<'_> {
    /// Whether an object may shade what a still camera sees through the first corners of some pixels.
    fn may_show_shadow(
        &self,
        objects: &[ObjectInView],
        (group, timeline): (usize, &Timeline),
        pixels: &PacketPixels,
        stack: &mut Stack,
    ) -> bool {
        let Some(shadows) = self.scene.shadows() else { return false };
        let pose = timeline.pieces[0].at(Floats::splat(0.0));
        let direction = pose.turned(pixels.corners[0]);
        let packet = Packet { origin_m: pose.place_m(), direction, t_min: Floats::splat(0.0), t_max: pixels.t_max };
        let scene = self.scene.scene();
        let hits = closest_through(&scene.bvh, &BackfaceCulled(&scene.mesh), &packet, stack);
        let lanes = hit(&hits.triangle);
        let t_m = lanes.select(hits.t, Floats::splat(0.0));
        let at_m = unrolled!(AXIS in 3 => packet.origin_m[AXIS] + direction[AXIS] * t_m);
        // A pixel on a slanting surface is longer than wide: twice its width covers the most that a neighbour does not.
        let slack_m = (pixels.spread + pixels.spread) * t_m;
        let of_object = |object: &ObjectInView| {
            let from = |towards| (object.parts_may_shade(group, &at_m, towards, slack_m) & lanes).any();
            shadows.towards_each().iter().any(from)
        };
        objects.iter().any(of_object)
    }
}

/// Light of rays among moving objects: traces the fixed scene, then each object that is near, and shades what is nearest.
pub(super) struct AmongObjects<'a, 'b> {
    pub view: &'a View<'b>,
    pub aim: &'a Aim<'a>,
    pub bearing: Vectors,
    pub pose: Turns,
    /// What the rays meet of the fixed scene.
    pub traced: Traced,
    pub stack: &'a mut Stack,
}

impl Kernel for AmongObjects<'_, '_> {
    type Output = ([Floats; BANDS], NearestHits);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { view, aim, bearing, pose, mut traced, stack } = self;
        let Objects { all, group, instants } = aim.objects;
        // Rays that end before they begin.
        let ended = Floats::splat(-1.0);
        let is_ray = Floats::splat(0.0).below(traced.packet.t_max);
        let mut distance_m = traced.hits.t;
        // Numbers of objects, what rays met of them, and the poses of the rays in their frames.
        let mut met: Vec<(usize, Traced, Turns)> = Vec::new();
        for (number, object) in all.iter().enumerate() {
            if !object.may_be_near(group, &bearing, Floats::splat(0.0)) {
                continue;
            }
            let mut gathered = None;
            let own_pose = instants.of(&object.timelines[group], &mut gathered).at(aim.share);
            let packet = Packet {
                origin_m: own_pose.place_m(),
                direction: own_pose.turned(bearing),
                t_min: Floats::splat(0.0),
                t_max: is_ray.select(distance_m, ended),
            };
            let mut own = Traced::through(&object.lit, packet, stack);
            let lanes = hit(&own.hits.triangle) & is_ray;
            if !lanes.any() {
                continue;
            }
            distance_m = lanes.select(own.hits.t, distance_m);
            // Nearer than all before.
            traced.packet.t_max = lanes.select(ended, traced.packet.t_max);
            for (_, other, _) in &mut met {
                other.packet.t_max = lanes.select(ended, other.packet.t_max);
            }
            own.packet.t_max = lanes.select(own.packet.t_max, ended);
            met.push((number, own, own_pose));
        }
        let mut lux = view.light_of(&traced, aim, &Filter::Primary { bearing: &bearing, pose: &pose }, stack);
        let mut object = [0; LANES];
        for (number, traced, pose) in &met {
            let seen = &all[*number];
            let mut gathered = None;
            let motion = instants.of(&seen.timelines[group], &mut gathered);
            let of_object = View { scene: &seen.lit, reflections: 0, ..*view };
            let own_aim = Aim { motion, objects: Objects { all: &[], ..aim.objects }, ..*aim };
            let (own, _) = of_object.shade(traced, &own_aim, &Filter::Primary { bearing: &bearing, pose }, stack);
            let lanes = Floats::splat(0.0).below(traced.packet.t_max);
            for band in 0..BANDS {
                lux[band] = lanes.select(own[band], lux[band]);
            }
            for lane in 0..LANES {
                object[lane] = if lanes.0[lane] == 0 { object[lane] } else { u32_from(*number + 1) };
            }
        }
        (lux, NearestHits { distance_m, object })
    }
}

/// Lanes that met something.
#[inline(always)]
fn hit(triangles: &[u32; LANES]) -> Mask {
    Mask(std::array::from_fn(|lane| if triangles[lane] == MISS { 0 } else { u32::MAX }))
}
