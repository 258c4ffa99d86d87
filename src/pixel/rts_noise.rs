//! Random telegraph (burst, popcorn) noise. Adds the state of each pixel's trap, in microvolts.
//!
//! Model: a share of the die's pixels has one trap under the gate of the source follower; it captures and emits an electron at random,
//! a two-state Markov process whose states differ by the trap's amplitude (exponentially distributed over traps). Rates of capture and
//! emission have the mean `rts_rate_hz`; the share of time that a trap is filled is even over traps. Two samples t apart find states with
//! correlation exp(-2 rate t), so their difference is -A, 0 or +A: the three peaks that double sampling leaves (Wang, Rao, Mierop and
//! Theuwissen, "Random telegraph signal in CMOS image sensor pixels", IEDM 2006). A signal alone carries 0 or A. Frames are taken to
//! lie many times 1/rate apart: states of two frames are drawn independently.

use std::borrow::Cow;

use super::die::{Die, exponential};
use super::params::PixelParams;
use super::row_memory::RowMemory;
use super::sample_noise::{SampleTiming, SampledLevels};
use crate::draw::{EffectNumber, fill_uniforms};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, u64_half_even};

/// A pixel with a trap.
#[derive(Clone, Copy)]
struct Trap {
    column: usize,
    amplitude_uv: f32,
    /// Share of time that it is filled.
    duty: f64,
}

/// Traps of the source followers.
pub struct RtsNoise {
    trap_below: u64,
    amplitude_uv: f64,
    samples: SampledLevels,
    /// Correlation of the states at the two samples.
    correlation: f64,
    traps: RowMemory<Trap>,
}

/// Fields of the keys: which pixels, their amplitudes, their duties; and the state at the reset sample.
const PIXELS: u64 = 2;
const AMPLITUDES: u64 = 3;
const DUTIES: u64 = 4;

const TWO_TO_32: f64 = 4_294_967_296.0;

impl RtsNoise {
    const NUMBER: EffectNumber = EffectNumber(110);

    /// `None` where no trap affects the samples.
    pub fn from_params(params: &PixelParams, timing: SampleTiming) -> Option<Box<dyn Effect>> {
        let effect = Self {
            trap_below: u64_half_even(1e-6 * params.rts_ppm * TWO_TO_32),
            amplitude_uv: params.rts_amplitude_uv,
            samples: timing.samples,
            correlation: libm::exp(-2.0 * params.rts_rate_hz * timing.interval_s),
            traps: RowMemory::default(),
        };
        (params.rts_ppm > 0.0 && params.rts_amplitude_uv > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    fn traps(&self, row: &mut RowPass<'_>) -> Cow<'_, [Trap]> {
        let key = Die::of(row).key(Self::NUMBER, row.row_id.row);
        let uniforms = &mut *row.uniforms;
        self.traps.row(key, uniforms.len(), || {
            fill_uniforms(key.with(PIXELS), uniforms);
            let has_trap = |uniform: &u32| u64::from(*uniform) < self.trap_below;
            let columns: Vec<usize> =
                uniforms.iter().enumerate().filter(|(_, u)| has_trap(u)).map(|(c, _)| c).collect();
            if columns.is_empty() {
                return Vec::new();
            }
            fill_uniforms(key.with(AMPLITUDES), uniforms);
            let amplitudes_uv: Vec<f32> =
                columns.iter().map(|&c| f32_nearest(self.amplitude_uv * exponential(uniforms[c]))).collect();
            fill_uniforms(key.with(DUTIES), uniforms);
            let trap =
                |(&column, &amplitude_uv): (&usize, &f32)| Trap { column, amplitude_uv, duty: unit(uniforms[column]) };
            columns.iter().zip(&amplitudes_uv).map(trap).collect()
        })
    }
}

/// A uniform in (0, 1).
fn unit(uniform: u32) -> f64 {
    (f64::from(uniform) + 0.5) / TWO_TO_32
}

impl Effect for RtsNoise {
    fn identity(&self) -> Identity {
        Identity { name: "rts_noise", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        if self.samples.is_double() { "double" } else { "" }
    }

    /// For a pixel that has a trap, over traps: E A^2 = 2 a^2 and E d(1 - d) = 1/6. The difference of two samples has mean 0 and
    /// variance A^2 2 d (1 - d) (1 - correlation); one sample has mean A d and second moment A^2 d.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let amplitude_e = self.amplitude_uv / facts.conversion_gain_uv_per_e;
        let square_e2 = amplitude_e * amplitude_e;
        if self.samples.is_double() {
            return Some(Omission { bias_e: 0.0, variance_e2: 2.0 / 3.0 * square_e2 * (1.0 - self.correlation) });
        }
        Some(Omission { bias_e: 0.5 * amplitude_e, variance_e2: 0.75 * square_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let amplitude_e = self.amplitude_uv / facts.conversion_gain_uv_per_e;
        let changes = 1.0 - self.correlation;
        format!(
            "{amplitude_e:.2} e- in a pixel with a trap; samples lie {changes:.1e} of the way to independence apart"
        )
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let traps = self.traps(row);
        row.only(traps.len());
        if traps.is_empty() {
            return;
        }
        // The state at the reset sample, which the signal's depends on.
        let mut filled_before = vec![false; traps.len()];
        if self.samples.is_double() {
            fill_uniforms(row.reset_key(Self::NUMBER), row.uniforms);
            for (filled, trap) in filled_before.iter_mut().zip(traps.iter()) {
                *filled = unit(row.uniforms[trap.column]) < trap.duty;
            }
        }
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        for (&filled_before, trap) in filled_before.iter().zip(traps.iter()) {
            let before = if filled_before { 1.0 } else { 0.0 };
            let likely =
                if self.samples.is_double() { trap.duty + (before - trap.duty) * self.correlation } else { trap.duty };
            let filled = unit(row.uniforms[trap.column]) < likely;
            let after = if filled { 1.0 } else { 0.0 };
            if row.reset.is_empty() {
                row.values[trap.column] += trap.amplitude_uv * f32_nearest(after - before);
            } else {
                row.values[trap.column] += trap.amplitude_uv * f32_nearest(after);
                row.reset[trap.column] += trap.amplitude_uv * f32_nearest(before);
            }
        }
    }
}
