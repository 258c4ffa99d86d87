//! Specular reflections. Computes the reflected ray at a hit on a glossy surface, and the weight of its light.
//!
//! Fresnel's reflectance by Schlick's formula; microfacets by GGX, sampled by their visible normals (Heitz, JCGT 7(4), 2018) with the
//! height-correlated shadowing of Smith. What a microfacet does not reflect leaves a dielectric diffusely; a metal has no diffuse part but
//! what its microfacets shadow, which single scattering would lose (5 % at alpha 0.16 and 80 degrees, under 1.2 % up to 66) and here
//! leaves diffusely.

use super::super::chance::{frame, turned};
use super::super::light::{BANDS, Bands};
use super::super::mesh::{Gloss, Material, Mesh, is_exact_mirror};
use super::super::texture::Footprint;
use super::super::vectors::{cross, dot, mirrored, unit};
use super::data::{ExitanceBounds, LitScene};
use crate::num::{greater, index};

/// Below this a surface is a mirror: its lobe is narrower than a pixel of any lens here.
const ALPHA_MIN: f32 = 1e-3;

/// Reflections that a ray follows, at most.
pub const REFLECTIONS_MAX: u32 = 4;

/// The most of a material's reflection that keeps an image anywhere, if any does.
pub(super) fn glossiest(mesh: &Mesh, material: &Material) -> Option<Gloss> {
    let [roughness, metallic] = mesh.glossiest(material);
    Material { roughness, metallic, ..material.clone() }.gloss()
}

/// Whether a material keeps an image anywhere: by gloss, and as a mirror.
pub(super) fn keeps_images(mesh: &Mesh, material: &Material) -> [bool; 2] {
    let is_glossy = glossiest(mesh, material).is_some();
    let is_mirror = material.transmission > 0.0 || is_exact_mirror(mesh.glossiest(material));
    [is_glossy, is_glossy && is_mirror]
}

/// A glossy surface where a ray meets it.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Smooth unit normal on the ray's side.
    normal: [f32; 3],
    /// Unit normal of the plane on the ray's side.
    pub plane: [f32; 3],
    at_normal: Bands,
    alpha: f32,
    /// 0 for dielectrics, 1 for metals.
    metallic: f32,
    /// Of a pane, with and without its tint: the rays that passed it are no hits.
    transmission: [f32; 2],
}

impl LitScene {
    /// Whether any surface keeps an image: all that gloss does, or mirrors only.
    #[inline(always)]
    pub fn has_gloss(&self, all: bool) -> bool {
        self.paints.iter().any(|paint| paint.glossy[usize::from(!all)])
    }

    /// The glossy surface at a hit; none where it is diffuse, or seen from a back that is not there. Unless `all` gloss is followed, only
    /// mirrors are, as if they were perfect.
    pub fn facet(&self, triangle: u32, [u, v]: [f32; 2], direction: [f32; 3], all: bool) -> Option<Facet> {
        let shade = &self.scene.layout.triangles[index(triangle)];
        if !self.paints[index(shade.material)].glossy[usize::from(!all)] {
            return None;
        }
        let mesh = &self.scene.mesh;
        let material = &mesh.materials[index(shade.material)];
        let texel = |map: u32| mesh.textures[index(map)].over(shade.uv_at(u, v), &Footprint::POINT);
        let mut gloss = self.gloss[index(shade.material)]?;
        if let Some((map, factors)) = material.maps.roughness_metallic {
            let at_hit = texel(map);
            let [roughness, metallic] = [at_hit[1] * factors[0], at_hit[2] * factors[1]];
            if !all && material.transmission <= 0.0 && !is_exact_mirror([roughness, metallic]) {
                return None;
            }
            gloss = Gloss::of(&material.base_colour, roughness, metallic)?;
        }
        let alpha = if all { gloss.alpha } else { 0.0 };
        let back = dot(shade.normal, direction) > 0.0;
        if back && !material.double_sided {
            return None;
        }
        let mut at_normal = gloss.at_normal;
        let is_painted = material.texture.is_some() || !mesh.colours.is_empty();
        if gloss.metallic > 0.0 && is_painted {
            let albedo = self.albedo(triangle, &self.paints[index(shade.material)], [u, v], &Footprint::POINT);
            for band in 0..BANDS {
                at_normal[band] += (albedo[band] - material.base_colour[band]) * gloss.metallic;
            }
        }
        let side = if back { -1.0 } else { 1.0 };
        let plane = shade.normal.map(|x| x * side);
        let normal = match material.maps.normal {
            Some((map, _)) => self.relief(triangle, [u, v], direction, texel(map)).mapped,
            None => self.smooth_normal(triangle, [u, v]).map_or(plane, |normal| normal.map(|x| x * side)),
        };
        let normal = if dot(normal, direction) < 0.0 { normal } else { plane };
        let pane = material.cut_out.and_then(|pane| mesh.cut_outs[index(pane)].transmission(shade.uv_at(u, v)));
        let passed = pane.unwrap_or(0.0);
        let transmission = [passed, if passed > 0.0 { passed / material.pane_tint() } else { 0.0 }];
        Some(Facet { normal, plane, at_normal, alpha, metallic: gloss.metallic, transmission })
    }

    /// A glossy surface adds what it reflects to its own light, each with a share of at most one in all: it is no brighter than the
    /// brightest surface, lamp or sky. Metals take from what they reflect, bounce by bounce, so only darkness bounds them from below.
    pub(super) fn widened_by_gloss(&self, bounds: &mut ExitanceBounds) {
        let glossy = |metals: bool| {
            let materials = self.gloss.iter().zip(&self.scene.mesh.materials);
            materials.filter(move |(gloss, material)| gloss.is_some() && (!metals || material.metallic > 0.0)).count()
                > 0
        };
        for band in 0..BANDS {
            if glossy(false) {
                bounds.greatest[band] = greater(bounds.greatest[band], bounds.emitted[band]);
            }
            if glossy(true) {
                bounds.least[band] = 0.0;
            }
        }
    }
}

impl Facet {
    /// The reflected ray, the weight of its light in each band, and that of the diffuse surface's, from two numbers of 0..1, which a mirror
    /// does not ask for. A ray whose weight is 0 sees nothing.
    pub fn reflected(&self, direction: [f32; 3], numbers: impl FnOnce() -> [f32; 2]) -> ([f32; 3], Bands, Bands) {
        let view = direction.map(|x| -x);
        let (half, kept) = if self.alpha < ALPHA_MIN { (self.normal, 1.0) } else { self.visible_half(view, numbers()) };
        let cos = dot(view, half).clamp(0.0, 1.0);
        let away = mirrored(direction, half);
        // A smooth normal may turn the ray into the surface: there the plane's own normal takes its place.
        let away = if dot(away, self.plane) > 1e-4 { away } else { mirrored(direction, self.plane) };
        let short = 1.0 - cos;
        let grazing = (short * short) * (short * short) * short;
        let weight = self.at_normal.map(|f0| (f0 + (1.0 - f0) * grazing) * kept);
        let [passed, clear] = self.transmission;
        if passed > 0.0 {
            // Only rays that a pane stops meet it: what it mirrors, scatters and absorbs.
            let hits = |weight: f32| 1.0 - (1.0 - weight) * passed;
            let diffuse = weight.map(|weight| (1.0 - weight) * (1.0 - clear) / hits(weight));
            return (unit(away).unwrap_or(self.plane), weight.map(|weight| weight / hits(weight)), diffuse);
        }
        let diffuse = weight.map(|weight| (1.0 - weight) * (1.0 - self.metallic) + (1.0 - kept) * self.metallic);
        (unit(away).unwrap_or(self.plane), weight, diffuse)
    }

    /// A visible normal of a microfacet, and the share of its reflection that no other microfacet shadows.
    fn visible_half(&self, view: [f32; 3], [along, around]: [f32; 2]) -> ([f32; 3], f32) {
        let sides = frame(self.normal);
        let local = [dot(view, sides[0]), dot(view, sides[1]), dot(view, self.normal)];
        let alpha = self.alpha;
        let stretched = unit([alpha * local[0], alpha * local[1], local[2]]).unwrap_or([0.0, 0.0, 1.0]);
        // The second axis leans towards the normal: the warp of the disc below counts on it.
        let first_axis = unit([-stretched[1], stretched[0], 0.0]).unwrap_or([1.0, 0.0, 0.0]);
        let across = [first_axis, cross(stretched, first_axis)];
        let (sin, cos) = libm::sincosf(2.0 * std::f32::consts::PI * around);
        let radius = along.sqrt();
        let first = radius * cos;
        let share = 0.5 * (1.0 + stretched[2]);
        let second = (1.0 - share) * (1.0 - first * first).sqrt() + share * radius * sin;
        let third = (1.0 - first * first - second * second).clamp(0.0, 1.0).sqrt();
        let point = turned([first, second, third], &across, stretched);
        let up = if point[2] > 0.0 { point[2] } else { 0.0 };
        let half = unit([alpha * point[0], alpha * point[1], up]).unwrap_or([0.0, 0.0, 1.0]);
        let cos_half = dot(local, half);
        let light: [f32; 3] = [0, 1, 2].map(|axis| 2.0 * cos_half * half[axis] - local[axis]);
        let kept = if light[2] > 0.0 {
            let (of_view, of_light) = (shadow(alpha, local[2]), shadow(alpha, light[2]));
            (1.0 + of_view) / (1.0 + of_view + of_light)
        } else {
            0.0
        };
        (turned(half, &sides, self.normal), kept)
    }
}

/// Smith's lambda for a cosine to the normal.
fn shadow(alpha: f32, cos: f32) -> f32 {
    let cos2 = if cos * cos > 1e-8 { cos * cos } else { 1e-8 };
    0.5 * ((1.0 + alpha * alpha * (1.0 - cos2).abs() / cos2).sqrt() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::super::cut_out::pane_reflectance;
    use super::*;
    use crate::num::{f32_from_u32, f32_nearest};

    fn facet(alpha: f32, at_normal: f32) -> Facet {
        let up = [0.0, 0.0, 1.0];
        Facet { normal: up, plane: up, at_normal: [at_normal; BANDS], alpha, metallic: 1.0, transmission: [0.0; 2] }
    }

    /// Share of even light that a facet reflects.
    fn albedo(facet: &Facet, cos: f64) -> f64 {
        let direction = [(1.0 - cos * cos).sqrt(), 0.0, -cos].map(f32_nearest);
        let steps = 64_u32;
        let mut sum = 0.0;
        for i in 0..steps * steps {
            let at = |i: u32| (f32_from_u32(i) + 0.5) / f32_from_u32(steps);
            let (away, weight, diffuse) = facet.reflected(direction, || [at(i % steps), at(i / steps)]);
            assert!(away[2] > 0.0 && weight[0] <= 1.0 && weight[0] >= 0.0, "{away:?} {weight:?}");
            // A white metal's two parts are all there is: one rounding.
            assert!((weight[0] + diffuse[0] - 1.0).abs() < 1e-6, "{weight:?} {diffuse:?}");
            sum += f64::from(weight[0]);
        }
        sum / f64::from(steps * steps)
    }

    #[test]
    fn a_white_metal_under_even_light_loses_no_more_than_single_scattering_does() {
        let mut tried = 0;
        for alpha in [0.0, 0.01, 0.05, 0.16] {
            for cos in [1.0, 0.7, 0.4, 0.2] {
                let kept = albedo(&facet(alpha, 1.0), cos);
                // Straight on, the share alpha^2 / (1 + alpha^2) of microfacets is steeper than 45 degrees and sends light below the
                // surface; shadowing takes about half as much again, more at grazing views. 1e-6 is rounding.
                let steep = f64::from(alpha * alpha);
                let least = if cos > 0.5 { 1.0 - 2.0 * steep - 0.012 } else { 0.95 - 4.0 * steep };
                assert!(kept <= 1.0 + 1e-6 && kept > least, "{alpha} {cos}: {kept}");
                tried += 1;
            }
        }
        assert_eq!(tried, 16);
    }

    #[test]
    fn a_pane_mirrors_passes_and_scatters_all_light_between_them() {
        for (transmission, cos) in [(1.0_f32, 0.8_f32), (0.5, 0.8), (1.0, 0.2), (0.1, 0.5)] {
            let pane = Facet { transmission: [transmission * 0.9, transmission], metallic: 0.0, ..facet(0.0, 0.04) };
            let (_, mirrored, diffuse) = pane.reflected([(1.0 - cos * cos).sqrt(), 0.0, -cos], || [0.3, 0.7]);
            let passed = 0.9 * transmission * (1.0 - pane_reflectance(cos));
            // Of all rays; 1e-6 is rounding.
            assert!(
                (mirrored[0] * (1.0 - passed) - pane_reflectance(cos)).abs() < 1e-6,
                "{transmission} {cos}: {mirrored:?}"
            );
            let scattered = (1.0 - transmission) * (1.0 - pane_reflectance(cos));
            assert!((diffuse[0] * (1.0 - passed) - scattered).abs() < 1e-6, "{transmission} {cos}: {diffuse:?}");
        }
    }

    #[test]
    fn a_mirror_reflects_by_schlick_and_turns_no_corner() {
        let (away, weight, _) = facet(0.0, 0.04).reflected([0.6, 0.0, -0.8], || [0.3, 0.7]);
        assert!((away[0] - 0.6).abs() < 1e-6 && (away[2] - 0.8).abs() < 1e-6, "{away:?}");
        // 0.04 + 0.96 * 0.2^5.
        assert!((weight[0] - 0.040_307_2).abs() < 1e-6, "{weight:?}");
    }
}
