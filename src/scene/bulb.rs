//! Small lamps of a stated intensity: point and spot lights as balls. They are seen as the triangles of their material; what they send
//! straight to a surface is that of a point, I cos / d^2, which holds at any distance outside the ball (Newton's shell theorem), so no
//! polyhedron's shape and no choice of points on it enters.

use super::light::Bands;
use super::vectors::{dot, sub};
use crate::num::{f32_nearest, f64_from_usize, greater};

/// Radius of the shell that shadow rays are aimed at, over the ball's: seen from afar it is as wide, by variance, as an even disc.
const SHELL: f64 = 0.866_025_403_784_438_6;

/// Cosines of a cone's two angles are at least this far apart, so that a sharp edge has a finite slope.
const EDGE_MIN: f64 = 1e-6;

/// A ball that a material belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bulb {
    /// Its middle.
    pub centre_m: [f32; 3],
    /// Its radius; all triangles lie within.
    pub radius_m: f32,
    /// Where it shines to; none: to all sides alike.
    pub cone: Option<Cone>,
}

/// Intensity over direction of a spot light (KHR_lights_punctual): whole within the inner angle, none beyond the outer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    axis: [f32; 3],
    cos_outer: f32,
    per_cos: f32,
}

impl Cone {
    /// Around an axis of unit length. Angles are brought into 0 to 90 degrees and into order.
    pub fn new(axis: [f32; 3], inner_rad: f64, outer_rad: f64) -> Self {
        let right = std::f64::consts::FRAC_PI_2;
        let sound = |angle: f64, most: f64| if angle.is_finite() { angle.clamp(0.0, most) } else { most };
        let outer_rad = sound(outer_rad, right);
        let [cos_inner, cos_outer] = [sound(inner_rad, outer_rad), outer_rad].map(libm::cos);
        let per_cos = f32_nearest(1.0 / greater(EDGE_MIN, cos_inner - cos_outer));
        Self { axis, cos_outer: f32_nearest(cos_outer), per_cos }
    }

    /// Share of the intensity towards a direction of unit length.
    #[inline(always)]
    pub fn share(&self, direction: [f32; 3]) -> f32 {
        let within = ((dot(direction, self.axis) - self.cos_outer) * self.per_cos).clamp(0.0, 1.0);
        within * within
    }

    /// All that it is made of, for a hash.
    pub(super) fn numbers(&self) -> [f32; 5] {
        [self.axis[0], self.axis[1], self.axis[2], self.cos_outer, self.per_cos]
    }
}

/// A point in a bulb that shadow rays are aimed at.
#[derive(Clone, Copy, Debug)]
pub struct BulbPoint {
    /// The bulb that it belongs to.
    pub bulb: Bulb,
    /// Metres.
    pub position_m: [f32; 3],
    /// Radiant intensity that it represents, in the scene's units, within the cone.
    pub intensity: Bands,
    /// What shines there.
    pub material: u32,
}

impl Bulb {
    /// Points in opposite pairs on the shell, so that their first moments cancel; the middle where there is one point only. Each stands
    /// for an equal share of the intensity.
    pub(super) fn points(&self, count: usize, intensity: [f64; 4], material: u32, points: &mut Vec<BulbPoint>) {
        let pairs = count / 2;
        let unit_points: Vec<[f64; 3]> = if pairs == 0 {
            vec![[0.0; 3]]
        } else {
            (0..pairs)
                .flat_map(|pair| {
                    let z = (f64_from_usize(pair) + 0.5) / f64_from_usize(pairs);
                    let across = (1.0 - z * z).sqrt();
                    // The golden angle.
                    let (sine, cosine) = libm::sincos(2.399_963_229_728_653 * f64_from_usize(pair));
                    let unit_point = [across * cosine, across * sine, z];
                    [unit_point, unit_point.map(|x| -x)]
                })
                .collect()
        };
        let share = 1.0 / f64_from_usize(unit_points.len());
        let intensity = intensity.map(|band| f32_nearest(band * share));
        let radius_m = SHELL * f64::from(self.radius_m);
        for unit_point in unit_points {
            let at = |axis: usize| f32_nearest(f64::from(self.centre_m[axis]) + radius_m * unit_point[axis]);
            points.push(BulbPoint { bulb: *self, position_m: [at(0), at(1), at(2)], intensity, material });
        }
    }
}

impl BulbPoint {
    /// Irradiance over intensity at a point with a normal, the share that the cone leaves of it, and the share of the way at which a ray
    /// enters the ball; none from within the ball.
    pub fn toward(&self, origin_m: [f32; 3], normal: [f32; 3]) -> Option<(f64, f32, f32)> {
        let wide = |v: [f32; 3]| v.map(f64::from);
        let (way, centre) = (wide(sub(self.position_m, origin_m)), wide(sub(self.bulb.centre_m, origin_m)));
        let product = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let radius_m = f64::from(self.bulb.radius_m);
        let (distance2, along) = (product(way, way), product(way, centre));
        let outside = product(centre, centre) - radius_m * radius_m;
        if outside <= 0.0 {
            return None;
        }
        let under_root = greater(0.0, along * along - distance2 * outside);
        let enters = (along - under_root.sqrt()) / distance2;
        // The cone is the light's own, from its middle.
        let out = 1.0 / product(centre, centre).sqrt();
        let share = self.bulb.cone.map_or(1.0, |cone| cone.share(centre.map(|x| f32_nearest(-x * out))));
        let cos = product(way, wide(normal)).abs() / distance2.sqrt();
        let strength = cos / greater(distance2, radius_m * radius_m / 16.0);
        (strength > 0.0).then_some((strength, share, f32_nearest(enters)))
    }
}
