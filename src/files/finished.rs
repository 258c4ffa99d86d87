//! Reads the folder of a finished run back: report, trajectories and a few pictures.

use std::path::{Path, PathBuf};

use super::errors::content_error;
use super::open::is_there;
use super::picture::read_grey;
use super::{read_bytes, read_text};
use crate::error::Error;
use crate::num::u32_from;
use crate::pose::{TimedPose, parse_tum};
use crate::report::Report;
use crate::report::compare::FinishedRun;

/// Longest report that is read: a million frames.
const REPORT_BYTES_MAX: u64 = 1 << 30;
/// Longest trajectory that is read.
const TUM_BYTES_MAX: u64 = 1 << 28;
/// Where a run keeps the poses that the cameras gave without the IMU.
pub const CAMERAS_ALONE: &str = "trajectory_cameras_alone.tum";

/// The report and the trajectories of a run's folder. Fails on a folder that is not there or is no run's, or a run that was cut short.
pub fn read_run(folder: &Path) -> Result<FinishedRun, Error> {
    let refused = |reason: String| content_error(folder, reason);
    if !folder.is_dir() {
        return Err(refused("is no folder; name a folder that 'sensel run' wrote".to_owned()));
    }
    let file = folder.join("report.json");
    if !is_there(&file) {
        // A run writes its pictures first and its report last.
        let has_pictures = folder.join("mav0").is_dir();
        let what = if has_pictures {
            "is of a run that was cut short: report.json is missing; run it again"
        } else {
            "is no run: report.json is missing; name a folder that 'sensel run' wrote"
        };
        return Err(refused(what.to_owned()));
    }
    let report: Report = serde_json::from_slice(&read_bytes(&file, REPORT_BYTES_MAX)?).map_err(|error| {
        let reason = if error.is_eof() {
            "ends in the middle: the run was cut short; run it again".to_owned()
        } else {
            format!("is no report of this version ({error}); run it again")
        };
        content_error(&file, reason)
    })?;
    check_whole(folder, &report)?;
    let truth = trajectory(&folder.join("trajectory_gt.tum"))?;
    let (poses, frames) = (truth.len(), report.frames.len());
    if poses != frames {
        return Err(refused(format!(
            "is of a run that was cut short: trajectory_gt.tum has {poses} poses, report.json {frames} frames; run it again"
        )));
    }
    let alone = folder.join(CAMERAS_ALONE);
    let cameras_alone = is_there(&alone).then(|| trajectory(&alone)).transpose()?;
    let estimate = trajectory(&folder.join("trajectory_est.tum"))?;
    Ok(FinishedRun { folder: folder.display().to_string(), report, truth, estimate, cameras_alone })
}

fn check_whole(folder: &Path, report: &Report) -> Result<(), Error> {
    let run = report.config.get("run").and_then(toml::Value::as_table);
    let asked = run.and_then(|run| run.get("frames")).and_then(toml::Value::as_integer);
    let there = i64::from(u32_from(report.frames.len()));
    if there == 0 || asked.is_some_and(|asked| there < asked) {
        let asked = asked.map_or("its".to_owned(), |asked| asked.to_string());
        let reason = format!("is of a run that was cut short: {there} of {asked} frames are there; run it again");
        return Err(content_error(folder, reason));
    }
    Ok(())
}

fn trajectory(file: &Path) -> Result<Vec<TimedPose>, Error> {
    if !is_there(file) {
        return Err(content_error(file, "is missing: the run was cut short; run it again"));
    }
    let text = read_text(file, TUM_BYTES_MAX)?;
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    parse_tum(&text).map_err(|error| content_error(file, error.to_string()))
}

/// Pictures of the first camera by frame number, as eight-bit grey values. Fails on a picture that is missing or damaged.
pub fn read_pictures(run: &FinishedRun, frames: &[usize]) -> Result<Vec<crate::plane::Plane<u16>>, Error> {
    let folder = Path::new(&run.folder).join("mav0/cam0");
    let list = folder.join("data.csv");
    let text = read_text(&list, TUM_BYTES_MAX)?;
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty()).collect();
    let read = |&frame: &usize| {
        let line =
            lines.get(frame).ok_or_else(|| content_error(&list, format!("lists no frame {frame}; run it again")))?;
        let name = line.split(',').nth(1).unwrap_or_default().trim();
        // Names come from a file: none leads out of the folder.
        let is_plain = !name.is_empty() && Path::new(name).file_name() == Some(name.as_ref());
        if !is_plain {
            return Err(content_error(&list, format!("names '{name}', which is no file's name; run it again")));
        }
        let path: PathBuf = folder.join("data").join(name);
        let (values, bits) = read_grey(&path)?;
        Ok(if bits > 8 { values.map(|value| value >> (bits - 8)) } else { values })
    };
    frames.iter().map(read).collect()
}
