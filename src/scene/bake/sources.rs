//! The strongest sources of a scene, whose shadows are followed one by one: each is a range of the light points.

use super::super::bulb::BulbPoint;
use super::super::environment::DistantLight;
use super::super::lamps::{LampPoint, Lamps};
use super::super::light::luminance;
use super::super::vectors::{dot, sub};
use crate::num::{f32_nearest, f64_from_usize};

/// Sources at most; those beyond count with all the rest.
pub const SOURCES_MAX: usize = 16;

/// A source is narrow where its radius is below this angle in radians, 3 degrees: half-shadows of what stands up to a metre away are then
/// about as narrow as a bake's samples stand apart.
const NARROW_RAD: f32 = 0.05;

/// A lamp, the sun or another bright part of the sky: consecutive light points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Number of its first light point: points on lamps come first, then points in bulbs, then directions.
    pub first: usize,
    /// How many it has.
    pub count: usize,
    /// How large it is, and where.
    pub extent: Extent,
    /// Greatest luminous intensity of what is near, illuminance of what is far on a surface that faces it; in the scene's units.
    pub strength: f64,
    /// Mean of the unit vectors in which it faces: of length 1 where it is flat, 0 where it shines to all sides.
    pub facing: [f32; 3],
}

/// How large a source is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// All of it lies so near to a point.
    Ball {
        /// The point.
        middle_m: [f32; 3],
        /// The distance.
        radius_m: f32,
    },
    /// Infinitely far, all within an angle of a direction.
    Cone {
        /// Towards it; of unit length where it is narrow.
        direction: [f32; 3],
        /// The angle.
        radius_rad: f32,
    },
}

impl Source {
    /// Whether it is narrow as seen from a point, so that all its points send about as much there.
    pub fn is_narrow(&self, at_m: [f32; 3]) -> bool {
        match self.extent {
            Extent::Ball { middle_m, radius_m } => {
                let way_m = sub(middle_m, at_m);
                radius_m * radius_m < NARROW_RAD * NARROW_RAD * dot(way_m, way_m)
            }
            Extent::Cone { radius_rad, .. } => radius_rad < NARROW_RAD,
        }
    }

    /// Whether a light point is one of its.
    #[inline]
    pub fn holds(&self, light_point: usize) -> bool {
        light_point.wrapping_sub(self.first) < self.count
    }
}

/// Luminance that a point on a surface has from a source, in the scene's units: with and without what stands between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceLight {
    /// If nothing stood between.
    pub unoccluded: f32,
    /// As it is.
    pub received: f32,
}

impl SourceLight {
    /// None.
    pub const NONE: Self = Self { unoccluded: 0.0, received: 0.0 };
}

/// The strongest sources of points on lamps, points in bulbs and directions of each distant source: all that is distant, then lamps and
/// bulbs by their intensity. Which they are does not depend on how many points there are.
pub fn sources(
    lamps: &Lamps,
    lamp_points: &[LampPoint],
    bulb_points: &[BulbPoint],
    distant: &[Vec<DistantLight>],
) -> Vec<Source> {
    let (lamps, bulbs) = lamps.intensities();
    let mut sources = Vec::new();
    let mut first = lamp_points.len() + bulb_points.len();
    for lights in distant {
        let (direction, radius_rad) = around(&lights.iter().map(|light| light.direction).collect::<Vec<_>>());
        let strength = lights.iter().map(|light| luminance(light.normal_irradiance.map(f64::from))).sum();
        sources.push(Source {
            first,
            count: lights.len(),
            extent: Extent::Cone { direction, radius_rad },
            strength,
            facing: [0.0; 3],
        });
        first += lights.len();
    }
    let of_lamp = |(lamp, &intensity): (u32, &f64)| {
        let first = lamp_points.partition_point(|point| point.lamp < lamp);
        let points = lamp_points[first..].iter().take_while(|point| point.lamp == lamp);
        let (facing, _) = around(&points.clone().map(|point| point.normal).collect::<Vec<_>>());
        let points_m: Vec<[f32; 3]> = points.map(|point| point.position_m).collect();
        Source { facing, ..near_source(first, &points_m, intensity) }
    };
    let mut near: Vec<Source> = (0_u32..).zip(&lamps).map(of_lamp).collect();
    let each = bulb_points.len() / bulbs.len().max(1);
    let of_bulb = |(bulb, &intensity): (usize, &f64)| {
        let points = &bulb_points[bulb * each..(bulb + 1) * each];
        let points_m: Vec<[f32; 3]> = points.iter().map(|point| point.position_m).collect();
        near_source(lamp_points.len() + bulb * each, &points_m, intensity)
    };
    near.extend(bulbs.iter().enumerate().map(of_bulb));
    near.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    sources.extend(near);
    sources.truncate(SOURCES_MAX);
    sources
}

fn near_source(first: usize, points_m: &[[f32; 3]], strength: f64) -> Source {
    let (middle_m, radius_m) = around(points_m);
    Source { first, count: points_m.len(), extent: Extent::Ball { middle_m, radius_m }, strength, facing: [0.0; 3] }
}

/// The mean of some points, and how far the farthest lies from it.
fn around(points: &[[f32; 3]]) -> ([f32; 3], f32) {
    let count = f64_from_usize(points.len().max(1));
    let mut sum = [0.0; 3];
    points.iter().for_each(|point| (0..3).for_each(|axis| sum[axis] += f64::from(point[axis])));
    let middle = sum.map(|sum| f32_nearest(sum / count));
    let farthest2 = points.iter().map(|&point| sub(point, middle)).fold(0.0_f32, |most, way| most.max(dot(way, way)));
    (middle, farthest2.sqrt())
}
