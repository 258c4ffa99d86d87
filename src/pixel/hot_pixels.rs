//! Hot pixels. Adds the dark charge of hot pixels, in electrons.
//!
//! Model: some pixels of the die have additional dark current, exponentially distributed over hot pixels with mean
//! `hot_dark_e_per_s` at 300 K, drawn as Poisson over exposure and wait (radiation and metal defects each add a generation centre; the
//! tail of measured dark-current histograms is exponential: Virmontois et al., IEEE Trans. Nucl. Sci. 57, 2010).

use super::dark_rates::DarkRates;
use super::defect_sites::DefectSites;
use super::die::{Die, EXPONENTIAL_MAX, dark_factor, exponential};
use super::params::PixelParams;
use crate::draw::{EffectNumber, fill_uniforms, poisson_quantile};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, index};
use crate::units::{RowIndex, Size};

/// Pixels with additional dark current.
pub struct HotPixels {
    rates: DarkRates,
    defects: DefectSites,
}

impl HotPixels {
    const NUMBER: EffectNumber = EffectNumber(115);

    /// `None` where no pixel is hot.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let rates = DarkRates::of(params);
        let defects = hot_sites(params)?;
        (rates.hot_e_per_s > 0.0).then(|| Box::new(Self { rates, defects }) as Box<dyn Effect>)
    }
}

/// Where the hot pixels of these parameters are.
pub(super) fn hot_sites(params: &PixelParams) -> Option<DefectSites> {
    DefectSites::new(HotPixels::NUMBER, params.hot_ppm, params.defect_cluster_share)
}

/// Arrays of more pixels than this are not searched for their hottest: that would take longer than all the rest of the plan.
const SEARCHED_PX_MAX: usize = 1 << 19;

/// Dark current of a die's hottest pixel over the mean of hot pixels: 0 where none is hot; of large arrays what a draw can give.
pub(super) fn hottest(params: &PixelParams, die: Die, array: Size) -> f64 {
    let Some(defects) = hot_sites(params) else { return 0.0 };
    if array.pixel_count() > SEARCHED_PX_MAX {
        return EXPONENTIAL_MAX;
    }
    let mut uniforms = vec![0; index(array.width_px)];
    let of_row = |row| defects.sites(die, RowIndex(row), &mut uniforms).iter().map(|site| site.uniform).min();
    (0..array.height_px).filter_map(of_row).min().map_or(0.0, exponential)
}

impl Effect for HotPixels {
    fn identity(&self) -> Identity {
        Identity { name: "hot_pixels", number: Self::NUMBER, domain: Domain::Electrons }
    }

    /// For the hottest pixel of these dies, so it holds in every pixel.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = self.rates.hot_e_max(facts.exposure_s, facts.storage_s_max, facts.dies);
        Some(Omission { bias_e: most_e, variance_e2: most_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let most_e = self.rates.hot_e_max(facts.exposure_s, facts.storage_s_max, facts.dies);
        format!("up to {most_e:.3e} e- in the hottest pixel at {} K", facts.temperature_k)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let die = Die::of(row);
        let sites = self.defects.sites(die, row.row_id.row, row.uniforms);
        row.only(sites.len());
        if sites.is_empty() {
            return;
        }
        let rate_e_per_s = self.rates.hot_e_per_s * dark_factor(self.rates.die_sigma, die);
        let mean_e = rate_e_per_s * (row.exposure_s + row.storage_s);
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        for site in sites.iter() {
            let own_e = f32_nearest(mean_e * exponential(site.uniform));
            row.values[site.column] += f32_nearest(poisson_quantile(row.uniforms[site.column], own_e));
        }
    }
}
