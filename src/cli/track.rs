//! `sensel track`: the tracker alone, on the pictures of an EuRoC folder, real or simulated.

use std::path::{Path, PathBuf};

use sensel::compute::{AlwaysReady, AtOnce, Extractor, Feature, Pixels, Records};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::events::Events;
use sensel::files::euroc::{EurocReader, FrameEntry};
use sensel::num::f64_from_u64;
use sensel::pose::{TimedPose, format_tum};
use sensel::report::trajectory_figures;
use sensel::tracker::{CameraCalibration, FrameInput, Tracker, TrackerParams};
use sensel::units::CameraIndex;
use serde_json::json;

use super::args::{Shared, TrackArguments};
use super::{listing, place, progress};

/// Pictures of two cameras this near in time are one frame of the rig.
const PAIR_NS_MAX: u64 = 1_000_000;

/// `sensel track`.
pub fn main(arguments: &TrackArguments, shared: &Shared) -> Result<(), Error> {
    let reader = EurocReader::open(&arguments.folder)?;
    let [left, right] = reader.cameras() else {
        let reason = format!("holds {} camera(s); the tracker takes two", reader.cameras().len());
        return Err(Error::Content { file: arguments.folder.display().to_string(), reason });
    };
    // A folder that a run wrote brings its own configuration; any other takes the defaults.
    let own = arguments.folder.join("config.toml");
    let (layer, text) = match std::fs::read_to_string(&own) {
        Ok(text) => (own.display().to_string(), text),
        Err(_) => ("command line".to_owned(), String::new()),
    };
    let resolved = Resolved::from_layers(&layer, &text, &shared.set)?;
    let out = output_file(shared)?;
    let extractor = resolved.scenario.extractor().map_err(|error| resolved.tree.locate(error))?;
    let mut extractors = [Extractor::new(&extractor), Extractor::new(&extractor)];
    let params =
        TrackerParams { seed: shared.seed.unwrap_or(resolved.scenario.seed), ..resolved.scenario.tracker_params()? };
    let calibration = |folder: &sensel::files::euroc::CameraFolder| CameraCalibration {
        lens: folder.camera.lens,
        size: folder.camera.size,
        body_from_camera: folder.camera.body_from_camera,
    };
    let mut tracker = Tracker::new(vec![calibration(left), calibration(right)], params)?;

    let pairs = pairs(&left.frames, &right.frames);
    // Some recorders stamp with nanoseconds since 1970; the tracker's own clock starts with the first frame.
    let start_ns = pairs.first().map_or(0, |pair| left.frames[pair.0].timestamp_ns);
    let bar = progress::bar("frames", pairs.len().try_into().unwrap_or(u64::MAX), shared.quiet);
    let mut poses = Vec::new();
    for (left_index, right_index) in &pairs {
        let mut features: Vec<Vec<Feature>> = Vec::new();
        for (camera, frame) in [(CameraIndex(0), *left_index), (CameraIndex(1), *right_index)] {
            let picture = reader.load(camera, frame)?;
            let extractor = &mut extractors[features.len()];
            let io = (&mut AtOnce as &mut dyn Pixels, &mut AlwaysReady as &mut dyn Records);
            let extracted = extractor.frame(&picture.values_dn, picture.bits, (1, 1), io, &mut Events::default())?;
            features.push(extracted.features);
        }
        let timestamp_ns = left.frames[*left_index].timestamp_ns;
        // Recordings do not say when their rows were exposed.
        let t_s = f64_from_u64(timestamp_ns - start_ns) * 1e-9;
        let tracked = tracker.track(&FrameInput { t_s, features, clocks: Vec::new() });
        if let Some(world_from_body) = tracked.world_from_body {
            poses.push(TimedPose { t_s: f64_from_u64(timestamp_ns) * 1e-9, world_from_body });
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    std::fs::write(&out, format_tum(&poses)).map_err(|source| place::io(&out, source))?;
    say(&reader, &poses, pairs.len(), &out, shared);
    Ok(())
}

/// Where the trajectory goes. Without `--out` an existing file is not replaced.
fn output_file(shared: &Shared) -> Result<PathBuf, Error> {
    let default = PathBuf::from("trajectory_est.tum");
    match &shared.out {
        Some(file) => Ok(file.clone()),
        None if default.exists() => {
            let reason = "exists already; --out FILE would do".to_owned();
            Err(Error::Content { file: default.display().to_string(), reason })
        }
        None => Ok(default),
    }
}

fn say(reader: &EurocReader, poses: &[TimedPose], frames: usize, out: &Path, shared: &Shared) {
    let figures = reader.ground_truth().and_then(|truth| trajectory_figures(truth, poses).ok());
    let ate_m = figures.as_ref().and_then(|figures| figures.se3.as_ref().ok()).map(|aligned| aligned.ate_m);
    if shared.json {
        let json =
            json!({"frames": frames, "tracked": poses.len(), "trajectory": out.display().to_string(), "ate_m": ate_m});
        listing::print_json(&json);
    } else if !shared.quiet {
        outln!("trajectory: {}", out.display());
        if let Some(ate_m) = ate_m {
            outln!("ATE {:.2} mm against the folder's ground truth", 1e3 * ate_m);
        }
        outln!("{frames} frames, {} tracked, {} lost", poses.len(), frames - poses.len());
    }
}

/// Indices of frames of the two cameras that belong together, in rising time.
fn pairs(left: &[FrameEntry], right: &[FrameEntry]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let mut at = 0;
    for (index, frame) in left.iter().enumerate() {
        while at < right.len() && right[at].timestamp_ns + PAIR_NS_MAX < frame.timestamp_ns {
            at += 1;
        }
        if at < right.len() && right[at].timestamp_ns.abs_diff(frame.timestamp_ns) <= PAIR_NS_MAX {
            pairs.push((index, at));
        }
    }
    pairs
}
