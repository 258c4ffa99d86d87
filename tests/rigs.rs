//! Rigs and motions as a scenario names them: what runs, what a run writes of them, and which keys are refused.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use crate::common;

use common::{Scratch, sensel};
use glam::{DQuat, DVec3};
use sensel::config::Resolved;
use sensel::files::euroc::EurocReader;
use sensel::pose::parse_tum;
use sensel::run::{NoFiles, NoProgress, SensorSetup, Setup};
use sensel::scene::motion::imu::{ADIS16448, GRAVITY_M_PER_S2};
use sensel::so3;
use sensel::units::{FrameIndex, RowIndex};

/// A small and quick sensor.
const SMALL: &str = "[sensor]\nwidth = 64\nheight = 48\n[run]\nframes = 3\nsamples_per_pixel = 2\n";

/// A scene that costs nothing, where only motion matters; a tracker would see nothing in it.
const FLAT: &str = "[scene]\ntarget = \"flat\"\n";

fn resolved(text: &str) -> Result<Resolved, sensel::error::Error> {
    Resolved::from_layers("scene.toml", &format!("{FLAT}{SMALL}{text}"), &[])
}

/// What the checks before a run say.
fn refusal(text: &str) -> String {
    let resolved = match resolved(text) {
        Ok(resolved) => resolved,
        Err(error) => return error.to_string(),
    };
    let checked = SensorSetup::new(&resolved).map(|_| ()).and_then(|()| resolved.scenario.motion.source().map(|_| ()));
    let checked = checked.and_then(|()| resolved.scenario.imu().map(|_| ()));
    checked.map_err(|error| resolved.tree.locate(error)).unwrap_err().to_string()
}

/// Runs a scenario in a scene and returns the folder with its output.
fn run_in(scene: &str, name: &str, text: &str) -> Scratch {
    let folder = Scratch::new(name);
    let file = folder.join("scene.toml");
    std::fs::write(&file, format!("{scene}{SMALL}{text}")).unwrap();
    let outcome = sensel(&["run", &file, "--quiet", "--out", &folder.join("out")]);
    assert_eq!(outcome.code, 0, "{text}: {}", outcome.stderr);
    folder
}

/// The same in the flat scene.
fn run(name: &str, text: &str) -> Scratch {
    run_in(FLAT, name, text)
}

#[test]
fn rigs_of_one_to_five_cameras_run_and_say_where_their_cameras_are() {
    let text = |count: u32| -> String {
        let camera = |k: u32| {
            format!(
                "[[rig.camera]]\nposition_mm = [{}, 10.0, -5.0]\nyaw_pitch_roll_deg = [{}, 10.0, 0.0]\n",
                30 * k,
                20 * k
            )
        };
        (0..count).map(camera).collect::<String>() + "[rig]\nbody_from_rig = [0.0, 0.0, 0.6, 0.8]\n"
    };
    let body_from_rig = DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8);
    let mut tried = 0;
    for count in 1..=5_u32 {
        let folder = run_in("[scene]\ngenerator = \"box\"\n", "rig", &text(count));
        let reader = EurocReader::open(&folder.path().join("out")).unwrap();
        assert_eq!(reader.cameras().len(), usize::try_from(count).unwrap());
        for (k, camera) in (0_u32..).zip(reader.cameras()) {
            let found = camera.camera.body_from_camera;
            let position_m = body_from_rig * DVec3::new(0.03 * f64::from(k), 0.01, -0.005);
            // Metres and matrix entries as text that returns to the same bits; some ten roundings on the way.
            assert!((found.translation_m - position_m).length() < 1e-15, "{found:?}");
            // To the right by the yaw, then up by 10 degrees: y is down.
            let (yaw, pitch) = ((20.0 * f64::from(k)).to_radians(), 10.0_f64.to_radians());
            let ahead =
                DVec3::new(libm::sin(yaw) * libm::cos(pitch), -libm::sin(pitch), libm::cos(yaw) * libm::cos(pitch));
            assert!((found.rotation * DVec3::Z - body_from_rig * ahead).length() < 1e-14, "camera {k}");
            assert_eq!(camera.frames.len(), 3);
            let (picture, _) = sensel::files::picture::read_grey(&camera.frames[0].path).unwrap();
            assert!(picture.values().iter().any(|&value| value != picture.values()[0]));
            tried += 1;
        }
        let report: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/report.json")).unwrap()).unwrap();
        assert_eq!(report["scenario"]["cameras"], count);
        let baseline_mm = report["scenario"]["baseline_mm"].as_f64().unwrap();
        assert!((baseline_mm - if count > 1 { 30.0 } else { 0.0 }).abs() < 1e-9, "{baseline_mm}");
    }
    assert_eq!(tried, 15);
}

#[test]
fn a_pair_of_cameras_is_the_baseline_in_other_words() {
    let pair = "[[rig.camera]]\nposition_mm = [-32.5, 0.0, 0.0]\n[[rig.camera]]\nposition_mm = [32.5, 0.0, 0.0]\n";
    let [by_baseline, by_cameras] = ["", pair].map(|text| resolved(text).unwrap().scenario.cameras().unwrap());
    assert_eq!(by_baseline, by_cameras);
    let again = Resolved::from_layers("config.toml", &resolved(pair).unwrap().canonical_text(), &[]).unwrap();
    assert_eq!(again.scenario, resolved(pair).unwrap().scenario, "the effective configuration says the same");
}

#[test]
fn the_inertial_unit_writes_its_rate_its_position_and_the_truth_of_its_time() {
    let folder = run(
        "unit",
        "[motion]\nkind = \"spin\"\nrate_deg_per_s = 200.0\n\
         [rig]\nbaseline_mm = 0.0\nimu = \"ideal\"\nimu_rate_hz = 400.0\nimu_position_mm = [100.0, 0.0, 0.0]\n",
    );
    let unit = folder.path().join("out/mav0/imu0");
    let yaml = std::fs::read_to_string(unit.join("sensor.yaml")).unwrap();
    assert!(yaml.contains("rate_hz: 400\n") && yaml.contains("data: [1, 0, 0, 0.1,"), "{yaml}");
    let table = std::fs::read_to_string(unit.join("data.csv")).unwrap();
    let rate = 200.0_f64.to_radians();
    let mut tried = 0;
    for (k, line) in table.lines().skip(1).enumerate() {
        let values: Vec<f64> = line.split(',').map(|text| text.parse().unwrap()).collect();
        assert_eq!(values[0], 2_500_000.0 * f64::from(u32::try_from(k).unwrap()));
        let (w, a) = (DVec3::from_slice(&values[1..4]), DVec3::from_slice(&values[4..7]));
        assert!((w - DVec3::Y * rate).length() < 1e-10, "{w}");
        assert!((a - DVec3::new(-rate * rate * 0.1, -GRAVITY_M_PER_S2, 0.0)).length() < 1e-7, "{a}");
        tried += 1;
    }
    // Three frames at 30 Hz: two frame times and the way to the middle of the last.
    assert!((25..=45).contains(&tried), "{tried} readings");
    let folder = run("unit", "[rig]\nimu = \"adis16448\"\n");
    let yaml = std::fs::read_to_string(folder.path().join("out/mav0/imu0/sensor.yaml")).unwrap();
    assert!(yaml.contains(&format!("gyroscope_noise_density: {} ", ADIS16448.gyroscope_noise_density)), "{yaml}");
    let folder = run("unit", "[rig]\nimu = \"none\"\n");
    assert!(!folder.path().join("out/mav0/imu0").exists());
}

#[test]
fn frames_are_timed_at_the_middle_of_all_their_rows_exposures() {
    let mut tried = 0;
    for shutter in ["rolling", "global"] {
        let text = format!("[sensor.readout]\nshutter = \"{shutter}\"\n[motion]\nkind = \"spin\"\n");
        let folder = run("time", &text);
        let out = folder.path().join("out");
        let sensor = SensorSetup::new(&resolved(&text).unwrap()).unwrap();
        let reader = EurocReader::open(&out).unwrap();
        let truth = parse_tum(&std::fs::read_to_string(out.join("trajectory_gt.tum")).unwrap()).unwrap();
        let table = reader.ground_truth().unwrap();
        for frame in 0..3_u32 {
            let start_s = sensor.schedule.exposure(FrameIndex(frame), RowIndex(0)).start_s;
            let end_s = sensor.schedule.exposure(FrameIndex(frame), RowIndex(47)).end_s;
            let t_s = 0.5 * (start_s + end_s);
            let index = usize::try_from(frame).unwrap();
            let entry = &reader.cameras()[0].frames[index];
            // All of these are on the nanosecond; half of it is lost in rounding, and a rounding of the sum.
            let ns = f64::from(u32::try_from(entry.timestamp_ns).unwrap());
            assert!((ns - t_s * 1e9).abs() < 0.5001, "{shutter} {frame}: {ns} {t_s}");
            assert!((truth[index].t_s - t_s).abs() < 1.001e-9 && (table[index].t_s - truth[index].t_s).abs() < 1e-12);
            // 60 deg/s to the right, from a level rig: the truth is that of this very time, not of the frame's start.
            let turned = so3::exp(DVec3::Y * -(60.0_f64.to_radians() * truth[index].t_s)) * DVec3::NEG_Z;
            let ahead = truth[index].world_from_body.rotation * DVec3::Z;
            // The start of the run is at 0 s; twelve decimals of the file.
            assert!((ahead - turned).length() < 1e-11, "{shutter} {frame}: {ahead} {turned}");
            tried += 1;
        }
    }
    assert_eq!(tried, 6);
}

const POSES: &str = "[motion]\nkind = \"spline\"\n\
    pose = [{ t_s = 1.5e9, position_m = [0.0, 1.5, 0.0] }, { t_s = 1500000001.0, position_m = [0.1, 1.5, 0.0] },\n\
            { t_s = 1500000002.0, position_m = [0.2, 1.5, 0.1], yaw_pitch_roll_deg = [30.0, 0.0, 0.0] },\n\
            { t_s = 1500000003.0, position_m = [0.3, 1.4, 0.1], orientation = [1.0, 0.0, 0.0, 0.0] }]\n";

#[test]
fn every_kind_of_motion_runs_and_its_effective_configuration_says_the_same() {
    let kinds = [
        "[motion]\nkind = \"still\"\noscillation_mm = 1.0\noscillation_axis = \"y\"\n",
        "[motion]\nkind = \"sway\"\n",
        "[motion]\nkind = \"walk\"\npath = \"circle\"\nradius_m = 0.5\n",
        "[motion]\nkind = \"run\"\npath = \"loop\"\nstep_rate_hz = 2.8\nspeed_m_per_s = 2.5\n",
        "[motion]\nkind = \"spin\"\nrate_deg_per_s = -200.0\n",
        POSES,
    ];
    for kind in kinds {
        let folder = run("kind", &format!("[rig]\nbaseline_mm = 0.0\n{kind}"));
        let again = folder.join("again");
        let outcome = sensel(&["run", &folder.join("out/config.toml"), "--quiet", "--out", &again]);
        assert_eq!(outcome.code, 0, "{kind}: {}", outcome.stderr);
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(text("out/trajectory_gt.tum"), text("again/trajectory_gt.tum"), "{kind}");
        assert_eq!(text("out/config.toml"), text("again/config.toml"), "{kind}");
        let poses = parse_tum(&text("out/trajectory_gt.tum")).unwrap();
        assert_ne!(poses[0].world_from_body, poses[2].world_from_body, "it moves: {kind}");
    }
}

/// A tremble of 1 mm is 1 mm away after a quarter of its period, also in a scenario whose recording was scaled; control poses follow the
/// factor.
#[test]
fn metres_that_a_motion_states_are_not_scaled() {
    let away_m = |motion: &str, t_s: f64| {
        let scaled = resolved(&format!("[rig]\nbaseline_mm = 0.0\n[motion]\nscale = 0.25\n{motion}")).unwrap();
        let setup = Setup::new(scaled, &NoFiles, &NoProgress).unwrap();
        let position_m = |t_s: f64| setup.motion.world_from_body(t_s).unwrap().translation_m;
        (position_m(t_s) - position_m(0.0)).length()
    };
    // A spline of 20 knots a period misses 3e-4 of a sine's height.
    let tremble_m = away_m("kind = \"still\"\noscillation_mm = 1.0\noscillation_hz = 10.0\n", 0.025);
    assert!((tremble_m - 1e-3).abs() < 4e-7, "{tremble_m}");
    let pose = |t_s: f64, x_m: f64| format!("{{ t_s = {t_s:.1}, position_m = [{x_m:.1}, 1.5, 0.0] }}");
    let poses: Vec<String> = (0..5).map(f64::from).map(|second| pose(second, second)).collect();
    // Control poses on a line at even steps are the line; the run starts at the second, where the spline does.
    let along_m = away_m(&format!("kind = \"spline\"\npose = [{}]\n", poses.join(", ")), 0.05);
    assert!((along_m - 0.25 * 0.05).abs() < 1e-9, "{along_m}");
}

#[test]
fn control_poses_of_a_file_are_a_spline_of_their_own() {
    let folder = Scratch::new("control");
    let file = folder.join("scene.toml");
    // EuRoC's table, a pose a second, along x: on control poses that turn back, a fit would reach 1 m and the spline does not.
    let mut table = "#timestamp [ns],p,q\n".to_owned();
    for (second, x) in [0.0, 0.0, 1.0, 0.0, 0.0].iter().enumerate() {
        table += &format!("{},{x},0,0,1,0,0,0\n", 1_520_530_308_000_000_000 + 1_000_000_000 * second);
    }
    std::fs::write(folder.path().join("poses.csv"), table).unwrap();
    let text = "[rig]\nbaseline_mm = 0.0\n[motion]\nfile = \"poses.csv\"\nkind = \"spline\"\nstart_s = 2.0\n";
    std::fs::write(&file, format!("{FLAT}{SMALL}{text}")).unwrap();
    let outcome = sensel(&["run", &file, "--quiet", "--out", &folder.join("out")]);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let truth = parse_tum(&std::fs::read_to_string(folder.path().join("out/trajectory_gt.tum")).unwrap()).unwrap();
    for pose in &truth {
        // Basis weights about a knot: 2/3 at it, less u^2 and u^3/2 of the way on (B1 = (4 - 6 u^2 + 3 u^3) / 6). Positions count from the
        // run's start, at the peak.
        let u = pose.t_s;
        let x_m = pose.world_from_body.translation_m.x;
        assert!((x_m - (-u * u + 0.5 * u * u * u)).abs() < 1e-11, "{u}: {x_m}");
    }
    assert!(truth.len() == 3 && truth[2].t_s > 0.05);
}

#[test]
fn a_bridged_gap_is_said_in_the_report_and_refused_unasked() {
    let folder = Scratch::new("gap");
    let mut text = String::new();
    for k in (0..400_u32).filter(|k| !(20..60).contains(k)) {
        text += &format!("{}.{:02} {} 0 0 0 0 0 1\n", k / 100, k % 100, f64::from(k) * 1e-3);
    }
    std::fs::write(folder.path().join("path.txt"), text).unwrap();
    let file = folder.join("scene.toml");
    std::fs::write(
        &file,
        format!("{FLAT}{SMALL}[rig]\nbaseline_mm = 0.0\n[motion]\nfile = \"path.txt\"\nstart_s = 0.15\n"),
    )
    .unwrap();
    let refused = sensel(&["run", &file, "--out", &folder.join("out")]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("a gap of 0.410 s at 0.190 s"), "{}", refused.stderr);
    assert!(refused.stderr.contains("raise motion.bridge_gaps_s"), "{}", refused.stderr);
    let bridged =
        sensel(&["run", &file, "--set", "motion.bridge_gaps_s=0.5", "--out", &folder.join("out"), "--json"]).json();
    let note = bridged["scenario"]["motion_notes"][0].as_str().unwrap();
    assert_eq!(note, "a gap of 0.410 s at 0.190 s is bridged by the path of least acceleration");
}

/// Lines of a scenario, and words of what they are told.
const REFUSED: &[(&str, &str)] = &[
    (
        "[motion]\nspeed_m_per_s = 1.0\n",
        "scene.toml:10: motion.speed_m_per_s = 1.0: has no effect here; use motion.kind = \"walk\"",
    ),
    ("[motion]\nkind = \"sway\"\nstep_rate_hz = 2.0\n", "motion.step_rate_hz = 2.0: has no effect here"),
    (
        "[motion]\nkind = \"walk\"\nradius_m = 3.0\n",
        "motion.radius_m = 3.0: has no effect here; use a walk or run with motion.path",
    ),
    ("[motion]\nkind = \"walk\"\nrate_deg_per_s = 3.0\n", "has no effect here; use motion.kind = \"spin\""),
    ("[motion]\nkind = \"spin\"\noscillation_mm = 3.0\n", "has no effect here; use motion.kind = \"still\""),
    ("[motion]\noscillation_hz = 3.0\n", "has no effect here; use motion.oscillation_mm above 0"),
    ("[motion]\nbridge_gaps_s = 0.5\n", "has no effect here; use a recorded motion.file"),
    ("[motion]\npose = []\n", "has no effect here; use motion.kind = \"spline\" without a file"),
    ("[motion]\nfile = \"a.txt\"\npath = \"loop\"\n", "motion.path = \"loop\": has no effect here"),
    ("[rig]\nimu = \"none\"\nimu_rate_hz = 100.0\n", "rig.imu_rate_hz = 100.0: has no effect here; use an IMU"),
    ("[motion]\nfile = \"a.txt\"\nkind = \"walk\"\n", "motion.kind = walk: does not go with a file"),
    ("[motion]\nkind = \"jump\"\n", "use still or sway, walk, run, spin or spline"),
    ("[motion]\nkind = \"spline\"\n", "motion.pose = 0 poses: too few control poses; use 4 or more"),
    ("[motion]\nkind = \"walk\"\nspeed_m_per_s = 0.0\n", "use 0.001 to 20"),
    ("[motion]\nkind = \"walk\"\nstep_rate_hz = 9.0\n", "use 0.5 to 4"),
    ("[motion]\nkind = \"walk\"\nstep_rate_sd_hz = 0.5\n", "use 0 to 0.3"),
    ("[motion]\nkind = \"walk\"\npath = \"maze\"\n", "use one of line, circle, loop"),
    ("[motion]\nkind = \"run\"\npath = \"loop\"\nradius_m = nan\n", "use 0.1 to 10,000"),
    ("[motion]\nkind = \"spin\"\nrate_deg_per_s = 2000.0\n", "use -1,800 to 1,800"),
    ("[motion]\noscillation_mm = -1.0\n", "use 0 to 1,000"),
    ("[motion]\noscillation_mm = 1.0\noscillation_axis = \"up\"\n", "use one of x, y, z"),
    ("[motion]\nfile = \"a.txt\"\nbridge_gaps_s = 3.0\n", "use 0 (none) to 2"),
    ("[[rig.camera]]\nposition_mm = [0.0, 0.0, 0.0]\n[rig]\nbaseline_mm = 5.0\n", "use either these or a baseline"),
    ("[rig]\ncamera = []\n", "use 1 to 16 of [[rig.camera]]"),
    ("[[rig.camera]]\nposition_mm = [0.0, nan, 0.0]\n", "rig.camera.0.position_mm"),
    ("[[rig.camera]]\nposition_mm = [0.0, 0.0, 0.0]\norientation = [1.0, 1.0, 0.0, 0.0]\n", "rig.camera.0.orientation"),
    (
        "[[rig.camera]]\nposition_mm = [0.0, 0.0, 0.0]\norientation = [1.0, 0.0, 0.0, 0.0]\nyaw_pitch_roll_deg = [0.0, 0.0, 0.0]\n",
        "use one of the two",
    ),
    (
        "[[rig.camera]]\nposition_mm = [0.0, 0.0, 0.0]\nyaw_pitch_roll_deg = [0.0, 0.0, 400.0]\n",
        "use angles of -360 to 360",
    ),
    ("[[rig.camera]]\nplace_mm = [0.0, 0.0, 0.0]\n", "unknown key"),
    ("[rig]\nimu = \"brick\"\n", "use one of mems_phone, adis16448, ideal, none"),
    ("[rig]\nimu_rate_hz = 0.0\n", "use 1 to 10,000"),
    ("[rig]\nimu_position_mm = [1e9, 0.0, 0.0]\n", "use -10000 to 10000"),
];

#[test]
fn keys_that_nothing_reads_and_values_that_cannot_be_are_refused() {
    let mut tried = 0;
    for &(text, words) in REFUSED {
        let said = refusal(text);
        assert!(said.contains(words), "{text}: {said}");
        tried += 1;
    }
    assert_eq!(tried, 32);
    let uneven = POSES.replace("1500000002.0", "1500000002.5");
    let folder = Scratch::new("uneven");
    let file = folder.join("scene.toml");
    std::fs::write(&file, format!("{FLAT}{SMALL}{uneven}")).unwrap();
    let refused = sensel(&["run", &file, "--out", &folder.join("out")]);
    assert!(refused.code == 2 && refused.stderr.contains("control poses are evenly spaced"), "{}", refused.stderr);
}
