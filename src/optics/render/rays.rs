//! Packets of sixteen rays: generation, tracing, and shading by groups that met one surface. The kernels of `tile` and `pixel` share it.

use super::among::AmongObjects;
use super::reflect::Reflection;
use super::shadows::{EdgeShadows, ObjectShadows, OnSurface};
use super::view::{Aim, Filter, NearestHits, Traced, View, lane3};
use crate::optics::motion::Turns;
use crate::scene::lanes::{Floats, LANES, Mask, Vectors, next_lane, unrolled};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{MapTexels, OnTriangle, by_band};
use crate::scene::texture::Footprint;
use crate::scene::texture::footprint::{Differentials, Look, footprint};
use crate::scene::tracer::{MISS, Packet, Stack};
use crate::simd::{Kernel, dispatch};

impl Aim<'_> {
    /// Bearings, poses and rays.
    #[inline(always)]
    fn rays(&self) -> (Vectors, Turns, Packet) {
        let bearing = bilinear(&self.pixels.corners, self.place[0], self.place[1]);
        let pose = self.motion.at(self.share);
        let (origin_m, direction) = (pose.place_m(), pose.turned(bearing));
        let mut t_max = self.pixels.t_max;
        for lane in 0..LANES {
            t_max.0[lane] = if lane < self.lanes { t_max.0[lane] } else { -1.0 };
        }
        (bearing, pose, Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max })
    }

    /// How far the end of a lane's ray goes in metres over the whole exposure, `t_m` along its bearing.
    #[inline(always)]
    fn travel_m(&self, lane: usize, bearing: [f32; 3], t_m: f32) -> [f32; 3] {
        let mut travel_m = [0.0; 3];
        if self.pieces > 0.0 {
            let change = self.motion.change_of(lane, self.share.0[lane], self.pieces);
            let (place_m, turn) = (change.place_m(), change.turned(bearing));
            for axis in 0..3 {
                travel_m[axis] = place_m[axis] + turn[axis] * t_m;
            }
        }
        travel_m
    }

    /// Where the look-ups of textures go.
    #[inline(always)]
    fn look(&self) -> Look {
        let half = Floats::splat(0.5);
        match self.moves {
            Some(moves) => Look::By(*moves),
            None => Look::Inwards([self.place[0] - half, self.place[1] - half, self.place[2] - half]),
        }
    }
}

impl View<'_> {
    /// Photons of a sample in each lane, and what it met.
    #[inline(always)]
    pub fn sample(&self, aim: &Aim, stack: &mut Stack) -> (Floats, NearestHits) {
        let (bearing, pose, packet) = aim.rays();
        let traced = Traced::through(self.scene, packet, stack);
        let ([r, g, b, n], nearest) = if aim.objects.all.is_empty() {
            let lux = self.light_of(&traced, aim, &Filter::Primary { bearing: &bearing, pose: &pose }, stack);
            (lux, NearestHits { distance_m: traced.hits.t, object: [0; LANES] })
        } else {
            dispatch(AmongObjects { view: self, aim, bearing, pose, traced, stack })
        };
        let [per_r, per_g, per_b, per_n] = aim.pixels.photons_per_lux;
        let mut roll_off = Floats::splat(0.0);
        for lane in 0..LANES {
            roll_off.0[lane] = self.camera.roll_off_at(bearing[2].0[lane]);
        }
        ((r * per_r + g * per_g + b * per_b + n * per_n) * roll_off, nearest)
    }

    /// Light by band of what each ray met, with what gloss reflects of the fixed scene.
    #[inline(always)]
    pub fn light_of(&self, traced: &Traced, aim: &Aim, filter: &Filter, stack: &mut Stack) -> [Floats; BANDS] {
        let (lux, is_glossy) = self.shade(traced, aim, filter, stack);
        if self.reflections > 0 && is_glossy {
            return dispatch(Reflection { view: self, traced, aim, lux, stack });
        }
        lux
    }

    /// Light by band of what each ray met, and whether any of that keeps an image. Rays that met one triangle at about one distance are
    /// shaded together: one texture footprint serves them all.
    #[inline(always)]
    pub fn shade(&self, traced: &Traced, aim: &Aim, filter: &Filter, stack: &mut Stack) -> ([Floats; BANDS], bool) {
        let hits = &traced.hits;
        let mut unshaded = Floats::splat(0.0).below(traced.packet.t_max);
        let (mut lux, mut is_glossy) = ([Floats::splat(0.0); BANDS], false);
        while unshaded.any() {
            let leader = if unshaded.0[MIDDLE] != 0 { MIDDLE } else { next_lane(&mut unshaded.bits()) };
            let triangle = hits.triangle[leader];
            let t_m = Floats::splat(hits.t.0[leader]);
            let mut lanes = (hits.t - t_m).abs().at_most(t_m * Floats::splat(ALIKE)) & unshaded;
            for lane in 0..LANES {
                lanes.0[lane] &= if hits.triangle[lane] == triangle { u32::MAX } else { 0 };
            }
            // Whatever its distance is, a leader is one of its group, so that the loop ends.
            lanes.0[leader] = u32::MAX;
            let light = if triangle == MISS {
                self.sky(traced, lanes)
            } else {
                is_glossy |= self.scene.face(triangle).has_gloss(self.follows_gloss);
                let maps = if self.scene.face(triangle).has_maps() {
                    dispatch(MapLookUp { view: self, traced, leader, lanes, aim, filter })
                } else {
                    MapTexels::NONE
                };
                let surface = (triangle, lanes, maps.normals.as_ref());
                let added = self.added_light(traced, surface, aim, filter, stack);
                self.surface(traced, (leader, lanes), aim, filter, [added.as_ref(), maps.emission.as_ref()])
            };
            lux = unrolled!(BAND in 4 => lanes.select(light[BAND], lux[BAND]));
            for lane in 0..LANES {
                unshaded.0[lane] &= !lanes.0[lane];
            }
        }
        (lux, is_glossy)
    }

    /// What is added to the baked irradiance of rays that met a triangle: beside edges of shadows, in shadows of objects, on normal maps.
    #[inline(always)]
    fn added_light(
        &self,
        traced: &Traced,
        (triangle, lanes, normals): (u32, Mask, Option<&[Bands; LANES]>),
        aim: &Aim,
        filter: &Filter,
        stack: &mut Stack,
    ) -> Option<[Floats; BANDS]> {
        let shadows = self.scene.sources()?;
        let seeds = &aim.pixels.facet_seeds;
        let surface = OnSurface { view: self, shadows, traced, triangle, lanes, aim, seeds };
        let mut sources = 0;
        if self.scene.face(triangle).has_shadow_edges() {
            let Traced { hits, packet } = traced;
            sources = self.scene.sources_around(shadows, triangle, lanes, [hits.u, hits.v], &packet.direction);
        }
        let is_changed = sources != 0 || normals.is_some();
        let of_edges = is_changed.then(|| dispatch(EdgeShadows { surface, sources, normals, stack }));
        let pose = match filter {
            Filter::Primary { pose, .. } if !aim.objects.all.is_empty() && shadows.are_traced() => pose,
            // Mirrors show no objects, and none of their shadows.
            Filter::Primary { .. } | Filter::Reflected { .. } => return of_edges,
        };
        let of_objects = dispatch(ObjectShadows { surface, pose, stack });
        Some(match of_edges {
            None => of_objects,
            Some(of_edges) => unrolled!(BAND in 4 => of_edges[BAND] + of_objects[BAND]),
        })
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

    /// What the leader's look-ups average over, and how far each lane's is moved.
    #[inline(always)]
    fn footprint(&self, traced: &Traced, leader: usize, aim: &Aim, filter: &Filter) -> (Footprint, [Floats; 2]) {
        let Traced { hits, packet } = traced;
        match filter {
            Filter::Primary { bearing, pose } => {
                let (face, t_m) = (self.scene.face(hits.triangle[leader]), hits.t.0[leader]);
                let pose = pose.lane(leader);
                let to_corner_m = |corner: usize| aim.pixels.to_corner_m([leader, corner], &pose, t_m);
                let ray = Differentials {
                    normal: face.normal(),
                    slopes: face.slopes(),
                    direction: lane3(&packet.direction, leader),
                    steps_m: [to_corner_m(1), to_corner_m(2), aim.travel_m(leader, lane3(bearing, leader), t_m)],
                    pixel_m: aim.pixels.spread.0[leader] * t_m,
                };
                footprint(&ray, &aim.look(), aim.shares)
            }
            Filter::Reflected { width_m } => {
                let width_texels = self.scene.texels_per_m(hits.triangle[leader]) * width_m.0[leader];
                (Footprint::round(width_texels), [Floats::splat(0.0); 2])
            }
        }
    }

    /// Light of the triangle that some rays met, of which the leader's footprint serves all. `added` and `emission`: as in `OnTriangle`.
    #[inline(always)]
    fn surface(
        &self,
        traced: &Traced,
        (leader, lanes): (usize, Mask),
        aim: &Aim,
        filter: &Filter,
        [added, emission]: [Option<&[Floats; BANDS]>; 2],
    ) -> [Floats; BANDS] {
        let Traced { hits, packet } = traced;
        let triangle = hits.triangle[leader];
        let face = self.scene.face(triangle);
        let [u, v] = weights(traced, leader, lanes);
        let mut colours = [Floats::splat(1.0); BANDS];
        if let Some(texture) = self.scene.texture_of(face) {
            let (footprint, shift_texels) = self.footprint(traced, leader, aim, filter);
            colours = by_band(&texture.over_alike(&face.uv(u, v), &shift_texels, &footprint, lanes));
        }
        let direction = &packet.direction;
        let rays = OnTriangle { triangle, lanes, u, v, direction, lamp_levels: aim.lamp_levels, added, emission };
        self.scene.exitances_lux(&rays, &colours)
    }
}

/// Weights of a triangle's second and third corner where some rays met it; the leader's in the other lanes.
#[inline(always)]
fn weights(traced: &Traced, leader: usize, lanes: Mask) -> [Floats; 2] {
    [traced.hits.u, traced.hits.v].map(|weight| lanes.select(weight, Floats::splat(weight.0[leader])))
}

/// Maps of a triangle that some rays met. It stands apart, because surfaces without maps are not to pay for it.
struct MapLookUp<'a, 'b> {
    view: &'a View<'b>,
    traced: &'a Traced,
    leader: usize,
    lanes: Mask,
    aim: &'a Aim<'a>,
    filter: &'a Filter<'a>,
}

impl Kernel for MapLookUp<'_, '_> {
    type Output = MapTexels;

    #[inline(always)]
    fn run(self) -> MapTexels {
        let Self { view, traced, leader, lanes, aim, filter } = self;
        let triangle = traced.hits.triangle[leader];
        let face = view.scene.face(triangle);
        let Some(texture) = view.scene.texture_of(face) else { return MapTexels::NONE };
        let (footprint, shift_texels) = view.footprint(traced, leader, aim, filter);
        let [u, v] = weights(traced, leader, lanes);
        view.scene.map_texels((triangle, texture), &face.uv(u, v), (&shift_texels, &footprint), lanes)
    }
}

/// A lane in the middle of a tile.
const MIDDLE: usize = LANES / 2 + 1;

/// Share of the distance by which the rays of a packet may differ that have one ellipse. Distances to a plane go as one over the cosine to
/// it, so the ellipse's width and length are off by as much and by twice that at the packet's rim: by 3 and 6 % of a sample's share of
/// the pixel where the middle lies amid.
const ALIKE: f32 = 1.0 / 16.0;

/// Bearings at shares x (to the right) and y (downwards) of pixels.
#[inline(always)]
pub(in crate::optics) fn bilinear(corners: &[Vectors; 4], x: Floats, y: Floats) -> Vectors {
    unrolled!(AXIS in 3 => {
        let above = corners[0][AXIS] + (corners[1][AXIS] - corners[0][AXIS]) * x;
        let below = corners[2][AXIS] + (corners[3][AXIS] - corners[2][AXIS]) * x;
        above + (below - above) * y
    })
}
