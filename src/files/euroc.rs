//! Reads and writes EuRoC's ASL folder: `mav0/{cam0,cam1,...,imu0,state_groundtruth_estimate0}`, each with `data.csv` and `sensor.yaml`.
//! Time stamps are nanoseconds.

mod layout;
mod lens;
mod reader;
mod writer;
mod yaml;

pub use reader::{CameraFolder, EurocReader, FrameEntry, ImuFolder};
pub use writer::{EurocWriter, GroundTruth, ImuReading};

pub use layout::{EurocCamera, EurocImu};

#[cfg(test)]
mod tests;
