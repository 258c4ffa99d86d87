//! What a camera of a run sees in a frame: photons of each exposure, rendered or from a store.

use super::render_inputs::{ExposureId, PictureId, RenderInputs};
use super::row_times::spans;
use super::setup::Setup;
use crate::error::Error;
use crate::optics::{Camera, Exposure};
use crate::readout::Schedule;
use crate::units::FrameIndex;

impl Setup {
    /// What a camera sees in a frame, one exposure a slot.
    pub(super) fn exposures_of(
        &self,
        frame: FrameIndex,
        camera: usize,
        schedule: &Schedule,
    ) -> Result<Vec<Exposure>, Error> {
        (0..schedule.slots().len())
            .map(|slot| {
                let exposure_id = ExposureId { picture: PictureId { frame, camera }, slot };
                self.exposure_of(exposure_id, &self.windows[camera], schedule)
            })
            .collect()
    }

    /// The same of one slot, by the rig's camera of that index.
    pub(super) fn exposure_of(
        &self,
        exposure_id: ExposureId,
        camera: &Camera,
        schedule: &Schedule,
    ) -> Result<Exposure, Error> {
        let settings = self.fidelity.render;
        let render = |inputs: &RenderInputs<'_>| inputs.expose_with(self.photon_store.as_ref());
        let mut exposure = self.with_inputs(exposure_id, camera, schedule, render)?;
        // Photon noise is that of the sensor's own electrons, whatever the tolerance counted with.
        let (own, counted) = (self.sensor.electrons_per_photon(), settings.quantum_efficiency);
        if own.to_bits() != counted.to_bits() && counted > 0.0 {
            exposure.render_variance_ratio *= own / counted;
        }
        Ok(exposure)
    }

    /// Calls `ask` with all that reaches the photons of one slot.
    pub(super) fn with_inputs<T>(
        &self,
        exposure_id: ExposureId,
        camera: &Camera,
        schedule: &Schedule,
        ask: impl FnOnce(&RenderInputs<'_>) -> T,
    ) -> T {
        let ExposureId { picture, slot } = exposure_id;
        let row_exposures = spans(schedule, |row| schedule.row_exposure_clk(picture.frame, slot, row));
        let (world, motion, settings) = (&self.world, &self.motion, self.fidelity.render);
        ask(&RenderInputs { world, camera, motion, row_exposures: &row_exposures, exposure_id, settings })
    }
}
