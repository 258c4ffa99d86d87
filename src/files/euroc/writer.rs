//! Writes calibrations, codes, readings and poses as an ASL folder, `mav0/`.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

use super::super::errors::content_error;
use super::super::text_file::TextFile;
use super::super::{make_folder, write};
use super::layout::{CAMERA_HEADER, EurocCamera, EurocImu, GROUND_TRUTH_FOLDER, GROUND_TRUTH_HEADER, IMU_HEADER};
use super::lens;
use crate::error::Error;
use crate::num;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::units::{CameraIndex, Size};

/// A line of `imu0/data.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// Time of the run.
    pub timestamp_ns: u64,
    /// In the IMU's frame.
    pub angular_velocity_rad_per_s: DVec3,
    /// Specific force in the IMU's frame.
    pub acceleration_m_per_s2: DVec3,
}

/// A line of `state_groundtruth_estimate0/data.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTruth {
    /// Time of the run.
    pub timestamp_ns: u64,
    /// Where the body was.
    pub world_from_body: Pose,
    /// In the world's frame.
    pub velocity_m_per_s: DVec3,
    /// True bias of the gyroscope.
    pub gyroscope_bias_rad_per_s: DVec3,
    /// True bias of the accelerometer.
    pub accelerometer_bias_m_per_s2: DVec3,
}

/// An ASL folder under construction. [`EurocWriter::finish`] makes sure that everything is on its way to the disk.
#[derive(Debug)]
pub struct EurocWriter {
    cameras: Vec<(PathBuf, TextFile, EurocCamera)>,
    imu: Option<TextFile>,
    ground_truth: TextFile,
}

/// The `data.csv` of a folder, which is made, beside its `sensor.yaml`.
fn create_table(folder: &Path, header: &str, yaml: &str) -> Result<TextFile, Error> {
    make_folder(folder)?;
    let mut table = TextFile::create(folder.join("data.csv"))?;
    table.line(header)?;
    write(&folder.join("sensor.yaml"), yaml)?;
    Ok(table)
}

/// A time stamp and numbers that return to the same bits when they are read.
fn numbers(timestamp_ns: u64, values: &[f64]) -> String {
    values.iter().fold(timestamp_ns.to_string(), |line, value| format!("{line},{value}"))
}

impl EurocWriter {
    /// Makes `dir/mav0` with the folders and `sensor.yaml` of every camera, of the IMU if there is one, and of the
    /// ground truth.
    pub fn create(dir: &Path, cameras: &[EurocCamera], imu: Option<&EurocImu>) -> Result<Self, Error> {
        let root = dir.join("mav0");
        make_folder(&root)?;
        let body = "# Written by sensel.\ncomment: simulated rig; its body is the frame of T_BS\n";
        write(&root.join("body.yaml"), body)?;
        let mut camera_tables = Vec::new();
        for (index, camera) in cameras.iter().enumerate() {
            let folder = root.join(format!("cam{index}"));
            let pictures = folder.join("data");
            make_folder(&pictures)?;
            camera_tables.push((pictures, create_table(&folder, CAMERA_HEADER, &camera_yaml(index, camera))?, *camera));
        }
        let imu_table = imu.map(|imu| create_table(&root.join("imu0"), IMU_HEADER, &imu_yaml(imu))).transpose()?;
        let ground_truth = create_table(&root.join(GROUND_TRUTH_FOLDER), GROUND_TRUTH_HEADER, &ground_truth_yaml())?;
        Ok(Self { cameras: camera_tables, imu: imu_table, ground_truth })
    }

    /// Writes a picture of codes of 1 to 16 `bits` and lists it. Panics on an unknown camera, on another size than the camera's, or on
    /// bits outside 1..=16.
    pub fn add_frame(
        &mut self,
        camera: CameraIndex,
        timestamp_ns: u64,
        codes_dn: &Plane<u16>,
        bits: u32,
    ) -> Result<(), Error> {
        let (folder, table, calibration) = &mut self.cameras[num::index(camera.0)];
        assert!(codes_dn.size() == calibration.size, "a frame has its camera's size");
        let name = format!("{timestamp_ns}.png");
        let path = folder.join(&name);
        let png = encode_png(codes_dn, bits)
            .map_err(|error| content_error(&path, format!("the picture cannot be written as PNG: {error}")))?;
        write(&path, png)?;
        table.line(&format!("{timestamp_ns},{name}"))
    }

    /// Lists an inertial reading. Panics if the folder was made without an IMU.
    pub fn add_imu(&mut self, reading: &ImuReading) -> Result<(), Error> {
        let table = self.imu.as_mut().expect("the folder was made with an IMU");
        let (w, a) = (reading.angular_velocity_rad_per_s, reading.acceleration_m_per_s2);
        table.line(&numbers(reading.timestamp_ns, &[w.x, w.y, w.z, a.x, a.y, a.z]))
    }

    /// Lists a true pose.
    pub fn add_ground_truth(&mut self, truth: &GroundTruth) -> Result<(), Error> {
        let (p, q) = (truth.world_from_body.translation_m, truth.world_from_body.rotation);
        let mut values = vec![p.x, p.y, p.z, q.w, q.x, q.y, q.z];
        for vector in [truth.velocity_m_per_s, truth.gyroscope_bias_rad_per_s, truth.accelerometer_bias_m_per_s2] {
            values.extend(vector.to_array());
        }
        self.ground_truth.line(&numbers(truth.timestamp_ns, &values))
    }

    /// Writes what is still in memory.
    pub fn finish(self) -> Result<(), Error> {
        for (_, table, _) in self.cameras {
            table.finish()?;
        }
        self.imu.map_or(Ok(()), TextFile::finish)?;
        self.ground_truth.finish()
    }
}

/// A grey PNG of the top 8 bits of codes of 1 to 16 bits, as EuRoC's own pictures have and its readers expect: readers see a full range at
/// any depth of the sensor.
fn encode_png(codes_dn: &Plane<u16>, bits: u32) -> image::ImageResult<Vec<u8>> {
    assert!((1..=16).contains(&bits), "codes have 1 to 16 bits");
    let top = |&code_dn: &u16| num::low_u8((u32::from(code_dn) << (16 - bits)) >> 8);
    let samples: Vec<u8> = codes_dn.values().iter().map(top).collect();
    let mut png = Vec::new();
    let size = codes_dn.size();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Up).write_image(
        &samples,
        size.width_px,
        size.height_px,
        ExtendedColorType::L8,
    )?;
    Ok(png)
}

fn pose_yaml(pose: &Pose) -> String {
    let (r, t) = (DMat3::from_quat(pose.rotation), pose.translation_m);
    let row = |r: DVec3, t: f64| format!("{}, {}, {}, {t}", r.x, r.y, r.z);
    format!(
        "T_BS:\n  cols: 4\n  rows: 4\n  data: [{},\n         {},\n         {},\n         0.0, 0.0, 0.0, 1.0]\n",
        row(r.row(0), t.x),
        row(r.row(1), t.y),
        row(r.row(2), t.z)
    )
}

fn camera_yaml(index: usize, camera: &EurocCamera) -> String {
    let EurocCamera { body_from_camera, rate_hz, size: Size { width_px, height_px }, lens } = camera;
    format!(
        "# Written by sensel. T_BS maps points of the camera into the body.\nsensor_type: camera\ncomment: simulated cam{index}\n\n\
         {}\nrate_hz: {rate_hz}\nresolution: [{width_px}, {height_px}]\n{}",
        pose_yaml(body_from_camera),
        lens::yaml(lens),
    )
}

fn imu_yaml(imu: &EurocImu) -> String {
    let noise = &imu.noise;
    let (gyroscope, gyroscope_walk) = (noise.gyroscope_noise_density, noise.gyroscope_random_walk);
    let (accelerometer, accelerometer_walk) = (noise.accelerometer_noise_density, noise.accelerometer_random_walk);
    format!(
        "# Written by sensel.\nsensor_type: imu\ncomment: simulated imu0\n\n{}\nrate_hz: {}\n\
         gyroscope_noise_density: {gyroscope} # [ rad / s / sqrt(Hz) ]\n\
         gyroscope_random_walk: {gyroscope_walk} # [ rad / s^2 / sqrt(Hz) ]\n\
         accelerometer_noise_density: {accelerometer} # [ m / s^2 / sqrt(Hz) ]\n\
         accelerometer_random_walk: {accelerometer_walk} # [ m / s^3 / sqrt(Hz) ]\n",
        pose_yaml(&imu.body_from_imu),
        noise.rate_hz
    )
}

fn ground_truth_yaml() -> String {
    format!(
        "# Written by sensel: the pose of the body, exact.\nsensor_type: pose\ncomment: simulated ground truth\n\n{}",
        pose_yaml(&Pose::IDENTITY)
    )
}
