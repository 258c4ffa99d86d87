//! The light of single sources at sample sides where a render needs it beside the sum: at edges of shadows that are sharper than the
//! distance between samples, where the visible share of a source changes and shadow rays are traced; and on normal maps.

use super::super::light::{Bands, luminance};
use super::super::mesh::Mesh;
use super::super::samples::Layout;
use super::buried::cells;
use super::sources::{SOURCES_MAX, Source, SourceLight};
use crate::num::{index, u32_from};

/// Change of a source's light over a cell, as a share of all light there, from which its shadow is traced: below a tenth it is no edge that
/// a corner detector finds, and the bake's slope over a cell is close to it.
const CHANGE_MIN: f32 = 0.1;
/// The same of a wide source, whose half-shadow one ray tells little of, and the change over a cell of its visible share: its shadow is
/// traced where the half-shadow is no wider than about a cell. Wider ones show in the bake's samples.
const WIDE_CHANGE_MIN: f32 = 0.2;
const WIDE_SHARE_CHANGE_MIN: f32 = 0.7;

/// The light of one source at a sample side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ListedLight {
    /// The source's number among those of the light points.
    pub source: u32,
    /// Its light, of which the baked irradiance holds what is received.
    pub light: SourceLight,
}

/// Sources by sample side: those whose shadow has an edge beside it, or those that light a surface with a normal map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceLists {
    /// Where the list of each sample side begins, and where the last one ends; empty without any light.
    pub starts: Vec<u32>,
    /// Lists of all sample sides, each by rising source.
    pub lights: Vec<ListedLight>,
}

impl SourceLists {
    /// Those whose shadow has an edge beside a sample side, and those that give a sample side of a triangle with a normal map any light;
    /// from the irradiance of all sample sides, steady and flickering, and from what each source sends there, which is asked for once.
    pub fn beside_edges_and_on_normal_maps(
        mesh: &Mesh,
        layout: &Layout,
        sources: &[Source],
        irradiance: [&[Bands]; 2],
        light_of: impl Fn(usize) -> Vec<SourceLight> + Send + Sync,
    ) -> [Self; 2] {
        let lux = |sample_side: usize| {
            let of = |light: &[Bands]| light.get(sample_side).map_or(0.0, |light| luminance(light.map(f64::from)));
            crate::num::f32_nearest(of(irradiance[0]) + of(irradiance[1]))
        };
        let all: Vec<f32> = (0..2 * layout.samples.len()).map(lux).collect();
        let is_mapped = on_normal_maps(mesh, layout);
        let listed = crate::parallel::collected(sources.len(), |source| {
            let light = light_of(source);
            let beside = beside_edges(layout, &sources[source], &all, &light);
            let is_listed: [&dyn Fn(usize) -> bool; 2] = [&|sample_side| beside[sample_side], &|sample_side| {
                is_mapped.get(sample_side) == Some(&true) && light[sample_side].received > 0.0
            }];
            is_listed.map(|is_listed| {
                let sample_sides = (0..all.len()).filter(|&sample_side| is_listed(sample_side));
                sample_sides.map(|sample_side| (u32_from(sample_side), light[sample_side])).collect::<Vec<_>>()
            })
        });
        [0, 1].map(|kind| {
            let by_source: Vec<_> = listed.iter().map(|lists| lists[kind].as_slice()).collect();
            Self::merged(&by_source, all.len())
        })
    }

    /// The lists of all sample sides, from each source's light where it is listed, by rising sample side.
    fn merged(by_source: &[&[(u32, SourceLight)]], sample_sides: usize) -> Self {
        let mut lists = Self { starts: vec![0], lights: Vec::new() };
        let mut rests = by_source.to_vec();
        for sample_side in 0..u32_from(sample_sides) {
            for (source, rest) in (0_u32..).zip(&mut rests) {
                if let Some((&(_, light), further)) = rest.split_first().filter(|((at, _), _)| *at == sample_side) {
                    lists.lights.push(ListedLight { source, light });
                    *rest = further;
                }
            }
            lists.starts.push(u32_from(lists.lights.len()));
        }
        if lists.lights.is_empty() { Self::default() } else { lists }
    }

    /// Whether the lists lie one behind another, belong to the given number of sample sides, and name existing sources.
    pub(super) fn is_sound(&self, sample_sides: usize) -> bool {
        let ends_there = match (self.starts.first(), self.starts.last()) {
            (None, None) => self.lights.is_empty(),
            (Some(&first), Some(&last)) => first == 0 && index(last) == self.lights.len(),
            _ => false,
        };
        ends_there
            && (self.starts.is_empty() || self.starts.len() == sample_sides + 1)
            && self.starts.is_sorted()
            && self.lights.iter().all(|light| index(light.source) < SOURCES_MAX)
    }

    /// The list of a sample side.
    #[inline]
    pub fn at(&self, sample_side: usize) -> &[ListedLight] {
        match (self.starts.get(sample_side), self.starts.get(sample_side + 1)) {
            (Some(&from), Some(&to)) => &self.lights[index(from)..index(to)],
            _ => &[],
        }
    }
}

/// Which sample sides belong to a triangle with a normal map; empty where none has one.
fn on_normal_maps(mesh: &Mesh, layout: &Layout) -> Vec<bool> {
    if mesh.materials.iter().all(|material| material.maps.normal.is_none()) {
        return Vec::new();
    }
    let mut is_mapped = vec![false; 2 * layout.samples.len()];
    for shade in &layout.triangles {
        if mesh.materials[index(shade.material)].maps.normal.is_some() {
            shade.sides().for_each(|(back, sample)| is_mapped[2 * sample + back] = true);
        }
    }
    is_mapped
}

/// Which sample sides belong to a cell that one source's shadow ends in, or to a neighbour of such a cell: what is narrower than a cell may
/// lie beside the samples that found it.
fn beside_edges(layout: &Layout, source: &Source, all: &[f32], light: &[SourceLight]) -> Vec<bool> {
    let mut on_edge = vec![false; all.len()];
    each_cell(layout, |sample_sides| {
        let is_narrow = source.is_narrow(layout.samples[sample_sides[0] / 2].position_m);
        if has_edge(sample_sides.map(|sample_side| (all[sample_side], light[sample_side])), is_narrow) {
            sample_sides.into_iter().for_each(|sample_side| on_edge[sample_side] = true);
        }
    });
    let mut beside = on_edge.clone();
    each_cell(layout, |sample_sides| {
        if sample_sides.into_iter().any(|sample_side| on_edge[sample_side]) {
            sample_sides.into_iter().for_each(|sample_side| beside[sample_side] = true);
        }
    });
    beside
}

/// The corners of each side of each cell.
fn each_cell(layout: &Layout, mut each: impl FnMut([usize; 3])) {
    for triangle in &layout.triangles {
        let sides = layout.samples[index(triangle.samples[0])].sides();
        cells(triangle, |corners| {
            for side in 0..sides {
                each(corners.map(|sample| 2 * sample + side));
            }
        });
    }
}

/// Whether the visible share of a source changes between corners, each given with all its light, enough for its shadow to be traced.
fn has_edge(corners: [(f32, SourceLight); 3], is_narrow: bool) -> bool {
    let (mut least, mut most, mut sent, mut all) = (1.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
    for (lux, light) in corners {
        all = all.max(lux);
        if light.unoccluded > 0.0 {
            let share = light.received / light.unoccluded;
            (least, most) = (least.min(share), most.max(share));
            sent = sent.max(light.unoccluded);
        }
    }
    let (share_change_min, change_min) =
        if is_narrow { (0.0, CHANGE_MIN) } else { (WIDE_SHARE_CHANGE_MIN, WIDE_CHANGE_MIN) };
    most - least > share_change_min && (most - least) * sent > change_min * all
}
