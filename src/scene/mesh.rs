//! Triangles and their materials. In a mesh every number is finite, every index is in range and every triangle has an area.

use std::collections::BTreeMap;
use std::ops::Range;

use super::bulb::Bulb;
use super::cut_out::{CutOut, DIELECTRIC_F0};
use super::environment::Sun;
use super::light::{BANDS, Bands, luminance, with_infrared};
use super::maps::Maps;
use super::texture::Texture;
use super::tracer::Holes;
use super::vectors::weighted;
pub use super::vectors::{area_m2, cross, dot, sub, unit, unit_normal};
use crate::draw::mix;
use crate::num::{f32_from_u32, f32_nearest, index, low_u32, u32_from};

/// Greatest albedo that a bake's bounces take: base colour times texture above it is clamped to it, since light in a closed room
/// of albedo 1 has no finite level. What a ray sees of a surface is not: glTF's white reflects all.
pub const ALBEDO_MAX: f32 = 0.99;

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// As the file calls it.
    pub name: String,
    /// Linear base colour, 0 to 1, multiplied with the texture.
    pub base_colour: Bands,
    /// Index of a texture, if there is one.
    pub texture: Option<u32>,
    /// Index of its holes, if it has any; they lie by the same texture coordinates.
    pub cut_out: Option<u32>,
    /// Radiance in the scene's own units, on both sides where `double_sided`.
    pub emission: Bands,
    /// The ball that all its triangles make, where it is a lamp of a stated intensity.
    pub bulb: Option<Bulb>,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: f32,
    /// 0 for a mirror, 1 for chalk.
    pub roughness: f32,
    /// Its maps beside the base colour.
    pub maps: Maps,
    /// Of a thin pane: the share of light that passes of what it does not reflect, without its tint; the mean of what its `cut_out` has.
    pub transmission: f32,
    /// Whether the back of a triangle is seen, lit and emits like its front.
    pub double_sided: bool,
    /// Whether a camera looks through its back (glTF's culling). Light that comes from behind is stopped all the same.
    pub culled: bool,
}

impl Material {
    /// A diffuse surface of one colour; in the near infrared like in red.
    pub fn plain(name: &str, base_colour: [f32; 3]) -> Self {
        Self {
            name: name.to_owned(),
            base_colour: with_infrared(base_colour),
            texture: None,
            cut_out: None,
            emission: [0.0; BANDS],
            bulb: None,
            metallic: 0.0,
            roughness: 1.0,
            maps: Maps::default(),
            transmission: 0.0,
            double_sided: true,
            culled: false,
        }
    }

    /// The part of its reflection that keeps an image, if any: metals up to `GLOSS_ROUGHNESS_MAX` by their base colour, and dielectrics as
    /// glossy by 4 % (glTF 2.0, appendix B). The rest of a metal's light, and all of a rough surface's, is diffuse.
    pub fn gloss(&self) -> Option<Gloss> {
        Gloss::of(&self.base_colour, self.roughness, self.metallic)
    }

    /// What a pane's colour takes of the light that passes, of all bands alike: the luminance of its base colour.
    pub fn pane_tint(&self) -> f32 {
        f32_nearest(luminance(self.base_colour.map(f64::from)))
    }

    /// Whether it is emissive.
    pub fn is_emissive(&self) -> bool {
        self.emission.iter().any(|&band| band > 0.0)
    }
}

/// Reflection that keeps an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Reflectance at normal incidence, in each band (Schlick's F0).
    pub at_normal: Bands,
    /// Width of the microfacets' slopes (GGX alpha, the square of glTF's roughness); 0 is a mirror.
    pub alpha: f32,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: f32,
}

impl Gloss {
    /// Of a base colour, roughness and metallic; none where that is too rough.
    pub(super) fn of(base_colour: &Bands, roughness: f32, metallic: f32) -> Option<Self> {
        if roughness > GLOSS_ROUGHNESS_MAX {
            return None;
        }
        let at_normal = base_colour.map(|band| DIELECTRIC_F0 + (band - DIELECTRIC_F0) * metallic);
        Some(Self { at_normal, alpha: roughness * roughness, metallic })
    }

    /// Reflectance of a smooth surface, in each band, along a ray at a cosine to its normal (Schlick).
    pub(super) fn reflectance(&self, cos: f32) -> Bands {
        let grazing = 1.0 - cos.min(1.0);
        let rise = grazing * grazing * grazing * grazing * grazing;
        self.at_normal.map(|normal| normal + (1.0 - normal) * rise)
    }
}

/// Metals up to this roughness are mirrors: alpha is 0.01, so half of the light that they reflect stays within 1.2 degrees (twice the
/// slope of the facets), and that of a bathroom's mirror (roughness 0.03) within 0.1.
const MIRROR_ROUGHNESS_MAX: f32 = 0.1;

/// From this on the greater part of a surface is a metal.
pub(super) const MIRROR_METALLIC_MIN: f32 = 0.5;

/// Whether a reflection is taken as a perfect mirror's.
pub(super) fn is_exact_mirror([roughness, metallic]: [f32; 2]) -> bool {
    metallic >= MIRROR_METALLIC_MIN && roughness <= MIRROR_ROUGHNESS_MAX
}

/// Surfaces rougher than this show no image of what they reflect.
pub const GLOSS_ROUGHNESS_MAX: f32 = 0.4;

/// One corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Metres, y up.
    pub position_m: [f32; 3],
    /// Unit length.
    pub normal: [f32; 3],
    /// Texture coordinates, v downwards.
    pub uv: [f32; 2],
}

/// Triangles of a scene. Fields are read freely inside the scene and only made by `MeshBuilder`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Three corners each, counter-clockwise seen from the side the normals point to.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub material_of: Vec<u32>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Holes that materials name.
    pub cut_outs: Vec<CutOut>,
    /// Linear colours, 0 to 1, of the first vertices, multiplied with the base colour; vertices beyond are white.
    pub colours: Vec<Bands>,
    /// Light from infinitely far that is not seen itself, in the scene's own units.
    pub distant: Vec<Sun>,
}

/// White, of vertices without a colour.
const WHITE: Bands = [1.0; BANDS];

impl Mesh {
    /// The holes of a triangle's material, if it has any.
    pub fn cut_out_of(&self, triangle: u32) -> Option<&CutOut> {
        let cut_out = self.materials[index(self.material_of[index(triangle)])].cut_out?;
        Some(&self.cut_outs[index(cut_out)])
    }

    /// Colour of a vertex.
    #[inline(always)]
    pub fn colour(&self, vertex: u32) -> Bands {
        self.colours.get(index(vertex)).copied().unwrap_or(WHITE)
    }

    /// Colours of a triangle's corners; none in a mesh whose vertices have no colours.
    #[inline(always)]
    pub fn corner_colours(&self, triangle: u32) -> Option<[Bands; 3]> {
        if self.colours.is_empty() {
            return None;
        }
        Some(self.triangles[index(triangle)].map(|corner| self.colour(corner)))
    }

    /// Colour at these weights of a triangle's corners; none in a mesh whose vertices have no colours.
    #[inline(always)]
    pub fn colour_at(&self, triangle: u32, weights: [f32; 3]) -> Option<Bands> {
        Some(weighted(self.corner_colours(triangle)?, weights))
    }

    /// Adds colours of the last vertices of the mesh.
    pub fn colour_last(&mut self, colours: &[Bands]) {
        let first = self.vertices.len().checked_sub(colours.len()).expect("colours belong to vertices");
        self.colours.resize(first, WHITE);
        self.colours.extend_from_slice(colours);
    }

    /// Corners of a triangle in metres.
    #[inline]
    pub fn corners_m(&self, triangle: usize) -> [[f32; 3]; 3] {
        let [a, b, c] = self.triangles[triangle];
        let at_m = |corner: u32| self.vertices[index(corner)].position_m;
        [at_m(a), at_m(b), at_m(c)]
    }

    /// Area in square metres of the triangles from one on.
    pub(super) fn area_from_m2(&self, first: usize) -> f64 {
        (first..self.triangles.len()).fold(0.0, |sum, piece| sum + f64::from(area_m2(self.corners_m(piece))))
    }

    /// Adds vertices and triangles (indices count from the first of `vertices`), repaired where that is harmless: triangles
    /// without area are dropped, the winding follows the normals, and a normal that is missing or not finite is made from the
    /// first triangle at its vertex. Says why where it cannot be repaired: a position that is not finite, an index out of
    /// range. Returns how many triangles were dropped.
    pub fn append(
        &mut self,
        material: u32,
        vertices: impl Into<Vec<Vertex>>,
        triangles: &[[u32; 3]],
    ) -> Result<usize, String> {
        let mut vertices = vertices.into();
        assert!(index(material) < self.materials.len(), "a mesh needs its material first");
        if let Some(bad) = vertices.iter().position(|vertex| !vertex.position_m.iter().all(|x| in_range(*x))) {
            let at_m = vertices[bad].position_m;
            return Err(format!("vertex {bad} is at {at_m:?}; coordinates are finite and below 1e6 m"));
        }
        let base = u32_from(self.vertices.len());
        let mut dropped = 0;
        let mut normal_known: Vec<bool> = vertices.iter_mut().map(repair_vertex).collect();
        for (number, corners) in triangles.iter().enumerate() {
            if let Some(bad) = corners.iter().find(|&&corner| index(corner) >= vertices.len()) {
                return Err(format!("triangle {number} names vertex {bad} of {}", vertices.len()));
            }
            let Some(face) = unit_normal(corners.map(|corner| vertices[index(corner)].position_m)) else {
                dropped += 1;
                continue;
            };
            for corner in corners.map(index) {
                if !normal_known[corner] {
                    vertices[corner].normal = face;
                    normal_known[corner] = true;
                }
            }
            let [a, b, c] = *corners;
            let along: f32 =
                corners.iter().map(|&corner| dot(vertices[index(corner)].normal, face)).fold(0.0, |a, b| a + b);
            let wound = if along < 0.0 { [a, c, b] } else { [a, b, c] };
            self.triangles.push(wound.map(|corner| base + corner));
            self.material_of.push(material);
        }
        self.vertices.append(&mut vertices);
        Ok(dropped)
    }

    /// Adds a flat quadrangle with corners in counter-clockwise order seen from its front. Its picture stands upright for
    /// corners that start at the bottom left: (0, v), (u, v), (u, 0), (0, 0) for a `uv_span` of (u, v). Two corners may be the same
    /// point, which leaves a triangle. Adds nothing where there is no area.
    pub fn append_quad(&mut self, material: u32, corners_m: [[f32; 3]; 4], uv_span: [f32; 2]) {
        let [a, b, c, d] = corners_m;
        let Some(normal) = unit_normal([a, b, c]).or_else(|| unit_normal([a, c, d])) else { return };
        let [u, v] = uv_span;
        let uvs = [[0.0, v], [u, v], [u, 0.0], [0.0, 0.0]];
        let vertex = |corner: usize| Vertex { position_m: corners_m[corner], normal, uv: uvs[corner] };
        let vertices = [vertex(0), vertex(1), vertex(2), vertex(3)];
        self.append(material, vertices, &[[0, 1, 2], [0, 2, 3]]).expect("a quadrangle made here is sound");
    }

    /// Takes ranges of triangles out, which are disjoint, and makes a mesh of each list of them with the materials that it uses. The rest
    /// keeps its materials and their order.
    #[must_use]
    pub fn split_off(&mut self, lists: &[&[Range<usize>]]) -> Vec<Self> {
        if lists.is_empty() {
            return Vec::new();
        }
        let parts = lists.iter().map(|ranges| self.part(ranges.iter().cloned().flatten())).collect();
        let mut is_taken = vec![false; self.triangles.len()];
        lists.iter().flat_map(|ranges| ranges.iter().cloned()).flatten().for_each(|triangle| is_taken[triangle] = true);
        let mut kept = is_taken.iter().map(|taken| !taken);
        self.triangles.retain(|_| kept.next().unwrap_or(true));
        let mut kept = is_taken.iter().map(|taken| !taken);
        self.material_of.retain(|_| kept.next().unwrap_or(true));
        parts
    }

    /// A mesh of some triangles.
    fn part(&self, triangles: impl Iterator<Item = usize>) -> Self {
        let mut part = Self::default();
        let (mut vertices, mut materials) = (BTreeMap::new(), BTreeMap::new());
        let (mut textures, mut cut_outs) = (BTreeMap::new(), BTreeMap::new());
        for triangle in triangles {
            let corners = self.triangles[triangle].map(|corner| {
                *vertices.entry(corner).or_insert_with(|| {
                    part.vertices.push(self.vertices[index(corner)]);
                    if !self.colours.is_empty() {
                        part.colours.push(self.colour(corner));
                    }
                    u32_from(part.vertices.len() - 1)
                })
            });
            let number = self.material_of[triangle];
            let material = *materials.entry(number).or_insert_with(|| {
                let mut material = self.materials[index(number)].clone();
                for texture in material.maps.textures_mut().chain(&mut material.texture) {
                    *texture = taken_over(*texture, &self.textures, &mut part.textures, &mut textures);
                }
                if let Some(cut_out) = &mut material.cut_out {
                    *cut_out = taken_over(*cut_out, &self.cut_outs, &mut part.cut_outs, &mut cut_outs);
                }
                pushed(&mut part.materials, material)
            });
            part.triangles.push(corners);
            part.material_of.push(material);
        }
        part
    }
}

/// Adds an item to a list and gives its number.
pub(super) fn pushed<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    u32_from(list.len() - 1)
}

/// The number in another list of an entry of one, which is copied where it is not there yet.
fn taken_over<T: Clone>(number: u32, from: &[T], to: &mut Vec<T>, known: &mut BTreeMap<u32, u32>) -> u32 {
    *known.entry(number).or_insert_with(|| pushed(to, from[index(number)].clone()))
}

fn in_range(coordinate_m: f32) -> bool {
    coordinate_m.is_finite() && coordinate_m.abs() < 1e6
}

/// Makes the normal a unit vector and the texture coordinates finite; whether there was a normal to begin with.
fn repair_vertex(vertex: &mut Vertex) -> bool {
    if !vertex.uv.iter().all(|x| x.is_finite() && x.abs() < 1e6) {
        vertex.uv = [0.0; 2];
    }
    let normal = unit(vertex.normal);
    vertex.normal = normal.unwrap_or([0.0, 1.0, 0.0]);
    normal.is_some()
}

/// Rays pass the holes of cut-out materials. Weights are those of the second and third corner.
impl Holes for Mesh {
    fn is_open(&self, triangle: u32, [u, v]: [f32; 2], cos: &dyn Fn() -> f32) -> bool {
        let Some(cut_out) = self.cut_out_of(triangle) else { return false };
        let uvs = self.triangles[index(triangle)].map(|corner| self.vertices[index(corner)].uv);
        cut_out.is_open(weighted(uvs, [1.0 - u - v, u, v]), cos, || draw_at(triangle, u, v))
    }
}

/// A number from 0 to 1, below 1, that looks random from point to point.
fn draw_at(triangle: u32, u: f32, v: f32) -> f32 {
    let point_bits = u64::from(u.to_bits()) << 32 | u64::from(v.to_bits());
    let bits = mix(mix(point_bits).wrapping_add(u64::from(triangle)));
    f32_from_u32(low_u32(bits >> 40)) / 16_777_216.0
}

/// A mesh as cameras see it: without the backs that glTF culls.
#[derive(Clone, Copy, Debug)]
pub struct BackfaceCulled<'a>(pub &'a Mesh);

impl Holes for BackfaceCulled<'_> {
    fn culls_backs(&self) -> bool {
        true
    }

    fn is_open(&self, triangle: u32, weights: [f32; 2], cos: &dyn Fn() -> f32) -> bool {
        self.0.is_open(triangle, weights, cos)
    }
}
