//! Reads calibrations, frame lists and ground truth of an ASL folder, real or ours. Errors name file and line.

use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use super::super::errors::content_error;
use super::layout::{EurocCamera, EurocImu, GROUND_TRUTH_FOLDER};
use super::lens;
use super::writer::ImuReading;
use super::yaml::{Document, Refusal, shortened};
use crate::error::Error;
use crate::files::open::is_there;
use crate::files::read_text;
use crate::num;
use crate::pose::{Pose, TimedPose};
use crate::scene::motion::imu::ImuNoise;
use crate::scene::motion::recording::{EurocPose, parse_euroc};
use crate::units::Size;

const YAML_BYTES_MAX: u64 = 1 << 20;
const CSV_BYTES_MAX: u64 = 1 << 30;
/// Cameras looked for: cam0, cam1, ... up to the first that is absent.
const CAMERAS_MAX: usize = 64;
const SIDE_PX_MAX: f64 = 16_384.0;
/// Entries of a rotation matrix written with few decimals may be off by this much.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// A line of a camera's `data.csv`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameEntry {
    /// Time of the frame.
    pub timestamp_ns: u64,
    /// Where its picture lies.
    pub path: PathBuf,
}

/// One camera's folder.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFolder {
    /// Its calibration.
    pub camera: EurocCamera,
    /// Its frames in rising time. Of lines with the same time stamp the first is kept.
    pub frames: Vec<FrameEntry>,
    /// How many lines repeated the time stamp before them.
    pub repeated: usize,
}

/// An opened folder. Pictures stay on the disk until asked for.
#[derive(Clone, Debug)]
pub struct EurocReader {
    cameras: Vec<CameraFolder>,
    ground_truth: Option<Vec<TimedPose>>,
    imu: Option<ImuFolder>,
}

/// An IMU's folder.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuFolder {
    /// Its calibration.
    pub imu: EurocImu,
    /// Its readings in rising time; of repeats the first.
    pub readings: Vec<ImuReading>,
}

impl EurocReader {
    /// Opens a folder that holds `mav0`, or `mav0` itself. Fails on no `cam0`, a file that cannot be read, or content that does not hold,
    /// named by file and line.
    pub fn open(dir: &Path) -> Result<Self, Error> {
        let inner = dir.join("mav0");
        let root = if inner.is_dir() { inner } else { dir.to_owned() };
        let mut cameras = Vec::new();
        for index in 0..CAMERAS_MAX {
            let folder = root.join(format!("cam{index}"));
            if !folder.is_dir() {
                break;
            }
            cameras.push(open_camera(&folder)?);
        }
        if cameras.is_empty() {
            return Err(content_error(dir, "is no EuRoC folder: it has neither mav0/cam0 nor cam0"));
        }
        let path = root.join(GROUND_TRUTH_FOLDER).join("data.csv");
        let ground_truth = if is_there(&path) { Some(read_ground_truth(&path)?) } else { None };
        let folder = root.join("imu0");
        let imu = if folder.is_dir() { Some(open_imu(&folder)?) } else { None };
        Ok(Self { cameras, ground_truth, imu })
    }

    /// The cameras in order.
    pub fn cameras(&self) -> &[CameraFolder] {
        &self.cameras
    }

    /// True poses of the body, if the folder has them. Times are seconds of the folder's clock; of repeats the first.
    pub fn ground_truth(&self) -> Option<&[TimedPose]> {
        self.ground_truth.as_deref()
    }

    /// The first IMU, if the folder has one.
    pub fn imu(&self) -> Option<&ImuFolder> {
        self.imu.as_ref()
    }
}

fn at_line(path: &Path) -> impl Fn(Refusal) -> Error {
    let path = path.to_owned();
    move |(line, reason)| content_error(&path, if line == 0 { reason } else { format!("line {line}: {reason}") })
}

fn read_calibration<T>(folder: &Path, parse: fn(&Document) -> Result<T, Refusal>) -> Result<T, Error> {
    let path = folder.join("sensor.yaml");
    let document = Document::parse(&read_text(&path, YAML_BYTES_MAX)?);
    document.and_then(|document| parse(&document)).map_err(at_line(&path))
}

fn open_camera(folder: &Path) -> Result<CameraFolder, Error> {
    let camera = read_calibration(folder, parse_camera)?;
    let path = folder.join("data.csv");
    let (frames, repeated) =
        parse_frames(&read_text(&path, CSV_BYTES_MAX)?, &folder.join("data")).map_err(at_line(&path))?;
    Ok(CameraFolder { camera, frames, repeated })
}

fn open_imu(folder: &Path) -> Result<ImuFolder, Error> {
    let imu = read_calibration(folder, parse_imu)?;
    let path = folder.join("data.csv");
    let readings = parse_readings(&read_text(&path, CSV_BYTES_MAX)?).map_err(at_line(&path))?;
    Ok(ImuFolder { imu, readings })
}

fn parse_imu(document: &Document) -> Result<EurocImu, Refusal> {
    let positive = |key: &str| {
        let value = document.number(key)?;
        if value >= 0.0 {
            Ok(value)
        } else {
            Err((document.get(key)?.line, format!("{key} = {value}; use 0 or above")))
        }
    };
    Ok(EurocImu {
        body_from_imu: parse_pose(document)?,
        noise: ImuNoise {
            rate_hz: positive("rate_hz")?,
            gyroscope_noise_density: positive("gyroscope_noise_density")?,
            accelerometer_noise_density: positive("accelerometer_noise_density")?,
            gyroscope_random_walk: positive("gyroscope_random_walk")?,
            accelerometer_random_walk: positive("accelerometer_random_walk")?,
        },
    })
}

fn parse_readings(text: &str) -> Result<Vec<ImuReading>, Refusal> {
    let mut readings: Vec<ImuReading> = Vec::new();
    for (line, fields) in csv_lines(text) {
        let &[timestamp, wx, wy, wz, ax, ay, az] = fields.as_slice() else {
            return Err((line, format!("{} fields; a reading is timestamp, w x y z, a x y z", fields.len())));
        };
        let timestamp_ns = parse_timestamp(line, timestamp)?;
        let number = |text: &str| {
            let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| (line, format!("'{}' is no finite number", shortened(text))))
        };
        let vector = |x, y, z| Ok(DVec3::new(number(x)?, number(y)?, number(z)?));
        let (angular_velocity_rad_per_s, acceleration_m_per_s2) = (vector(wx, wy, wz)?, vector(ax, ay, az)?);
        if !check_order(line, readings.last().map(|reading| reading.timestamp_ns), timestamp_ns)? {
            readings.push(ImuReading { timestamp_ns, angular_velocity_rad_per_s, acceleration_m_per_s2 });
        }
    }
    Ok(readings)
}

fn parse_camera(document: &Document) -> Result<EurocCamera, Refusal> {
    let rate_hz = document.number("rate_hz")?;
    if rate_hz <= 0.0 {
        return Err((document.get("rate_hz")?.line, format!("rate_hz = {rate_hz}; use a value above 0")));
    }
    let sides_px: [f64; 2] = document.numbers("resolution")?;
    if sides_px.iter().any(|&side_px| !(1.0..=SIDE_PX_MAX).contains(&side_px) || side_px.fract() != 0.0) {
        let line = document.get("resolution")?.line;
        return Err((line, format!("resolution = {sides_px:?}; use whole numbers from 1 to {SIDE_PX_MAX}")));
    }
    Ok(EurocCamera {
        body_from_camera: parse_pose(document)?,
        rate_hz,
        size: Size { width_px: num::u32_truncated(sides_px[0]), height_px: num::u32_truncated(sides_px[1]) },
        lens: lens::parse(document)?,
    })
}

fn parse_pose(document: &Document) -> Result<Pose, Refusal> {
    let m: [f64; 16] = document.numbers("T_BS.data")?;
    let rotation =
        DMat3::from_cols(DVec3::new(m[0], m[4], m[8]), DVec3::new(m[1], m[5], m[9]), DVec3::new(m[2], m[6], m[10]));
    let off = rotation * rotation.transpose() - DMat3::IDENTITY;
    let is_rigid = off.to_cols_array().iter().all(|entry| entry.abs() <= ROTATION_TOLERANCE)
        && rotation.determinant() > 0.0
        && m[12..] == [0.0, 0.0, 0.0, 1.0];
    if !is_rigid {
        return Err((document.get("T_BS.data")?.line, "T_BS is no rotation and translation".to_owned()));
    }
    Ok(Pose::new(DQuat::from_mat3(&rotation).normalize(), DVec3::new(m[3], m[7], m[11])))
}

/// Lines that hold something, with their number and their fields.
fn csv_lines(text: &str) -> impl Iterator<Item = (usize, Vec<&str>)> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    lines
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(number, line)| (number, line.split(',').map(str::trim).collect()))
}

fn parse_timestamp(line: usize, text: &str) -> Result<u64, Refusal> {
    text.parse().map_err(|_| (line, format!("'{}' is no time stamp in whole nanoseconds", shortened(text))))
}

fn check_order(line: usize, last_ns: Option<u64>, timestamp_ns: u64) -> Result<bool, Refusal> {
    match last_ns {
        Some(last_ns) if timestamp_ns < last_ns => {
            Err((line, format!("time goes back from {last_ns} to {timestamp_ns}")))
        }
        Some(last_ns) => Ok(timestamp_ns == last_ns),
        None => Ok(false),
    }
}

fn parse_frames(text: &str, pictures: &Path) -> Result<(Vec<FrameEntry>, usize), Refusal> {
    let mut frames: Vec<FrameEntry> = Vec::new();
    let mut repeated = 0;
    for (line, fields) in csv_lines(text) {
        let &[timestamp, name] = fields.as_slice() else {
            return Err((line, format!("{} fields; a frame is timestamp,filename", fields.len())));
        };
        let timestamp_ns = parse_timestamp(line, timestamp)?;
        // A name, never a path: a data set cannot make its reader open files elsewhere.
        if name.is_empty() || name.starts_with("..") || name.contains(['/', '\\', ':', '\0']) {
            return Err((line, format!("'{}' is no plain file name", shortened(name))));
        }
        if check_order(line, frames.last().map(|frame| frame.timestamp_ns), timestamp_ns)? {
            repeated += 1;
        } else {
            frames.push(FrameEntry { timestamp_ns, path: pictures.join(name) });
        }
    }
    Ok((frames, repeated))
}

fn read_ground_truth(path: &Path) -> Result<Vec<TimedPose>, Error> {
    let (poses, _) =
        parse_euroc(&read_text(path, CSV_BYTES_MAX)?).map_err(|error| at_line(path)((error.line, error.reason)))?;
    let timed = |(ns, pose): &EurocPose| TimedPose { t_s: num::f64_from_u64(*ns) / 1e9, world_from_body: *pose };
    Ok(poses.iter().map(timed).collect())
}
