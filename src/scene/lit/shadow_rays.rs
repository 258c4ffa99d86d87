//! Rays from a hit to the sources that it has to ask for.

use super::super::bake::Source;
use super::super::bake::light_points::{ShadowRay, shadow_ray_to};
use super::super::bake::rays::Receiver;
use super::super::light::luminance;
use super::super::vectors::dot;
use super::data::LitScene;
use super::shadows::Shadows;
use super::surface::on_side;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u32_truncated_f32};

/// A source that stands lower over a triangle's plane is left to the bake: there a mesh's triangles would shade themselves (the shadow
/// terminator of smooth surfaces).
const GRAZING: f32 = 0.05;
/// Parts of a wide source that a ray to it is chosen from.
const QUARTERS: usize = 4;

impl LitScene {
    /// What shadows are traced by; none where they are as baked.
    #[inline(always)]
    pub fn traced_shadows(&self) -> Option<&Shadows> {
        self.shadows().filter(|shadows| shadows.are_traced())
    }

    /// What shadows are traced by, if they are, and normal maps lit by; none without light points.
    #[inline(always)]
    pub fn shadows(&self) -> Option<&Shadows> {
        self.shadows.as_deref()
    }

    /// Sample sides that a ray meets, of the three samples around a hit, with their weights; and the unit normal of that side.
    #[inline]
    pub fn sample_sides_around(
        &self,
        triangle: u32,
        [u, v]: [f32; 2],
        direction: [f32; 3],
    ) -> ([(usize, f32); 3], [f32; 3]) {
        let shade = &self.scene.layout.triangles[index(triangle)];
        let back = dot(shade.normal, direction) > 0.0;
        (on_side(shade.around(u, v), back), if back { shade.normal.map(|x| -x) } else { shade.normal })
    }

    /// Luminance of the steady baked light at a sample side.
    #[inline]
    pub fn baked_lux(&self, sample_side: usize) -> f32 {
        f32_nearest(luminance(self.irradiance_lux[sample_side].map(f64::from)))
    }

    /// A ray from a point on a triangle, on one side of it, to a point of a source that a number of 0..1 chooses; none where that stands
    /// below the plane, or barely above it.
    pub fn shadow_ray(
        &self,
        shadows: &Shadows,
        (at_m, normal): ([f32; 3], [f32; 3]),
        source: u32,
        number: f32,
    ) -> Option<ShadowRay> {
        let Source { first, count, .. } = shadows.light_points.sources[index(source)];
        let chosen = first + below(count, number)?;
        let ray = shadow_ray_to(&self.scene, &Receiver { at_m, normal, sides: 1 }, &shadows.light_points, chosen)?;
        let length2 = dot(ray.direction, ray.direction);
        let cos = dot(ray.direction, normal);
        (cos > 0.0 && cos * cos > GRAZING * GRAZING * length2).then_some(ray)
    }

    /// The same, to a point that is chosen about in proportion to the light that it sends: by the first number among the four that stand
    /// where the second one says in each quarter of the source (resampled importance sampling). Points of a narrow source send alike.
    pub fn shadow_ray_by_light(
        &self,
        shadows: &Shadows,
        (at_m, normal): ([f32; 3], [f32; 3]),
        source: u32,
        (number, within_quarter): (f32, impl FnOnce() -> f32),
    ) -> Option<ShadowRay> {
        let of_source = &shadows.light_points.sources[index(source)];
        if of_source.is_narrow(at_m) || of_source.count < QUARTERS {
            return self.shadow_ray(shadows, (at_m, normal), source, number);
        }
        let quarter = of_source.count / QUARTERS;
        let within = below(quarter, within_quarter())?;
        let mut points = [None; QUARTERS];
        let (mut sent, mut sum) = ([0.0; QUARTERS], 0.0);
        for part in 0..QUARTERS {
            points[part] = shadow_ray_to(
                &self.scene,
                &Receiver { at_m, normal, sides: 1 },
                &shadows.light_points,
                of_source.first + part * quarter + within,
            );
            sent[part] = points[part].map_or(0.0, |ray| f32_nearest(luminance(ray.sent)));
            sum += sent[part];
        }
        let (mut chosen, mut before) = (None, 0.0);
        for part in 0..QUARTERS {
            if sent[part] > 0.0 && number * sum >= before {
                chosen = points[part];
            }
            before += sent[part];
        }
        chosen
    }
}

/// A whole number below a count, by a number of 0..1; none below 0.
#[inline]
fn below(count: usize, number: f32) -> Option<usize> {
    let last = u32_from(count).checked_sub(1)?;
    Some(index(u32_truncated_f32(number * f32_from_u32(last + 1)).min(last)))
}
