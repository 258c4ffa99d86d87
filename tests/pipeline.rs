//! The whole way on small pictures: what a run writes agrees with itself, with the packets it sent, and with the sensor's
//! equations.

#![allow(clippy::unwrap_used)]

use crate::common;

use std::path::Path;

use common::{SMALL, Scratch, nulls, run_box, sensel};
use glam::{DVec2, DVec3};
use sensel::draw::mix;
use sensel::files::euroc::{EurocReader, FrameEntry};
use sensel::files::picture;
use sensel::link;
use sensel::num::{f64_from_u64, f64_from_usize};
use sensel::pose::{TimedPose, parse_tum};
use serde_json::Value;

const FRAMES: u32 = 4;

/// Keys that programs read.
const KEYS: &[&str] = &[
    "version seed config_hash",
    "plan.kept plan.omitted plan.bias_e plan.sigma_e",
    "timing.line_time_us timing.frame_time_us timing.fps timing.latency_us timing.clocks_per_frame",
    "bandwidth.raw_bits_per_frame bandwidth.feature_bits_per_frame bandwidth.link_bits_per_s bandwidth.reduction",
    "energy.blocks energy.total_pj_per_frame energy.power_mw energy.pj_per_pixel features.median_tracked",
    "tracking.ate_m tracking.rpe_m tracking.jitter_frame_m tracking.jitter_d2_m tracking.prediction_error_m",
    "tracking.innovation_px tracking.tracked_fraction tracking.ms_per_frame",
    "hashes.photons hashes.codes hashes.features hashes.energy hashes.poses cost.render.ms_per_frame cost.tracker.ms_per_frame",
];

/// Those of them that two trajectories of four poses and their sigmas tell.
const FIGURES: &[&str] = &[
    "ate_m",
    "ate_sim3_m",
    "jitter_frame_m",
    "jitter_d2_m",
    "single_picture_sigma_m",
    "jitter_still_m",
    "still_steps_under_1um",
];

fn at<'a>(report: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(report, |value, key| value.get(key))
}

fn decoded(folder: &Scratch, camera: usize) -> Vec<link::Received> {
    let bytes = std::fs::read(folder.path().join(format!("out/cam{camera}.csi2"))).unwrap();
    let decoded = link::decode(&bytes);
    assert_eq!((decoded.counts.bytes_skipped, decoded.counts.cut_short, decoded.counts.frames_damaged), (0, 0, 0));
    decoded.frames
}

fn same_poses(left: &[TimedPose], right: &[TimedPose]) {
    assert_eq!(left.len(), right.len());
    for (left, right) in left.iter().zip(right) {
        // Both files carry nine decimals or more.
        let apart_m = (left.world_from_body.translation_m - right.world_from_body.translation_m).length();
        let turn = left.world_from_body.rotation.dot(right.world_from_body.rotation).abs();
        assert!(apart_m < 2e-9 && 1.0 - turn < 2e-9 && (left.t_s - right.t_s).abs() < 2e-9, "{left:?} {right:?}");
    }
}

/// The points of a PLY cloud, as its own header describes it.
fn points(path: &Path) -> Vec<DVec3> {
    let text = std::fs::read_to_string(path).unwrap();
    let (header, body) = text.split_once("end_header\n").unwrap();
    let count: usize = header.split_once("element vertex ").unwrap().1.lines().next().unwrap().parse().unwrap();
    let names: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property ")).collect();
    assert_eq!(names, ["double x", "double y", "double z", "uint landmark", "uint frames_found", "uint keyframes"]);
    let rows: Vec<Vec<f64>> =
        body.lines().map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
    assert!(rows.len() == count && rows.iter().all(|row| row.len() == 6));
    // Each has its own number, was found at least where it was made, and made by a keyframe.
    assert!(rows.windows(2).all(|pair| pair[0][3] < pair[1][3]) && rows.iter().all(|row| row[5] >= 1.0));
    rows.iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect()
}

/// The landmarks of `map.ply`, seen from the last pose of `keyframes.tum`, lie on the features of that frame.
fn the_map_is_what_the_features_show(out: &Path, reader: &EurocReader) {
    let landmarks = points(&out.join("map.ply"));
    let keyframes = parse_tum(&std::fs::read_to_string(out.join("keyframes.tum")).unwrap()).unwrap();
    let last = keyframes.last().unwrap();
    let camera = &reader.cameras()[0];
    let near_ns = |frame: &&FrameEntry| (f64_from_u64(frame.timestamp_ns) * 1e-9 - last.t_s).abs() < 1e-6;
    let stamp = camera.frames.iter().find(near_ns).unwrap().timestamp_ns;
    let table = std::fs::read_to_string(out.join(format!("features/cam0/{stamp}.csv"))).unwrap();
    let features: Vec<DVec2> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').take(2).map(|word| word.parse().unwrap()).collect::<Vec<f64>>())
        .map(|position| DVec2::new(position[0], position[1]))
        .collect();
    let world_from_camera = last.world_from_body.then(&camera.camera.body_from_camera);
    let shown = |landmark: &DVec3| camera.camera.lens.project(world_from_camera.inverse().point(*landmark));
    let positions: Vec<DVec2> = landmarks.iter().filter_map(shown).collect();
    // Half a pixel of noise and as much of the map: three sigma on each axis.
    let is_on = |position: &&DVec2| features.iter().any(|feature| feature.distance(**position) < 3.0);
    let on = positions.iter().filter(is_on).count();
    // By chance alone: features cover this share of the picture with discs of that radius.
    let by_chance = f64_from_usize(features.len()) * 9.0 * std::f64::consts::PI
        / f64::from(camera.camera.size.width_px * camera.camera.size.height_px);
    let share = f64_from_usize(on) / f64_from_usize(positions.len());
    assert!(
        positions.len() > 50 && share > 0.6 && by_chance < 0.2,
        "{on} of {}, {by_chance} by chance",
        positions.len()
    );
}

#[test]
fn a_run_writes_files_that_agree_with_each_other() {
    let folder = Scratch::new("pipeline");
    let report = run_box(&folder.join("out"), FRAMES, &["--keep", "packets,codes,features,depth,map"]);
    for key in KEYS.iter().flat_map(|line| line.split(' ')) {
        assert!(at(&report, key).is_some(), "{key} is missing");
    }
    let mut found = Vec::new();
    nulls(&report, "", &mut found);
    for path in &found {
        assert!(report["not_measurable"][path].is_string(), "{path} is null without a reason");
    }
    assert!(found.contains(&"tracking.rpe_m".to_owned()), "four frames are no second: {found:?}");
    assert_eq!(report["tracking"]["tracked_fraction"], 1.0);

    let reader = EurocReader::open(&folder.path().join("out")).unwrap();
    let mut packet_bytes = 0;
    for camera in [0, 1] {
        packet_bytes += std::fs::metadata(folder.path().join(format!("out/cam{camera}.csi2"))).unwrap().len();
        let frames = decoded(&folder, camera);
        assert_eq!(frames.len(), 4);
        for (index, (frame, entry)) in frames.iter().zip(&reader.cameras()[camera].frames).enumerate() {
            let kept = |stage: &str, end: &str| {
                folder.path().join(format!("out/{stage}/cam{camera}/{}.{end}", entry.timestamp_ns))
            };
            let (codes, _) = picture::read_grey(&kept("codes", "png")).unwrap();
            assert!(frame.picture.as_ref() == Some(&codes), "codes of camera {camera}, frame {index}");
            assert_eq!(frame.metadata.unwrap().timestamp_ns, entry.timestamp_ns);
            let table = std::fs::read_to_string(kept("features", "csv")).unwrap();
            let mut lines = table.lines();
            assert_eq!(lines.next(), Some("x,y,score,angle,octave,descriptor"));
            assert!(frame.features.len() > 100, "{} features", frame.features.len());
            for feature in &frame.features {
                let descriptor: String = feature.descriptor.iter().map(|byte| format!("{byte:02x}")).collect();
                let (x, y) = (feature.x_px(), feature.y_px());
                let row =
                    format!("{x},{y},{},{},{},{descriptor}", feature.score, feature.angle.to_bits(), feature.octave);
                assert_eq!(lines.next(), Some(row.as_str()));
            }
            assert_eq!(lines.next(), None, "no feature more than the packets held");
            // Eight bits are what EuRoC's pictures have: the codes' upper ones.
            let (shown, bits) = picture::read_grey(&entry.path).unwrap();
            let upper = codes.values().iter().map(|code| code >> 2);
            assert!(bits == 8 && shown.values().iter().copied().eq(upper), "frame {index}");
        }
    }
    let sent_bits = report["bandwidth"]["link_bits_per_s"].as_f64().unwrap()
        * report["timing"]["frame_time_us"].as_f64().unwrap()
        * f64::from(FRAMES)
        * 1e-6;
    let kept_bits = f64::from(u32::try_from(8 * packet_bytes).unwrap());
    assert!((sent_bits / kept_bits - 1.0).abs() < 1e-9, "{sent_bits} bits reported, {kept_bits} bits kept");

    let truth = parse_tum(&std::fs::read_to_string(folder.path().join("out/trajectory_gt.tum")).unwrap()).unwrap();
    assert_eq!(truth.len(), 4);
    same_poses(reader.ground_truth().unwrap(), &truth);

    the_map_is_what_the_features_show(&folder.path().join("out"), &reader);

    let (out, cloud) = (folder.join("again.tum"), folder.join("again.ply"));
    let tracked = sensel(&["track", &folder.join("out"), "--out", &out, "--map", &cloud, "--json"]).json();
    assert!(points(Path::new(&cloud)).len() > 50);
    assert_eq!((&tracked["frames"], &tracked["tracked"]), (&4.into(), &4.into()));
    assert_eq!(parse_tum(&std::fs::read_to_string(out).unwrap()).unwrap().len(), 4);
}

/// What the tracker makes of the packets that a run kept is what it made of them during the run: rows of a rolling shutter at their own
/// times, damaged packets, pictures without features. Calibration and readings went through EuRoC's text.
#[test]
fn packets_that_a_run_kept_give_its_own_poses_again() {
    let rolling = ["sensor.readout.shutter=rolling", "link.bit_error_rate=1e-5", "motion.kind=walk"];
    let frames = ["link.mode=frames", "link.line_sync=true", "link.bit_error_rate=1e-6"];
    for (name, set) in [("rolling", rolling), ("frames", frames)] {
        let folder = Scratch::new(name);
        let more: Vec<&str> = set
            .iter()
            .flat_map(|key| ["--set", key])
            .chain(["--keep", "packets", "--set", "scene.bake=direct"])
            .collect();
        let report = run_box(&folder.join("out"), 5, &more);
        let est = folder.join("again.tum");
        let tracked = sensel(&["track", &folder.join("out"), "--out", &est, "--json"]).json();
        assert_eq!(tracked["from"], "packets", "{name}");
        let poses = |path: &Path| parse_tum(&std::fs::read_to_string(path).unwrap()).unwrap();
        let run = poses(&folder.path().join("out/trajectory_est.tum"));
        assert!(run.len() >= 4, "{name}: {} poses", run.len());
        same_poses(&poses(Path::new(&est)), &run);
        // The host's counts are the run's own.
        for key in ["packets", "headers_corrected", "payloads_refused", "frames_damaged", "rows_lost"] {
            assert_eq!(tracked["link"][key], report["link"][key], "{name}: {key}");
        }
        // So are the figures, as far as nine decimals of the poses go: 0.5 nm a coordinate, which a difference of three has four times.
        for key in FIGURES {
            let (own, again) = (report["tracking"][key].as_f64(), tracked[key].as_f64());
            let apart = own.zip(again).map(|(own, again)| (own - again).abs());
            assert!(apart.is_some_and(|apart| apart < 4e-9), "{name}: {key} is {own:?} and {again:?}");
        }
        assert_eq!(
            (&tracked["rpe_m"], &report["tracking"]["rpe_m"]),
            (&Value::Null, &Value::Null),
            "less than a second"
        );
        let damaged = tracked["link"]["payloads_refused"].as_u64().unwrap();
        assert!(damaged > 0, "{name}: no payload was refused");
        let without_times = |events: &Value| {
            let mut events = events.clone();
            events.as_array_mut().unwrap().iter_mut().for_each(|event| event["t_s"] = Value::Null);
            events
        };
        assert_eq!(without_times(&tracked["events"]), without_times(&report["tracking"]["events"]), "{name}");

        // From pictures the rows have no times, so the rolling path is another one.
        let seen = folder.join("seen.tum");
        let pictures = sensel(&["track", &folder.join("out"), "--from", "pictures", "--out", &seen, "--json"]).json();
        assert_eq!((&pictures["from"], &pictures["link"]), (&"pictures".into(), &Value::Null));
        if name == "rolling" {
            let pairs = poses(Path::new(&seen)).into_iter().zip(&run);
            let apart = |(a, b): (TimedPose, &TimedPose)| {
                a.world_from_body.translation_m.distance(b.world_from_body.translation_m)
            };
            assert!(pairs.map(apart).fold(0.0, f64::max) > 1e-5, "rows' times do nothing");
        }
    }
}

/// The second frame has no partner, and the last two are dark: events count the frames of the first camera.
#[test]
fn a_track_names_the_frame_and_the_reason_of_a_loss() {
    let folder = Scratch::new("dark");
    let out = folder.join("out");
    run_box(&out, 5, &["--set", "scene.bake=direct"]);
    for camera in ["cam0", "cam1"] {
        let camera = folder.path().join("out/mav0").join(camera);
        let table = std::fs::read_to_string(camera.join("data.csv")).unwrap();
        let rows: Vec<&str> = table.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(rows.len(), 5);
        for row in &rows[3..] {
            let path = camera.join("data").join(row.split_once(',').unwrap().1);
            let (width, height) = image::image_dimensions(&path).unwrap();
            image::GrayImage::new(width, height).save(&path).unwrap();
        }
        if camera.ends_with("cam1") {
            let left: Vec<&str> = table.lines().filter(|line| *line != rows[1]).collect();
            std::fs::write(camera.join("data.csv"), left.join("\n") + "\n").unwrap();
        }
    }
    let reason = "no credible pose, neither near the prediction nor by descriptors";
    let [json, text] = ["json.tum", "text.tum"].map(|name| folder.join(name));
    let tracked = sensel(&["track", &out, "--from", "pictures", "--out", &json, "--json"]).json();
    let events = tracked["events"].as_array().unwrap();
    let found: Vec<_> = events.iter().map(|event| [&event["frame"], &event["event"], &event["reason"]]).collect();
    let expected = [(0, "initialised", Value::Null), (3, "lost", reason.into())];
    assert_eq!(found.len(), 2, "{tracked}");
    for (found, (frame, event, reason)) in found.iter().zip(&expected) {
        assert_eq!(found, &[&Value::from(*frame), &Value::from(*event), reason]);
    }
    assert_eq!((&tracked["frames"], &tracked["tracked"]), (&4.into(), &2.into()));
    let warned = tracked["warnings"].to_string();
    assert!(warned.contains("1 of 5 pictures of a camera have no partner"), "{warned}");
    // An IMU without readings is said, and no reason to fail.
    let readings = folder.path().join("out/mav0/imu0/data.csv");
    let head = std::fs::read_to_string(&readings).unwrap().lines().next().unwrap().to_owned() + "\n";
    std::fs::write(&readings, head).unwrap();
    let again = folder.join("again.tum");
    let without = sensel(&["track", &out, "--from", "pictures", "--out", &again, "--json"]).json();
    assert!(without["warnings"].to_string().contains("IMU has no readings"), "{}", without["warnings"]);
    let text = sensel(&["track", &out, "--from", "pictures", "--out", &text]).stdout;
    assert!(text.contains(&format!(", frame 3: lost ({reason})\n")), "{text}");
}

#[test]
fn packets_are_not_asked_for_another_extractor() {
    let folder = Scratch::new("asked");
    run_box(&folder.join("out"), 1, &["--keep", "packets", "--set", "scene.bake=direct"]);
    let (out, est) = (folder.join("out"), folder.join("est.tum"));
    let another = ["track", &out, "--out", &est, "--set", "compute.threshold=9"];
    let refused = sensel(&[&another[..], &["--from", "packets"]].concat());
    assert_eq!(refused.code, 2);
    assert!(
        refused.stderr.contains("compute.threshold") && refused.stderr.contains("--from pictures"),
        "{}",
        refused.stderr
    );
    assert_eq!(sensel(&[&another[..], &["--json"]].concat()).json()["from"], "pictures");
    // A camera whose packets are gone.
    std::fs::remove_file(folder.path().join("out/cam1.csi2")).unwrap();
    std::fs::remove_file(&est).unwrap();
    let missing = sensel(&["track", &out, "--out", &est, "--from", "packets"]);
    assert!(missing.code == 4 && missing.stderr.contains("cam1.csi2"), "{}", missing.stderr);
    assert_eq!(sensel(&["track", &out, "--out", &est, "--json"]).json()["from"], "pictures");
}

/// A flat target of known light through an ideal chain: photons of the render's own count (its plane is tested in optics) are not
/// needed, because light is proportional to lux: with twice the light the mean code above black doubles. The absolute
/// level: E = pi L T / (1 + 4 N^2) with L = rho lux / pi, 10,880 photons per lux s um^2 of D65, QE 0.6 and fill factor 0.9,
/// 10 uV/e-, 110 mV over 1024 codes.
#[test]
fn a_flat_target_gives_the_code_that_its_light_calls_for() {
    let folder = Scratch::new("flat");
    let file = folder.join("flat.toml");
    std::fs::write(&file, "[scene]\ntarget = \"flat\"\n[optics]\nroll_off = \"none\"\n").unwrap();
    for lux in [100.0, 400.0] {
        let light = format!("scene.illuminance_lux={lux:.1}");
        let more = ["--set", &light, "--frames", "2", "--out", &folder.join("out"), "--json"];
        let report = sensel(&[&["run", &file][..], &SMALL, &more].concat()).json();
        let exposure_s = report["scenario"]["exposure_us"].as_f64().unwrap() * 1e-6;
        let photons = 10_880.0 * 9.0 * lux * exposure_s * 0.18 * 0.9 / (1.0 + 4.0 * 4.0);
        let signal_e = photons * 0.6 * 0.9;
        let expected = 64.0 + signal_e * 10.0 / (110_000.0 / 1024.0);
        let mean = report["frames"][0]["mean_code_dn"].as_f64().unwrap();
        // Both conversions count from the edge below, so the half steps cancel in their difference. Means over 320 columns whose
        // offsets (2 e-) and gains (0.1 %) are one draw of a die, over 76,800 pixels with PRNU 1 %, read noise 10 e- and
        // shot noise; two cameras share the die's numbers at worst.
        let pixels = 76_800.0_f64;
        let columns_e = (4.0 + (1e-3 * signal_e) * (1e-3 * signal_e)) / 320.0;
        let own_e = (signal_e + 100.0 + (0.01 * signal_e) * (0.01 * signal_e)) / pixels;
        let se_dn = (columns_e + own_e).sqrt() * 10.0 / (110_000.0 / 1024.0);
        // The luminous constant is stated to four digits.
        let constant_dn = (expected - 64.0) * 5e-5;
        let error_dn = mean - expected;
        assert!(error_dn.abs() < 4.0 * se_dn + constant_dn, "{lux} lux: {mean} DN for {expected}, SE {se_dn}");
    }
}

/// Small runs whose bytes are kept: name, arguments, and the least frames that have a pose. Each has what the others have
/// not: a room of code
/// with all bounces; photographs on its walls; a long room with windows; sun and sky over a walk; a still target, whose edge no map can be
/// made of, behind a colour mosaic and a rolling shutter; and a file's own lamps, seen by one camera.
const GOLDEN: [(&str, &str, u64); 6] = [
    ("box", "--frames 6", 4),
    ("photo_box", "--frames 6 --set scene.bake=direct", 4),
    ("hall", "--frames 4 --set scene.bake=sketch", 3),
    ("street", "--frames 4 --set scene.bake=sketch", 0),
    ("slanted_edge", "--frames 2 --set sensor.preset=rggb_rolling", 0),
    ("bathroom", "--frames 4 --set scene.bake=sketch --set rig.baseline_mm=0.0", 0),
];

/// The bytes of small runs. They may change only with a change that is meant to change them; it is a breaking change for everybody who
/// compares runs, so it says so in CHANGELOG.md. `SENSEL_GOLDEN=write cargo test --test all bytes_of_small_runs` writes them anew.
#[test]
fn the_bytes_of_small_runs_of_six_scenes_stay_what_they_are() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/hashes.json");
    let writes = std::env::var("SENSEL_GOLDEN").is_ok_and(|word| word == "write");
    let mut found = serde_json::Map::new();
    for (scene, arguments, tracked_least) in GOLDEN {
        let folder = Scratch::new("golden");
        let out = folder.join("out");
        let arguments = arguments.split(' ').chain(["--seed", "42", "--out", &out, "--json"]);
        let report = sensel(&["run", scene].into_iter().chain(SMALL).chain(arguments).collect::<Vec<_>>()).json();
        let frames = report["frames"].as_array().unwrap();
        let tracked = std::fs::read_to_string(folder.path().join("out/trajectory_est.tum")).unwrap();
        let tracked = u64::try_from(parse_tum(&tracked).map_or(0, |poses| poses.len())).unwrap();
        assert!(tracked >= tracked_least, "{scene}: {tracked} poses of {} frames", frames.len());
        let has_pose =
            |frame: &&Value| ["initialised", "tracked", "relocalised"].iter().any(|&with| frame["status"] == with);
        assert_eq!(frames.iter().filter(has_pose).count(), usize::try_from(tracked).unwrap(), "{scene}");
        // One threshold a camera; the last of all stands in `features` too.
        let cameras = report["scenario"]["cameras"].as_u64().unwrap();
        let thresholds = |frame: &Value| frame["thresholds"].as_array().unwrap().clone();
        assert!(frames.iter().all(|frame| thresholds(frame).len() as u64 == cameras), "{scene}");
        assert_eq!(thresholds(frames.last().unwrap()).last(), Some(&report["features"]["threshold"]), "{scene}");
        found.insert(scene.to_owned(), report["hashes"].clone());
    }
    let found = Value::Object(found);
    if writes {
        std::fs::create_dir_all(Path::new(file).parent().unwrap()).unwrap();
        std::fs::write(file, serde_json::to_string_pretty(&found).unwrap() + "\n").unwrap();
        return;
    }
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    for (scene, ..) in GOLDEN {
        for stage in ["photons", "codes", "features", "energy", "poses"] {
            assert_eq!(found[scene][stage], golden[scene][stage], "{scene}: {stage}");
        }
    }
}

/// Damage that a link or a recorder does: bits, a late start, doubled, inserted and lost bytes. The host's times rise through all of it.
#[test]
fn damaged_packets_are_tracked_in_rising_time() {
    const SEED: u64 = 3;
    let folder = Scratch::new("damaged");
    let small =
        ["--keep", "packets", "--set", "scene.bake=direct", "--set", "sensor.width=160", "--set", "sensor.height=120"];
    run_box(&folder.join("out"), 12, &small);
    let names = ["cam0.csi2", "cam1.csi2"];
    let sent = names.map(|name| std::fs::read(folder.path().join("out").join(name)).unwrap());
    let (mut poses, mut damaged) = (0, 0);
    for case in 0..60_u64 {
        for (camera, (name, sent)) in (0..).zip(names.into_iter().zip(&sent)) {
            let draw = |of: u64| usize::try_from(mix(SEED ^ mix(case << 32 | camera << 24 | of)) >> 16).unwrap();
            let mut bytes = sent.clone();
            let rate = [0, 0, 2_000, 500, 100][draw(0) % 5];
            for flip in 0..(8 * bytes.len()).checked_div(rate).unwrap_or(0) {
                let at = draw(1_000 + u64::try_from(flip).unwrap()) % (8 * bytes.len());
                bytes[at / 8] ^= 1 << (at % 8);
            }
            let start = draw(1) % bytes.len();
            let length = draw(2) % (bytes.len() / 3);
            let end = (start + length).min(bytes.len());
            match draw(3) % 5 {
                0 => drop(bytes.drain(..length)),
                1 => drop(bytes.splice(start..start, bytes[start..end].to_vec())),
                2 => drop(
                    bytes
                        .splice(start..start, (0..length % 500).map(|byte| byte.to_le_bytes()[0]).collect::<Vec<u8>>()),
                ),
                3 => drop(bytes.drain(start..end)),
                _ => {}
            }
            std::fs::write(folder.path().join("out").join(name), bytes).unwrap();
        }
        let est = folder.join("est.tum");
        let _ = std::fs::remove_file(&est);
        let tracked = sensel(&["track", &folder.join("out"), "--from", "packets", "--out", &est, "--json"]);
        assert_eq!(tracked.code, 0, "seed {SEED}, case {case}: {}", tracked.stderr);
        let found = parse_tum(&std::fs::read_to_string(&est).unwrap()).unwrap();
        assert!(found.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "seed {SEED}, case {case}");
        poses += found.len();
        damaged += u32::from(tracked.json()["link"]["frames_damaged"].as_u64().unwrap() > 0);
    }
    println!("seed {SEED}: {poses} poses, {damaged} streams with damage");
    assert!(poses > 100 && damaged > 40);
}
