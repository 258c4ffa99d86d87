//! Light of a whole packet's hits. Enters: hits, and what each ray stands for on its texture. Leaves: exitance toward each ray in
//! lux-equivalents, lane by lane equal to `exitance_lux` in every bit.
//!
//! Neighbouring rays mostly meet the same triangle or two, so its numbers are fetched once; all places of all look-ups are found
//! side by side; and only the fetching of texels and samples goes ray by ray, with the four bands in one register.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::super::lanes::{Floats, LANES, Vectors, dot3};
use super::super::light::{BANDS, Bands};
use super::super::mesh::Mesh;
use super::super::samples::Layout;
use super::super::texture::{Footprints, Lookups, TO_WHOLE};
use super::super::tracer::{Hits, MISS};
use super::{LitScene, Paint};
use crate::num::index;

/// Numbers of a face: its normal, the slopes of both texture coordinates, the coordinates of its three corners.
const NUMBERS: usize = 15;

/// A triangle as a ray meets it, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Face {
    pub(super) numbers: [f32; NUMBERS],
    /// Its texture, `UNTEXTURED` without one, and marks.
    kind: u32,
}

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
}

/// Marks of a face that keeps an image: any gloss, and mirrors only.
const GLOSSY: [u32; 2] = [1 << 31, 1 << 30];
/// The part of a face's kind that names its texture.
const TEXTURE: u32 = (1 << 30) - 1;
/// Names no texture.
const UNTEXTURED: u32 = TEXTURE;

/// Faces of all triangles. `slopes` is empty without textures.
pub fn faces(mesh: &Mesh, layout: &Layout, slopes: &[[[f32; 3]; 2]], paints: &[Paint]) -> Vec<Face> {
    let mut faces = Vec::with_capacity(layout.triangles.len());
    for (triangle, shade) in layout.triangles.iter().enumerate() {
        let mut numbers = [0.0; NUMBERS];
        numbers[..3].copy_from_slice(&shade.normal);
        if let Some(slopes) = slopes.get(triangle) {
            numbers[3..9].copy_from_slice(slopes.as_flattened());
        }
        numbers[9..].copy_from_slice(shade.uv.as_flattened());
        let mut kind = mesh.materials[index(shade.material)].texture.unwrap_or(UNTEXTURED);
        for (mark, is_glossy) in GLOSSY.into_iter().zip(paints[index(shade.material)].glossy) {
            kind |= if is_glossy { mark } else { 0 };
        }
        faces.push(Face { numbers, kind });
    }
    faces
}

/// Faces that a packet met, side by side; where a ray met none, any numbers and no kind.
#[derive(Clone, Debug)]
pub struct Met {
    numbers: [Floats; NUMBERS],
    kind: [u32; LANES],
}

impl Met {
    /// Unit normals of the planes.
    #[inline(always)]
    pub fn normal(&self) -> Vectors {
        [self.numbers[0], self.numbers[1], self.numbers[2]]
    }

    /// Texels along u, then along v, for a metre in the world.
    #[inline(always)]
    pub fn slopes(&self) -> [Vectors; 2] {
        let n = &self.numbers;
        [[n[3], n[4], n[5]], [n[6], n[7], n[8]]]
    }

    /// Whether any ray met a surface that keeps an image: by any gloss, or as a mirror.
    #[inline(always)]
    pub fn has_gloss(&self, all: bool) -> bool {
        let mut marks = 0;
        for lane in 0..LANES {
            marks |= self.kind[lane];
        }
        marks & GLOSSY[usize::from(!all)] != 0
    }

    /// Texture of each lane; one that does not exist where there is none.
    #[inline(always)]
    fn texture(&self) -> [u32; LANES] {
        let mut texture = [0; LANES];
        for lane in 0..LANES {
            texture[lane] = self.kind[lane] & TEXTURE;
        }
        texture
    }

    /// Texture coordinates at weights of the second and third corner.
    #[inline(always)]
    fn uv(&self, u: Floats, v: Floats) -> [Floats; 2] {
        let n = &self.numbers;
        let w = Floats::splat(1.0) - u - v;
        [n[9] * w + n[11] * u + n[13] * v, n[10] * w + n[12] * u + n[14] * v]
    }
}

/// Samples of irradiance around hits and their weights, lane by lane as `ShadeTriangle::around` gives them.
struct Around {
    samples: [[u32; LANES]; 3],
    weights: [Floats; 3],
}

impl Around {
    /// Of hits on triangles; lanes without one have any.
    #[inline(always)]
    fn of(corners: &[[u32; LANES]; 3], grid_steps: &[u32; LANES], u: Floats, v: Floats) -> Self {
        let (zero, one) = (Floats::splat(0.0), Floats::splat(1.0));
        let mut steps = zero;
        for lane in 0..LANES {
            steps.0[lane] = crate::num::f32_from_u32(grid_steps[lane]);
        }
        let x = u.greater(zero).lesser(one) * steps;
        let y = v.greater(zero).lesser(one) * steps;
        let (row, row_number) = whole_below(y, steps - one);
        let (column, column_number) = whole_below(x, steps - one - row);
        let (fx, fy) = (x - column, y - row);
        let rest = (one - fx - fy).greater(zero).lesser(one);
        let (mut samples, mut weights) = (*corners, [one - u - v, u, v]);
        for lane in 0..LANES {
            let (steps, row, column) = (grid_steps[lane], row_number[lane], column_number[lane]);
            // Rows of falling length: the first sample of this one and of the next.
            let first = corners[0][lane]
                .wrapping_add(row.wrapping_mul(steps.wrapping_mul(2).wrapping_add(3).wrapping_sub(row)) / 2);
            let here = first.wrapping_add(column);
            let below = here.wrapping_add(steps.wrapping_add(1).wrapping_sub(row));
            let across = (fx.0[lane] + fy.0[lane] > 1.0) & (column.wrapping_add(row).wrapping_add(2) <= steps);
            let is_grid = steps > 0;
            let far = if across { below.wrapping_add(1) } else { here };
            let [second, third] = if across { [below, here.wrapping_add(1)] } else { [here.wrapping_add(1), below] };
            samples[0][lane] = if is_grid { far } else { corners[0][lane] };
            samples[1][lane] = if is_grid { second } else { corners[1][lane] };
            samples[2][lane] = if is_grid { third } else { corners[2][lane] };
            let far = if across { fx.0[lane] + fy.0[lane] - 1.0 } else { rest.0[lane] };
            let second = if across { 1.0 - fx.0[lane] } else { fx.0[lane] };
            let third = if across { 1.0 - fy.0[lane] } else { fy.0[lane] };
            weights[0].0[lane] = if is_grid { far } else { weights[0].0[lane] };
            weights[1].0[lane] = if is_grid { second } else { weights[1].0[lane] };
            weights[2].0[lane] = if is_grid { third } else { weights[2].0[lane] };
        }
        Self { samples, weights }
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

/// A lane in the middle of a packet's square of pixels.
pub(super) const MIDDLE: usize = LANES / 2 + 1;

impl LitScene {
    /// Unit normal of a triangle, and the texels along u and v for a metre in the world.
    #[inline(always)]
    pub fn surface(&self, triangle: u32) -> ([f32; 3], [[f32; 3]; 2]) {
        let n = &self.faces[index(triangle)].numbers;
        ([n[0], n[1], n[2]], [[n[3], n[4], n[5]], [n[6], n[7], n[8]]])
    }

    /// Faces of what a packet met. Most packets meet one triangle: the face of a middle lane fills all, and the others follow one by one.
    #[inline(always)]
    pub fn met(&self, hits: &Hits) -> Met {
        let mut met = Met { numbers: [Floats::splat(0.0); NUMBERS], kind: [UNTEXTURED; LANES] };
        let common = hits.triangle[MIDDLE];
        if common != MISS {
            let face = &self.faces[index(common)];
            for number in 0..NUMBERS {
                met.numbers[number] = Floats::splat(face.numbers[number]);
            }
            met.kind = [face.kind; LANES];
        }
        let mut others = 0;
        for lane in 0..LANES {
            others |= hits.triangle[lane] ^ common;
        }
        if others == 0 {
            return met;
        }
        for lane in 0..LANES {
            let triangle = hits.triangle[lane];
            if triangle == MISS {
                met.kind[lane] = UNTEXTURED;
            } else if triangle != common {
                let face = &self.faces[index(triangle)];
                for number in 0..NUMBERS {
                    met.numbers[number].0[lane] = face.numbers[number];
                }
                met.kind[lane] = face.kind;
            }
        }
        met
    }

    /// Colours of the textures of what a packet met; white where there is none.
    #[inline(always)]
    pub fn colours(&self, hits: &Hits, met: &Met, footprints: &Footprints) -> [Bands; LANES] {
        let mut colours = [[1.0; BANDS]; LANES];
        let texture = met.texture();
        Lookups::of(met.uv(hits.u, hits.v), &texture, &self.scene.mesh.textures, footprints).run(&mut colours);
        colours
    }

    /// As `exitance_lux` for all lanes of a packet that hit something, and dark for the others. Footprints may be left out where no
    /// surface has a texture.
    #[inline(always)]
    pub fn exitances_lux(
        &self,
        hits: &Hits,
        met: &Met,
        direction: &Vectors,
        footprints: Option<&Footprints>,
        lamp_levels: &[f32; LANES],
    ) -> [Bands; LANES] {
        let colours = match footprints {
            Some(footprints) => self.colours(hits, met, footprints),
            None => [[1.0; BANDS]; LANES],
        };
        let along = dot3(met.normal(), *direction);
        let (mut corners, mut grid_steps) = ([[0; LANES]; 3], [0; LANES]);
        for lane in 0..LANES {
            if hits.triangle[lane] != MISS {
                let shade = &self.scene.layout.triangles[index(hits.triangle[lane])];
                (corners[0][lane], corners[1][lane], corners[2][lane]) =
                    (shade.samples[0], shade.samples[1], shade.samples[2]);
                grid_steps[lane] = shade.grid_steps;
            }
        }
        let around = Around::of(&corners, &grid_steps, hits.u, hits.v);
        let mut lux = [[0.0; BANDS]; LANES];
        for lane in 0..LANES {
            let triangle = hits.triangle[lane];
            if triangle == MISS {
                continue;
            }
            let shade = &self.scene.layout.triangles[index(triangle)];
            let (paint, back) = (&self.paints[index(shade.material)], along.0[lane] > 0.0);
            if back && !paint.double_sided {
                continue;
            }
            let level = lamp_levels[lane];
            let mut near = [(0, 0.0); 3];
            for place in 0..3 {
                near[place] = (index(around.samples[place][lane]), around.weights[place].0[lane]);
            }
            let irradiance = self.irradiance_of(near, back, level);
            let along = [direction[0].0[lane], direction[1].0[lane], direction[2].0[lane]];
            let glow_level = self.glow_level(paint, along, level);
            for band in 0..BANDS {
                let albedo = paint.base_colour[band] * colours[lane][band];
                lux[lane][band] = irradiance[band] * albedo + paint.glow_lux[band] * glow_level;
            }
        }
        lux
    }
}

#[cfg(test)]
mod tests;
