//! Image lag. Splits the electrons of the array, with those left by the previous frame, into transferred charge and charge that stays for
//! the next frame.
//!
//! Model: T = min(Q, full well) + R, the charge gathered and the charge left by the frame before; of T each electron stays behind the
//! transfer gate with probability l, a binomial draw, and is read with the next frame (incomplete transfer; Fossum and Hondongwa, "A
//! review of the pinned photodiode", IEEE J. Electron Devices Soc. 2, 2014). No charge is made or lost. Under constant light what is
//! read has the mean Q and stays Poisson; without light it falls by a factor l a frame. The first frame finds an empty array.
//! Charge that stayed does not count against the full well of the next exposure.

use super::params::PixelParams;
use super::row::add_scaled;
use super::thinning::binomial;
use crate::draw::{DrawKey, EffectNumber, RowId, fill_uniforms};
use crate::effect::{ArrayPass, Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, lesser, u32_from};
use crate::plane::Plane;
use crate::units::RowIndex;

/// Charge that is read a frame late.
pub struct ImageLag {
    share: f64,
    capacity_e: f64,
    prnu: f64,
}

impl ImageLag {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(114);

    /// `None` where the transfer is complete.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let effect = Self { share: params.image_lag, capacity_e: params.full_well_e, prnu: params.prnu };
        (effect.share > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    /// The greatest mean charge that is left behind after any earlier light. That charge was at most the full well.
    fn most_e(&self, facts: &Facts) -> f64 {
        self.share / (1.0 - self.share) * lesser(facts.frame_e_max + facts.dark_mean_e, self.capacity_e)
    }
}

impl Effect for ImageLag {
    fn identity(&self) -> Identity {
        Identity { name: "image_lag", number: Self::NUMBER, domain: Domain::ArrayElectrons }
    }

    /// The error is the charge that the frame before left less the charge that this one leaves. Each is at most l / (1 - l) of the frame's
    /// greatest charge, with Poisson variance and the same relative spread over the array.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = self.most_e(facts);
        let spread = self.share / (1.0 - self.share);
        // A clipped charge has no more variance than the charge.
        let (gain_e, dark_e) = (spread * self.prnu * facts.frame_e_max, spread * facts.dark_rms_e);
        Some(Omission { bias_e: most_e, variance_e2: 2.0 * (most_e + gain_e * gain_e + dark_e * dark_e) })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("up to {:.3e} e- of the frame before", self.most_e(facts))
    }

    fn apply(&self, _row: &mut RowPass<'_>) {
        unreachable!("image lag acts on the array")
    }

    fn apply_to_array(&self, array: &mut ArrayPass<'_>) {
        let size = array.charge_e.size();
        let mut left_e = Plane::filled(size, 0.0_f32);
        let mut uniforms = vec![0; array.charge_e.width_px()];
        let well_e = f32_nearest(self.capacity_e);
        for y in 0..array.charge_e.height_px() {
            let row_e = array.charge_e.row_mut(y);
            super::row::clip_above(row_e, well_e);
            if let Some(before_e) = array.before_e {
                add_scaled(row_e, before_e.row(y), 1.0);
            }
            let row_id = RowId { row: RowIndex(u32_from(y)), ..array.row_id };
            fill_uniforms(DrawKey::of_row(Self::NUMBER, row_id), &mut uniforms);
            binomial(row_e, self.share, &uniforms, left_e.row_mut(y));
            add_scaled(row_e, left_e.row(y), -1.0);
        }
        array.left_e = Some(left_e);
    }
}
