//! Stuck pixels. Sets the microvolts far outside every converter's range where the die's pixel is stuck.
//!
//! Model: at some pixels of the die the signal sample is at the bottom or the top of the range, half of them each, in any light.

use super::defect_sites::{DefectSites, Site};
use super::die::Die;
use super::params::PixelParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;

/// Pixels whose signal does not move.
pub struct StuckPixels {
    defects: DefectSites,
}

/// A kilovolt: the widest ramp spans 10 V, so no gain or noise after this brings a stuck pixel back into range.
const FAR_UV: f32 = 1e9;

impl StuckPixels {
    const NUMBER: EffectNumber = EffectNumber(117);

    /// `None` where no pixel is stuck.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        stuck_sites(params).map(|defects| Box::new(Self { defects }) as Box<dyn Effect>)
    }
}

/// Where the stuck pixels of these parameters are.
pub(super) fn stuck_sites(params: &PixelParams) -> Option<DefectSites> {
    DefectSites::new(StuckPixels::NUMBER, params.stuck_ppm, params.defect_cluster_share)
}

/// Whether a stuck pixel is at the top of the range.
pub(super) fn is_high(site: Site) -> bool {
    site.uniform >= 1 << 31
}

impl Effect for StuckPixels {
    fn identity(&self) -> Identity {
        Identity { name: "stuck_pixels", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    /// A stuck pixel is wrong by as much as the range allows, under any light: never left out.
    fn omission(&self, _facts: &Facts) -> Option<Omission> {
        None
    }

    fn reason(&self, _facts: &Facts) -> String {
        "a stuck pixel is off by the converter's range".to_owned()
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let sites = self.defects.sites(Die::of(row), row.row_id.row, row.uniforms);
        row.only(sites.len());
        for &site in sites.iter() {
            row.values[site.column] = if is_high(site) { FAR_UV } else { -FAR_UV };
        }
    }
}
