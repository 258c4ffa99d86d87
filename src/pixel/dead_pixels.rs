//! Dead pixels. Sets the mean photoelectrons to 0 where the die's pixel sees no light.
//!
//! Model: in some pixels of the die the photodiode is not connected: no photoelectron arrives, dark charge and noise stay.

use super::defect_sites::DefectSites;
use super::die::Die;
use super::params::PixelParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;

/// Pixels that see no light.
pub struct DeadPixels {
    defects: DefectSites,
    prnu: f64,
}

impl DeadPixels {
    const NUMBER: EffectNumber = EffectNumber(116);

    /// `None` where no pixel is dead.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        dead_sites(params).map(|defects| Box::new(Self { defects, prnu: params.prnu }) as Box<dyn Effect>)
    }
}

/// Where the dead pixels of these parameters are.
pub(super) fn dead_sites(params: &PixelParams) -> Option<DefectSites> {
    DefectSites::new(DeadPixels::NUMBER, params.dead_ppm, params.defect_cluster_share)
}

impl Effect for DeadPixels {
    fn identity(&self) -> Identity {
        Identity { name: "dead_pixels", number: Self::NUMBER, domain: Domain::MeanElectrons }
    }

    /// A dead pixel lacks its whole signal, with its shot noise and its response's pattern.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let pattern_e = self.prnu * facts.signal_e_max;
        Some(Omission { bias_e: facts.signal_e_max, variance_e2: facts.signal_e_max + pattern_e * pattern_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("a dead pixel lacks up to {}", facts.signal_words())
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let sites = self.defects.sites(Die::of(row), row.row_id.row, row.uniforms);
        row.only(sites.len());
        for site in sites.iter() {
            row.values[site.column] = 0.0;
        }
    }
}
