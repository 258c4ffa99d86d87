//! A lit scene's fields, and the bounds of its exitance.

use super::super::bulb::Cone;
use super::super::flicker::Flicker;
use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands, Illuminant};
use super::super::mesh::Gloss;
use super::shadows::Shadows;
use crate::num::{greater, lesser};
use std::sync::{Arc, OnceLock};

/// Least and greatest light that leaves a scene's surfaces, in lux-equivalents a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExitanceBounds {
    /// Least of any reflecting surface (and of the sky, where the scene is open to it).
    pub least: [f64; BANDS],
    /// Greatest of any reflecting surface.
    pub greatest: [f64; BANDS],
    /// Greatest of lamps and sky; 0 without.
    pub emitted: [f64; BANDS],
}

impl ExitanceBounds {
    /// Of what either of two bounds.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let of = |choose: fn(f64, f64) -> f64, a: &[f64; BANDS], b: &[f64; BANDS]| {
            std::array::from_fn(|band| choose(a[band], b[band]))
        };
        Self {
            least: of(lesser, &self.least, &other.least),
            greatest: of(greater, &self.greatest, &other.greatest),
            emitted: of(greater, &self.emitted, &other.emitted),
        }
    }
}

/// What shading needs of a material, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Paint {
    pub(super) base_colour: Bands,
    /// Emitted light in lux-equivalents.
    pub(super) glow_lux: Bands,
    /// `PAINT_WITHOUT_TEXTURE` without one.
    pub(super) texture: u32,
    pub(super) double_sided: bool,
    /// Index of the cone of its emitted light; `NO_CONE` where it shines to all sides.
    pub(super) cone: u32,
    /// Whether its own light flickers.
    pub(super) flickers: bool,
    /// Whether it keeps an image: by gloss, and as a mirror.
    pub(super) glossy: [bool; 2],
}

pub(super) const PAINT_WITHOUT_TEXTURE: u32 = u32::MAX;
pub(super) const NO_CONE: u32 = u32::MAX;

/// A scene under light.
#[derive(Clone, Debug)]
pub struct LitScene {
    /// Shared, so that one scene under different light is cheap.
    pub(super) scene: Arc<Scene>,
    pub(super) illuminant: Illuminant,
    /// Lux-equivalents of steady light by sample side (`samples`).
    pub(super) irradiance_lux: Vec<Bands>,
    /// The same of light that flickers, at its mean; empty where none does.
    pub(super) flickering_lux: Vec<Bands>,
    /// What shading needs of each material.
    pub(super) paints: Vec<Paint>,
    /// Where spot lights shine to.
    pub(super) cones: Vec<Cone>,
    /// How lamps flicker; none: not at all.
    pub(super) flicker: Option<Flicker>,
    /// Exitance in lux-equivalents over radiance in the scene's own units.
    pub(super) lux_per_radiance: f64,
    pub(super) sky_lux: Bands,
    /// Of a horizontal plane where the light was set or measured.
    pub(super) illuminance_lux: f64,
    /// Whether the bake followed light over surfaces.
    pub(super) bounces: bool,
    /// What a ray needs of each triangle.
    pub(super) faces: Arc<[Face]>,
    pub(super) has_textures: bool,
    /// What shadows are traced by, and normal maps lit by; none without light points.
    pub(super) shadows: Option<Arc<Shadows>>,
    /// What of each material keeps an image.
    pub(super) gloss: Vec<Option<Gloss>>,
    /// Found once.
    pub(super) bounds: OnceLock<ExitanceBounds>,
    /// Hash of all that decides its radiance; found once.
    pub(super) content: OnceLock<[u8; 32]>,
}

/// A triangle as a ray meets it, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Face {
    pub(super) numbers: [f32; NUMBERS],
    /// Its texture (`FACE_WITHOUT_TEXTURE` of `surface` without one), and marks.
    pub(super) kind: u32,
}

/// Numbers of a face: its normal, the slopes of both texture coordinates, the coordinates of its three corners.
pub(super) const NUMBERS: usize = 15;
