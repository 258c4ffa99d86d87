//! The list of a die's defects: each defective pixel with its kind, in order of kind, row and column, at the positions that the effects
//! use.

use super::dark_rates::DarkRates;
use super::dead_pixels::dead_sites;
use super::defect_sites::{DefectSites, Site};
use super::die::{Die, dark_factor, exponential};
use super::hot_pixels::hot_sites;
use super::params::PixelParams;
use super::stuck_pixels::{is_high, stuck_sites};
use crate::num::index;
use crate::units::{CameraIndex, RowIndex, Size};

/// What is wrong with a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DefectKind {
    /// Additional dark current, at the die's temperature.
    Hot {
        /// Mean rate.
        rate_e_per_s: f64,
    },
    /// No light arrives.
    Dead,
    /// At the bottom of the range.
    StuckLow,
    /// At the top of the range.
    StuckHigh,
}

/// A defective pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defect {
    /// What is wrong.
    pub kind: DefectKind,
    /// Column, counted from 0.
    pub x_px: usize,
    /// Row.
    pub row: RowIndex,
}

/// All defects of a camera's die. A pixel may have several.
pub fn defects(params: &PixelParams, die_seed: u64, camera: CameraIndex, size: Size) -> Vec<Defect> {
    let die = Die { seed: die_seed, camera };
    let rates = DarkRates::of(params);
    let hot_e_per_s = rates.hot_e_per_s * dark_factor(rates.die_sigma, die);
    let hot = |site: Site| DefectKind::Hot { rate_e_per_s: hot_e_per_s * exponential(site.uniform) };
    let stuck = |site: Site| if is_high(site) { DefectKind::StuckHigh } else { DefectKind::StuckLow };
    let kinds: [(Option<DefectSites>, &dyn Fn(Site) -> DefectKind); 3] =
        [(hot_sites(params), &hot), (dead_sites(params), &|_| DefectKind::Dead), (stuck_sites(params), &stuck)];
    let mut uniforms = vec![0; index(size.width_px)];
    let mut found = Vec::new();
    for (defect_sites, kind) in kinds {
        let Some(defect_sites) = defect_sites else { continue };
        for row in (0..size.height_px).map(RowIndex) {
            let sites = defect_sites.sites(die, row, &mut uniforms);
            found.extend(sites.iter().map(|&site| Defect { kind: kind(site), x_px: site.column, row }));
        }
    }
    found
}
