//! Simulates single frames in any order for accuracy studies: photons, samples, codes and features, by the same draws as in a run. There
//! is no lag charge from the frame before, and automatic exposure stays at its initial value.

use super::extractor::extract_one;
use super::render_inputs::ExposureId;
pub use super::render_inputs::PictureId;
use super::row_times::{merge_planes, row_times};
use super::setup::Setup;
use crate::compute::{Extractor, Feature};
use crate::effects::chain::{Capture, Chain, Expected, RowSamples};
use crate::error::Error;
use crate::events::Events;
use crate::num::u32_from;
use crate::optics::Exposure;
use crate::plane::Plane;
use crate::readout::Schedule;
use crate::units::{CameraIndex, FrameIndex, RowIndex};

/// What a sensor makes of a picture.
pub struct Sensed {
    /// Codes as they leave the readout.
    pub codes: Plane<u16>,
    /// Events of its conversions.
    pub events: Events,
}

impl Setup {
    /// What a camera sees in a frame, one exposure a slot. Fails on a picture that cannot be read any more.
    pub fn exposures_at(&self, picture: PictureId) -> Result<Vec<Exposure>, Error> {
        self.exposures_of(picture.frame, picture.camera, &self.schedule_at(picture))
    }

    /// Keys in a photon store of what a camera sees in a frame, one a slot; none where its photons are not stored.
    pub fn photon_keys(&self, picture: PictureId) -> Vec<Option<String>> {
        let schedule = self.schedule_at(picture);
        let of = |slot| {
            let exposure_id = ExposureId { picture, slot };
            self.with_inputs(exposure_id, &self.windows[picture.camera], &schedule, |inputs| inputs.photon_key())
        };
        (0..schedule.slots().len()).map(of).collect()
    }

    /// The chain from photons to codes at the gain of the run's start.
    pub fn first_chain(&self) -> Chain {
        self.chain(self.exposure.gain(FrameIndex(0)))
    }

    /// Codes of a picture from its photons, a plane a slot.
    pub fn sense_at(&self, chain: &Chain, picture: PictureId, photons: &[Plane<f32>]) -> Sensed {
        let schedule = self.schedule_at(picture);
        let mut events = Events::default();
        let mut read = Vec::with_capacity(photons.len());
        for (slot, photons) in photons.iter().enumerate() {
            let captured =
                chain.capture(photons, capture(picture, slot), &row_times(&schedule, picture.frame, slot, &[]));
            events.merge(&captured.events);
            read.push(captured.codes);
        }
        let merge = self.sensor.merge_of(&schedule).filter(|_| read.len() > 1);
        let codes = merge.map_or_else(|| read[0].clone(), |merge| merge_planes(&merge, &read));
        Sensed { codes, events }
    }

    /// Codes of some rows of a picture, of the first slot.
    pub fn codes_at(
        &self,
        chain: &Chain,
        picture: PictureId,
        photons: &Plane<f32>,
        rows: &[RowIndex],
    ) -> Vec<Vec<u16>> {
        let schedule = self.schedule_at(picture);
        chain.codes_of_rows(photons, capture(picture, 0), &row_times(&schedule, picture.frame, 0, &[]), rows)
    }

    /// Mean and variance of the codes of a picture, of a setup on the rung `expected`.
    pub fn expected_at(&self, chain: &Chain, picture: PictureId, photons: &Plane<f32>) -> Expected {
        let schedule = self.schedule_at(picture);
        chain.expected(photons, capture(picture, 0), &row_times(&schedule, picture.frame, 0, &[]))
    }

    /// Samples of all rows of a picture at the converters' inputs, of the first slot and reading.
    pub fn samples_at(&self, chain: &Chain, picture: PictureId, photons: &Plane<f32>) -> Vec<RowSamples> {
        let schedule = self.schedule_at(picture);
        let rows: Vec<RowIndex> = (0..self.sensor.size.height_px).map(RowIndex).collect();
        chain.samples_of_rows(photons, capture(picture, 0), &row_times(&schedule, picture.frame, 0, &[]), &rows)
    }

    /// Electrons of all pixels of a picture at the sense node, of the first slot and reading.
    pub fn electrons_at(&self, chain: &Chain, picture: PictureId, photons: &Plane<f32>) -> Plane<f32> {
        let schedule = self.schedule_at(picture);
        chain.electrons(photons, capture(picture, 0), &row_times(&schedule, picture.frame, 0, &[]))
    }

    /// Features of a picture, and the events of finding them. Fails on a picture that the extractor cannot take.
    pub fn features_at(&self, codes: &Plane<u16>) -> Result<(Vec<Feature>, Events), Error> {
        let mut extractor = Extractor::new(&self.sensor.extractor);
        let (extracted, events) = extract_one(&self.sensor, &mut extractor, codes)?;
        Ok((extracted.features, events))
    }

    fn schedule_at(&self, picture: PictureId) -> Schedule {
        self.exposure.schedules(FrameIndex(0)).swap_remove(picture.camera)
    }
}

fn capture(picture: PictureId, slot: usize) -> Capture<'static> {
    let camera = CameraIndex(u32_from(picture.camera));
    Capture { camera, frame: picture.frame, slot: u32_from(slot), before_e: None }
}
