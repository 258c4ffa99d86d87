//! Reads single-camera folders in the TUM RGB-D layout, and plainer ones: picture paths with times in nanoseconds, the lens, and the true
//! path if there is one.
//!
//! Pictures are listed by `rgb.txt` (`timestamp filename` a line). Without it, those of `images` or `rgb` are taken in the order of their
//! names, one to each line of the ground truth. `K.txt` holds the 3 x 3 matrix of a lens without distortion. Ground truth is
//! `groundtruth.txt` or `groundtruth.tum`.

use std::path::{Path, PathBuf};

use super::errors::{content_error, io_error};
use super::euroc::FrameEntry;
use super::open::is_there;
use super::read_text;
use crate::error::Error;
use crate::num::u64_half_even;
use crate::optics::lens::{Intrinsics, Lens, Mapping};
use crate::pose::{TimedPose, parse_tum};

const TEXT_BYTES_MAX: u64 = 1 << 28;

/// An opened folder. Pictures stay on the disk.
#[derive(Clone, Debug)]
pub struct TumFolder {
    /// In rising time; of repeated times the first.
    pub frames: Vec<FrameEntry>,
    /// Lens of the camera.
    pub lens: Lens,
    /// True poses of the camera.
    pub ground_truth: Option<Vec<TimedPose>>,
}

impl TumFolder {
    /// Whether a folder is laid out so.
    pub fn is_one(dir: &Path) -> bool {
        is_there(&dir.join("rgb.txt")) || (is_there(&dir.join("K.txt")) && pictures_folder(dir).is_some())
    }

    /// Opens a folder. Fails on no calibration, no list of pictures that fits, a file that cannot be read, each named.
    pub fn open(dir: &Path) -> Result<Self, Error> {
        let truth = ["groundtruth.txt", "groundtruth.tum"].map(|name| dir.join(name)).into_iter().find(|f| is_there(f));
        let truth_text = truth.as_ref().map(|file| read_text(file, TEXT_BYTES_MAX)).transpose()?;
        let ground_truth = match (&truth, &truth_text) {
            (Some(file), Some(text)) => {
                Some(parse_tum(text).map_err(|e| content_error(file, format!("line {}: {}", e.line, e.reason)))?)
            }
            _ => None,
        };
        let list = dir.join("rgb.txt");
        let entries = if is_there(&list) { listed(dir, &list)? } else { by_truth(dir, truth_text.as_deref())? };
        let mut frames: Vec<FrameEntry> = Vec::new();
        for entry in entries {
            match frames.last() {
                Some(last) if entry.timestamp_ns < last.timestamp_ns => {
                    let reason = format!("time goes back from {} ns to {} ns", last.timestamp_ns, entry.timestamp_ns);
                    return Err(content_error(&list, reason));
                }
                Some(last) if entry.timestamp_ns == last.timestamp_ns => {}
                _ => frames.push(entry),
            }
        }
        Ok(Self { frames, lens: lens(&dir.join("K.txt"))?, ground_truth })
    }
}

/// Lines of a text that hold something, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, Vec<&str>)> {
    let numbered = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    numbered
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(number, line)| (number, line.split([' ', '\t', ',']).filter(|field| !field.is_empty()).collect()))
}

/// A time in seconds as nanoseconds; `None` for what is none.
fn nanoseconds(text: &str) -> Option<u64> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..1e10).contains(seconds))?;
    Some(u64_half_even(seconds * 1e9))
}

fn listed(dir: &Path, list: &Path) -> Result<Vec<FrameEntry>, Error> {
    let text = read_text(list, TEXT_BYTES_MAX)?;
    let entry = |(line, fields): (usize, Vec<&str>)| {
        let refused = |reason: &str| content_error(list, format!("line {line}: {reason}"));
        let &[time, name] = fields.as_slice() else { return Err(refused("a frame is timestamp filename")) };
        let timestamp_ns = nanoseconds(time).ok_or_else(|| refused("the first field is no time in seconds"))?;
        // A name inside the folder: a data set cannot make its reader open files elsewhere.
        let is_inside = Path::new(name).components().all(|part| matches!(part, std::path::Component::Normal(_)));
        if !is_inside {
            return Err(refused("the second field is no path inside the folder"));
        }
        Ok(FrameEntry { timestamp_ns, path: dir.join(name) })
    };
    lines(&text).map(entry).collect()
}

fn pictures_folder(dir: &Path) -> Option<PathBuf> {
    ["images", "rgb"].map(|name| dir.join(name)).into_iter().find(|folder| folder.is_dir())
}

fn by_truth(dir: &Path, truth: Option<&str>) -> Result<Vec<FrameEntry>, Error> {
    let (Some(folder), Some(truth)) = (pictures_folder(dir), truth) else {
        return Err(content_error(dir, "has no rgb.txt; add it, or pictures and a ground truth of as many lines"));
    };
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(io_error(&folder))? {
        let path = entry.map_err(io_error(&folder))?.path();
        let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase());
        if kind.is_some_and(|kind| kind == "png" || kind == "jpg" || kind == "jpeg") {
            paths.push(path);
        }
    }
    paths.sort();
    let times: Vec<u64> = lines(truth).filter_map(|(_, fields)| nanoseconds(fields[0])).collect();
    if times.len() != paths.len() {
        let reason = format!("holds {} pictures for {} lines of ground truth; add rgb.txt", paths.len(), times.len());
        return Err(content_error(&folder, reason));
    }
    Ok(times.into_iter().zip(paths).map(|(timestamp_ns, path)| FrameEntry { timestamp_ns, path }).collect())
}

fn lens(file: &Path) -> Result<Lens, Error> {
    if !is_there(file) {
        return Err(content_error(file, "is missing; write three lines 'fx 0 cx', '0 fy cy', '0 0 1' in pixels"));
    }
    let text = read_text(file, TEXT_BYTES_MAX)?;
    let fields = lines(&text).flat_map(|(_, fields)| fields);
    let numbers: Option<Vec<f64>> = fields.map(|field| field.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[fx_px, skew, cx_px, 0.0, fy_px, cy_px, 0.0, 0.0, 1.0]) if skew == 0.0 && fx_px > 0.0 && fy_px > 0.0 => {
            Ok(Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, mapping: Mapping::Pinhole })
        }
        _ => Err(content_error(file, "is no matrix 'fx 0 cx', '0 fy cy', '0 0 1' of pixels")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;

    fn folder(files: &[(&str, &str)]) -> Scratch {
        let dir = Scratch::new();
        std::fs::create_dir(dir.path().join("images")).unwrap();
        files.iter().for_each(|(name, text)| std::fs::write(dir.path().join(name), text).unwrap());
        dir
    }

    const K: &str = "500.5 0 320\n0 501 240\n0 0 1\n";

    #[test]
    fn repeated_times_and_quaternions_of_four_decimals_are_accepted() {
        let truth = "# t x y z q\n1.5 0 0 0 0.7071 0.0 0.0 0.7071\n1.5 0 0 0 0.7071 0 0 0.7071\n1.6 1 0 0 0 0 0 1\n";
        let list = "# time file\n1.5 images/a.png\n1.5 images/b.png\n1.6 images/c.png\n";
        let dir = folder(&[("K.txt", K), ("groundtruth.txt", truth), ("rgb.txt", list)]);
        assert!(TumFolder::is_one(dir.path()));
        let opened = TumFolder::open(dir.path()).unwrap();
        let times: Vec<u64> = opened.frames.iter().map(|frame| frame.timestamp_ns).collect();
        assert_eq!(times, [1_500_000_000, 1_600_000_000]);
        assert!(opened.frames[0].path.ends_with("images/a.png"));
        assert_eq!(opened.ground_truth.unwrap().len(), 2);
        assert_eq!(opened.lens.intrinsics.fy_px, 501.0);
        // Without the list, pictures go with the lines of the truth.
        let dir = folder(&[
            ("K.txt", K),
            ("groundtruth.tum", truth),
            ("images/00.png", ""),
            ("images/01.png", ""),
            ("images/02.png", ""),
        ]);
        assert_eq!(TumFolder::open(dir.path()).unwrap().frames.len(), 2);
    }

    #[test]
    fn what_is_no_such_folder_is_refused_by_file() {
        let list = "1.5 images/a.png\n";
        let mut tried = 0;
        for (files, named) in [
            (vec![("rgb.txt", list)], "K.txt"),
            (vec![("rgb.txt", list), ("K.txt", "500 1 320\n0 500 240\n0 0 1\n")], "no matrix"),
            (vec![("rgb.txt", "1.5 ../a.png\n"), ("K.txt", K)], "inside the folder"),
            (vec![("rgb.txt", "2.0 a.png\n1.0 b.png\n"), ("K.txt", K)], "time goes back"),
            (vec![("rgb.txt", "x a.png\n"), ("K.txt", K)], "no time"),
            (vec![("K.txt", K)], "rgb.txt"),
            (vec![("K.txt", K), ("groundtruth.txt", "1 0 0 0 0 0 0 1\n")], "0 pictures for 1 lines"),
        ] {
            let dir = folder(&files);
            let refusal = TumFolder::open(dir.path()).unwrap_err().to_string();
            assert!(refusal.contains(named), "{named}: {refusal}");
            tried += 1;
        }
        assert_eq!(tried, 7);
    }
}
