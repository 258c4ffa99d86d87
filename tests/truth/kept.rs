//! `run --keep` as a user meets it: every file read back by another reader where there is one, and held against the others.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use sensel::config::Resolved;
use sensel::num::{f64_from_u64, f64_from_usize, index};
use sensel::picture::from_exr;
use sensel::plane::Plane;
use sensel::pose::{Pose, parse_tum};
use sensel::run::{NoClock, NoFiles, NoProgress, Session, Setup};
use sensel::units::FrameIndex;
use serde_json::Value;

use super::common::{Scratch, names, sensel};

const KINDS: [&str; 9] =
    ["photons", "electrons", "codes", "colour", "poses", "depth", "normals", "materials", "features"];

fn channels(path: &Path) -> Vec<(String, Plane<f32>)> {
    let found = from_exr("kept", &std::fs::read(path).unwrap()).unwrap();
    found.into_iter().map(|channel| (channel.name, channel.plane)).collect()
}

fn channel(path: &Path, name: &str) -> Plane<f32> {
    let found = channels(path);
    found.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("{path:?} has no {name}")).1.clone()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The time stamps of a camera's pictures, as `mav0` names them.
fn stamps(out: &Path) -> Vec<u64> {
    let mut stamps: Vec<u64> =
        names(&out.join("mav0/cam0/data")).iter().map(|name| name.trim_end_matches(".png").parse().unwrap()).collect();
    stamps.sort_unstable();
    stamps
}

/// What the mosaic lets through of the full colour is the mosaic's own picture.
fn check_colour(out: &Path, stamp: u64) {
    let meaning = &json(&out.join("ground_truth.json"))["kept"]["colour"]["exr"];
    let pattern: Vec<Vec<char>> =
        meaning["filters"].as_array().unwrap().iter().map(|row| row.as_str().unwrap().chars().collect()).collect();
    assert_eq!((pattern.len(), pattern[0].len()), (2, 2));
    let photons = channel(&out.join(format!("photons/cam0/{stamp}.exr")), "Y");
    let colour = channels(&out.join(format!("colour/cam0/{stamp}.exr")));
    let mut bands: Vec<&str> = colour.iter().map(|(name, _)| name.as_str()).collect();
    bands.sort_unstable();
    assert_eq!(bands, ["B", "G", "NIR", "R"]);
    for y in 0..photons.height_px() {
        for x in 0..photons.width_px() {
            let letter = pattern[y % 2][x % 2].to_string();
            let passed = &meaning["transmission_by_filter"][&letter];
            let sum: f64 = ["R", "G", "B", "NIR"]
                .iter()
                .enumerate()
                .map(|(band, name)| {
                    let (_, plane) = colour.iter().find(|(known, _)| known == name).unwrap();
                    passed[band].as_f64().unwrap() * f64::from(plane.at(x, y))
                })
                .sum();
            let mosaic = f64::from(photons.at(x, y));
            // Four samples, each a product and a sum of four bands, and their mean: some thirty roundings of 2^-24.
            assert!((mosaic / sum - 1.0).abs() < 30.0 * 6e-8, "{x} {y}: {mosaic} for {sum}");
        }
    }
}

/// PNG pictures read by the `image` crate say what the EXR pictures say, within their steps.
fn check_steps(out: &Path, stamp: u64, has_next: bool) {
    let png = |kind: &str| image::open(out.join(format!("{kind}/cam1/{stamp}.png")));
    let exr = |kind: &str, name: &str| channel(&out.join(format!("{kind}/cam1/{stamp}.exr")), name);
    let (depth, z_m, range_m) = (png("depth").unwrap().into_luma16(), exr("depth", "Z"), exr("depth", "range"));
    let (mut near, mut units) = (0, 0);
    for ((steps, &z_m), &range_m) in depth.as_raw().iter().zip(z_m.values()).zip(range_m.values()) {
        // Half a step of 0.2 mm, and a rounding of f32 at 6 m.
        assert!((f64::from(*steps) / 5000.0 - f64::from(z_m)).abs() < 1.01e-4, "{steps} {z_m}");
        assert!(range_m >= z_m);
        near += 1;
    }
    let normal = ["X", "Y", "Z"].map(|axis| exr("normals", &format!("normal.{axis}")));
    for at in 0..near {
        let normal = DVec3::from_array([0, 1, 2].map(|axis| f64::from(normal[axis].values()[at])));
        // Three roundings to f32.
        assert!((normal.length() - 1.0).abs() < 2e-7);
        units += 1;
    }
    assert_eq!((near, units), (160 * 120, 160 * 120));
    assert_eq!(png("flow").is_ok(), has_next, "the last frame has no next one");
    if !has_next {
        assert!(png("visibility").is_err());
        return;
    }
    let (flow, u_px, v_px) = (png("flow").unwrap().into_rgb16(), exr("flow", "forward.u"), exr("flow", "forward.v"));
    let seen = png("visibility").unwrap().into_luma8();
    let (mut moved, mut visible) = (0, 0);
    for (at, pixel) in flow.pixels().enumerate() {
        let exact_px = [u_px.values()[at], v_px.values()[at]].map(f64::from);
        assert_eq!(pixel.0[2], 1);
        for axis in 0..2 {
            // Half a step of 1/64 px.
            let shown_px = (f64::from(pixel.0[axis]) - 32_768.0) / 64.0;
            assert!((shown_px - exact_px[axis]).abs() <= 0.5 / 64.0, "{at}: {shown_px} for {}", exact_px[axis]);
        }
        moved += usize::from(libm::hypot(exact_px[0], exact_px[1]) > 0.05);
        visible += usize::from(seen.as_raw()[at] == 1);
    }
    assert!(moved > 5_000 && visible > 15_000, "{moved} moved, {visible} visible");
}

/// The folder of the TUM benchmark, by its own conventions.
fn check_tum(out: &Path, stamps: &[u64]) {
    let tum = out.join("tum");
    let text = |name: &str| std::fs::read_to_string(tum.join(name)).unwrap();
    let truth = parse_tum(&text("groundtruth.txt")).unwrap();
    let body = parse_tum(&std::fs::read_to_string(out.join("trajectory_gt.tum")).unwrap()).unwrap();
    let rig: Vec<f64> = calibration(&out.join("mav0/cam0/sensor.yaml"));
    assert_eq!(truth.len(), stamps.len());
    for (pose, body) in truth.iter().zip(&body) {
        let position_m = body.world_from_body.point(DVec3::new(rig[3], rig[7], rig[11]));
        // Both files have twelve decimals.
        assert!((pose.world_from_body.translation_m - position_m).length() < 1e-11);
    }
    let lines: Vec<String> = text("associations.txt").lines().map(str::to_owned).collect();
    assert_eq!(lines.len(), stamps.len());
    for (line, &stamp) in lines.iter().zip(stamps) {
        let [t, rgb, t_depth, depth] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
        assert!(t == t_depth && text("rgb.txt").contains(&format!("{t} {rgb}\n")) && text("depth.txt").contains(depth));
        assert!((t.parse::<f64>().unwrap() - f64_from_u64(stamp) * 1e-9).abs() < 1e-10, "{t}");
        let picture = image::open(tum.join(rgb)).unwrap().into_luma8();
        let asl = image::open(out.join(format!("mav0/cam0/data/{stamp}.png"))).unwrap().into_luma8();
        assert!(picture == asl, "both folders show the same eight bits");
        let kept = image::open(out.join(format!("depth/cam0/{stamp}.png"))).unwrap().into_luma16();
        assert!(image::open(tum.join(depth)).unwrap().into_luma16() == kept);
    }
    let readings = text("accelerometer.txt");
    let rows: Vec<&str> = readings.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(rows.len() > 10 && rows.iter().all(|row| row.split(' ').count() == 4), "{} readings", rows.len());
}

/// `T_BS` of a `sensor.yaml`, row by row.
fn calibration(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let (_, list) = text.split_once("data: [").unwrap();
    let (list, _) = list.split_once(']').unwrap();
    list.split(',').map(|number| number.trim().parse().unwrap()).collect()
}

#[test]
fn every_kind_is_written_for_every_frame_and_says_what_the_others_say() {
    let folder = Scratch::new("kept");
    let out = PathBuf::from(folder.join("out"));
    let all =
        "packets,photons,electrons,codes,features,colour,poses,depth,normals,materials,flow,visibility,stereo,tum";
    let words = ["run", "box", "--frames", "3", "--quiet", "--keep", all, "--out", &folder.join("out")];
    let sets = [
        "sensor.preset='rggb_rolling'",
        "sensor.width=160",
        "sensor.height=120",
        "sensor.pixel.pitch_um=8.0",
        "sensor.pixel.qe_by_filter.R=[0.5,0.12,0.04,0.2]",
        "optics.infrared_transmission=0.5",
        // Rays to a target go elsewhere in each band; a fixed count takes the same rays.
        "run.samples_per_pixel=4",
    ];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let outcome = sensel(&[&words[..], &sets].concat());
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let stamps = stamps(&out);
    assert_eq!(stamps.len(), 3);
    for kind in KINDS {
        for camera in ["cam0", "cam1"] {
            let mut found: Vec<u64> = names(&out.join(kind).join(camera))
                .iter()
                .filter_map(|name| name.split('.').next()?.parse().ok())
                .collect();
            found.sort_unstable();
            found.dedup();
            assert_eq!(found, stamps, "{kind} of {camera}");
        }
    }
    let kept = json(&out.join("ground_truth.json"));
    assert_eq!(kept["kept"].as_object().unwrap().len(), 14);
    assert_eq!(kept["kept"]["codes"]["png"]["bits"], 10);
    let materials = kept["kept"]["materials"]["png"]["names_from_1"].as_array().unwrap().len();
    for (number, &stamp) in stamps.iter().enumerate() {
        check_colour(&out, stamp);
        check_steps(&out, stamp, number < 2);
        let shown = image::open(out.join(format!("materials/cam0/{stamp}.png"))).unwrap().into_luma16();
        assert!(shown.as_raw().iter().all(|&number| number >= 1 && usize::from(number) <= materials));
        // The right camera stands 65 mm to the right: what both see lies further left there, by f b / z.
        let pair = out.join(format!("stereo/cam0_to_cam1/{stamp}"));
        let (dx_px, z_m) = (
            channel(&pair.with_extension("exr"), "disparity.x"),
            channel(&out.join(format!("depth/cam0/{stamp}.exr")), "Z"),
        );
        let seen = image::open(pair.with_extension("png")).unwrap().into_luma8();
        let visible = seen.as_raw().iter().filter(|&&code| code == 1).count();
        assert!(visible > 14_000 && seen.as_raw().iter().all(|&code| code <= 3), "{visible} visible");
        let ratio = f64::from(dx_px.at(80, 60) * z_m.at(80, 60)) / -0.065;
        // Some 80 px of focal length (90 degrees over 160 px, and its distortion).
        assert!((70.0..100.0).contains(&ratio), "{ratio}");
    }
    check_tum(&out, &stamps);
}

/// A rolling shutter that sways before an even target: nothing to bake.
const FLAT: &str = "[scene]\ntarget = \"flat\"\nreflectance = 0.5\nilluminance_lux = 300.0\n[motion]\nkind = \"sway\"\n\
    [run]\nframes = 2\n[sensor]\npreset = \"paper_6t_vga\"\nwidth = 96\nheight = 64\n[sensor.readout]\nshutter = \"rolling\"\n";

#[test]
fn rows_have_the_poses_of_the_motion_at_the_middle_of_their_exposure() {
    let folder = Scratch::new("poses");
    let scenario = folder.join("flat.toml");
    std::fs::write(&scenario, FLAT).unwrap();
    let out = PathBuf::from(folder.join("out"));
    let outcome = sensel(&["run", &scenario, "--quiet", "--keep", "poses,photons", "--out", &folder.join("out")]);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let resolved = Resolved::from_layers("flat.toml", FLAT, &[]).unwrap();
    let mut session = Session::new(Setup::new(resolved, &NoFiles, &NoProgress).unwrap()).unwrap();
    let mut tried = 0;
    for number in 0..2 {
        let frame = session.step(&NoClock).unwrap();
        let setup = session.setup();
        let stamp = stamps(&out)[number];
        let photons = channel(&out.join(format!("photons/cam1/{stamp}.exr")), "Y");
        assert!(photons == *frame.cameras[1].photons, "kept photons are the run's, bit for bit");
        let table = std::fs::read_to_string(out.join(format!("poses/cam1/{stamp}.csv"))).unwrap();
        let mut lines = table.lines();
        assert_eq!(lines.next(), Some("row,t_s,px_m,py_m,pz_m,qx,qy,qz,qw"));
        let line_s = setup.sensor.schedule.line_time_s();
        for (row, line) in lines.enumerate() {
            let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            let [at, t_s, px, py, pz, qx, qy, qz, qw] = fields[..] else { panic!("{line}") };
            // The frame's time is the middle of the first row's start and the last row's end, and rows follow line by line.
            let expected_s = frame.t_s + (f64_from_usize(row) - 31.5) * line_s;
            // The frame's time is rounded to a nanosecond.
            assert!(
                at == f64_from_usize(row) && (t_s - expected_s).abs() < 0.6e-9,
                "row {row}: {t_s} for {expected_s}"
            );
            let pose = setup.motion.world_from_body(t_s).unwrap().then(&setup.cameras[1].body_from_camera);
            assert_eq!(Pose::new(DQuat::from_xyzw(qx, qy, qz, qw), DVec3::new(px, py, pz)), pose, "row {row}");
            tried += 1;
        }
        let next = FrameIndex(frame.frame.0 + 1);
        assert!(session.row_times_s(next, 0)[0] > session.row_times_s(frame.frame, 0)[63]);
    }
    assert_eq!(tried, 2 * 64);
}

#[test]
fn kept_electrons_are_those_that_the_codes_are_made_of() {
    // Without any noise behind the charge a code follows from its electrons: e g over the converter's step, above the black level.
    let mut counted = 0;
    let others = sensel::effects::names().into_iter().filter(|name| *name != "shot_noise");
    let shot_alone =
        others.map(|name| format!("-{name}")).chain(["+shot_noise".to_owned()]).collect::<Vec<_>>().join(",");
    for (effects, whole) in [("none", false), (shot_alone.as_str(), true)] {
        let resolved = Resolved::from_layers("flat.toml", FLAT, &[format!("run.effects='{effects}'")]).unwrap();
        let mut session = Session::new(Setup::new(resolved, &NoFiles, &NoProgress).unwrap()).unwrap();
        assert!(session.step(&NoClock).unwrap().cameras[0].electrons.is_none(), "only where asked for");
        session.keep_electrons();
        let frame = session.step(&NoClock).unwrap();
        let parameters = &session.setup().sensor.parameters;
        let (pixel, adc) = (&parameters.pixel, &parameters.adc);
        let efficiency = pixel.quantum_efficiency * pixel.fill_factor;
        let lsb_e = adc.full_scale_uv / f64::from(1_u32 << adc.bits) / pixel.conversion_gain_uv_per_e;
        for camera in &frame.cameras {
            let electrons = camera.electrons.as_ref().unwrap();
            let mut squares = 0.0;
            for ((&e, &photons), &code) in
                electrons.values().iter().zip(camera.photons.values()).zip(camera.codes.values())
            {
                let (e, mean_e) = (f64::from(e), f64::from(photons) * efficiency);
                let code_dn = e / lsb_e + f64::from(adc.black_level_dn);
                // A whole step from the floor, and the middle of the reset ramp that digital CDS takes away.
                assert!((f64::from(code) - code_dn).abs() <= 1.0, "{code} for {e} e-");
                if whole {
                    assert_eq!(e.fract(), 0.0);
                    squares += (e - mean_e) * (e - mean_e) / mean_e;
                } else {
                    // Three roundings of f32.
                    assert!((e / mean_e - 1.0).abs() < 2e-7, "{e} for {mean_e}");
                }
                counted += 1;
            }
            if whole {
                let ratio = squares / f64_from_usize(index(96) * 64);
                // The variance of 6,144 Poisson counts over their mean has a standard error of sqrt(2 / 6144) = 0.018: 4 of them.
                assert!((ratio - 1.0).abs() < 0.072, "{ratio}");
            }
        }
    }
    assert_eq!(counted, 2 * 2 * 96 * 64);
}

#[test]
fn what_cannot_be_kept_is_refused_with_what_can() {
    let folder = Scratch::new("unkept");
    let out = folder.join("out");
    let refused = |words: &[&str], named: &str| {
        let outcome = sensel(&[&["run", "box", "--frames", "1", "--out", &out][..], words].concat());
        assert!(outcome.code == 2 && outcome.stderr.contains(named), "{outcome:?}");
        assert!(!Path::new(&out).exists());
        assert!(outcome.stderr.contains("photons, electrons, codes"), "{}", outcome.stderr);
    };
    refused(&["--keep", "photons,optical_flow"], "'optical_flow' is not known");
    let one = ["--set", "rig.baseline_mm=0.0", "--set", "sensor.width=64", "--set", "sensor.height=48"];
    refused(&[&["--keep", "stereo"][..], &one].concat(), "stage to keep of one camera 'stereo'");
}
