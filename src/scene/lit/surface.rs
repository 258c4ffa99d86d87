//! Light that leaves one triangle towards the rays of a packet that met it, in lux-equivalents by band; lane by lane equal to
//! `exitance_lux` in every bit.

use super::super::lanes::{Floats, LANES, Mask, Vectors, dot3, next_lane, splat3};
use super::super::light::{BANDS, Bands};
use super::super::mesh::Mesh;
use super::super::samples::{Layout, ShadeTriangle};
use super::super::texture::{TO_WHOLE, Texture};
pub use super::data::Face;
pub(super) use super::data::NUMBERS;
use super::data::{LitScene, NO_CONE, Paint};
use super::shadows::Shadows;
use crate::num::{f32_from_u32, index};

impl Face {
    /// Its texture; one that does not exist where there is none.
    #[inline(always)]
    pub(super) fn texture(&self) -> u32 {
        self.kind & TEXTURE
    }

    /// Whether it keeps an image: by any gloss, or as a mirror.
    #[inline(always)]
    pub fn has_gloss(&self, all: bool) -> bool {
        self.kind & GLOSSY[usize::from(!all)] != 0
    }

    /// Whether a shadow has an edge somewhere on it.
    #[inline(always)]
    pub fn has_shadow_edges(&self) -> bool {
        self.kind & SHADOWED != 0
    }

    /// Whether it has a map of normals or of emission.
    #[inline(always)]
    pub fn has_maps(&self) -> bool {
        self.kind & MAPPED != 0
    }

    /// Unit normal of the plane.
    #[inline(always)]
    pub fn normal(&self) -> [f32; 3] {
        [self.numbers[0], self.numbers[1], self.numbers[2]]
    }

    /// Texels along u, then along v, for a metre in the world.
    #[inline(always)]
    pub fn slopes(&self) -> [[f32; 3]; 2] {
        let n = &self.numbers;
        [[n[3], n[4], n[5]], [n[6], n[7], n[8]]]
    }

    /// Texture coordinates at weights of the second and third corner.
    #[inline(always)]
    pub fn uv(&self, u: Floats, v: Floats) -> [Floats; 2] {
        let w = Floats::splat(1.0) - u - v;
        let mut uv = [w; 2];
        for axis in 0..2 {
            let [a, b, c] = [self.numbers[9 + axis], self.numbers[11 + axis], self.numbers[13 + axis]];
            uv[axis] = Floats::splat(a) * w + Floats::splat(b) * u + Floats::splat(c) * v;
        }
        uv
    }
}

/// Marks of a face that keeps an image: any gloss, and mirrors only.
const GLOSSY: [u32; 2] = [1 << 31, 1 << 30];
/// Mark of a face with edges of shadows.
const SHADOWED: u32 = 1 << 29;
/// Mark of a face with maps of normals or emission.
const MAPPED: u32 = 1 << 28;
/// The part of a face's kind that names its texture.
const TEXTURE: u32 = (1 << 28) - 1;
/// Names no texture.
const FACE_WITHOUT_TEXTURE: u32 = TEXTURE;

/// Faces of all triangles. `slopes` is empty without textures.
pub fn faces(
    mesh: &Mesh,
    layout: &Layout,
    slopes: &[[[f32; 3]; 2]],
    paints: &[Paint],
    shadows: Option<&Shadows>,
) -> Vec<Face> {
    let mut faces = Vec::with_capacity(layout.triangles.len());
    for (triangle, shade) in layout.triangles.iter().enumerate() {
        let mut numbers = [0.0; NUMBERS];
        numbers[..3].copy_from_slice(&shade.normal);
        if let Some(slopes) = slopes.get(triangle) {
            numbers[3..9].copy_from_slice(slopes.as_flattened());
        }
        numbers[9..].copy_from_slice(shade.uv.as_flattened());
        let mut kind = mesh.materials[index(shade.material)].texture.unwrap_or(FACE_WITHOUT_TEXTURE);
        for (mark, is_glossy) in GLOSSY.into_iter().zip(paints[index(shade.material)].glossy) {
            kind |= if is_glossy { mark } else { 0 };
        }
        let has_edge = |shadows: &Shadows| shade.sides().any(|(back, sample)| shadows.has_edge(2 * sample + back));
        kind |= if shadows.is_some_and(has_edge) { SHADOWED } else { 0 };
        let maps = &mesh.materials[index(shade.material)].maps;
        kind |= if maps.normal.is_some() || maps.emission.is_some() { MAPPED } else { 0 };
        faces.push(Face { numbers, kind });
    }
    faces
}

/// Rays of a packet that met one triangle.
pub struct OnTriangle<'a> {
    /// The triangle.
    pub triangle: u32,
    /// Which lanes.
    pub lanes: Mask,
    /// Weights of its second and third corner at the hits.
    pub u: Floats,
    /// See `u`.
    pub v: Floats,
    /// Unit directions of the rays.
    pub direction: &'a Vectors,
    /// Level of the flickering lamps over each ray's stratum of time.
    pub lamp_levels: &'a [f32; LANES],
    /// Lux by band to add to the baked irradiance, from shadow rays and normal maps.
    pub added: Option<&'a [Floats; BANDS]>,
    /// What the emission is multiplied by; white without.
    pub emission: Option<&'a [Floats; BANDS]>,
}

/// Where hits lie among a triangle's samples of irradiance.
struct Around<'a> {
    shade: &'a ShadeTriangle,
    /// Cell of the grid: row and column, as numbers of both kinds.
    row: (Floats, [u32; LANES]),
    column: (Floats, [u32; LANES]),
    /// Lanes in the half of their cell that is farther from the first corner.
    beyond: Mask,
    /// Weights of the three samples around each, the one at the half's right angle first, then that below or above it (in the farther half)
    /// and that beside it; in the nearer half the other way round.
    weights: [Floats; 3],
}

impl<'a> Around<'a> {
    /// Of hits at weights of the second and third corner.
    #[inline(always)]
    fn of(shade: &'a ShadeTriangle, u: Floats, v: Floats) -> Self {
        let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
        if shade.grid_steps == 0 {
            let none = (zero, [0; LANES]);
            return Self { shade, row: none, column: none, beyond: Mask([0; LANES]), weights: [one - u - v, u, v] };
        }
        let steps = Floats::splat(f32_from_u32(shade.grid_steps));
        let (x, y) = (u.greater(zero).lesser(one) * steps, v.greater(zero).lesser(one) * steps);
        let row = whole_below(y, steps - one);
        let column = whole_below(x, steps - one - row.0);
        let (fx, fy) = (x - column.0, y - row.0);
        // The last cell of a row has no farther half. Sums of a few thousand are exact.
        let beyond = one.below(fx + fy) & (column.0 + row.0 + Floats::splat(2.0)).at_most(steps);
        let weights = [
            beyond.select(fx + fy - one, (one - fx - fy).greater(zero).lesser(one)),
            beyond.select(one - fx, fx),
            beyond.select(one - fy, fy),
        ];
        Self { shade, row, column, beyond, weights }
    }

    /// Whether all lanes lie in one cell.
    #[inline(always)]
    fn is_one_cell(&self) -> bool {
        let (row, column) = (self.row.0, self.column.0);
        all(row.equal(Floats::splat(row.0[0])) & column.equal(Floats::splat(column.0[0])))
    }

    /// The samples of a lane's cell: at its first corner, and beside, below and opposite that.
    #[inline(always)]
    fn corners(&self, lane: usize) -> [usize; 4] {
        let [first, second, third] = self.shade.samples;
        let steps = self.shade.grid_steps;
        if steps == 0 {
            return [first, second, third, third].map(index);
        }
        let (row, column) = (self.row.1[lane], self.column.1[lane]);
        // Rows of falling length: the first sample of this one and of the next.
        let here = first.wrapping_add(row.wrapping_mul((2 * steps + 3).wrapping_sub(row)) / 2).wrapping_add(column);
        let below = here.wrapping_add((steps + 1).wrapping_sub(row));
        [index(here), index(here.wrapping_add(1)), index(below), index(below.wrapping_add(1))]
    }
}

/// Whether all lanes are set.
#[inline(always)]
fn all(mask: Mask) -> bool {
    let mut all = u32::MAX;
    for lane in 0..LANES {
        all &= mask.0[lane];
    }
    all != 0
}

impl LitScene {
    /// What a ray needs of a triangle.
    #[inline(always)]
    pub fn face(&self, triangle: u32) -> &Face {
        &self.faces[index(triangle)]
    }

    /// The picture on a triangle.
    #[inline(always)]
    pub fn texture_of(&self, face: &Face) -> Option<&Texture> {
        self.scene.mesh.textures.get(index(face.texture()))
    }

    /// As `exitance_lux` for the rays of `lanes`, which all met `triangle`; any numbers in the other lanes, whose `u` and `v` must lie
    /// within 0..1. `colours` are those of its texture, or white.
    #[inline(always)]
    pub fn exitance_lux_alike(&self, rays: &OnTriangle, colours: &[Floats; BANDS]) -> [Floats; BANDS] {
        let OnTriangle { triangle, lanes, u, v, direction, lamp_levels, added, emission } = rays;
        let shade = &self.scene.layout.triangles[index(*triangle)];
        let paint = &self.paints[index(shade.material)];
        let levels = Floats(**lamp_levels);
        let back = Floats::splat(0.0).below(dot3(splat3(shade.normal), **direction)) & *lanes;
        let sees_both_sides = back.any() && back != *lanes;
        let around = Around::of(shade, *u, *v);
        let mut irradiance = if around.is_one_cell() && !sees_both_sides {
            self.irradiance_within(&around, back.any(), levels)
        } else {
            self.irradiance_by_lane(&around, back, *lanes, lamp_levels)
        };
        if let Some(added) = added {
            for band in 0..BANDS {
                irradiance[band] = (irradiance[band] + added[band]).greater(Floats::splat(0.0));
            }
        }
        let mut glow_levels = if paint.flickers { levels } else { Floats::splat(1.0) };
        if paint.cone != NO_CONE {
            for lane in 0..LANES {
                let along = [direction[0].0[lane], direction[1].0[lane], direction[2].0[lane]];
                glow_levels.0[lane] = self.glow_level(paint, along, lamp_levels[lane]);
            }
        }
        let mut colours = *colours;
        if let Some(corners) = self.scene.mesh.corner_colours(*triangle) {
            mix_in(&mut colours, &corners, *u, *v);
        }
        let mut lux = irradiance;
        for band in 0..BANDS {
            let albedo = Floats::splat(paint.base_colour[band]) * colours[band];
            let mut glow = Floats::splat(paint.glow_lux[band]) * glow_levels;
            if let Some(emission) = emission {
                glow = glow * emission[band];
            }
            lux[band] = irradiance[band] * albedo + glow;
        }
        if back.any() && !paint.double_sided {
            for band in 0..BANDS {
                lux[band] = back.select(Floats::splat(0.0), lux[band]);
            }
        }
        lux
    }

    /// Sources whose shadow may end at one of the rays that met a triangle: a bit each.
    #[inline(always)]
    pub fn sources_around(
        &self,
        shadows: &Shadows,
        triangle: u32,
        lanes: Mask,
        [u, v]: [Floats; 2],
        direction: &Vectors,
    ) -> u32 {
        let shade = &self.scene.layout.triangles[index(triangle)];
        let back = Floats::splat(0.0).below(dot3(splat3(shade.normal), *direction)) & lanes;
        let mut rest = lanes.bits();
        let first = next_lane(&mut rest);
        // Other lanes do not count: they stand where the first does.
        let [u, v] = [u, v].map(|weight| lanes.select(weight, Floats::splat(weight.0[first])));
        let around = Around::of(shade, u, v);
        // Both halves of a cell have the samples beside and below its first.
        let of_lane = |lane: usize| {
            let [_, beside, below, _] = around.corners(lane).map(|sample| 2 * sample + usize::from(back.0[lane] != 0));
            shadows.sources_at(beside) & shadows.sources_at(below)
        };
        let mut sources = of_lane(first);
        if around.is_one_cell() && (!back.any() || back == lanes) {
            return sources;
        }
        while rest != 0 {
            sources |= of_lane(next_lane(&mut rest));
        }
        sources
    }

    /// Lux-equivalents that reach one side of a surface within one cell of its samples.
    #[inline(always)]
    fn irradiance_within(&self, around: &Around, back: bool, levels: Floats) -> [Floats; BANDS] {
        let samples = around.corners(0);
        let mut irradiance = [Floats::splat(0.0); BANDS];
        add_light(&mut irradiance, &of_samples(&self.irradiance_lux, &samples, back), around, &around.weights);
        if !self.flickering_lux.is_empty() {
            let mut weights = around.weights;
            for corner in 0..3 {
                weights[corner] = weights[corner] * levels;
            }
            add_light(&mut irradiance, &of_samples(&self.flickering_lux, &samples, back), around, &weights);
        }
        irradiance
    }

    /// Lux-equivalents that reach each lane's side of a surface.
    #[inline(always)]
    fn irradiance_by_lane(
        &self,
        around: &Around,
        back: Mask,
        lanes: Mask,
        lamp_levels: &[f32; LANES],
    ) -> [Floats; BANDS] {
        let mut irradiance: [Bands; LANES] = [[0.0; BANDS]; LANES];
        let mut rest = lanes.bits();
        while rest != 0 {
            let lane = next_lane(&mut rest);
            let [here, beside, below, opposite] = around.corners(lane);
            let weights = [around.weights[0].0[lane], around.weights[1].0[lane], around.weights[2].0[lane]];
            let is_beyond = around.beyond.0[lane] != 0;
            let samples = if is_beyond { [opposite, below, beside] } else { [here, beside, below] };
            let near = [(samples[0], weights[0]), (samples[1], weights[1]), (samples[2], weights[2])];
            irradiance[lane] = self.irradiance_of(on_side(near, back.0[lane] != 0), lamp_levels[lane]);
        }
        by_band(&irradiance)
    }
}

/// Sample sides of samples, all on the front or all on the back.
#[inline(always)]
pub(super) fn on_side(around: [(usize, f32); 3], back: bool) -> [(usize, f32); 3] {
    around.map(|(sample, weight)| (2 * sample + usize::from(back), weight))
}

/// Multiplies colours with those of a triangle's corners, by the weights of its second and third.
#[inline(always)]
fn mix_in(colours: &mut [Floats; BANDS], [a, b, c]: &[Bands; 3], u: Floats, v: Floats) {
    let w = Floats::splat(1.0) - u - v;
    for band in 0..BANDS {
        let mixed = Floats::splat(a[band]) * w + Floats::splat(b[band]) * u + Floats::splat(c[band]) * v;
        colours[band] = colours[band] * mixed;
    }
}

/// Light of four samples on one side.
#[inline(always)]
fn of_samples(all: &[Bands], samples: &[usize; 4], back: bool) -> [Bands; 4] {
    let mut light = [[0.0; BANDS]; 4];
    for corner in 0..4 {
        // The last cell of a grid has no fourth sample, and no lane beyond that would ask for it.
        light[corner] = *all.get(2 * samples[corner] + usize::from(back)).unwrap_or(&[0.0; BANDS]);
    }
    light
}

/// Adds the light of a cell's samples by each lane's weights.
#[inline(always)]
fn add_light(
    sums: &mut [Floats; BANDS],
    [here, beside, below, opposite]: &[Bands; 4],
    around: &Around,
    weights: &[Floats; 3],
) {
    let nearer = [here, beside, below];
    if !around.beyond.any() {
        for corner in 0..3 {
            for band in 0..BANDS {
                sums[band] = sums[band] + Floats::splat(nearer[corner][band]) * weights[corner];
            }
        }
        return;
    }
    let farther = [opposite, below, beside];
    for corner in 0..3 {
        for band in 0..BANDS {
            let light = around.beyond.select(Floats::splat(farther[corner][band]), Floats::splat(nearer[corner][band]));
            sums[band] = sums[band] + light * weights[corner];
        }
    }
}

/// The whole part of numbers from 0 to 2^22, at most another whole number, as numbers of both kinds; 0 where that is below 0.
#[inline(always)]
pub(super) fn whole_below(value: Floats, most: Floats) -> (Floats, [u32; LANES]) {
    let magic = Floats::splat(TO_WHOLE);
    let near = (value + magic) - magic;
    let whole = value.below(near).select(near - Floats::splat(1.0), near);
    let whole = whole.lesser(most).greater(Floats::splat(0.0));
    let mut number = [0; LANES];
    for lane in 0..LANES {
        number[lane] = (whole.0[lane] + TO_WHOLE).to_bits().wrapping_sub(TO_WHOLE.to_bits());
    }
    (whole, number)
}

/// Light by lane.
#[inline(always)]
pub fn by_lane(lux: &[Floats; BANDS]) -> [Bands; LANES] {
    let mut out = [[0.0; BANDS]; LANES];
    for lane in 0..LANES {
        for band in 0..BANDS {
            out[lane][band] = lux[band].0[lane];
        }
    }
    out
}

/// Light by band, side by side.
#[inline(always)]
pub fn by_band(lux: &[Bands; LANES]) -> [Floats; BANDS] {
    let mut out = [Floats::splat(0.0); BANDS];
    for lane in 0..LANES {
        for band in 0..BANDS {
            out[band].0[lane] = lux[lane][band];
        }
    }
    out
}

#[cfg(test)]
mod tests;
