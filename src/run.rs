//! One run, frame by frame, from photons to pose. Enters: a resolved scenario and the bytes of its files. Leaves: every stage's
//! output of each frame, then the report. It touches no disk and reads no clock: both come through `assets`.

pub mod assets;
mod checked;
mod estimate;
pub mod expose;
mod exposed;
mod extractor;
mod exposure;
mod facts;
mod felt;
mod hashes;
mod host;
mod inputs;
mod light;
mod motion;
mod on_link;
pub mod photons;
pub mod probe;
mod power_line;
mod record;
mod row_check;
mod rows;
mod seen;
pub mod sensor;
pub mod session;
pub mod setup;
mod timing;
mod transfer;
mod truth;
mod warnings;
pub mod world;

pub use assets::{Assets, NoClock, NoFiles, NoProgress, Progress, Stopwatch};
pub use estimate::{ESTIMATED_LEVEL, LinkSplit};
pub use felt::noise_of;
pub use host::{Host, HostFrame};
pub use inputs::inputs_hash;
pub use on_link::LinkTimes;
pub use photons::PhotonStore;
pub use seen::Seen;
pub use sensor::SensorSetup;
pub use session::{CameraFrame, Frame, Session};
pub use setup::Setup;
pub use timing::{burst_utilisation, timing_diagram, timing_record};
pub use warnings::Warnings;
pub use world::World;
