//! Reads the folder of an EMVA 1288 measurement: the descriptor `emva1288.txt` and the frames that it names.
//!
//! Lines of a descriptor: `n BITS WIDTH HEIGHT`; `b EXPOSURE_NS PHOTONS` and `d EXPOSURE_NS` begin a bright and a dark group; `i FILE` is
//! a frame of it. Groups of two frames are points of photon transfer; the longest groups are the stacks. Frames are raw (row-major, u8
//! up to 8 bits, else u16 little-endian), PNG or TIFF.

use std::path::Path;

use super::errors::content_error;
use super::input::InputFolders;
use super::picture;
use crate::characterize::fit::defective::DefectivePixels;
use crate::characterize::fit::doubling::{DarkPoint, DarkSeries};
use crate::characterize::measure::ChannelMeasurement;
use crate::characterize::set::{PlannedShot, SeriesExposure};
use crate::error::Error;
use crate::num::{f64_from_u64, greater, lesser, u64_from};
use crate::plane::Plane;
use crate::scene::images::PictureBytes as _;
use crate::text::without_mark;
use crate::units::{FrameIndex, Size};

/// Name of the descriptor.
pub const DESCRIPTOR: &str = "emva1288.txt";

/// Fewest frames of a stack: the spatial figures take the noise of its mean off.
const STACK_MIN: usize = 8;
/// Fewest points of photon transfer.
const POINTS_MIN: usize = 5;
/// Longest side of a frame.
const SIDE_PX_MAX: u32 = 8_192;

/// Frames of one exposure and light.
#[derive(Debug)]
struct EmvaGroup {
    line: usize,
    is_lit: bool,
    exposure_ns: u64,
    /// 0 in the dark, and where the descriptor states none.
    photons: f64,
    files: Vec<String>,
}

/// A measurement that was read.
pub struct FoundMeasurement {
    /// Its sums, in which defective pixels have the codes of sound ones.
    pub measurement: ChannelMeasurement,
    /// The defective pixels.
    pub defects: DefectivePixels,
    /// Depth of the codes.
    pub bits: u32,
    /// Of the frames.
    pub size: Size,
    /// Points of photon transfer.
    pub points: usize,
    /// Frames of each stack.
    pub stack: usize,
    /// Exposure and light of both stacks.
    pub half: SeriesExposure,
    /// What a user should know.
    pub warnings: Vec<String>,
}

/// A folder with its descriptor.
struct EmvaFolder {
    files: InputFolders,
    descriptor: EmvaDescriptor,
}

impl EmvaFolder {
    fn open(folder: &Path) -> Result<Self, Error> {
        if !folder.join(DESCRIPTOR).exists() {
            let reason =
                format!("has no {DESCRIPTOR}; name a folder that 'sensel characterize' or an EMVA 1288 tool wrote");
            return Err(content_error(folder, reason));
        }
        let files = InputFolders::new(vec![folder.to_owned()]);
        let text = String::from_utf8(files.read(DESCRIPTOR)?)
            .map_err(|_| refused("is no UTF-8 text; use a descriptor of EMVA 1288".to_owned()))?;
        let descriptor = EmvaDescriptor::parse(&text)?;
        Ok(Self { files, descriptor })
    }

    /// The same, for frames of the sensor whose measurement is known.
    fn of_sensor(folder: &Path, size: Size, bits: u32) -> Result<Self, Error> {
        let found = Self::open(folder)?;
        let EmvaDescriptor { size: Size { width_px, height_px }, bits: own_bits, .. } = found.descriptor;
        if (Size { width_px, height_px }, own_bits) != (size, bits) {
            let reason = format!(
                "has frames of {width_px} x {height_px} pixels and {own_bits} bits; use frames of the same sensor: {} x {}, {bits} bits",
                size.width_px, size.height_px
            );
            return Err(content_error(folder, reason));
        }
        Ok(found)
    }

    fn codes(&self, file: &str) -> Result<Plane<u16>, Error> {
        frame(&self.files, file, self.descriptor.size, self.descriptor.bits)
    }

    /// How many of a group's first frames differ from each other.
    fn distinct(&self, group: &EmvaGroup, frames: usize) -> Result<usize, Error> {
        let bytes = |file: &String| Ok(blake3::hash(&self.files.read(file)?));
        let hashes: Vec<blake3::Hash> = group.files.iter().take(frames).map(bytes).collect::<Result<_, Error>>()?;
        Ok((0..hashes.len()).filter(|&at| !hashes[..at].contains(&hashes[at])).count())
    }

    /// Both stacks, of so many frames each.
    fn stacks(
        &self,
        stacks: &[&EmvaGroup; 2],
        frames: usize,
        mend: impl Fn(&mut Plane<u16>),
    ) -> Result<ChannelMeasurement, Error> {
        let mut measurement = ChannelMeasurement::of_points(self.descriptor.size, &[]);
        for group in stacks {
            for (at, file) in group.files.iter().take(frames).enumerate() {
                let mut codes = self.codes(file)?;
                mend(&mut codes);
                measurement.add(&group.shot(None, at), &codes);
            }
        }
        Ok(measurement)
    }
}

/// Reads a folder, the stacks twice: defective pixels are found in them first. Fails on a folder without descriptor, a line that is none,
/// frames of another size or depth, too few of them.
pub fn read(folder: &Path) -> Result<FoundMeasurement, Error> {
    let emva = EmvaFolder::open(folder)?;
    let series = emva.descriptor.series()?;
    let EmvaDescriptor { bits, size, .. } = emva.descriptor;
    let half = series.stacks[0].exposure();
    let exposures: Vec<SeriesExposure> = series.points.iter().map(|[bright, _]| bright.exposure()).collect();
    let mut warnings = Vec::new();
    let mut defects = {
        let distinct = emva.distinct(series.stacks[1], series.stack)?;
        if distinct < series.stack {
            warnings.push(format!(
                "only {distinct} of the dark stack's {} frames differ; take each frame anew, or noise and its intervals are wrong",
                series.stack
            ));
        }
        let shortest = emva.codes(&series.points[0][1].files[0])?;
        let stacks = emva.stacks(&series.stacks, series.stack, |_| {})?;
        DefectivePixels::find(&stacks.bright, &stacks.dark, u64_from(distinct), shortest.values(), bits)
    };
    let mut measurement = ChannelMeasurement::of_points(size, &exposures);
    let mut greatest = 0;
    let points = series.points.iter().enumerate().flat_map(|(at, pair)| pair.map(|group| (Some(at), group)));
    let stacks = series.stacks.map(|group| (None, group));
    for (point, group) in points.chain(stacks) {
        let most = if point.is_some() { group.files.len() } else { series.stack };
        for (at, file) in group.files.iter().take(most).enumerate() {
            let mut codes = emva.codes(file)?;
            greatest = codes.values().iter().copied().fold(greatest, u16::max);
            let shot = group.shot(point, at);
            defects.follow(&shot, &codes);
            defects.mend(&mut codes);
            measurement.add(&shot, &codes);
        }
    }
    // A whole factor of 16 is more than any series misses saturation by.
    if u32::from(greatest) < (1 << bits) / 16 {
        warnings.push(format!(
            "the greatest code is {greatest}, of {bits} bits; if the frames have fewer bits, correct line n of {DESCRIPTOR}"
        ));
    }
    let points = exposures.len();
    Ok(FoundMeasurement { measurement, defects, bits, size, points, stack: series.stack, half, warnings })
}

/// Reads the dark frames of a folder, of a sensor whose measurement is known, at another temperature.
/// Fails as [`read`] does, and on frames of fewer than two exposures.
pub fn read_dark(folder: &Path, temperature_k: f64, sensor: &FoundMeasurement) -> Result<DarkSeries, Error> {
    let emva = EmvaFolder::of_sensor(folder, sensor.size, sensor.bits)?;
    let mut points = Vec::new();
    for group in emva.descriptor.groups.iter().filter(|group| !group.is_lit && !group.files.is_empty()) {
        let mut sum = 0_u64;
        for file in &group.files {
            let mut codes = emva.codes(file)?;
            sensor.defects.mend(&mut codes);
            sum += codes.values().iter().map(|&code| u64::from(code)).sum::<u64>();
        }
        let frames = u64_from(group.files.len());
        let mean_dn = f64_from_u64(sum) / f64_from_u64(frames * u64_from(sensor.size.pixel_count()));
        points.push(DarkPoint { exposure_s: group.exposure().exposure_s(), mean_dn, frames });
    }
    let least = points.iter().map(|point| point.exposure_s).reduce(lesser);
    if points.iter().map(|point| point.exposure_s).reduce(greater) == least {
        return Err(content_error(
            folder,
            "has dark frames of fewer than two exposures; add a line d with another".to_owned(),
        ));
    }
    Ok(DarkSeries { temperature_k, points })
}

/// Reads the bright and the dark stack of a folder, of a sensor whose measurement is known.
/// Fails as [`read`] does.
pub fn read_flat(folder: &Path, sensor: &FoundMeasurement) -> Result<ChannelMeasurement, Error> {
    let emva = EmvaFolder::of_sensor(folder, sensor.size, sensor.bits)?;
    let stacks = emva.descriptor.stacks()?;
    let count = stacks.map(|group| group.files.len());
    emva.stacks(&stacks, count[0].min(count[1]), |codes| sensor.defects.mend(codes))
}

fn refused(reason: String) -> Error {
    Error::Content { file: DESCRIPTOR.to_owned(), reason }
}

struct EmvaDescriptor {
    bits: u32,
    size: Size,
    groups: Vec<EmvaGroup>,
}

/// Points and stacks of a descriptor, bright before dark.
struct EmvaSeries<'a> {
    points: Vec<[&'a EmvaGroup; 2]>,
    stacks: [&'a EmvaGroup; 2],
    /// Frames that both stacks have.
    stack: usize,
}

impl EmvaGroup {
    fn exposure(&self) -> SeriesExposure {
        SeriesExposure { exposure_ns: self.exposure_ns, photons: self.photons }
    }

    /// Its frame at an index; frames that exist have no number in a measurement.
    fn shot(&self, point: Option<usize>, at: usize) -> PlannedShot {
        let exposure = self.exposure();
        PlannedShot { frame: FrameIndex(0), exposure, is_lit: self.is_lit, point, is_first: at == 0 }
    }
}

impl EmvaDescriptor {
    fn parse(text: &str) -> Result<Self, Error> {
        let mut found: Option<(u32, Size)> = None;
        let mut groups: Vec<EmvaGroup> = Vec::new();
        for (at, line) in without_mark(text).lines().enumerate() {
            let number = at + 1;
            let wrong =
                |accepted: &str| refused(format!("line {number}: '{line}' is no line of a descriptor; use {accepted}"));
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                [] | ["v" | "#", ..] => {}
                ["n", rest @ ..] => {
                    let number = |field: usize| rest.get(field).and_then(|word| word.parse::<u32>().ok());
                    let numbers = (number(0), number(1), number(2));
                    let (Some(bits), Some(width_px), Some(height_px)) = numbers else {
                        return Err(wrong("n BITS WIDTH HEIGHT, such as n 12 640 480"));
                    };
                    let sides = 16..=SIDE_PX_MAX;
                    if !(1..=16).contains(&bits) || !sides.contains(&width_px) || !sides.contains(&height_px) {
                        return Err(wrong("1 to 16 bits and 16 to 8,192 pixels a side"));
                    }
                    if found.replace((bits, Size { width_px, height_px })).is_some() {
                        return Err(wrong("one line n"));
                    }
                }
                [kind @ ("b" | "d"), rest @ ..] => {
                    let is_lit = *kind == "b";
                    let exposure_ns = rest.first().and_then(|word| word.parse::<f64>().ok());
                    let photons = rest.get(1).map_or(Some(0.0), |word| word.parse::<f64>().ok());
                    let (Some(exposure_ns), Some(photons)) = (exposure_ns, photons) else {
                        return Err(wrong("b EXPOSURE_NS PHOTONS or d EXPOSURE_NS"));
                    };
                    if !((1.0..=1e15).contains(&exposure_ns) && (0.0..=1e12).contains(&photons)) {
                        return Err(wrong("an exposure of 1 to 1e15 ns and 0 to 1e12 photons per pixel"));
                    }
                    let exposure_ns = crate::num::u64_half_even(exposure_ns);
                    groups.push(EmvaGroup { line: number, is_lit, exposure_ns, photons, files: Vec::new() });
                }
                ["i", file] => {
                    // Windows tools write backslashes.
                    let file = file.replace('\\', "/");
                    groups.last_mut().ok_or_else(|| wrong("a line b or d before the first i"))?.files.push(file);
                }
                _ => return Err(wrong("n, b, d or i with its values")),
            }
        }
        let (bits, size) = found.ok_or_else(|| refused("has no line n BITS WIDTH HEIGHT".to_owned()))?;
        Ok(Self { bits, size, groups })
    }

    /// The longest groups, bright and dark.
    fn stacks(&self) -> Result<[&EmvaGroup; 2], Error> {
        let stack = |is_lit: bool| {
            let of = self.groups.iter().filter(|group| group.is_lit == is_lit && group.files.len() >= STACK_MIN);
            let kind = if is_lit { "bright" } else { "dark" };
            of.max_by_key(|group| group.files.len()).ok_or_else(|| {
                refused(format!("has no {kind} stack; use {STACK_MIN} or more frames of one exposure, better 50"))
            })
        };
        let stacks = [stack(true)?, stack(false)?];
        if stacks[0].exposure_ns != stacks[1].exposure_ns {
            let [bright, dark] = stacks.map(|group| group.exposure_ns);
            let reason = format!("its bright stack has {bright} ns, its dark one {dark} ns; use one exposure for both");
            return Err(refused(reason));
        }
        Ok(stacks)
    }

    fn series(&self) -> Result<EmvaSeries<'_>, Error> {
        let stacks = self.stacks()?;
        let pairs = |is_lit| self.groups.iter().filter(move |group| group.is_lit == is_lit && group.files.len() == 2);
        let mut points = Vec::new();
        for bright in pairs(true) {
            let dark = pairs(false).find(|dark| dark.exposure_ns == bright.exposure_ns).ok_or_else(|| {
                let EmvaGroup { line, exposure_ns, .. } = bright;
                refused(format!("line {line}: no dark pair has its exposure of {exposure_ns} ns; add two dark frames"))
            })?;
            points.push([bright, dark]);
        }
        points.sort_by(|[a, _], [b, _]| a.exposure_ns.cmp(&b.exposure_ns).then(a.photons.total_cmp(&b.photons)));
        if points.len() < POINTS_MIN {
            return Err(refused(format!(
                "has {} bright pairs; use pairs at {POINTS_MIN} or more exposures, from dark to saturation",
                points.len()
            )));
        }
        if points.first().map(|[bright, _]| bright.exposure_ns) == points.last().map(|[bright, _]| bright.exposure_ns) {
            let reason = "all pairs have one exposure; dark current and noise without exposure need several".to_owned();
            return Err(refused(reason));
        }
        let frames = stacks.map(|group| group.files.len());
        Ok(EmvaSeries { points, stacks, stack: frames[0].min(frames[1]) })
    }
}

/// Codes of a frame.
fn frame(files: &InputFolders, name: &str, size: Size, bits: u32) -> Result<Plane<u16>, Error> {
    let wrong = |reason: String| Error::Content { file: name.to_owned(), reason };
    let bytes = files.read(name)?;
    let Size { width_px: width, height_px: height } = size;
    let each = if bits > 8 { 2 } else { 1 };
    let expected = each * size.pixel_count();
    // Codes may begin with the letters of a TIFF file, which is longer than they are.
    let is_tiff = bytes.len() != expected && [b"II*\0", b"MM\0*"].iter().any(|letters| bytes.starts_with(*letters));
    let codes = if bytes.starts_with(b"\x89PNG") || is_tiff {
        let (codes, _) = picture::grey_of(&bytes, name)?;
        if codes.size() != size {
            let Size { width_px, height_px } = codes.size();
            let reason = format!("has {width_px} x {height_px} pixels, line n of {DESCRIPTOR} says {width} x {height}");
            return Err(wrong(reason));
        }
        codes
    } else {
        if bytes.len() != expected {
            let found = bytes.len();
            let reason = format!("has {found} bytes; {width} x {height} codes of {bits} bits take {expected}");
            return Err(wrong(reason));
        }
        let values = match each {
            1 => bytes.iter().map(|&byte| u16::from(byte)).collect(),
            _ => bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect(),
        };
        Plane::from_values(size, values)
    };
    let most = codes.values().iter().copied().max().unwrap_or(0);
    if u64::from(most) >= 1_u64 << bits {
        return Err(wrong(format!("has code {most}, beyond {bits} bits; correct line n of {DESCRIPTOR}")));
    }
    Ok(codes)
}
