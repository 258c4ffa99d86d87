//! Packets of sixteen rays: generation, tracing, and shading by groups that met one surface.

use super::among::AmongObjects;
use super::objects::Objects;
use super::reflect::Reflection;
use super::shadows::{EdgeShadows, ObjectShadows, OnSurface};
use super::view::{Filter, Met, NearestHits, ObjectHits, PacketSamples, Traced, View, lane3};
use crate::scene::lanes::{Floats, LANES, Mask, Vectors, next_lane, unrolled};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{MapTexels, OnTriangle, by_band};
use crate::scene::texture::Footprint;
use crate::scene::texture::footprint::{Differentials, footprint};
use crate::scene::tracer::{MISS, Packet, Stack};
use crate::simd::{Kernel, dispatch};

impl PacketSamples<'_> {
    /// How far the end of a lane's ray goes in metres over the whole exposure, `t_m` along its bearing.
    #[inline(always)]
    fn travel_m(&self, lane: usize, bearing: [f32; 3], t_m: f32) -> [f32; 3] {
        let mut travel_m = [0.0; 3];
        if self.pieces > 0.0 {
            let change = self.motion.change_of(lane, self.share.0[lane], self.pieces);
            let (shift_m, turn) = (change.translation_m(), change.turned(bearing));
            for axis in 0..3 {
                travel_m[axis] = shift_m[axis] + turn[axis] * t_m;
            }
        }
        travel_m
    }
}

impl View<'_> {
    /// What rays meet that were traced through the static scene; `rays`: the same in the camera's frame.
    #[inline(always)]
    pub fn among_objects(&self, fixed: Traced, rays: Packet, samples: &PacketSamples, stack: &mut Stack) -> Met {
        if samples.objects.all.is_empty() {
            return Met { fixed, objects: Vec::new() };
        }
        dispatch(AmongObjects { samples, rays, fixed, stack })
    }

    /// Light by band of what each ray met, and whether any of that keeps an image.
    pub fn shade(
        &self,
        met: &Met,
        samples: &PacketSamples,
        filter: &Filter,
        stack: &mut Stack,
    ) -> ([Floats; BANDS], bool) {
        let (mut lux, mut is_glossy) = dispatch(Shading { view: self, traced: &met.fixed, samples, filter, stack });
        for ObjectHits { object, traced, pose } in &met.objects {
            let object_in_view = &samples.objects.all[*object];
            let mut gathered = None;
            let motion = samples.objects.instants.of(&object_in_view.timelines[samples.objects.group], &mut gathered);
            let samples = &PacketSamples { motion, objects: Objects { all: &[], ..samples.objects }, ..*samples };
            let filter = &match *filter {
                Filter::Primary { bearing, .. } => Filter::Primary { bearing, pose },
                Filter::Reflected { width_m, .. } => Filter::Reflected { width_m, pose },
            };
            let view = &View { scene: &object_in_view.lit, ..*self };
            let (own, keeps_image) = dispatch(Shading { view, traced, samples, filter, stack });
            is_glossy |= keeps_image;
            let lanes = Floats::splat(0.0).below(traced.packet.t_max);
            lux = unrolled!(BAND in 4 => lanes.select(own[BAND], lux[BAND]));
        }
        (lux, is_glossy)
    }

    #[inline(always)]
    fn sky(&self, traced: &Traced, lanes: Mask) -> [Floats; BANDS] {
        let mut lux = [[0.0; BANDS]; LANES];
        let mut rest = lanes.bits();
        while rest != 0 {
            let lane = next_lane(&mut rest);
            lux[lane] = self.scene.sky_lux(lane3(&traced.packet.direction, lane));
        }
        by_band(&lux)
    }
}

/// Photons of a sample in each lane, and what it met. It is compiled once for the kernels of `tile` and `pixel`.
pub(super) struct Sample<'a, 'b> {
    pub view: &'a View<'b>,
    pub samples: &'a PacketSamples<'a>,
    pub stack: &'a mut Stack,
}

impl Kernel for Sample<'_, '_> {
    type Output = (Floats, NearestHits);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { view, samples, stack } = self;
        let bearing = bilinear(&samples.pixels.corners, samples.coordinates[0], samples.coordinates[1]);
        let pose = samples.motion.at(samples.share);
        let (origin_m, direction) = (pose.translation_m(), pose.turned(bearing));
        let mut t_max = samples.pixels.t_max;
        for lane in 0..LANES {
            t_max.0[lane] = if lane < samples.lanes { t_max.0[lane] } else { -1.0 };
        }
        let packet = Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max };
        let fixed = Traced::through(view.scene, packet, stack);
        let from_camera = Packet { origin_m: [Floats::splat(0.0); 3], direction: bearing, ..packet };
        let met = view.among_objects(fixed, from_camera, samples, stack);
        let nearest = met.nearest();
        let (lux, is_glossy) = view.shade(&met, samples, &Filter::Primary { bearing: &bearing, pose: &pose }, stack);
        let reflection = Reflection { view, met, samples, pose: &pose, lux, stack };
        let [r, g, b, n] = if view.reflections > 0 && is_glossy { dispatch(reflection) } else { lux };
        let [per_r, per_g, per_b, per_n] = samples.pixels.photons_per_lux;
        let mut roll_off = Floats::splat(0.0);
        for lane in 0..LANES {
            roll_off.0[lane] = view.camera.roll_off_at(bearing[2].0[lane]);
        }
        ((r * per_r + g * per_g + b * per_b + n * per_n) * roll_off, nearest)
    }
}

/// Light by band of what rays met of the static scene or of one object, and whether any of that keeps an image. Rays that met one triangle
/// at about one distance are shaded together: one texture footprint serves them all.
struct Shading<'a, 'b> {
    view: &'a View<'b>,
    traced: &'a Traced,
    samples: &'a PacketSamples<'a>,
    filter: &'a Filter<'a>,
    stack: &'a mut Stack,
}

impl Kernel for Shading<'_, '_> {
    type Output = ([Floats; BANDS], bool);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { view, traced, samples, filter, stack } = self;
        let hits = &traced.hits;
        let mut unshaded = Floats::splat(0.0).below(traced.packet.t_max);
        let (mut lux, mut is_glossy) = ([Floats::splat(0.0); BANDS], false);
        while unshaded.any() {
            let leader = if unshaded.0[MIDDLE] != 0 { MIDDLE } else { next_lane(&mut unshaded.bits()) };
            let triangle = hits.triangle[leader];
            let t_m = Floats::splat(hits.t.0[leader]);
            let mut lanes = (hits.t - t_m).abs().at_most(t_m * Floats::splat(DISTANCE_SPREAD_MAX)) & unshaded;
            for lane in 0..LANES {
                lanes.0[lane] &= if hits.triangle[lane] == triangle { u32::MAX } else { 0 };
            }
            // Whatever its distance is, a leader is one of its group, so that the loop ends.
            lanes.0[leader] = u32::MAX;
            let light = if triangle == MISS {
                view.sky(traced, lanes)
            } else {
                let face = view.scene.face(triangle);
                is_glossy |= face.has_gloss(view.follows_gloss);
                let group = Group { view, traced, triangle, leader, lanes, samples, filter };
                let maps = if face.has_maps() { dispatch(MapLookUp(group)) } else { MapTexels::NONE };
                let added = group.added_light(maps.normals.as_ref(), stack);
                group.light([added.as_ref(), maps.emission.as_ref()])
            };
            lux = unrolled!(BAND in 4 => lanes.select(light[BAND], lux[BAND]));
            for lane in 0..LANES {
                unshaded.0[lane] &= !lanes.0[lane];
            }
        }
        (lux, is_glossy)
    }
}

/// Rays of a packet that met one triangle at about one distance.
#[derive(Clone, Copy)]
struct Group<'a, 'b> {
    view: &'a View<'b>,
    traced: &'a Traced,
    triangle: u32,
    /// The lane whose footprint serves all.
    leader: usize,
    lanes: Mask,
    samples: &'a PacketSamples<'a>,
    filter: &'a Filter<'a>,
}

impl Group<'_, '_> {
    /// What is added to the baked irradiance: beside edges of shadows, in shadows of objects, on normal maps.
    #[inline(always)]
    fn added_light(&self, normals: Option<&[Bands; LANES]>, stack: &mut Stack) -> Option<[Floats; BANDS]> {
        let Self { view, traced, triangle, lanes, samples, .. } = *self;
        let shadows = view.scene.shadows()?;
        let seeds = &samples.pixels.facet_seeds;
        let surface = OnSurface { view, shadows, traced, triangle, lanes, samples, seeds };
        let mut sources = 0;
        if view.scene.face(triangle).has_shadow_edges() {
            let Traced { hits, packet } = traced;
            sources = view.scene.sources_around(shadows, triangle, lanes, [hits.u, hits.v], &packet.direction);
        }
        let is_changed = sources != 0 || normals.is_some();
        let of_edges = is_changed.then(|| dispatch(EdgeShadows { surface, sources, normals, stack }));
        if samples.objects.all.is_empty() || !shadows.are_traced() {
            return of_edges;
        }
        let (Filter::Primary { pose, .. } | Filter::Reflected { pose, .. }) = self.filter;
        let of_objects = dispatch(ObjectShadows { surface, pose, stack });
        Some(match of_edges {
            None => of_objects,
            Some(of_edges) => unrolled!(BAND in 4 => of_edges[BAND] + of_objects[BAND]),
        })
    }

    /// What the leader's look-ups average over, and how far each lane's is moved.
    #[inline(always)]
    fn footprint(&self) -> (Footprint, [Floats; 2]) {
        let Self { view, traced: Traced { hits, packet }, triangle, leader, samples, .. } = *self;
        match self.filter {
            Filter::Primary { bearing, pose } => {
                let (face, pose, t_m) = (view.scene.face(triangle), pose.lane(leader), hits.t.0[leader]);
                let right_m = samples.pixels.step_m([leader, 1], &pose, t_m);
                let down_m = samples.pixels.step_m([leader, 2], &pose, t_m);
                let ray = Differentials {
                    normal: face.normal(),
                    slopes: face.slopes(),
                    direction: lane3(&packet.direction, leader),
                    steps_m: [right_m, down_m, samples.travel_m(leader, lane3(bearing, leader), t_m)],
                    pixel_m: samples.pixels.spread.0[leader] * t_m,
                };
                footprint(&ray, &samples.look, samples.shares)
            }
            Filter::Reflected { width_m, .. } => {
                let width_texels = view.scene.texels_per_m(triangle) * width_m.0[leader];
                (Footprint::round(width_texels), [Floats::splat(0.0); 2])
            }
        }
    }

    /// Weights of the triangle's second and third corner; the leader's in the other lanes.
    #[inline(always)]
    fn weights(&self) -> [Floats; 2] {
        let hits = &self.traced.hits;
        [hits.u, hits.v].map(|weight| self.lanes.select(weight, Floats::splat(weight.0[self.leader])))
    }

    /// Light of the triangle. `added` and `emission`: as in `OnTriangle`.
    #[inline(always)]
    fn light(&self, [added, emission]: [Option<&[Floats; BANDS]>; 2]) -> [Floats; BANDS] {
        let Self { view, traced, triangle, lanes, samples, .. } = *self;
        let face = view.scene.face(triangle);
        let [u, v] = self.weights();
        let mut colours = [Floats::splat(1.0); BANDS];
        if let Some(texture) = view.scene.texture_of(face) {
            let (footprint, shift_texels) = self.footprint();
            colours = by_band(&texture.over_alike(&face.uv(u, v), &shift_texels, &footprint, lanes));
        }
        let direction = &traced.packet.direction;
        let rays = OnTriangle { triangle, lanes, u, v, direction, lamp_levels: samples.lamp_levels, added, emission };
        view.scene.exitance_lux_alike(&rays, &colours)
    }
}

/// Maps of a triangle. It stands apart, because surfaces without maps are not to pay for it.
struct MapLookUp<'a, 'b>(Group<'a, 'b>);

impl Kernel for MapLookUp<'_, '_> {
    type Output = MapTexels;

    #[inline(always)]
    fn run(self) -> MapTexels {
        let Group { view, triangle, lanes, .. } = self.0;
        let face = view.scene.face(triangle);
        let Some(texture) = view.scene.texture_of(face) else { return MapTexels::NONE };
        let (footprint, shift_texels) = self.0.footprint();
        let [u, v] = self.0.weights();
        view.scene.map_texels((triangle, texture), &face.uv(u, v), (&shift_texels, &footprint), lanes)
    }
}

/// A lane in the middle of a tile.
const MIDDLE: usize = LANES / 2 + 1;

/// Share of the distance by which the rays of a packet may differ that have one ellipse. Distances to a plane go as one over the cosine to
/// it, so the ellipse's width and length are off by as much and by twice that at the packet's rim: by 3 and 6 % of a sample's share of
/// the pixel where distances differ by this in all and the leader's is in their middle.
const DISTANCE_SPREAD_MAX: f32 = 1.0 / 16.0;

/// Bearings at shares x (to the right) and y (downwards) of pixels.
#[inline(always)]
pub(in crate::optics) fn bilinear(corners: &[Vectors; 4], x: Floats, y: Floats) -> Vectors {
    unrolled!(AXIS in 3 => {
        let above = corners[0][AXIS] + (corners[1][AXIS] - corners[0][AXIS]) * x;
        let below = corners[2][AXIS] + (corners[3][AXIS] - corners[2][AXIS]) * x;
        above + (below - above) * y
    })
}
