//! Writes the first camera's pictures, depth, poses and readings in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012):
//! `rgb/`, `depth/`, their lists, `groundtruth.txt`, `accelerometer.txt`. evo, ORB-SLAM's RGB-D mode and the benchmark's tools read it.
//!
//! Times are seconds with nine decimals, the same for a picture, its depth and its pose, so that any association is exact.

use std::path::{Path, PathBuf};

use super::super::make_folder;
use super::super::picture::{write_grey_8, write_grey_16};
use super::super::text_file::TextFile;
use crate::error::Error;
use crate::num::low_u8;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::motion::imu::ImuSample;

/// A folder under construction.
#[derive(Debug)]
pub struct TumWriter {
    folder: PathBuf,
    rgb: TextFile,
    depth: TextFile,
    both: TextFile,
    ground_truth: TextFile,
    accelerometer: TextFile,
}

impl TumWriter {
    /// Makes the folder and its lists.
    pub fn create(folder: &Path) -> Result<Self, Error> {
        for inside in ["rgb", "depth"] {
            make_folder(&folder.join(inside))?;
        }
        let list = |name: &str, header: &str| -> Result<TextFile, Error> {
            let mut list = TextFile::create(folder.join(name))?;
            list.line(header)?;
            Ok(list)
        };
        Ok(Self {
            folder: folder.to_owned(),
            rgb: list("rgb.txt", "# pictures\n# timestamp filename")?,
            depth: list("depth.txt", "# depth along the axis, 5000 steps a metre, 0: none\n# timestamp filename")?,
            // ORB-SLAM reads this list without knowing comments.
            both: TextFile::create(folder.join("associations.txt"))?,
            ground_truth: list("groundtruth.txt", "# world from camera\n# timestamp tx ty tz qx qy qz qw")?,
            accelerometer: list("accelerometer.txt", "# specific force in the body's frame\n# timestamp ax ay az")?,
        })
    }

    /// Writes a picture of codes of 1 to 16 `bits` (the upper 8 of them; a mosaic stays a mosaic), its depth and its pose. Panics on bits
    /// outside 1..=16.
    pub fn add_frame(
        &mut self,
        timestamp_ns: u64,
        codes_dn: &Plane<u16>,
        bits: u32,
        depth_steps: &Plane<u16>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        assert!((1..=16).contains(&bits), "codes have 1 to 16 bits");
        let time = seconds(timestamp_ns);
        let (picture, depth) = (format!("rgb/{time}.png"), format!("depth/{time}.png"));
        let upper = codes_dn.map(|code_dn| low_u8((u32::from(code_dn) << (16 - bits)) >> 8));
        write_grey_8(&self.folder.join(&picture), &upper)?;
        write_grey_16(&self.folder.join(&depth), depth_steps)?;
        self.rgb.line(&format!("{time} {picture}"))?;
        self.depth.line(&format!("{time} {depth}"))?;
        self.both.line(&format!("{time} {picture} {time} {depth}"))?;
        let (p, q) = (world_from_camera.translation_m, world_from_camera.rotation);
        let numbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(|number| format!("{number:.12}"));
        self.ground_truth.line(&format!("{time} {}", numbers.join(" ")))
    }

    /// Lists what the accelerometer said.
    pub fn add_readings(&mut self, readings: &[ImuSample]) -> Result<(), Error> {
        for reading in readings {
            let a = reading.acceleration_m_per_s2;
            let time = seconds(crate::num::u64_half_even(reading.t_s * 1e9));
            self.accelerometer.line(&format!("{time} {:.9} {:.9} {:.9}", a.x, a.y, a.z))?;
        }
        Ok(())
    }

    /// Writes what is still in memory.
    pub fn finish(self) -> Result<(), Error> {
        let lists = [self.rgb, self.depth, self.both, self.ground_truth, self.accelerometer];
        lists.into_iter().try_for_each(TextFile::finish)
    }
}

/// Nanoseconds as seconds, exact.
fn seconds(timestamp_ns: u64) -> String {
    format!("{}.{:09}", timestamp_ns / 1_000_000_000, timestamp_ns % 1_000_000_000)
}
