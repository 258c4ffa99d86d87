//! Chooses the samples of grids whose rays are traced; the light of all others is interpolated.
//!
//! Rays are first traced at the nodes of coarse cells. A cell is split until its nodes agree with a linear interpolation, nothing stands
//! close to it, and each of its samples sees the lamps that all its nodes see (cf. irradiance caching: Ward, Rubinstein and Clear,
//! SIGGRAPH 1988). Choices depend on traced light alone, wave by wave, so they are the same on any number of threads.

use glam::DVec3;

use super::super::chance::in_chunks;
use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands};
use super::super::tracer::Stack;
use super::cells::{GridCell, Nodes};
use super::clearance::{FlatBox, is_anything_near};
use super::fan::GROUPS;
use super::gathered::Gathered;
use super::light_points::LightPoints;
use super::secondary::SecondarySources;
use super::settings::BakeSettings;
use super::shadow_rays::visible_light_points;
use super::traced::{CHUNKS_TOGETHER, Stencil, TracedSamples, interpolate};
use crate::num::{f32_nearest, f64_from_usize, index, u32_from};

/// Samples of a unit of parallel work.
const CHUNK: usize = 128;

/// Cells of a unit of parallel work.
const CELLS: usize = 64;

/// Greatest difference between a node and the linear interpolation of its cell's corners, as a share of the light there.
const DIFFERENCE: f32 = 0.02;

/// The same in standard errors of the node's own light, if its rays were drawn without strata: a difference that the node's noise may
/// have made is no reason for more rays.
const ERRORS: f32 = 2.5;

/// Light below this share of the scene's mean counts as this share.
const DIM: f64 = 0.02;

/// A cell is split where anything stands within this share of its longer edge.
const CLEARANCE: f64 = 0.5;

/// Bounces in the light that cells are judged by.
const BOUNCES: usize = 2;

/// Traces a scene. `progress` is told the share of samples that are done.
pub fn traced_samples(scene: &Scene, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> TracedSamples {
    let mut refinement = WaveRefinement::new(scene, settings, progress);
    let mut cells = Vec::new();
    for (number, shade) in (0_u32..).zip(&scene.layout.triangles) {
        if shade.grid_steps > 0 {
            GridCell::append_grid(number, shade.grid_steps, &mut cells);
        }
    }
    if !settings.interpolates {
        cells.clear();
    }
    let is_wanted = |&sample: &u32| !settings.interpolates || !scene.layout.samples[index(sample)].on_grid;
    refinement.wanted = (0..u32_from(scene.layout.samples.len())).filter(is_wanted).collect();
    while !(cells.is_empty() && refinement.wanted.is_empty()) {
        cells = refinement.wave(cells);
    }
    refinement.traced()
}

/// The state between waves.
struct WaveRefinement<'a> {
    scene: &'a Scene,
    light_points: [LightPoints; 2],
    secondary: [SecondarySources; 2],
    /// Some of the light points of samples on grids.
    probes: LightPoints,
    bounces: bool,
    progress: &'a (dyn Fn(f64) + Sync),
    groups: usize,
    traced: TracedSamples,
    wanted: Vec<u32>,
    is_traced: Vec<bool>,
    is_done: Vec<bool>,
    done: usize,
    /// Light of traced sample sides by group, with the bounces that are known.
    light: [Vec<Bands>; GROUPS],
    /// Standard errors of `light`.
    errors: [Vec<Bands>; GROUPS],
    /// Estimated at all sample sides after the first wave.
    exitance: [Vec<Bands>; GROUPS],
    least: [Bands; GROUPS],
    seen: Vec<Option<u32>>,
}

impl<'a> WaveRefinement<'a> {
    fn new(scene: &'a Scene, settings: &BakeSettings, progress: &'a (dyn Fn(f64) + Sync)) -> Self {
        let light_points = LightPoints::of(scene, settings);
        let secondary = if settings.bounces {
            SecondarySources::of(scene, &light_points)
        } else {
            <[SecondarySources; 2]>::default()
        };
        let samples = scene.layout.samples.len();
        let groups = 1 + usize::from(!scene.flickering.is_empty());
        // Zeros as the allocator has them take no memory before they are written to, as a copy does.
        let dark = || -> [Vec<Bands>; GROUPS] {
            std::array::from_fn(|group| if group < groups { vec![[0.0; BANDS]; 2 * samples] } else { Vec::new() })
        };
        Self {
            scene,
            probes: light_points[1].thinned(),
            traced: TracedSamples {
                buried: vec![false; 2 * samples],
                sources: light_points[1].sources.clone(),
                ..TracedSamples::default()
            },
            light_points,
            secondary,
            bounces: settings.bounces,
            progress,
            groups,
            wanted: Vec::new(),
            is_traced: vec![false; samples],
            is_done: vec![false; samples],
            done: 0,
            light: dark(),
            errors: dark(),
            exitance: dark(),
            least: [[0.0; BANDS]; GROUPS],
            seen: vec![None; samples],
        }
    }

    /// Traces the nodes of cells, and gives back the parts of those that are split.
    fn wave(&mut self, cells: Vec<GridCell>) -> Vec<GridCell> {
        let layout = &self.scene.layout;
        let nodes_of = |cell: &GridCell| cell.nodes(&layout.triangles[index(cell.triangle)]);
        let mut wanted = std::mem::take(&mut self.wanted);
        cells.iter().for_each(|cell| wanted.extend_from_slice(nodes_of(cell).samples()));
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|&sample| !self.is_traced[index(sample)]);
        let first = self.trace(&wanted);
        let cells: Vec<GridCell> = cells.into_iter().filter(GridCell::has_inner).collect();
        if cells.is_empty() {
            return cells;
        }
        if first == 0 {
            self.estimate(&cells);
        } else {
            self.light_up(first);
        }
        self.find_errors(first);
        let smooth = self.each_cell(&cells, |cell| self.is_smooth(cell));
        self.probe(cells.iter().zip(&smooth).filter_map(|(cell, &smooth)| smooth.then_some(cell)));
        let kept = cells.iter().zip(smooth).map(|(cell, smooth)| smooth && self.is_lit_alike(cell));
        let kept: Vec<bool> = kept.collect();
        let mut parts = Vec::new();
        for (cell, kept) in cells.iter().zip(kept) {
            if kept { self.keep(cell) } else { cell.split(&mut parts) }
        }
        parts
    }

    fn each_cell<T: Send>(&self, cells: &[GridCell], work: impl Fn(&GridCell) -> T + Sync) -> Vec<T> {
        let chunks = in_chunks(cells.len(), CELLS, |range| cells[range].iter().map(&work).collect::<Vec<T>>());
        chunks.into_iter().flatten().collect()
    }

    /// Traces samples, and gives back the first of their chunks.
    fn trace(&mut self, wanted: &[u32]) -> usize {
        let total = f64_from_usize(self.is_traced.len().max(1));
        let before = std::sync::atomic::AtomicUsize::new(self.done);
        let (scene, light_points, secondary) = (self.scene, &self.light_points, &self.secondary);
        let (bounces, progress) = (self.bounces, self.progress);
        let first = self.traced.gathered.len();
        for wanted in wanted.chunks(CHUNKS_TOGETHER * CHUNK) {
            let new = in_chunks(wanted.len(), CHUNK, |range| {
                let count = range.len();
                let chunk = Gathered::of(scene, light_points, secondary, bounces, &wanted[range]);
                let before = before.fetch_add(count, std::sync::atomic::Ordering::Relaxed);
                progress(f64_from_usize(before + count) / total);
                chunk
            });
            for (mut chunk, hits) in new {
                chunk.append_hits(hits, &mut self.traced.hits);
                chunk.put(&chunk.buried, &mut self.traced.buried);
                chunk.sample_sides.iter().for_each(|&sample_side| self.is_traced[index(sample_side / 2)] = true);
                self.traced.gathered.push(chunk);
            }
        }
        wanted.iter().for_each(|&sample| self.finish(sample));
        first
    }

    fn finish(&mut self, sample: u32) {
        self.done += usize::from(!std::mem::replace(&mut self.is_done[index(sample)], true));
    }

    /// Light of traced samples from a chunk on, under the exitance that is known.
    fn light_up(&mut self, first: usize) {
        for group in 0..self.groups {
            let TracedSamples { gathered, hits, .. } = &self.traced;
            let (chunks, exitance) = (&gathered[first..], &self.exitance[group]);
            let lights = in_chunks(chunks.len(), 1, |range| chunks[range.start].bounced(hits, group, exitance));
            for (chunk, values) in chunks.iter().zip(&lights) {
                chunk.put(values, &mut self.light[group]);
            }
        }
    }

    /// Standard errors of the same.
    fn find_errors(&mut self, first: usize) {
        let TracedSamples { gathered, hits, .. } = &self.traced;
        let chunks: Vec<&Gathered> = gathered[first..].iter().filter(|chunk| chunk.has_grid()).collect();
        for group in 0..self.groups {
            let exitance = &self.exitance[group];
            let errors = in_chunks(chunks.len(), 1, |range| chunks[range.start].standard_errors(hits, group, exitance));
            for (chunk, values) in chunks.iter().zip(&errors) {
                chunk.put(values, &mut self.errors[group]);
            }
        }
    }

    /// Estimates the exitance of all sample sides from what the first wave traced, and what light counts as dim.
    fn estimate(&mut self, cells: &[GridCell]) {
        let stencils: Vec<Stencil> = self.each_cell(cells, |cell| self.stencils(cell)).into_iter().flatten().collect();
        for group in 0..self.groups {
            for chunk in &self.traced.gathered {
                chunk.put(&chunk.direct[group], &mut self.light[group]);
            }
        }
        for _ in 0..if self.bounces { BOUNCES } else { 0 } {
            for group in 0..self.groups {
                let mut light = self.light[group].clone();
                interpolate(&stencils, &mut light);
                let samples = &self.scene.layout.samples;
                let exitance = light.iter().enumerate().map(|(sample_side, light)| {
                    std::array::from_fn(|band| light[band] * samples[sample_side / 2].albedo[band])
                });
                self.exitance[group] = exitance.collect();
            }
            self.light_up(0);
        }
        for group in 0..self.groups {
            for band in 0..BANDS {
                let (mut sum, mut lit) = (0.0, 0);
                for light in self.light[group].iter().filter(|light| light[band] > 0.0) {
                    sum += f64::from(light[band]);
                    lit += 1;
                }
                self.least[group][band] = f32_nearest(DIM * sum / f64_from_usize(lit.max(1)));
            }
        }
    }

    fn stencils(&self, cell: &GridCell) -> Vec<Stencil> {
        let shade = &self.scene.layout.triangles[index(cell.triangle)];
        let (nodes, mut found) = (*cell.nodes(shade).all(), Vec::new());
        cell.each_inner(shade, |sample, weights| {
            if !self.is_traced[index(sample)] {
                found.push(Stencil { sample, nodes, weights });
            }
        });
        found
    }

    fn is_smooth(&self, cell: &GridCell) -> bool {
        let nodes = cell.nodes(&self.scene.layout.triangles[index(cell.triangle)]);
        let sides = self.scene.layout.samples[index(nodes.samples()[0])].sides();
        (0..sides).all(|side| self.is_smooth_on(cell, &nodes, side))
    }

    fn is_smooth_on(&self, cell: &GridCell, nodes: &Nodes, side: usize) -> bool {
        let sample_sides = || nodes.samples().iter().map(|&sample| 2 * index(sample) + side);
        if sample_sides().any(|sample_side| self.traced.buried[sample_side]) {
            return false;
        }
        let is_dark = |sample_side: usize| (0..self.groups).all(|group| self.light[group][sample_side] == [0.0; BANDS]);
        sample_sides().all(is_dark) || (self.is_linear(cell, nodes, side) && !self.is_cramped(cell, nodes, side))
    }

    fn is_linear(&self, cell: &GridCell, nodes: &Nodes, side: usize) -> bool {
        let mut linear = true;
        for group in 0..self.groups {
            let light = |node: usize| &self.light[group][2 * index(nodes.samples()[node]) + side];
            let error = |node: usize| &self.errors[group][2 * index(nodes.samples()[node]) + side];
            cell.each_middle(|node, corners| {
                for band in 0..BANDS {
                    let mixed = corners.iter().fold(0.0, |sum, &(corner, share)| sum + share * light(corner)[band]);
                    let bound = DIFFERENCE * mixed.max(self.least[group][band]) + ERRORS * error(node)[band];
                    linear &= (light(node)[band] - mixed).abs() <= bound;
                }
            });
        }
        linear
    }

    /// Whether anything stands close on one side of a cell.
    fn is_cramped(&self, cell: &GridCell, nodes: &Nodes, side: usize) -> bool {
        let at_m =
            |&sample: &u32| DVec3::from_array(self.scene.layout.samples[index(sample)].position_m.map(f64::from));
        let positions_m = nodes.samples().iter().map(at_m);
        let (low_m, high_m) =
            positions_m.fold((DVec3::MAX, DVec3::MIN), |(low_m, high_m), at_m| (low_m.min(at_m), high_m.max(at_m)));
        let reach_m = DVec3::splat(CLEARANCE * (high_m - low_m).max_element());
        let normal = DVec3::from_array(self.scene.layout.triangles[index(cell.triangle)].normal.map(f64::from));
        let normal = if side == 0 { normal } else { -normal };
        let part = FlatBox { corners_m: [low_m - reach_m, high_m + reach_m], normal, at_m: at_m(&nodes.samples()[0]) };
        is_anything_near(&self.scene.bvh, &part)
    }

    /// Finds which of some light points all samples of cells see.
    fn probe<'b>(&mut self, cells: impl Iterator<Item = &'b GridCell>) {
        if self.probes.count() == 0 {
            return;
        }
        let mut asked = Vec::new();
        for cell in cells {
            let shade = &self.scene.layout.triangles[index(cell.triangle)];
            asked.extend_from_slice(cell.nodes(shade).samples());
            cell.each_inner(shade, |sample, _| asked.push(sample));
        }
        asked.retain(|&sample| self.seen[index(sample)].is_none());
        asked.sort_unstable();
        asked.dedup();
        let (scene, probes) = (self.scene, &self.probes);
        let seen = in_chunks(asked.len(), CHUNK, |range| {
            let mut stack = Stack::new();
            asked[range]
                .iter()
                .map(|&sample| visible_light_points(scene, index(sample), probes, &mut stack))
                .collect::<Vec<_>>()
        });
        for (sample, seen) in asked.into_iter().zip(seen.into_iter().flatten()) {
            self.seen[index(sample)] = Some(seen);
        }
    }

    /// Whether each sample sees those light points that all nodes see, and none that no node sees.
    fn is_lit_alike(&self, cell: &GridCell) -> bool {
        let shade = &self.scene.layout.triangles[index(cell.triangle)];
        let seen = |sample: u32| self.seen[index(sample)].unwrap_or(0);
        let (mut by_all, mut by_some) = (u32::MAX, 0);
        for &node in cell.nodes(shade).samples() {
            (by_all, by_some) = (by_all & seen(node), by_some | seen(node));
        }
        let mut alike = true;
        cell.each_inner(shade, |sample, _| alike &= seen(sample) & by_all == by_all && seen(sample) & !by_some == 0);
        alike
    }

    fn keep(&mut self, cell: &GridCell) {
        for stencil in self.stencils(cell) {
            self.finish(stencil.sample);
            self.traced.stencils.push(stencil);
        }
    }

    /// What was traced. A sample on the rim of a cell may have been traced for its neighbour, and on the rims of two it has one stencil.
    fn traced(mut self) -> TracedSamples {
        let is_traced = &self.is_traced;
        let stencils = &mut self.traced.stencils;
        stencils.retain(|stencil| !is_traced[index(stencil.sample)]);
        stencils.sort_by_key(|stencil| stencil.sample);
        stencils.dedup_by_key(|stencil| stencil.sample);
        self.traced
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::sky::{Sky, SkyKind};
    use super::super::super::target::cube;
    use super::super::BakeCost;
    use super::*;

    /// Cubes on and over a floor, under sun and sky.
    fn props(floor_m: f32, boxes: &[([f32; 3], f32)]) -> Scene {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { double_sided: false, ..Material::plain("prop", [0.5; 3]) });
        let [low, high] = [-0.5 * floor_m, 0.5 * floor_m];
        mesh.append_quad(0, [[low, 0.0, high], [high, 0.0, high], [high, 0.0, low], [low, 0.0, low]], [1.0, 1.0]);
        for &(corner_m, size_m) in boxes {
            for corners_m in cube(corner_m, corner_m.map(|x| x + size_m), false) {
                mesh.append_quad(0, corners_m, [1.0, 1.0]);
            }
        }
        let kind = SkyKind::Clear;
        let sky = Sky { kind, cie_type: 12, sun_elevation_deg: 40.0, sun_azimuth_deg: 30.0, ground_reflectance: 0.2 };
        Scene::new("props", mesh, [0.0; BANDS]).unwrap().with_environment(sky.environment())
    }

    #[test]
    fn the_work_of_baking_open_props_does_not_grow() {
        let numbers = || (0..5_u8).map(f32::from);
        let mut boxes = Vec::new();
        for (x, y) in numbers().flat_map(|x| numbers().map(move |y| (x, y))) {
            boxes.extend(numbers().map(|z| ([1.5 * x - 3.5, 1.5 * y + 0.25, 1.5 * z - 3.5], 1.0)));
        }
        let scene = props(10.0, &boxes);
        let settings = BakeSettings::of(&scene);
        let traced = traced_samples(&scene, &settings, &|_| {});
        let (samples, all) = (traced.samples(), scene.layout.samples.len());
        assert!(boxes.len() == 125 && all > 200_000, "{all} samples");
        let cost = BakeCost::of(&scene, &settings);
        let rays = cost.rays / u64::try_from(all).unwrap() * u64::try_from(samples).unwrap();
        println!("{samples} of {all} samples, {rays} of {} rays", cost.rays);
        assert!(100 * samples < 35 * all, "{samples} of {all} samples were traced");
        assert!(rays < 27_000_000, "{rays} rays");
    }

    #[test]
    fn interpolated_light_is_what_rays_would_have_found() {
        let scene = props(6.0, &[([-0.4, 0.0, -0.3], 0.8), ([0.9, 0.7, 0.2], 0.4), ([-1.7, 0.0, 0.9], 0.1)]);
        let settings = BakeSettings::ROOM;
        let traced = traced_samples(&scene, &settings, &|_| {});
        let sample_sides = 2 * scene.layout.samples.len();
        let light = traced.direct(0, sample_sides);
        let samples: Vec<u32> = (0..u32_from(scene.layout.samples.len())).collect();
        let (all, _) = Gathered::of(&scene, &LightPoints::of(&scene, &settings), &Default::default(), true, &samples);
        let (mut squares, mut worst, mut lit) = (0.0, 0.0_f64, 0);
        for ((&sample_side, &buried), expected) in all.sample_sides.iter().zip(&all.buried).zip(&all.direct[0]) {
            let (sample_side, light) = (index(sample_side), &light[index(sample_side)]);
            assert_eq!(traced.buried[sample_side], buried, "sample side {sample_side}");
            if expected[1] > 0.0 {
                let error = f64::from(light[1] / expected[1] - 1.0);
                (squares, lit) = (squares + error * error, lit + 1);
                worst = worst.max(error.abs());
            }
        }
        let rms = (squares / f64::from(lit)).sqrt();
        println!("{} of {} samples, rms {rms}, worst {worst}", traced.samples(), samples.len());
        assert!(10 * traced.samples() < 3 * samples.len() && lit > 5_000);
        // Nodes differ from a linear interpolation by 2 %, and from that of second degree by far less. The worst sample lies in a
        // half-shadow between nodes, where the sun's 48 points come and go.
        assert!(rms < 0.007 && worst < 0.2, "rms {rms}, worst {worst}");
    }
}
