//! From the folders that a scenario names to streams of pictures: which files, which times, which camera.

use std::sync::Arc;

use super::super::assets::{Assets, Progress};
use super::demand::Demand;
use crate::config::Scenario;
use crate::config::check::{one_of, within};
use crate::config::scenario::{Folders, ImagesCamera};
use crate::error::Error;
use crate::num::{f64_from_i64, u32_from};
use crate::optics::resample;
use crate::scene::images::list::{self, ImageList, TimeUnit};
use crate::scene::images::{Blend, ImageStream, PictureBytes, PictureCamera, StreamParams, TransferCurve, pinhole};
use crate::scene::{ImageSequence, images};
use crate::units::{Size, Span};

/// Folders inside the named one that may hold the pictures: `images` of many datasets, `rgb` of TUM, `data` of EuRoC.
const INNER: [&str; 4] = ["", "images/", "rgb/", "data/"];

/// Lists of times, in the order in which they are looked for.
const LISTS: [(&str, TimeUnit); 4] = [
    ("times.csv", TimeUnit::Seconds),
    ("times.txt", TimeUnit::Seconds),
    ("rgb.txt", TimeUnit::Seconds),
    ("data.csv", TimeUnit::Nanoseconds),
];

/// Bytes of files at most that are held where they cannot be read during the run.
const HELD_BYTES_MAX: usize = 512 << 20;

/// Streams of all cameras.
pub(super) fn sequence(
    scenario: &Scenario,
    folders: &Folders,
    demand: &Demand,
    assets: &dyn Assets,
    progress: &dyn Progress,
) -> Result<(ImageSequence, Vec<String>), Error> {
    super::super::light::only_images(&scenario.scene)?;
    let folders = folders.list();
    let cameras = demand.cameras.len();
    if folders.len() != cameras {
        let reason = format!("{} folder(s) for {cameras} camera(s); use one for each", folders.len());
        return Err(Error::key("scene.images", format!("{folders:?}"), reason));
    }
    let (mut streams, mut notes) = (Vec::with_capacity(cameras), Vec::new());
    // A rig's lists have one clock: all pictures are counted from the first camera's first.
    let mut first_ns = None;
    for (number, (folder, camera)) in folders.iter().zip(demand.cameras).enumerate() {
        let named = |error: Error| error.named_by("scene.images", folder);
        let found = FolderContent::of(scenario, folder, assets).map_err(named)?;
        notes.extend(found.notes.iter().map(|note| format!("{folder}: {note}")));
        let base_ns = *first_ns.get_or_insert(found.first_ns);
        let offset_s = f64_from_i64(found.first_ns - base_ns) * 1e-9;
        let params = found.params(scenario, demand, offset_s)?;
        let bytes = bytes_of(&params, assets).map_err(named)?;
        let span = (demand.span_of)(demand.frames);
        let share_of = |done: f64| (f64::from(u32_from(number)) + done) / f64::from(u32_from(cameras));
        let stream = ImageStream::new(params, span, bytes, &|done| progress.at("pictures", share_of(done)));
        let stream = stream.map_err(named)?;
        resample::check(&stream)?;
        notes.extend(notes_of(folder, &stream, camera, span));
        streams.push(stream);
    }
    Ok((ImageSequence { streams }, notes))
}

/// What lies in a folder.
struct FolderContent {
    folder: String,
    /// Names of pictures with their folder, in the order of time.
    files: Vec<String>,
    depth_files: Option<Vec<String>>,
    /// Seconds after the first.
    times_s: Vec<f64>,
    /// What the list has for the first; 0 without a list.
    first_ns: i64,
    camera: PictureCamera,
    notes: Vec<String>,
}

impl FolderContent {
    fn of(scenario: &Scenario, folder: &str, assets: &dyn Assets) -> Result<Self, Error> {
        let refused = |reason: &str| Error::Content { file: folder.to_owned(), reason: reason.to_owned() };
        let folder = folder.trim_end_matches('/').to_owned();
        let beside = assets.list(&folder)?;
        let pictures_in = |inner: &str| -> Vec<String> {
            let path = format!("{folder}/{inner}");
            let names = if inner.is_empty() {
                beside.clone()
            } else {
                assets.list(path.trim_end_matches('/')).unwrap_or_default()
            };
            names.into_iter().filter(|name| is_picture(name)).map(|name| format!("{path}{name}")).collect()
        };
        let pictures = INNER.iter().map(|inner| pictures_in(inner)).find(|found| !found.is_empty());
        let pictures = pictures.ok_or_else(|| refused("holds no picture; use files that end in .png or .exr"))?;
        let mut notes = Vec::new();
        let (files, times_s, first_ns) = match scenario.scene.images_fps {
            Some(rate_hz) => {
                let rate_hz = within("scene.images_fps", rate_hz, 1e-3..=1e6, "0.001 to 1,000,000")?;
                let times_s = list::at_rate(&pictures, rate_hz)?;
                (pictures, times_s, 0)
            }
            None => {
                let (name, unit) = LISTS.into_iter().find(|(name, _)| beside.iter().any(|file| file == name)).ok_or_else(|| {
                    refused("holds no list of times; use times.csv, times.txt, rgb.txt or data.csv in it, or scene.images_fps")
                })?;
                let file = format!("{folder}/{name}");
                let listed = list::parse(&file, &text(&file, assets)?, unit)?;
                if listed.repeated > 0 {
                    notes.push(format!("{name} repeats {} time(s); the first line of each holds", listed.repeated));
                }
                let first_ns = listed.first_ns;
                let (files, times_s) = listed_files(&folder, &file, listed, &pictures)?;
                (files, times_s, first_ns)
            }
        };
        let depth_files = scenario.scene.images_depth.as_ref();
        let depth_files =
            depth_files.map(|inner| depth_files_in(&format!("{folder}/{inner}"), &files, assets)).transpose()?;
        let camera = source_camera(scenario, &folder, &files[0], assets)?;
        Ok(Self { folder, files, depth_files, times_s, first_ns, camera, notes })
    }

    fn params(self, scenario: &Scenario, demand: &Demand, offset_s: f64) -> Result<StreamParams, Error> {
        let section = &scenario.scene;
        let (illuminant, white_lux) = scenario.light()?;
        let blend = one_of("scene.images_blend", &section.images_blend, &Blend::ALL)?;
        let transfer = one_of("scene.images_transfer", &section.images_transfer, &TransferCurve::ALL)?;
        let start_s = within("scene.images_start_s", section.images_start_s, -1e6..=1e6, "-1,000,000 to 1,000,000")?;
        let times_s: Vec<f64> = self.times_s.iter().map(|t_s| t_s + offset_s - start_s).collect();
        let depth_per_m = within("scene.images_depth_per_m", section.images_depth_per_m, 1.0..=1e6, "1 to 1,000,000")?;
        check_span(&self.folder, blend.covered(&times_s), demand)?;
        Ok(StreamParams {
            files: self.files,
            depth_files: self.depth_files,
            depth_per_m,
            times_s,
            camera: self.camera,
            transfer,
            blend,
            illuminant,
            white_lux,
        })
    }
}

/// The run must lie within the pictures' time.
fn check_span(folder: &str, covered: Span, demand: &Demand) -> Result<(), Error> {
    let fits = |frames: u32| {
        let span = (demand.span_of)(frames);
        span.start_s >= covered.start_s && span.end_s <= covered.end_s
    };
    if fits(demand.frames) {
        return Ok(());
    }
    let asked = (demand.span_of)(demand.frames);
    let (mut most, mut too_many) = (0, demand.frames);
    while most + 1 < too_many {
        let middle = most + (too_many - most) / 2;
        if fits(middle) { most = middle } else { too_many = middle }
    }
    let would_do = if most > 0 {
        format!("use up to {most} frames, or an earlier scene.images_start_s")
    } else {
        "use another scene.images_start_s, or more pictures".to_owned()
    };
    let reason = format!(
        "the pictures of {folder} last from {:.3} s to {:.3} s of the run, which needs {:.3} s to {:.3} s; {would_do}",
        covered.start_s, covered.end_s, asked.start_s, asked.end_s
    );
    Err(Error::key("run.frames", demand.frames, reason))
}

fn is_picture(name: &str) -> bool {
    let end = name.rsplit_once('.').map(|(_, end)| end.to_ascii_lowercase());
    !name.starts_with('.') && matches!(end.as_deref(), Some("png" | "exr"))
}

fn text(file: &str, assets: &dyn Assets) -> Result<String, Error> {
    let bytes = assets.read(file)?;
    crate::text::from_bytes(bytes).map_err(|reason| Error::Content { file: file.to_owned(), reason })
}

/// The files that a list names, or all pictures where it has times only.
fn listed_files(
    folder: &str,
    list: &str,
    listed: ImageList,
    pictures: &[String],
) -> Result<(Vec<String>, Vec<f64>), Error> {
    let refused = |reason: String| Error::Content { file: list.to_owned(), reason };
    if listed.names.is_empty() {
        if listed.times_s.len() != pictures.len() {
            let reason = format!("has {} times for {} pictures; use one each", listed.times_s.len(), pictures.len());
            return Err(refused(reason));
        }
        return Ok((pictures.to_vec(), listed.times_s));
    }
    let of_name = |name: &String| {
        let paths = INNER.map(|inner| format!("{folder}/{inner}{name}"));
        let found = paths.into_iter().find(|path| pictures.binary_search(path).is_ok());
        found.ok_or_else(|| refused(format!("names {name}, which is no picture of the folder")))
    };
    let files: Result<Vec<String>, Error> = listed.names.iter().map(of_name).collect();
    Ok((files?, listed.times_s))
}

/// Depth by picture: the files that have the pictures' names, or as many files in the same order.
fn depth_files_in(path: &str, files: &[String], assets: &dyn Assets) -> Result<Vec<String>, Error> {
    let names: Vec<String> = assets.list(path)?.into_iter().filter(|name| is_picture(name)).collect();
    let stem = |file: &str| file.rsplit('/').next().unwrap_or(file).rsplit_once('.').map(|(stem, _)| stem.to_owned());
    let named = |file: &String| names.iter().find(|name| stem(name) == stem(file));
    let by_name: Option<Vec<String>> =
        files.iter().map(|file| named(file).map(|name| format!("{path}/{name}"))).collect();
    match by_name {
        Some(found) => Ok(found),
        None if names.len() == files.len() => Ok(names.into_iter().map(|name| format!("{path}/{name}")).collect()),
        None => {
            let (depths, pictures) = (names.len(), files.len());
            let reason = format!(
                "has {depths} files for {pictures} pictures; use one for each, of the same name or in the same order"
            );
            Err(Error::Content { file: path.to_owned(), reason })
        }
    }
}

/// The camera of the keys, or of `K.txt` in the folder or beside it.
fn source_camera(scenario: &Scenario, folder: &str, first: &str, assets: &dyn Assets) -> Result<PictureCamera, Error> {
    if let Some(keys) = &scenario.scene.images_camera {
        let size =
            |assets: &dyn Assets| images::Picture::decode(first, &assets.read(first)?, None).map(|seen| seen.size());
        return camera_of_keys(keys, &|| size(assets));
    }
    let above = folder.rsplit_once('/').map_or("K.txt".to_owned(), |(above, _)| format!("{above}/K.txt"));
    for file in [format!("{folder}/K.txt"), above] {
        let parent = file.rsplit_once('/').map_or("", |(parent, _)| parent);
        if assets.list(parent).is_ok_and(|names| names.iter().any(|name| name == "K.txt")) {
            let [fx_px, fy_px, cx_px, cy_px] = list::intrinsics_of_matrix(&file, &text(&file, assets)?)?;
            return Ok(PictureCamera { fx_px, fy_px, cx_px, cy_px, distortion: [0.0; 4] });
        }
    }
    let reason = "what camera made the pictures is not known; give fx_px, fy_px, cx_px and cy_px, or horizontal_fov_deg, in \
                  [scene.images_camera], or a matrix in K.txt";
    Err(Error::key("scene.images_camera", "nothing", reason))
}

fn camera_of_keys(keys: &ImagesCamera, size: &dyn Fn() -> Result<Size, Error>) -> Result<PictureCamera, Error> {
    let name = |key: &str| format!("scene.images_camera.{key}");
    let mut distortion = [0.0; 4];
    for (term, (key, value)) in
        distortion.iter_mut().zip([("k1", keys.k1), ("k2", keys.k2), ("p1", keys.p1), ("p2", keys.p2)])
    {
        *term = within(&name(key), value.unwrap_or(0.0), -10.0..=10.0, "-10 to 10")?;
    }
    match (keys.fx_px, keys.fy_px, keys.cx_px, keys.cy_px, keys.horizontal_fov_deg) {
        (None, None, None, None, Some(fov_deg)) => {
            let fov_deg = within(&name("horizontal_fov_deg"), fov_deg, 1.0..=170.0, "1 to 170")?;
            Ok(pinhole(size()?, fov_deg.to_radians(), distortion))
        }
        (Some(fx_px), Some(fy_px), Some(cx_px), Some(cy_px), None) => {
            for (key, value) in [("fx_px", fx_px), ("fy_px", fy_px)] {
                within(&name(key), value, 1.0..=1e6, "1 to 1,000,000")?;
            }
            for (key, value) in [("cx_px", cx_px), ("cy_px", cy_px)] {
                within(&name(key), value, -1e6..=1e6, "-1,000,000 to 1,000,000")?;
            }
            Ok(PictureCamera { fx_px, fy_px, cx_px, cy_px, distortion })
        }
        _ => {
            let reason = "use either all of fx_px, fy_px, cx_px and cy_px, or horizontal_fov_deg";
            Err(Error::key("scene.images_camera", "incomplete", reason))
        }
    }
}

/// The files as they are read during the run: from their source where it can be read then, else held from the start.
fn bytes_of(params: &StreamParams, assets: &dyn Assets) -> Result<Arc<dyn PictureBytes>, Error> {
    if let Some(reader) = assets.during_run() {
        return Ok(reader);
    }
    let (mut files, mut total) = (Vec::new(), 0);
    for file in params.files.iter().chain(params.depth_files.iter().flatten()) {
        let bytes = assets.read(file)?;
        total += bytes.len();
        if total > HELD_BYTES_MAX {
            let reason = format!("the files up to here have {total} bytes; at most {HELD_BYTES_MAX} are held here");
            return Err(Error::Content { file: file.clone(), reason });
        }
        files.push((file.clone(), bytes));
    }
    files.sort();
    Ok(Arc::new(Held(files)))
}

/// Files in memory, sorted by name.
struct Held(Vec<(String, Vec<u8>)>);

impl PictureBytes for Held {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let at = self.0.binary_search_by(|(known, _)| known.as_str().cmp(name)).map_err(|_| Error::Content {
            file: name.to_owned(),
            reason: "was not read when the run began".to_owned(),
        })?;
        Ok(self.0[at].1.clone())
    }
}

/// What a person should know of a stream: what is black, what is coarse, what its files cut off, how far apart its times are.
fn notes_of(folder: &str, stream: &ImageStream, camera: &crate::optics::Camera, run: Span) -> Vec<String> {
    let mut notes = Vec::new();
    let outside = resample::outside_share(stream, camera);
    if outside > 0.0 {
        notes.push(format!("{:.1} % of the sensor's picture lies outside the pictures and is black", 100.0 * outside));
    }
    let source_pixels = resample::source_pixels(stream, camera);
    if source_pixels < 1.0 {
        notes.push(format!(
            "a pixel of the sensor covers {source_pixels:.2} of a picture's: between them is interpolated"
        ));
    }
    if stream.clipped_share() > 1e-3 {
        let percent = 100.0 * stream.clipped_share();
        notes.push(format!(
            "{percent:.1} % of the pictures' values stand at their greatest code: brighter light is lost"
        ));
    }
    let counted = stream.weights(run);
    if let (Some((first, _)), Some((last, _))) = (counted.first(), counted.last())
        && last > first
    {
        let steps = (*first..*last).map(|number| stream.time_s(number + 1) - stream.time_s(number));
        let (least_s, most_s) = steps.fold((f64::MAX, 0.0), |(least, most), step| {
            (crate::num::lesser(least, step), crate::num::greater(most, step))
        });
        let (count, least_ms, most_ms) = (counted.len(), 1e3 * least_s, 1e3 * most_s);
        notes.push(format!("{count} pictures, {least_ms:.2} to {most_ms:.2} ms apart; nothing is known between them"));
    }
    notes.into_iter().map(|note| format!("{folder}: {note}")).collect()
}
