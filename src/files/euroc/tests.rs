//! An EuRoC folder that was written reads back, and a broken one is refused with its file and line.

use crate::optics::lens::Lens;
use crate::pose::Pose;
use crate::units::Size;
use std::fs;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::*;
use crate::error::Error;
use crate::files::scratch::Scratch;
use crate::optics::lens::{Intrinsics, Mapping, Radtan};
use crate::plane::Plane;
use crate::scene::motion::imu::MEMS_PHONE;
use crate::units::CameraIndex;

const SIZE: Size = Size { width_px: 5, height_px: 3 };

const RADTAN: Radtan = Radtan { k1: -0.283_408_11, k2: 0.073_959_07, p1: 0.000_193_59, p2: 1.761_871_14e-5, k3: 0.0 };

fn camera(x_m: f64) -> EurocCamera {
    EurocCamera {
        body_from_camera: Pose::new(DQuat::from_xyzw(0.5, -0.5, 0.5, -0.5), DVec3::new(x_m, 0.02, -0.01)),
        rate_hz: 30.0,
        size: SIZE,
        lens: Lens {
            intrinsics: Intrinsics { fx_px: 458.654, fy_px: 457.296, cx_px: 2.1, cy_px: 1.2 },
            mapping: Mapping::Radtan(RADTAN),
        },
    }
}

fn codes(bits: u32) -> Plane<u16> {
    let code_max = (1_u32 << bits) - 1;
    Plane::from_values(SIZE, (0..15_u32).map(|k| num_u16(k * code_max / 14)).collect())
}

fn num_u16(value: u32) -> u16 {
    u16::try_from(value).unwrap()
}

fn truth(timestamp_ns: u64) -> GroundTruth {
    GroundTruth {
        timestamp_ns,
        world_from_body: Pose::new(DQuat::from_xyzw(0.1, -0.7, 0.2, 0.4).normalize(), DVec3::new(1.0, -2.0, 3.5)),
        velocity_m_per_s: DVec3::new(0.25, 0.5, -1.0),
        gyroscope_bias_rad_per_s: DVec3::ZERO,
        accelerometer_bias_m_per_s2: DVec3::new(1e-7, 0.0, 0.0),
    }
}

fn write_folder(dir: &Path, bits: u32) {
    let imu = EurocImu { body_from_imu: Pose::IDENTITY, noise: MEMS_PHONE };
    let mut writer = EurocWriter::create(dir, &[camera(0.0), camera(0.065)], Some(&imu)).unwrap();
    for timestamp_ns in [1_000_000, 34_333_333] {
        for index in 0..2 {
            writer.add_frame(CameraIndex(index), timestamp_ns, &codes(bits), bits).unwrap();
        }
        writer.add_ground_truth(&truth(timestamp_ns)).unwrap();
        let (angular_velocity_rad_per_s, acceleration_m_per_s2) = (DVec3::X, DVec3::new(0.0, 9.8, 0.1));
        writer.add_imu(&ImuReading { timestamp_ns, angular_velocity_rad_per_s, acceleration_m_per_s2 }).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_written_folder_reads_back_the_same() {
    let mut tried = 0;
    for bits in [1, 4, 8, 10, 16] {
        let scratch = Scratch::new();
        write_folder(scratch.path(), bits);
        let reader = EurocReader::open(scratch.path()).unwrap();
        assert_eq!(reader.cameras().len(), 2);
        for (index, x_m) in [(0, 0.0), (1, 0.065)] {
            let folder = &reader.cameras()[index];
            assert_eq!(
                folder.frames.iter().map(|frame| frame.timestamp_ns).collect::<Vec<_>>(),
                [1_000_000, 34_333_333]
            );
            assert_eq!(folder.repeated, 0);
            assert_eq!(folder.camera.lens, camera(x_m).lens, "decimals return to the same bits");
            assert_eq!(folder.camera.size, SIZE);
            let (found, written) = (folder.camera.body_from_camera, camera(x_m).body_from_camera);
            assert_eq!(found.translation_m, written.translation_m);
            // Through a matrix and back: roundings of unit numbers.
            assert!(found.inverse().then(&written).angle_rad() < 1e-15);
            let picture = image::open(&folder.frames[1].path).unwrap();
            let expected = codes(bits).map(|code| crate::num::low_u8((u32::from(code) << (16 - bits)) >> 8));
            assert_eq!(picture.as_luma8().unwrap().as_raw(), expected.values(), "{bits} bits");
            tried += 1;
        }
        let poses = reader.ground_truth().unwrap();
        assert_eq!(poses.len(), 2);
        assert_eq!(poses[0].t_s, 0.001);
        assert_eq!(poses[1].world_from_body.translation_m, DVec3::new(1.0, -2.0, 3.5));
        // Renormalised on reading: an ulp of a unit number.
        assert!((poses[1].world_from_body.rotation - truth(0).world_from_body.rotation).length() < 1e-15);
        let unit = reader.imu().unwrap();
        assert_eq!(unit.imu, EurocImu { body_from_imu: Pose::IDENTITY, noise: MEMS_PHONE });
        assert_eq!(unit.readings.len(), 2);
        assert_eq!(unit.readings[1].timestamp_ns, 34_333_333);
        assert_eq!(unit.readings[1].angular_velocity_rad_per_s, DVec3::X);
        assert_eq!(unit.readings[1].acceleration_m_per_s2, DVec3::new(0.0, 9.8, 0.1));
        // Seventeen columns, as EuRoC's own.
        let text = fs::read_to_string(scratch.path().join("mav0/state_groundtruth_estimate0/data.csv")).unwrap();
        assert!(text.lines().all(|line| line.split(',').count() == 17), "{text}");
    }
    assert_eq!(tried, 10);
}

/// The layout of the real MH_01_easy/mav0/cam0/sensor.yaml, with its comments and its list over four lines.
const REAL_LAYOUT: &str = "# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
         0.0, 0.0, 0.0, 1.0]

# Camera specific definitions.
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
";

/// A folder of one camera without ground truth.
fn folder_with(yaml: &str, csv: &str) -> (Scratch, Result<EurocReader, Error>) {
    let scratch = Scratch::new();
    let folder = scratch.path().join("cam0");
    fs::create_dir_all(folder.join("data")).unwrap();
    fs::write(folder.join("sensor.yaml"), yaml).unwrap();
    fs::write(folder.join("data.csv"), csv).unwrap();
    let reader = EurocReader::open(scratch.path());
    (scratch, reader)
}

#[test]
fn the_layouts_of_real_data_sets_are_understood() {
    let csv = "#timestamp [ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n\
               1403636579763555584,again.png\r\n1403636579813555456,1403636579813555456.png\r\n";
    let opencv_style = format!("%YAML:1.0\n---\n{}", REAL_LAYOUT.replace("T_BS:", "T_BS: !!opencv-matrix"));
    for yaml in [REAL_LAYOUT.to_owned(), opencv_style, REAL_LAYOUT.replace('\n', "\r\n")] {
        let (_scratch, reader) = folder_with(&yaml, csv);
        let reader = reader.unwrap();
        let folder = &reader.cameras()[0];
        assert_eq!(folder.camera.size, Size { width_px: 752, height_px: 480 });
        assert_eq!(folder.camera.lens.intrinsics.cy_px, 248.375);
        assert_eq!(folder.camera.lens.mapping, Mapping::Radtan(RADTAN));
        assert_eq!(folder.camera.body_from_camera.translation_m.y, -0.064_676_986_768);
        // The camera's x axis is nearly the body's y: column 0 of T_BS.
        assert!((folder.camera.body_from_camera.rotation * DVec3::X).y > 0.999);
        assert_eq!((folder.frames.len(), folder.repeated), (2, 1));
        assert!(folder.frames[0].path.ends_with("cam0/data/1403636579763555584.png"));
        assert!(reader.ground_truth().is_none());
    }
}

#[test]
fn hostile_calibrations_are_refused_with_file_and_line() {
    let cases = [
        ("rate_hz: 20", "rate_hz: fast", "line 15: rate_hz = 'fast'"),
        ("rate_hz: 20", "rate_hz: -1", "line 15: rate_hz"),
        ("rate_hz: 20", "rate_hz: 20\nrate_hz: 30", "line 16: 'rate_hz' is there twice"),
        ("rate_hz: 20\n", "", "has no 'rate_hz'"),
        ("[752, 480]", "[752]", "line 16: resolution = '[752]' is no list of 2 numbers"),
        ("[752, 480]", "[752, 1e9]", "line 16: resolution"),
        ("[752, 480]", "[0, 480]", "line 16: resolution"),
        ("[752, 480]", "[752.5, 480]", "line 16: resolution"),
        ("[752, 480]", "[752, 480", "line 17: is no YAML"),
        ("pinhole", "omni", "line 17: camera_model = 'omni' is not known; known: pinhole"),
        ("radial-tangential", "fov", "line 19: distortion_model"),
        ("458.654", "nan", "line 18: intrinsics"),
        ("458.654", "-458.654", "line 18: focal lengths"),
        ("0.999557249008", "0.5", "line 9: T_BS is no rotation"),
        ("[752, 480]", "[[752], 480]", "line 16: 'resolution' is a list of more than numbers"),
        ("pinhole", "*model", "line 17: is no YAML"),
        ("rate_hz: 20", "rate_hz: &rate 20\ncopy_hz: *rate", "line 16: has an alias; write the value"),
        ("rate_hz: 20", "? [a]\n: 20", "line 15: has a key that is no text"),
        ("sensor_type: camera", "a: {a: {a: {a: {a: {a: {a: {a: {a: 1}}}}}}}}", "line 2: is more than 8 levels deep"),
        ("T_BS:", "T_BS", "line 7: is no YAML"),
        ("1.76187114e-05]", "1.76187114e-05", "line 21: is no YAML"),
    ];
    for (from, to, message) in cases {
        assert!(REAL_LAYOUT.contains(from), "{from}");
        let (_scratch, reader) = folder_with(&REAL_LAYOUT.replacen(from, to, 1), "");
        let error = reader.unwrap_err();
        assert_eq!(error.exit_code(), 2, "{to}");
        let text = error.to_string();
        assert!(text.contains("sensor.yaml") && text.contains(message), "{to}: {text}");
    }
}

#[test]
fn hostile_frame_lists_are_refused_with_file_and_line() {
    let cases = [
        ("1,a.png\n0,b.png\n", "line 2: time goes back from 1 to 0"),
        ("#c\n\n-1,a.png\n", "line 3: '-1' is no time stamp"),
        ("1e9,a.png\n", "line 1: '1e9' is no time stamp"),
        ("1\n", "line 1: 1 fields"),
        ("1,a,b\n", "line 1: 3 fields"),
        ("1,../../secret.png\n", "line 1: '../../secret.png' is no plain file name"),
        ("1,/secret.png\n", "line 1: '/secret.png' is no plain file name"),
        ("1,\n", "line 1: '' is no plain file name"),
    ];
    for (csv, message) in cases {
        let (_scratch, reader) = folder_with(REAL_LAYOUT, csv);
        let text = reader.unwrap_err().to_string();
        assert!(text.contains("data.csv") && text.contains(message), "{csv}: {text}");
    }
}

#[test]
fn hostile_ground_truth_is_refused_with_file_and_line() {
    for (csv, message) in [
        ("1,0,0,0,1,0,0\n", "line 1: 7 fields"),
        ("#\n1,0,0,0,0.5,0,0,0\n", "line 2: a quaternion of norm 0.5"),
        ("1,0,0,inf,1,0,0,0\n", "line 1: 'inf' is no finite number"),
        ("2,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n", "line 2: time goes back"),
    ] {
        let scratch = Scratch::new();
        write_folder(scratch.path(), 8);
        fs::write(scratch.path().join("mav0/state_groundtruth_estimate0/data.csv"), csv).unwrap();
        let text = EurocReader::open(scratch.path()).unwrap_err().to_string();
        assert!(text.contains("data.csv") && text.contains(message), "{csv}: {text}");
    }
}
