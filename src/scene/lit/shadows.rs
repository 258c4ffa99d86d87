//! Direct light at the edges of shadows: which sources a hit has to ask for, and what an answer changes.
//!
//! Between samples that a source lights differently, its baked light is replaced by its unoccluded light, interpolated, times what a ray to
//! a random point on it finds: 0 or 1. Where nothing stands between, that is the baked light again, to the last digit but one. So there is
//! neither noise nor a seam where no shadow is.

use super::super::bake::light_points::{LightPoints, ShadowRay};
use super::super::bake::{Bake, Extent, ListedLight, Source, SourceLight, SourceLists};
use super::super::geometry::Scene;
use super::super::lanes::{Floats, LANES, Mask, Vectors, dot3, splat3, unrolled};
use super::super::light::{BANDS, Bands, luminance};
use super::super::tracer::come_near;
use super::super::vectors::{dot, sub};
use crate::num::{f32_from_u32, f32_nearest, greater, index, u32_from};

/// Points on the lamps of each material and in each bulb; a disc as the sun's has a quarter.
const POINTS: usize = 256;
/// Directions are the same for all fans, which are not used here.
const FAN: usize = 16;
/// Points on lamps in all, at most.
const POINTS_MAX: usize = 16_384;
/// Bright parts of a sky that reach further from their middle, in radians, cast no shadows of objects: any hit might lie in one.
const WIDE_RAD: f32 = 0.5;

/// Light on a mapped normal is at most one over this times that on the smooth one: a source that stands lower is a sliver of the bake.
const TILTED_COS_MIN: f32 = 0.1;

/// What the shadows of a scene are traced by, and what its normal maps are lit by.
#[derive(Clone, Debug)]
pub struct Shadows {
    /// Points on sources.
    pub(super) light_points: LightPoints,
    /// Colour of each source, of luminance 1, in lux-equivalents by band; and whether it flickers.
    colours: Vec<(Bands, bool)>,
    /// Light at the edges, and on normal maps, in lux.
    edges: SourceLists,
    on_normal_maps: SourceLists,
    /// Whether shadows are traced at all.
    are_traced: bool,
    /// The sources of each sample side's list, a bit each; empty without edges.
    sources_at: Vec<u16>,
    /// Of all sources, one a lane; and of each, in all lanes.
    bounds_by_lane: SourceBounds,
    bounds_of_each: Vec<SourceBounds>,
    lux_per_unit: f32,
}

/// Where sources are and how strong at most, lane by lane: all of them, or one in all lanes.
#[derive(Clone, Copy, Debug)]
pub struct SourceBounds {
    /// Middle in metres, or direction where it is infinitely far.
    middle_or_direction: Vectors,
    /// Radius in metres, or as an angle.
    radius: Floats,
    /// Greatest lux, at a metre from what is near.
    strength_lux: Floats,
    /// Mean of the unit vectors in which a source faces, and what its length lacks to 1.
    facing: Vectors,
    spread: Floats,
    is_far: Mask,
    /// Not of lanes without a source, nor of a sky's bright parts that are too wide for objects to cast shadows.
    is_source: Mask,
}

impl SourceBounds {
    /// One source in all lanes.
    #[inline(always)]
    fn one(source: &Source, lux_per_unit: f64) -> Self {
        let (middle_or_direction, radius, is_far, is_wide) = match source.extent {
            Extent::Ball { middle_m, radius_m } => (middle_m, radius_m, 0, false),
            Extent::Cone { direction, radius_rad } => (direction, radius_rad, u32::MAX, radius_rad > WIDE_RAD),
        };
        let radius = Floats::splat(radius);
        let strength_lux = Floats::splat(f32_nearest(source.strength * lux_per_unit));
        let facing = splat3(source.facing);
        let spread = Floats::splat(1.0 - dot(source.facing, source.facing).sqrt());
        Self {
            middle_or_direction: splat3(middle_or_direction),
            radius,
            strength_lux,
            facing,
            spread,
            is_far: Mask([is_far; LANES]),
            is_source: Mask([if is_wide { 0 } else { u32::MAX }; LANES]),
        }
    }

    fn all(each: &[Self]) -> Self {
        let (zero, none) = (Floats::splat(0.0), Mask([0; LANES]));
        let nowhere = [zero; 3];
        let mut all = Self {
            middle_or_direction: nowhere,
            radius: zero,
            strength_lux: zero,
            facing: nowhere,
            spread: zero,
            is_far: none,
            is_source: none,
        };
        for (lane, one) in each.iter().enumerate() {
            all.set(lane, one);
        }
        all
    }

    /// A source of each lane, by their numbers.
    #[inline(always)]
    pub fn chosen(each: &[Self], numbers: &[u32; LANES]) -> Self {
        let mut chosen = each[0];
        for lane in 0..LANES {
            chosen.set(lane, &each[index(numbers[lane])]);
        }
        chosen
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, one: &Self) {
        for axis in 0..3 {
            self.middle_or_direction[axis].0[lane] = one.middle_or_direction[axis].0[lane];
        }
        self.radius.0[lane] = one.radius.0[lane];
        self.strength_lux.0[lane] = one.strength_lux.0[lane];
        for axis in 0..3 {
            self.facing[axis].0[lane] = one.facing[axis].0[lane];
        }
        self.spread.0[lane] = one.spread.0[lane];
        (self.is_far.0[lane], self.is_source.0[lane]) = (one.is_far.0[lane], one.is_source.0[lane]);
    }

    /// Whether sources may give points more than the given lux.
    #[inline(always)]
    pub fn may_give(&self, at_m: &Vectors, lux: f32) -> Mask {
        let way_m = unrolled!(AXIS in 3 => self.middle_or_direction[AXIS] - at_m[AXIS]);
        let distance2 = self.is_far.select(Floats::splat(1.0), dot3(way_m, way_m));
        (Floats::splat(lux) * distance2).at_most(self.strength_lux) & self.is_source
    }

    /// About how many lux each source gives a point with a normal, if nothing stands between: from its middle.
    #[inline(always)]
    pub fn lux_at(&self, at_m: [f32; 3], normal: [f32; 3]) -> Floats {
        let (zero, at_m) = (Floats::splat(0.0), splat3(at_m));
        let way = unrolled!(AXIS in 3 => self.is_far.select(self.middle_or_direction[AXIS], self.middle_or_direction[AXIS] - at_m[AXIS]));
        let distance2 = dot3(way, way);
        let cos_here = dot3(way, splat3(normal)).greater(zero);
        let cos_there = (zero - dot3(way, self.facing)).greater(zero);
        let mut lux = self.strength_lux;
        for lane in 0..LANES {
            let distance = distance2.0[lane].sqrt();
            let seen = if self.is_far.0[lane] != 0 { 1.0 } else { cos_there.0[lane] / distance + self.spread.0[lane] };
            let per_strength =
                if distance > 0.0 { cos_here.0[lane] * seen / (distance * distance2.0[lane]) } else { 0.0 };
            lux.0[lane] = if self.is_source.0[lane] != 0 { lux.0[lane] * per_strength } else { 0.0 };
        }
        lux
    }

    /// Whether a ball may stand between points, each known to `slack_m`, and sources.
    #[inline(always)]
    pub fn may_be_blocked(&self, (middle_m, radius_m): ([f32; 3], f32), at_m: &Vectors, slack_m: Floats) -> Mask {
        let middle_m = splat3(middle_m);
        let way_m = unrolled!(AXIS in 3 => middle_m[AXIS] - at_m[AXIS]);
        let to = unrolled!(AXIS in 3 => self.is_far.select(self.middle_or_direction[AXIS], self.middle_or_direction[AXIS] - at_m[AXIS]));
        let along = dot3(way_m, to);
        let of_source = self.is_far.select(along.abs() * self.radius, self.radius);
        let reach_m = Floats::splat(radius_m) + slack_m + of_source;
        come_near(&way_m, &to, along, reach_m) & self.is_source
    }
}

/// Unit normals at a hit, on the ray's side.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    /// Between those of the triangle's corners.
    pub smooth: [f32; 3],
    /// By the normal map.
    pub mapped: [f32; 3],
}

impl Shadows {
    /// Of a scene whose radiances count `lux_per_unit`; none without light points.
    pub(super) fn of(scene: &Scene, bake: &Bake, lux_per_unit: f64) -> Option<Self> {
        let light_points = LightPoints::new(scene, (POINTS * scene.lamps.groups().max(1)).min(POINTS_MAX), FAN);
        if light_points.sources.is_empty() {
            return None;
        }
        let colours = light_points.sources.iter().map(|source| colour(scene, &light_points, source)).collect();
        let scaled = |lux: f32| f32_nearest(f64::from(lux) * lux_per_unit);
        let [edges, on_normal_maps] = [&bake.edges, &bake.on_normal_maps].map(|lists| {
            let mut lists = lists.clone();
            for ListedLight { light, .. } in &mut lists.lights {
                (light.unoccluded, light.received) = (scaled(light.unoccluded), scaled(light.received));
            }
            lists
        });
        let bits = |sample_side: usize| edges.at(sample_side).iter().fold(0, |bits, light| bits | 1 << light.source);
        let sources_at = (0..edges.starts.len().saturating_sub(1)).map(bits).collect();
        let bounds = light_points.sources.iter().map(|source| SourceBounds::one(source, lux_per_unit));
        let bounds_of_each: Vec<SourceBounds> = bounds.collect();
        Some(Self {
            light_points,
            colours,
            edges,
            on_normal_maps,
            are_traced: true,
            sources_at,
            bounds_by_lane: SourceBounds::all(&bounds_of_each),
            bounds_of_each,
            lux_per_unit: f32_nearest(lux_per_unit),
        })
    }

    /// Whether shadows are traced at all.
    #[inline(always)]
    pub fn are_traced(&self) -> bool {
        self.are_traced
    }

    /// The same, but none is traced.
    pub(super) fn untraced(&self) -> Self {
        Self { edges: SourceLists::default(), sources_at: Vec::new(), are_traced: false, ..self.clone() }
    }

    /// Adds all that does not follow from the scene.
    pub(super) fn hash_into(&self, hasher: &mut blake3::Hasher) {
        hasher.update(if self.are_traced { b"shadows" } else { b"sources" });
        for SourceLists { starts, lights } in [&self.edges, &self.on_normal_maps] {
            for start in starts {
                hasher.update(&start.to_le_bytes());
            }
            for ListedLight { source, light } in lights {
                hasher.update(&source.to_le_bytes());
                super::super::hashing::hash_floats(hasher, &[light.unoccluded, light.received]);
            }
        }
    }

    /// Bounds of each source, in all lanes, by their numbers.
    #[inline(always)]
    pub fn bounds_of_each(&self) -> &[SourceBounds] {
        &self.bounds_of_each
    }

    /// Lux by band that a source gives a point if all of it sends what a ray towards one of its points does.
    pub fn lux_by(&self, ray: &ShadowRay, source: u32) -> Bands {
        let points = f32_from_u32(u32_from(self.light_points.sources[index(source)].count));
        ray.sent.map(|band| f32_nearest(band) * ray.cone * points * self.lux_per_unit)
    }

    /// Colour of a source, of luminance 1.
    pub fn colour(&self, source: u32) -> &Bands {
        &self.colours[index(source)].0
    }

    /// Whether a source flickers.
    pub fn flickers(&self, source: u32) -> bool {
        self.colours[index(source)].1
    }

    /// Whether a sample side lies beside an edge.
    pub(super) fn has_edge(&self, sample_side: usize) -> bool {
        !self.edges.at(sample_side).is_empty()
    }

    /// Sources that light a sample side on a normal map.
    pub(super) fn on_normal_maps(&self, sample_side: usize) -> &[ListedLight] {
        self.on_normal_maps.at(sample_side)
    }

    /// Light of a source on a mapped normal, over that on the smooth one.
    pub fn tilted(&self, source: u32, at_m: [f32; 3], relief: &Relief) -> f32 {
        let way = match self.light_points.sources[index(source)].extent {
            Extent::Ball { middle_m, .. } => sub(middle_m, at_m),
            Extent::Cone { direction, .. } => direction,
        };
        let least = TILTED_COS_MIN * dot(way, way).sqrt();
        let [smooth, mapped] = [relief.smooth, relief.mapped].map(|normal| dot(normal, way));
        if smooth > 0.0 && mapped > 0.0 { mapped / if smooth > least { smooth } else { least } } else { 0.0 }
    }

    /// How much less and how much more light a sample side may have than is baked, if flickering sources are at most at a level.
    pub(super) fn changes(&self, sample_side: usize, level_most: f64) -> [[f64; BANDS]; 2] {
        let mut changes = [[0.0; BANDS]; 2];
        for ListedLight { source, light } in self.on_normal_maps.at(sample_side) {
            let level = if self.flickers(*source) { level_most } else { 1.0 };
            for (band, &colour) in self.colour(*source).iter().enumerate() {
                let lux = f64::from(light.received) * f64::from(colour) * level;
                changes[0][band] -= lux;
                changes[1][band] += lux / f64::from(TILTED_COS_MIN);
            }
        }
        for ListedLight { source, light } in self.edges.at(sample_side) {
            let level = if self.flickers(*source) { level_most } else { 1.0 };
            let (less, more) = (-f64::from(light.received), f64::from(light.unoccluded) - f64::from(light.received));
            for (band, &colour) in self.colour(*source).iter().enumerate() {
                changes[0][band] += less * f64::from(colour) * level;
                changes[1][band] += greater(more, 0.0) * f64::from(colour) * level;
            }
        }
        changes
    }

    /// Bounds of all sources: the lane is a source's number.
    #[inline(always)]
    pub fn bounds_by_lane(&self) -> &SourceBounds {
        &self.bounds_by_lane
    }

    /// Sources whose shadow ends beside a sample side: a bit each.
    #[inline(always)]
    pub(super) fn sources_at(&self, sample_side: usize) -> u32 {
        self.sources_at.get(sample_side).map_or(0, |&bits| u32::from(bits))
    }

    /// Light of a source whose shadow ends near a hit among three sample sides with their weights; none where one of them is not beside.
    #[inline]
    pub fn light(&self, source: u32, around: &[(usize, f32); 3]) -> Option<SourceLight> {
        let mut mixed = SourceLight::NONE;
        for &(sample_side, weight) in around {
            let ListedLight { light, .. } = self.edges.at(sample_side).iter().find(|light| light.source == source)?;
            mixed.unoccluded += light.unoccluded * weight;
            mixed.received += light.received * weight;
        }
        Some(mixed)
    }
}

/// Colour of a source's light, of luminance 1, and whether it flickers.
fn colour(scene: &Scene, light_points: &LightPoints, source: &Source) -> (Bands, bool) {
    let mut sum = [0.0_f64; BANDS];
    let mut add = |light: Bands| (0..BANDS).for_each(|band| sum[band] += f64::from(light[band]));
    let mut flickers = false;
    let (lamps, bulbs) = (light_points.lamp_points.len(), light_points.bulb_points.len());
    for number in source.first..source.first + source.count {
        if let Some(point) = light_points.lamp_points.get(number) {
            add(point.radiance);
            flickers = scene.flickers(point.material);
        } else if let Some(point) = light_points.bulb_points.get(number - lamps) {
            add(point.intensity);
            flickers = scene.flickers(point.material);
        } else {
            add(light_points.distant[number - lamps - bulbs].normal_irradiance);
        }
    }
    let all = luminance(sum);
    (if all > 0.0 { sum.map(|band| f32_nearest(band / all)) } else { [0.0; BANDS] }, flickers)
}
