//! One exposure of one camera. Enters: a run's setup, a camera, the times of a frame. Leaves: mean photons of the window.

use super::rows::spans;
use super::setup::Setup;
use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::{f32_nearest, u64_from};
use crate::optics::{Camera, Exposure, Sampling};
use crate::readout::Schedule;
use crate::units::FrameIndex;

/// Published number of the renderer's sample pattern in keys.
const RENDER_NUMBER: u64 = 1;

/// What a camera's window sees in one exposure of a frame.
///
/// # Errors
/// A picture that cannot be read any more.
pub(super) fn expose(
    setup: &Setup,
    camera: &Camera,
    camera_index: usize,
    schedule: &Schedule,
    frame: FrameIndex,
    slot: usize,
) -> Result<Exposure, Error> {
    // The motion was checked to cover the whole run before the first frame.
    let pose = |t_s: f64| setup.motion.world_from_body(t_s).expect("the motion covers the run");
    // Nothing distinguishes the frames of a still picture, so its samples are those of frame 0 at every time.
    let named = if setup.is_still() { FrameIndex(0) } else { frame };
    let key = DrawKey::root(setup.resolved.scenario.seed)
        .with(RENDER_NUMBER)
        .with(u64_from(camera_index))
        .with(named.0.into());
    let sampling = Sampling {
        samples_per_pixel: setup.fidelity.samples_per_pixel,
        samples_max: setup.fidelity.samples_max,
        tolerance: setup.fidelity.render_tolerance,
        subframes: setup.fidelity.subframes,
        reflections: setup.fidelity.reflections,
        follows_gloss: setup.fidelity.follows_gloss,
        electrons_per_photon: setup.sensor.electrons_per_photon(),
        saturation_photons: f32_nearest(setup.sensor.saturation_photons()),
        outlines: true,
        key: repeated(if slot == 0 { key } else { key.with(u64_from(slot)) }, setup.fidelity.render_repeat),
    };
    let rows = spans(schedule, |row| schedule.row_exposure_clk(frame, slot, row));
    setup.world.expose((camera_index, camera), &rows, &pose, sampling)
}

/// Published number of repetitions in keys.
const REPEAT_NUMBER: u64 = 0x7265_7065_6174;

/// The key of a render that is made once more with chance of its own; the run's own is number 0.
fn repeated(key: DrawKey, number: u32) -> DrawKey {
    if number == 0 { key } else { key.with(REPEAT_NUMBER).with(number.into()) }
}
