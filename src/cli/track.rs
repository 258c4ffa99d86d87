//! `sensel track`: the tracker alone, on the pictures of an EuRoC or TUM folder, real or simulated, of any number of cameras, or on the
//! packets that a run kept.

mod figures;
mod packets;
mod pictures;
mod recording;
mod rig_frame;

use std::path::{Path, PathBuf};

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::content_error;
use sensel::files::euroc::{ImuFolder, ImuReading};
use sensel::files::map::ply;
use sensel::files::open::is_there;
use sensel::link::LinkCounts;
use sensel::num::{f64_from_i64, f64_from_u64};
use sensel::pose::{TimedPose, format_tum};
use sensel::report::record::TrackingEvent;
use sensel::run::SensorSetup;
use sensel::tracker::{FrameInput, ImuCalibration, ImuMeasurement, Status, TrackedFrame, Tracker, TrackerParams};
use serde_json::json;

use super::args::{CommonOptions, TrackArguments};
use super::{listing, paths, progress, words};
use figures::TrackFigures;
use packets::Packets;
use pictures::PictureStream;
use recording::AnyRecording;
pub use rig_frame::RigFrame;

/// What the tracker made of a recording.
#[derive(Default)]
struct TrackingResult {
    poses: Vec<TimedPose>,
    frames: usize,
    /// Of all cameras and frames.
    features: usize,
    /// Single-picture position sigmas of the frames given the map, in the map's unit.
    sigmas: Vec<f64>,
    /// Lost and found again, starts and closed loops.
    events: Vec<TrackingEvent>,
    last: Option<Status>,
}

impl TrackingResult {
    /// Tracks frame by frame. Some recorders stamp with nanoseconds since 1970: without another origin the tracker's own clock starts with
    /// the first frame.
    fn follow(
        &mut self,
        tracker: &mut Tracker,
        mut readings: &[ImuReading],
        mut origin_ns: Option<u64>,
        frames: impl Iterator<Item = Result<RigFrame, Error>>,
        bar: &progress::StepsBar,
    ) -> Result<(), Error> {
        for frame in frames {
            let RigFrame { number, timestamp_ns, features, clocks } = frame?;
            let origin_ns = *origin_ns.get_or_insert(timestamp_ns);
            self.features += features.iter().map(Vec::len).sum::<usize>();
            let t_s = f64_from_u64(timestamp_ns - origin_ns) * 1e-9;
            tracker.add_imu_readings(&readings_until(&mut readings, (origin_ns, timestamp_ns)));
            let tracked = tracker.track(&FrameInput { t_s, features, clocks });
            self.add(number, f64_from_u64(timestamp_ns) * 1e-9, &tracked);
            bar.inc();
        }
        Ok(())
    }

    fn add(&mut self, number: u32, t_s: f64, tracked: &TrackedFrame) {
        self.frames += 1;
        self.poses.extend(tracked.world_from_body.map(|world_from_body| TimedPose { t_s, world_from_body }));
        self.sigmas.extend(tracked.single_picture_sigma_m);
        self.events.extend(tracked.events(self.last).map(|event| TrackingEvent::of(number, t_s, event)));
        self.last = Some(tracked.status);
    }
}

/// Where features come from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum FeatureSource {
    Packets,
    Pictures,
}

impl FeatureSource {
    /// What was asked for. Without a word packets are taken where a run kept them, unless a key asks for another extractor than was on its
    /// sensor.
    fn of(arguments: &TrackArguments, shared: &CommonOptions, cameras: usize) -> Result<Self, Error> {
        let key = shared.set.iter().find(|key| key.trim_start().starts_with("compute"));
        match (arguments.from.as_deref(), key) {
            (Some("pictures"), _) => Ok(Self::Pictures),
            (Some(_), Some(key)) => {
                let (key, value) = key.split_once('=').unwrap_or((key, ""));
                let reason = "packets bring what the sensor found; use --from pictures";
                Err(Error::key(key.trim(), value.trim(), reason))
            }
            (Some(_), None) => Ok(Self::Packets),
            (None, Some(_)) => Ok(Self::Pictures),
            (None, None) => {
                let are_kept = (0..cameras).all(|camera| is_there(&packets::file(&arguments.folder, camera)));
                Ok(if are_kept { Self::Packets } else { Self::Pictures })
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Packets => "packets",
            Self::Pictures => "pictures",
        }
    }
}

pub fn main(arguments: &TrackArguments, shared: &CommonOptions) -> Result<(), Error> {
    let out = output_file(shared)?;
    if let Some(map) = &arguments.map {
        paths::check_ending("--map", map, &["ply"], "PLY")?;
    }
    let recording = AnyRecording::open(&arguments.folder)?;
    let from = FeatureSource::of(arguments, shared, recording.cameras.len())?;
    // A folder that a run wrote brings its own configuration; any other takes the defaults.
    let own = arguments.folder.join("config.toml");
    let (layer, text) = if is_there(&own) {
        (own.display().to_string(), sensel::files::read_text(&own, paths::SCENARIO_BYTES_MAX)?)
    } else {
        ("command line".to_owned(), String::new())
    };
    let resolved = Resolved::from_layers(&layer, &text, &shared.set)?;
    check_outputs(&recording, &out, arguments)?;
    let mut tracker = tracker(&recording, &resolved, shared)?;
    let uses_imu =
        resolved.scenario.tracker_uses_imu(recording.imu.is_some()).map_err(|error| resolved.tree.locate(error))?;
    let imu_folder = recording.imu.as_ref().filter(|_| uses_imu);
    if let Some(ImuFolder { imu, .. }) = imu_folder {
        let noise = sensel::run::noise_of(&imu.noise);
        tracker = tracker.with_imu(ImuCalibration { body_from_imu: imu.body_from_imu, noise });
    }
    let readings = imu_folder.map_or(&[][..], |imu_folder| &imu_folder.readings);

    let extractor = resolved.scenario.extractor().map_err(|error| resolved.tree.locate(error))?;
    let pictures = PictureStream::new(&recording.cameras, &recording.frames, &extractor);
    let bar = progress::bar("frames", pictures.rig_frames().try_into().unwrap_or(u64::MAX), shared.quiet);
    let mut result = TrackingResult::default();
    let mut link = None;
    match from {
        FeatureSource::Pictures => result.follow(&mut tracker, readings, None, pictures, &bar)?,
        FeatureSource::Packets => {
            let sensor = SensorSetup::new(&resolved)?;
            let mut packets = Packets::open(&arguments.folder, recording.cameras.len(), &sensor)?;
            // A sensor's clock begins with its run, as the IMU's does.
            result.follow(&mut tracker, readings, Some(0), &mut packets, &bar)?;
            link = Some(packets.counts());
        }
    }
    bar.finish();
    paths::write_output("--out", &out, format_tum(&result.poses).as_bytes())?;
    if let Some(map) = &arguments.map {
        paths::write_output("--map", map, ply(tracker.landmarks()).as_bytes())?;
    }
    let input = input_warnings(&recording, uses_imu, (from, result.frames));
    say(&recording, &result, &out, (from, link), (shared, seed(&resolved, shared), input));
    Ok(())
}

/// Refuses outputs that would take the place of the recording's files, before it is tracked.
fn check_outputs(recording: &AnyRecording, out: &PathBuf, arguments: &TrackArguments) -> Result<(), Error> {
    paths::refuse_same(&[("--out", Some(out)), ("--map", arguments.map.as_ref())])?;
    let packets = (0..recording.cameras.len()).map(|camera| packets::file(&arguments.folder, camera));
    let inputs: Vec<PathBuf> =
        recording.frames.iter().flatten().map(|frame| frame.path.clone()).chain(packets).collect();
    for (option, file) in [("--out", Some(out)), ("--map", arguments.map.as_ref())] {
        let Some(file) = file else { continue };
        paths::check_output(option, file)?;
        let real = paths::real(file);
        if inputs.iter().any(|input| input.file_name() == real.file_name() && paths::real(input) == real) {
            return Err(Error::key(option, file.display(), "is a file that this command reads; name another"));
        }
    }
    Ok(())
}

fn seed(resolved: &Resolved, shared: &CommonOptions) -> u64 {
    shared.seed.unwrap_or(resolved.scenario.seed)
}

fn tracker(recording: &AnyRecording, resolved: &Resolved, shared: &CommonOptions) -> Result<Tracker, Error> {
    let params = TrackerParams { seed: seed(resolved, shared), ..resolved.scenario.tracker_params()? };
    Tracker::new(recording.cameras.clone(), params)
}

/// The readings up to the first one after a frame, on the tracker's clock; the rest stays.
fn readings_until(readings: &mut &[ImuReading], (start_ns, frame_ns): (u64, u64)) -> Vec<ImuMeasurement> {
    let to = readings.partition_point(|reading| reading.timestamp_ns <= frame_ns) + 1;
    let (now, later) = readings.split_at(to.min(readings.len()));
    *readings = later;
    let reading = |reading: &ImuReading| ImuMeasurement {
        // Those from before the first frame have negative times.
        t_s: f64_from_i64(reading.timestamp_ns.wrapping_sub(start_ns).cast_signed()) * 1e-9,
        angular_velocity_rad_per_s: reading.angular_velocity_rad_per_s,
        acceleration_m_per_s2: reading.acceleration_m_per_s2,
    };
    now.iter().map(reading).collect()
}

fn link_json(counts: LinkCounts) -> serde_json::Value {
    json!({
        "packets": counts.packets, "headers_corrected": counts.headers_corrected, "headers_refused": counts.headers_refused,
        "payloads_refused": counts.payloads_refused, "packets_cut_short": counts.cut_short,
        "packets_doubled": counts.packets_doubled, "bytes_skipped": counts.bytes_skipped,
        "frames_damaged": counts.frames_damaged, "rows_lost": counts.rows_lost,
    })
}

/// Where the trajectory goes. Without `--out` an existing file is not replaced.
fn output_file(shared: &CommonOptions) -> Result<PathBuf, Error> {
    let usual = "trajectory_est.tum";
    match paths::output_file(shared, &["tum", "txt"], "a trajectory in TUM's format", usual)? {
        Some(file) => Ok(file),
        None if Path::new(usual).exists() => {
            Err(content_error(Path::new(usual), "exists already; name another with --out FILE"))
        }
        None => Ok(PathBuf::from(usual)),
    }
}

/// What of a recording counts for nothing: pictures without a partner of the other cameras, an IMU or truth without readings.
fn input_warnings(recording: &AnyRecording, uses_imu: bool, (from, frames): (FeatureSource, usize)) -> Vec<String> {
    let mut warnings = Vec::new();
    let most = recording.frames.iter().map(Vec::len).max().unwrap_or(0);
    if from == FeatureSource::Pictures && frames < most {
        warnings.push(format!(
            "{} of {most} pictures of a camera have no partner of every other camera within 1 ms; they are left out",
            most - frames
        ));
    }
    if uses_imu && recording.imu.as_ref().is_some_and(|imu| imu.readings.is_empty()) {
        warnings.push("the folder's IMU has no readings; the tracker runs without".to_owned());
    }
    if recording.ground_truth.as_ref().is_some_and(Vec::is_empty) {
        warnings.push("the folder's ground truth has no pose; no error is measured".to_owned());
    }
    warnings
}

/// What a user should know of a trajectory without a pose.
fn warnings(result: &TrackingResult, cameras: usize) -> Vec<String> {
    if !result.poses.is_empty() {
        return Vec::new();
    }
    if result.frames == 0 {
        return vec!["the folder has no frame; name one with pictures or packets".to_owned()];
    }
    let found = result.features / (result.frames * cameras).max(1);
    let remedy = if found < 20 {
        "lower compute.threshold (with --from pictures) or bring brighter pictures".to_owned()
    } else if cameras == 1 {
        "one camera starts a map once it has moved sideways by some hundredths of the depth; bring more frames"
            .to_owned()
    } else {
        "check the cameras' calibration and that they see the same".to_owned()
    };
    vec![format!("none of {} frames has a pose, with {found} features per frame; {remedy}", result.frames)]
}

fn say(
    recording: &AnyRecording,
    result: &TrackingResult,
    out: &Path,
    (from, link): (FeatureSource, Option<LinkCounts>),
    (shared, seed, mut warned): (&CommonOptions, u64, Vec<String>),
) {
    let truth = recording.ground_truth.as_ref().map(|truth| recording.reported(truth));
    let of_rig = (recording.cameras.len(), seed);
    let figures = TrackFigures::of(truth.as_deref(), result.poses.clone(), &result.sigmas, of_rig);
    let (tracked, frames) = (result.poses.len(), result.frames);
    warned.extend(warnings(result, recording.cameras.len()));
    let warnings = warned;
    words::warn(&warnings);
    if shared.json {
        let mut json = json!({
            "frames": frames, "tracked": tracked, "trajectory": out.display().to_string(), "events": result.events,
            "from": from.name(), "not_measurable": figures.reasons(), "warnings": warnings,
        });
        let parts = json.as_object_mut().expect("an object");
        parts.extend(link.map(|counts| ("link".to_owned(), link_json(counts))));
        parts.extend(figures.json());
        listing::print_json(&json);
    } else if !shared.quiet {
        outln!("trajectory: {}, from {}", out.display(), from.name());
        if let Some(counts) = link.filter(|counts| !counts.clean()) {
            outln!("link: {}", link_json(counts));
        }
        if truth.is_some() {
            outln!("against the folder's ground truth: {figures}");
        }
        for TrackingEvent { frame, t_s, event, reason } in &result.events {
            let frame = frame.map_or_else(String::new, |frame| format!(", frame {frame}"));
            let reason = reason.as_ref().map_or_else(String::new, |reason| format!(" ({reason})"));
            outln!("{t_s:.3} s{frame}: {event}{reason}");
        }
        outln!("{frames} frames, {tracked} tracked, {} without a pose", frames - tracked);
    }
}
