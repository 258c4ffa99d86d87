//! Points on surfaces where irradiance is known, and for each triangle the points to interpolate between.
//!
//! Small triangles have a sample at each vertex; a large one has a grid of samples ("mesh colours"). Each sample has two
//! sides: the side of its normal (0), then the back (1). A *sample side* is the number `2 * sample + side` of one of them: its index in
//! every list of both sides of all samples.

use std::collections::BTreeMap;

use super::light::{BANDS, Bands};
use super::mesh::{ALBEDO_MAX, MIRROR_METALLIC_MIN, Material, Mesh, Vertex};
use super::vectors::{area_m2, cross, dot, sub, unit, unit_normal, weighted};
use crate::num::{f32_from_u32, f32_nearest, i32_truncated_f32, index, u32_from, u32_truncated_f32};

/// Triangles with a longer edge than this have a grid.
const GRID_EDGE_M: f32 = 0.15;

/// Distance between the samples of a grid along its longest edge, in a scene of a room's size.
pub const GRID_SPACING_M: f32 = 0.08;

/// Samples of all grids together, about: in a larger scene they stand further apart, and triangles may be larger before they have a grid.
const GRID_SAMPLES: f64 = 250_000.0;

/// Steps along the edge of a grid at most: 33,153 samples in one triangle.
const GRID_STEPS_MAX: u32 = 256;

/// Edge of the cells in which vertices share a sample.
const VERTEX_CELL_M: f32 = 0.006;

/// Sectors of a normal's coordinate from 0 to 1.
const NORMAL_SECTORS: f32 = 2.0;

/// Samples at the rim of a grid stand this share of a step inside, so that they do not lie in the neighbouring wall.
const RIM_STEPS: f32 = 0.1;

/// A point on a surface where irradiance is baked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradianceSample {
    /// Metres.
    pub position_m: [f32; 3],
    /// Unit length; the first side.
    pub normal: [f32; 3],
    /// Reflectance around it of what leaves in all directions: a glossy metal has none.
    pub albedo: Bands,
    /// Whether the back is lit and seen as well.
    pub double_sided: bool,
    /// Part of a grid on a large triangle, which deserves more rays than a vertex of a small one.
    pub on_grid: bool,
}

impl IrradianceSample {
    /// Sides that are lit.
    pub fn sides(&self) -> usize {
        1 + usize::from(self.double_sided)
    }
}

/// What shading needs of a triangle, in one cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct ShadeTriangle {
    /// Unit normal of the plane, on the side of the vertex normals.
    pub normal: [f32; 3],
    /// Texture coordinates of the corners.
    pub uv: [[f32; 2]; 3],
    /// Samples of the corners; of a grid, the first sample stands in each.
    pub samples: [u32; 3],
    /// Steps along the edge of its grid; 0 where the corners carry the samples.
    pub grid_steps: u32,
    /// Material.
    pub material: u32,
    /// Texels of the texture's finest level in a metre; 0 without texture.
    pub texels_per_m: f32,
}

impl ShadeTriangle {
    /// Three samples around a point and their weights, from the weights of the second and third corner.
    #[inline(always)]
    pub fn around(&self, u: f32, v: f32) -> [(usize, f32); 3] {
        if self.grid_steps == 0 {
            let [a, b, c] = self.samples.map(index);
            return [(a, 1.0 - u - v), (b, u), (c, v)];
        }
        let steps = f32_from_u32(self.grid_steps);
        let (x, y) = (u.clamp(0.0, 1.0) * steps, v.clamp(0.0, 1.0) * steps);
        // The last cell along either edge is that of the last step, so that every named sample exists.
        let row = u32_truncated_f32(y).min(self.grid_steps - 1);
        let column = u32_truncated_f32(x).min(self.grid_steps - 1 - row);
        let (fx, fy) = (x - f32_from_u32(column), y - f32_from_u32(row));
        let at = |column: u32, row: u32| index(self.grid_sample(column, row));
        let across = fx + fy > 1.0 && column + row + 2 <= self.grid_steps;
        if across {
            let far = (at(column + 1, row + 1), fx + fy - 1.0);
            [far, (at(column, row + 1), 1.0 - fx), (at(column + 1, row), 1.0 - fy)]
        } else {
            // On the slanted rim rounding may leave the cell by an ulp: the weight of the first sample is then clipped.
            let first = (1.0 - fx - fy).clamp(0.0, 1.0);
            [(at(column, row), first), (at(column + 1, row), fx), (at(column, row + 1), fy)]
        }
    }

    /// Texture coordinates at weights of the second and third corner.
    #[inline(always)]
    pub fn uv_at(&self, u: f32, v: f32) -> [f32; 2] {
        weighted(self.uv, [1.0 - u - v, u, v])
    }

    /// Both sides, 0 and 1, of each of its samples.
    pub fn sides(&self) -> impl Iterator<Item = (usize, usize)> {
        let (first, steps) = (index(self.samples[0]), index(self.grid_steps));
        let grid = first..if steps > 0 { first + (steps + 1) * (steps + 2) / 2 } else { first };
        let corners = if steps > 0 { None } else { Some(self.samples.map(index)) };
        grid.chain(corners.into_iter().flatten()).flat_map(|sample| [(0, sample), (1, sample)])
    }

    /// The sample of a grid at the given steps from its first corner towards the second and towards the third.
    #[inline(always)]
    pub fn grid_sample(&self, column: u32, row: u32) -> u32 {
        self.samples[0] + grid_index(self.grid_steps, column, row)
    }
}

/// Index of a grid's sample among the grid's samples: rows of falling length.
#[inline(always)]
fn grid_index(steps: u32, column: u32, row: u32) -> u32 {
    row * (2 * steps + 3 - row) / 2 + column
}

/// All samples and triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// The samples.
    pub samples: Vec<IrradianceSample>,
    /// One for each triangle of the mesh.
    pub triangles: Vec<ShadeTriangle>,
}

impl Layout {
    /// Lays samples out.
    pub fn of(mesh: &Mesh) -> Self {
        let mut layout = Self { samples: Vec::new(), triangles: Vec::with_capacity(mesh.triangles.len()) };
        let spacing_m = spacing_m(mesh);
        let mut sample_of_vertex = vec![u32::MAX; mesh.vertices.len()];
        let mut sample_of_cell = BTreeMap::new();
        for triangle in 0..mesh.triangles.len() {
            let mut shade = unsampled(mesh, triangle);
            let steps = grid_steps(mesh.corners_m(triangle), spacing_m);
            if steps > 0 {
                shade.samples = [u32_from(layout.samples.len()); 3];
                shade.grid_steps = steps;
                layout.push_grid(mesh, triangle, &shade, spacing_m);
            } else {
                shade.samples = mesh.triangles[triangle].map(|corner| {
                    let known = &mut sample_of_vertex[index(corner)];
                    if *known == u32::MAX {
                        let vertex = &mesh.vertices[index(corner)];
                        let key = (cell(vertex), shade.material);
                        *known = *sample_of_cell
                            .entry(key)
                            .or_insert_with(|| layout.push_vertex(mesh, corner, &shade, spacing_m));
                    }
                    *known
                });
            }
            layout.triangles.push(shade);
        }
        layout
    }

    fn push_vertex(&mut self, mesh: &Mesh, corner: u32, shade: &ShadeTriangle, spacing_m: f32) -> u32 {
        let vertex = &mesh.vertices[index(corner)];
        let albedo = albedo(mesh, shade, vertex.uv, mesh.colour(corner), spacing_m);
        let (position_m, normal) = (vertex.position_m, vertex.normal);
        let double_sided = mesh.materials[index(shade.material)].double_sided;
        self.samples.push(IrradianceSample { position_m, normal, albedo, double_sided, on_grid: false });
        u32_from(self.samples.len() - 1)
    }

    fn push_grid(&mut self, mesh: &Mesh, triangle: usize, shade: &ShadeTriangle, spacing_m: f32) {
        let steps = shade.grid_steps;
        let corners_m = mesh.corners_m(triangle);
        let normals = mesh.triangles[triangle].map(|corner| mesh.vertices[index(corner)].normal);
        let inset = RIM_STEPS / f32_from_u32(steps);
        for row in 0..=steps {
            for column in 0..=(steps - row) {
                let v = f32_from_u32(row) / f32_from_u32(steps);
                let u = f32_from_u32(column) / f32_from_u32(steps);
                let weights = inside([1.0 - u - v, u, v], inset);
                let normal = unit(weighted(normals, weights)).unwrap_or(shade.normal);
                let colour = mesh.colour_at(u32_from(triangle), weights).unwrap_or([1.0; BANDS]);
                let albedo = albedo(mesh, shade, weighted(shade.uv, weights), colour, spacing_m);
                let double_sided = mesh.materials[index(shade.material)].double_sided;
                let position_m = weighted(corners_m, weights);
                self.samples.push(IrradianceSample { position_m, normal, albedo, double_sided, on_grid: true });
            }
        }
    }
}

/// Vertices of one material in the same cell, with normals in the same sector, share a sample: fine meshes have far more
/// vertices than light has detail.
fn cell(vertex: &Vertex) -> [i32; 6] {
    let [x, y, z] = vertex.position_m.map(|x| i32_truncated_f32((x / VERTEX_CELL_M).floor()));
    let [a, b, c] = vertex.normal.map(|x| i32_truncated_f32((x * NORMAL_SECTORS).round_ties_even()));
    [x, y, z, a, b, c]
}

/// Corner weights with none below `least`, still summing to 1.
fn inside(weights: [f32; 3], least: f32) -> [f32; 3] {
    let share = 1.0 - 3.0 * least;
    weights.map(|weight| least + weight * share)
}

fn unsampled(mesh: &Mesh, triangle: usize) -> ShadeTriangle {
    let corners_m = mesh.corners_m(triangle);
    let uv = mesh.triangles[triangle].map(|corner| mesh.vertices[index(corner)].uv);
    let material = mesh.material_of[triangle];
    let normal = unit_normal(corners_m).expect("a mesh keeps no triangle without area");
    let texels_per_m = mesh.materials[index(material)].texture.map_or(0.0, |texture| {
        let [width, height] = mesh.textures[index(texture)].size();
        let [a, b, c] = uv;
        let [bu, bv, cu, cv] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]];
        let texels2 = 0.5 * ((bu * cv - bv * cu) * width * height).abs();
        (texels2 / area_m2(corners_m)).sqrt()
    });
    ShadeTriangle { normal, uv, samples: [0; 3], grid_steps: 0, material, texels_per_m }
}

/// Distance between samples that this mesh can have: a compact triangle of area A has 1.42^2 A / spacing^2 of them.
fn spacing_m(mesh: &Mesh) -> f32 {
    let areas = (0..mesh.triangles.len()).map(|triangle| f64::from(area_m2(mesh.corners_m(triangle))));
    let total_m2 = areas.fold(0.0, |sum, area| sum + area);
    f32_nearest((2.0164 * total_m2 / GRID_SAMPLES).sqrt()).max(GRID_SPACING_M)
}

/// Steps of a triangle's grid, 0 where its vertices do.
fn grid_steps(corners_m: [[f32; 3]; 3], spacing_m: f32) -> u32 {
    let [a, b, c] = corners_m;
    let length = |vector: [f32; 3]| dot(vector, vector).sqrt();
    let longest = length(sub(b, a)).max(length(sub(c, b))).max(length(sub(a, c)));
    if longest <= GRID_EDGE_M * (spacing_m / GRID_SPACING_M) {
        return 0;
    }
    // A sliver needs samples along its length only, but a grid has them across as well: it gets twice the samples that a
    // compact triangle of its area has.
    let doubled_area = length(cross(sub(b, a), sub(c, a)));
    let compact = 1.42 * doubled_area.sqrt() / spacing_m;
    let steps = (longest / spacing_m).min(compact).ceil();
    u32_truncated_f32(steps).clamp(2, GRID_STEPS_MAX)
}

/// Reflectance of a material around a texture coordinate, averaged over the spacing of a grid, as bounces take it.
fn albedo(mesh: &Mesh, shade: &ShadeTriangle, uv: [f32; 2], colour: Bands, spacing_m: f32) -> Bands {
    let material = &mesh.materials[index(shade.material)];
    let diffuse = if material.is_mirror() { 1.0 - material.metallic } else { 1.0 };
    let base: Bands = std::array::from_fn(|band| material.base_colour[band] * diffuse * colour[band]);
    let product = match material.texture {
        None => base,
        Some(texture) => {
            let colour = mesh.textures[index(texture)].colour(uv, shade.texels_per_m * spacing_m);
            std::array::from_fn(|band| base[band] * colour[band])
        }
    };
    let product = product.map(|band| of_hits(material, band));
    product.map(|band| if band > ALBEDO_MAX { ALBEDO_MAX } else { band })
}

/// Reflectance of a pane for light that does not pass: a bake takes its mirror image as diffuse, as that of all dielectrics.
fn of_hits(material: &Material, albedo: f32) -> f32 {
    let clear = material.transmission;
    if clear <= 0.0 {
        return albedo;
    }
    let reflected = PANE_REFLECTANCE + (1.0 - PANE_REFLECTANCE) * (1.0 - clear) * albedo;
    reflected / (1.0 - (1.0 - PANE_REFLECTANCE) * clear * material.pane_tint())
}

/// What a pane reflects of even light: the mean of Schlick's formula over the hemisphere, 0.04 + 0.96 / 21.
const PANE_REFLECTANCE: f32 = 0.0857;

impl Material {
    /// Whether a bake follows light over it: glossy metals. What glazed tiles and polished wood mirror, some 4 %, is baked as
    /// if they sent it to all sides, because such surfaces are everywhere and each ray that they mirror takes as much as one more ray.
    pub(super) fn is_mirror(&self) -> bool {
        self.gloss().is_some() && self.metallic >= MIRROR_METALLIC_MIN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_weights_reproduce_the_point_and_stay_in_range() {
        let steps = 7;
        let mut points = Vec::new();
        for row in 0..=steps {
            for column in 0..=(steps - row) {
                assert_eq!(index(grid_index(steps, column, row)), points.len());
                points.push([f32_from_u32(column) / 7.0, f32_from_u32(row) / 7.0]);
            }
        }
        let shade = ShadeTriangle {
            normal: [0.0, 1.0, 0.0],
            uv: [[0.0; 2]; 3],
            samples: [0; 3],
            grid_steps: steps,
            material: 0,
            texels_per_m: 0.0,
        };
        let mut tried = 0;
        for i in 0..=100_u32 {
            for j in 0..=(100 - i) {
                let (u, v) = (f32_from_u32(i) / 100.0, f32_from_u32(j) / 100.0);
                let (mut x, mut y, mut sum) = (0.0, 0.0, 0.0);
                for (sample, weight) in shade.around(u, v) {
                    x += points[sample][0] * weight;
                    y += points[sample][1] * weight;
                    sum += weight;
                }
                // Weights are differences of numbers up to 7 (rounding 7 * 2^-24 each, three of them).
                assert!((x - u).abs() < 3e-6 && (y - v).abs() < 3e-6 && (sum - 1.0).abs() < 3e-6, "{u} {v}: {x} {y}");
                tried += 1;
            }
        }
        assert_eq!(tried, 5151);
    }
}
