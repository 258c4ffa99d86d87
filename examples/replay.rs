//! Private experiment: features out of packets, tracker over them.
use sensel::compute::{self, ExtractorParams, Feature};
use sensel::link;
use sensel::pose::{Pose, TimedPose};
use sensel::report::trajectory_figures;
use sensel::tracker::{CameraCalibration, FrameInput, RowClock, Tracker, TrackerParams};
use std::io::{Read, Write};

fn dump(folder: &str, out: &str) {
    let mut streams: Vec<std::fs::File> =
        (0..2).map(|c| std::fs::File::open(format!("{folder}/cam{c}.csi2")).unwrap()).collect();
    let mut out = std::io::BufWriter::new(std::fs::File::create(out).unwrap());
    let mut rest: Vec<Vec<u8>> = vec![Vec::new(); 2];
    let reextract = std::env::var("REEXTRACT").is_ok();
    let params = ExtractorParams { threshold: 12, top_k: Some(500), cell_px: 32, subpixel: true };
    let mut count = 0;
    loop {
        let mut frames = Vec::new();
        for c in 0..2 {
            while rest[c].len() < 8_000_000 {
                let mut chunk = vec![0; 8_000_000];
                let n = streams[c].read(&mut chunk).unwrap();
                if n == 0 {
                    break;
                }
                rest[c].extend_from_slice(&chunk[..n]);
            }
            // one frame: find size by decoding a prefix
            let size = 406_452.min(rest[c].len());
            let _ = size;
            let mut decoded = link::decode(&rest[c][..rest[c].len().min(900_000)]);
            if decoded.frames.is_empty() {
                frames.clear();
                break;
            }
            let frame = decoded.frames.remove(0);
            frames.push(frame);
        }
        if frames.len() < 2 || !frames.iter().all(|f| f.whole) {
            break;
        }
        for (c, frame) in frames.iter().enumerate() {
            let m = frame.metadata.unwrap();
            let features: Vec<Feature> = if reextract {
                compute::extract(frame.picture.as_ref().unwrap(), 10, &params, &mut Default::default())
            } else {
                frame.features.clone()
            };
            out.write_all(&m.timestamp_ns.to_le_bytes()).unwrap();
            out.write_all(&m.row_time_ns.to_le_bytes()).unwrap();
            out.write_all(&(features.len() as u32).to_le_bytes()).unwrap();
            for f in &features {
                out.write_all(&f.x_q4.to_le_bytes()).unwrap();
                out.write_all(&f.y_q4.to_le_bytes()).unwrap();
                out.write_all(&[f.score as u8, f.angle, f.octave]).unwrap();
                out.write_all(&f.descriptor).unwrap();
            }
            // bytes of this frame: search next frame start: packets are constant unless features differ
            let bytes = frame_bytes(&rest[c]);
            rest[c].drain(..bytes);
        }
        count += 1;
    }
    println!("{count} frames dumped");
}

fn frame_bytes(bytes: &[u8]) -> usize {
    // walk packets until a frame end (data type 1)
    let mut at = 0;
    loop {
        let dt = bytes[at] & 0x3f;
        let count = usize::from(bytes[at + 1]) | usize::from(bytes[at + 2]) << 8;
        at += if dt < 0x10 { 4 } else { 4 + count + 2 };
        if dt == 1 {
            return at;
        }
    }
}

fn load(file: &str) -> Vec<FrameInput> {
    let bytes = std::fs::read(file).unwrap();
    let mut at = 0;
    let mut take = |n: usize| {
        let s = bytes[at..at + n].to_vec();
        at += n;
        s
    };
    let mut inputs = Vec::new();
    let total = bytes.len();
    let mut used = 0;
    while used < total {
        let mut input = FrameInput { t_s: 0.0, features: Vec::new(), clocks: Vec::new() };
        for c in 0..2 {
            let t = u64::from_le_bytes(take(8).try_into().unwrap());
            let row = u32::from_le_bytes(take(4).try_into().unwrap());
            let n = u32::from_le_bytes(take(4).try_into().unwrap());
            used += 16 + n as usize * 39;
            if c == 0 {
                input.t_s = t as f64 * 1e-9;
            }
            input.clocks.push(RowClock { offset_s: t as f64 * 1e-9 - input.t_s, row_time_s: f64::from(row) * 1e-9 });
            let mut features = Vec::new();
            for _ in 0..n {
                let b = take(39);
                features.push(Feature {
                    x_q4: u16::from_le_bytes([b[0], b[1]]),
                    y_q4: u16::from_le_bytes([b[2], b[3]]),
                    score: b[4].into(),
                    angle: b[5],
                    octave: b[6],
                    descriptor: b[7..39].try_into().unwrap(),
                });
            }
            input.features.push(features);
        }
        inputs.push(input);
    }
    inputs
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    if args[1] == "dump" {
        dump(&args[2], &args[3]);
        return;
    }
    // replay FEATURES TRUTH [rs 0/1]
    let inputs = load(&args[1]);
    let mut params = TrackerParams::room(1);
    params.rolling_shutter = std::env::var("NORS").is_err();
    let text = std::fs::read_to_string(&args[2]).unwrap();
    let truth: Vec<TimedPose> = std::env::var("TRUTH")
        .ok()
        .map(|f| sensel::pose::parse_tum(&std::fs::read_to_string(f).unwrap()).unwrap())
        .unwrap_or_default();
    let resolved = sensel::config::Resolved::from_layers("replay", &text, &[]).unwrap();
    let lens = resolved.scenario.lens().unwrap();
    let size = sensel::units::Size { width_px: 640, height_px: 480 };
    let calibrations: Vec<CameraCalibration> = resolved
        .scenario
        .cameras()
        .unwrap()
        .into_iter()
        .map(|body_from_camera| CameraCalibration { lens, size, body_from_camera })
        .collect();
    let mut tracker = Tracker::new(calibrations, params).unwrap();
    let frames: usize = std::env::var("FRAMES").ok().map_or(usize::MAX, |f| f.parse().unwrap());
    let start = std::time::Instant::now();
    let mut est = Vec::new();
    let mut found = Vec::new();
    let mut worst = 0.0_f64;
    let mut keyframes = 0;
    let mut status = std::collections::BTreeMap::new();
    for input in inputs.iter().take(frames) {
        let t0 = std::time::Instant::now();
        let a = tracker.track(input);
        worst = worst.max(t0.elapsed().as_secs_f64());
        found.push(f64::from(a.tracked_features));
        keyframes += u32::from(a.keyframe);
        *status.entry(a.status.name()).or_insert(0) += 1;
        if let Some(p) = a.world_from_body {
            est.push(TimedPose { t_s: input.t_s, world_from_body: p });
        }
    }
    let n = inputs.len().min(frames);
    let ms = 1e3 * start.elapsed().as_secs_f64() / n as f64;
    println!(
        "{n} frames {ms:.2} ms (worst {:.1}) keyframes {keyframes} landmarks {} tracked {:?} {status:?}",
        1e3 * worst,
        tracker.landmarks().len(),
        sensel::report::median(&found)
    );
    if truth.is_empty() {
        return;
    }
    let figures = |truth: &[TimedPose], est: &[TimedPose]| {
        let f = trajectory_figures(truth, est).unwrap();
        match &f.se3 {
            Ok(a) => println!(
                "ate {:.2} mm rpe1s {:.2} jit_frame {:.3} d2 {:.3} mm still d2 {:.3} sim3 scale {:.4} ate {:.2}",
                1e3 * a.ate_m,
                1e3 * a.rpe_m.clone().unwrap_or(0.0),
                1e3 * a.jitter_frame_m,
                1e3 * a.jitter_d2_m.clone().unwrap_or(0.0),
                1e3 * f.still.jitter_d2_m.clone().unwrap_or(0.0),
                f.sim3.as_ref().map_or(0.0, |s| s.alignment.scale),
                f.sim3.as_ref().map_or(0.0, |s| 1e3 * s.ate_m)
            ),
            Err(e) => println!("{e} still {:?}", f.still),
        }
        f
    };
    let f = figures(&truth, &est);
    if std::env::var("SPLIT").is_ok() {
        for (i, part) in est.chunks(150).enumerate() {
            print!("part {i}: ");
            figures(&truth, part);
        }
    }
    let _ = (Pose::IDENTITY, f);
    std::fs::write("/tmp/loops/est.tum", sensel::pose::format_tum(&est)).unwrap();
}
