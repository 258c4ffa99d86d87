//! One reading of a pixel's charge: from gathered electrons to codes. Enters: electrons of a row. Leaves: samples, codes, events.
//!
//! A pixel is read once, or with dual conversion gain twice: the same charge at two gains, each conversion with noise of its own.

use super::{Parameters, RowAt, RowBuffers};
use crate::adc::Converter;
use crate::draw::RowPlace;
use crate::effect::{Domain, Effect};
use crate::pixel;

/// A conversion gain with everything behind it.
pub(super) struct Reading {
    pub parameters: Parameters,
    /// Effects on sensed electrons and on microvolts, in physical order.
    effects: Vec<Box<dyn Effect>>,
    converter: Converter,
    /// Counted into the slot of its draws, so that readings of one exposure err apart.
    number: u32,
}

impl Reading {
    /// The reading of that number; effects of earlier domains are left to the caller.
    pub fn new(parameters: Parameters, effects: Vec<Box<dyn Effect>>, number: u32) -> Self {
        assert!(
            effects.iter().all(|effect| effect.domain() >= Domain::SensedElectrons),
            "a reading begins at the sense node"
        );
        Self { converter: Converter::new(&parameters.adc), parameters, effects, number }
    }

    /// From gathered electrons to electrons at the sense node, in place.
    pub fn sense(&self, at: RowAt, die_seed: u64, buffers: &mut RowBuffers) {
        let mut pass = buffers.pass(self.numbered(at), die_seed);
        for effect in self.effects.iter().filter(|effect| effect.domain() == Domain::SensedElectrons) {
            effect.apply(&mut pass);
        }
    }

    /// From electrons at the sense node to the samples at the converters' inputs, in place.
    pub fn sample(&self, at: RowAt, die_seed: u64, buffers: &mut RowBuffers) {
        buffers.reset.fill(0.0);
        let mut pass = buffers.pass(self.numbered(at), die_seed);
        pixel::electrons_to_microvolts(&self.parameters.pixel, pass.values);
        for effect in self.effects.iter().filter(|effect| effect.domain() == Domain::Microvolts) {
            effect.apply(&mut pass);
        }
    }

    /// Codes of a row of samples.
    pub fn convert(&self, buffers: &RowBuffers, codes: &mut [u16]) {
        self.converter.convert_row(&buffers.values, &buffers.reset, codes);
    }

    fn numbered(&self, at: RowAt) -> RowAt {
        RowAt { place: RowPlace { slot: at.place.slot + self.number, ..at.place }, ..at }
    }
}
