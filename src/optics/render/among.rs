//! Rays among moving objects: the kernel that traces them, and the tiles that may see any.

use super::super::motion::Timeline;
use super::objects::{ObjectInView, Objects};
use super::settings::{COLUMNS, ROWS};
use super::view::{Met, ObjectHits, PacketPixels, PacketSamples, Traced, View};
use crate::num::index;
use crate::scene::lanes::{Floats, LANES, unrolled};
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
            view.may_show(objects, (group, &timelines[group]), &pixels, &mut stack)
        };
        (0..width.div_ceil(COLUMNS)).map(&mut is_in_view).collect()
    };
    let tiles: Vec<Vec<bool>> = crate::parallel::collected(height.div_ceil(ROWS), of_group);
    // A pixel may show a sliver of a surface that the ray through its corner passed by: then a neighbour shows more of it.
    let beside = |number: usize, count: usize| number.saturating_sub(1)..(number + 2).min(count);
    let grown = |group: usize| {
        let is_near = |tile: usize| {
            beside(group, tiles.len()).any(|group| beside(tile, tiles[group].len()).any(|tile| tiles[group][tile]))
        };
        (0..tiles[group].len()).map(is_near).collect()
    };
    (0..tiles.len()).map(grown).collect()
}

impl View<'_> {
    /// Whether a still camera may see an object or its shadow through the first corners of some pixels, or a mirror that may show one.
    fn may_show(
        &self,
        objects: &[ObjectInView],
        (group, timeline): (usize, &Timeline),
        pixels: &PacketPixels,
        stack: &mut Stack,
    ) -> bool {
        let pose = timeline.pieces[0].at(Floats::splat(0.0));
        let direction = pose.turned(pixels.corners[0]);
        let packet =
            Packet { origin_m: pose.translation_m(), direction, t_min: Floats::splat(0.0), t_max: pixels.t_max };
        // A pixel on a slanting surface is longer than wide: twice its width covers the most that a neighbour does not.
        let slack = pixels.spread + pixels.spread;
        if objects.iter().any(|object| object.may_be_met(group, &packet, slack)) {
            return true;
        }
        let scene = self.scene.scene();
        let hits = closest_through(&scene.bvh, &BackfaceCulled(&scene.mesh), &packet, stack);
        let lanes = hits.met();
        let mirrors = |&triangle: &u32| triangle != MISS && self.scene.face(triangle).has_gloss(self.follows_gloss);
        if self.reflections > 0 && !objects.is_empty() && hits.triangle.iter().any(mirrors) {
            return true;
        }
        let Some(shadows) = self.scene.traced_shadows() else { return false };
        let t_m = lanes.select(hits.t, Floats::splat(0.0));
        let at_m = unrolled!(AXIS in 3 => packet.origin_m[AXIS] + direction[AXIS] * t_m);
        let of_object = |object: &ObjectInView| {
            let from = |source| (object.parts_may_shade(group, &at_m, source, slack * t_m) & lanes).any();
            shadows.bounds_of_each().iter().any(from)
        };
        objects.iter().any(of_object)
    }
}

/// Finds which rays meet an object before the static scene.
pub(super) struct AmongObjects<'a> {
    pub samples: &'a PacketSamples<'a>,
    /// In the camera's frame.
    pub rays: Packet,
    /// The same rays in the world, and what they meet of the static scene.
    pub fixed: Traced,
    pub stack: &'a mut Stack,
}

impl Kernel for AmongObjects<'_> {
    type Output = Met;

    #[inline(always)]
    fn run(self) -> Met {
        let Self { samples, rays, mut fixed, stack } = self;
        let Objects { all, group, instants } = samples.objects;
        // Rays that end before they begin.
        let ended = Floats::splat(-1.0);
        let is_ray = Floats::splat(0.0).below(fixed.packet.t_max);
        let world = fixed.packet;
        let mut distance_m = fixed.hits.t;
        let mut objects: Vec<ObjectHits> = Vec::new();
        for (number, object) in all.iter().enumerate() {
            if !object.may_be_met(group, &world, Floats::splat(0.0)) {
                continue;
            }
            let mut gathered = None;
            let pose = instants.of(&object.timelines[group], &mut gathered).at(samples.share);
            let packet = Packet { t_max: is_ray.select(distance_m, ended), ..pose.rays(&rays) };
            let mut traced = Traced::through(&object.lit, packet, stack);
            let lanes = traced.hits.met() & is_ray;
            if !lanes.any() {
                continue;
            }
            distance_m = lanes.select(traced.hits.t, distance_m);
            // Nearer than all before.
            fixed.packet.t_max = lanes.select(ended, fixed.packet.t_max);
            for other in &mut objects {
                other.traced.packet.t_max = lanes.select(ended, other.traced.packet.t_max);
            }
            traced.packet.t_max = lanes.select(traced.packet.t_max, ended);
            objects.push(ObjectHits { object: number, traced, pose });
        }
        Met { fixed, objects }
    }
}
