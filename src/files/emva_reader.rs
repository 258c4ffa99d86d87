//! Reads the folder of an EMVA 1288 measurement: the descriptor `emva1288.txt` and the frames that it names.
//!
//! Lines of a descriptor: `n BITS WIDTH HEIGHT`; `b EXPOSURE_NS PHOTONS` and `d EXPOSURE_NS` begin a bright and a dark group; `i FILE` is
//! a frame of it. Groups of two frames are points of photon transfer; the longest groups are the stacks. Frames are raw (row-major, u8
//! up to 8 bits, else u16 little-endian) or PNG.

use std::path::Path;

use super::errors::content_error;
use super::input::InputFolders;
use super::picture;
use crate::characterize::measure::ChannelMeasurement;
use crate::characterize::set::{PlannedShot, SeriesExposure};
use crate::error::Error;
use crate::plane::Plane;
use crate::scene::images::PictureBytes as _;
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
    /// Its sums.
    pub measurement: ChannelMeasurement,
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

/// Reads a folder. Fails on a folder without descriptor, a line that is none, frames of another size or depth, too few of them.
pub fn read(folder: &Path) -> Result<FoundMeasurement, Error> {
    if !folder.join(DESCRIPTOR).exists() {
        let reason =
            format!("has no {DESCRIPTOR}; name a folder that 'sensel characterize' or an EMVA 1288 tool wrote");
        return Err(content_error(folder, reason));
    }
    let files = InputFolders::new(vec![folder.to_owned()]);
    let text = String::from_utf8(files.read(DESCRIPTOR)?)
        .map_err(|_| refused("is no UTF-8 text; use a descriptor of EMVA 1288".to_owned()))?;
    let descriptor = EmvaDescriptor::parse(&text)?;
    let series = descriptor.series()?;
    let half = series.stacks[0].exposure();
    let exposures: Vec<SeriesExposure> = series.points.iter().map(|[bright, _]| bright.exposure()).collect();
    let mut measurement = ChannelMeasurement::of_points(descriptor.size, &exposures);
    let mut greatest = 0;
    let (stacks, mut number) = (series.stacks.map(|group| (None, group)), 0);
    let points = series.points.iter().enumerate().flat_map(|(at, pair)| pair.map(|group| (Some(at), group)));
    for (point, group) in points.chain(stacks) {
        let most = if point.is_some() { group.files.len() } else { series.stack };
        for (place, file) in group.files.iter().take(most).enumerate() {
            let codes = frame(&files, file, descriptor.size, descriptor.bits)?;
            greatest = codes.values().iter().copied().fold(greatest, u16::max);
            let shot = PlannedShot {
                frame: FrameIndex(number),
                exposure: group.exposure(),
                is_lit: group.is_lit,
                point,
                is_first: place == 0,
            };
            measurement.add(&shot, &codes);
            number += 1;
        }
    }
    let mut warnings = Vec::new();
    // A whole factor of 16 is more than any series misses saturation by.
    if u32::from(greatest) < (1 << descriptor.bits) / 16 {
        warnings.push(format!(
            "the greatest code is {greatest}, of {} bits; if the frames have fewer bits, correct line n of {DESCRIPTOR}",
            descriptor.bits
        ));
    }
    let EmvaDescriptor { bits, size, .. } = descriptor;
    Ok(FoundMeasurement { measurement, bits, size, points: exposures.len(), stack: series.stack, half, warnings })
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
}

impl EmvaDescriptor {
    fn parse(text: &str) -> Result<Self, Error> {
        let mut found: Option<(u32, Size)> = None;
        let mut groups: Vec<EmvaGroup> = Vec::new();
        for (place, line) in text.lines().enumerate() {
            let number = place + 1;
            let wrong =
                |accepted: &str| refused(format!("line {number}: '{line}' is no line of a descriptor; use {accepted}"));
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                [] | ["v" | "#", ..] => {}
                ["n", rest @ ..] => {
                    let number = |place: usize| rest.get(place).and_then(|word| word.parse::<u32>().ok());
                    let numbers = (number(0), number(1), number(2));
                    let (Some(bits), Some(width_px), Some(height_px)) = numbers else {
                        return Err(wrong("n BITS WIDTH HEIGHT, such as n 12 640 480"));
                    };
                    let sides = 16..=SIDE_PX_MAX;
                    if !(1..=16).contains(&bits) || !sides.contains(&width_px) || !sides.contains(&height_px) {
                        return Err(wrong("1 to 16 bits and 16 to 8,192 pixels a side"));
                    }
                    found = Some((bits, Size { width_px, height_px }));
                }
                [kind @ ("b" | "d"), rest @ ..] => {
                    let is_lit = *kind == "b";
                    let exposure_ns = rest.first().and_then(|word| word.parse::<f64>().ok());
                    let photons = rest.get(1).map_or(Some(0.0), |word| word.parse::<f64>().ok());
                    let (Some(exposure_ns), Some(photons)) = (exposure_ns, photons) else {
                        return Err(wrong("b EXPOSURE_NS PHOTONS or d EXPOSURE_NS"));
                    };
                    if !((1.0..=1e15).contains(&exposure_ns) && (0.0..=1e12).contains(&photons)) {
                        return Err(wrong("an exposure of 1 to 1e15 ns and 0 to 1e12 photons a pixel"));
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

    fn series(&self) -> Result<EmvaSeries<'_>, Error> {
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
    let codes = if bytes.starts_with(b"\x89PNG") {
        let (codes, _) = picture::grey_of(&bytes, name)?;
        if codes.size() != size {
            let Size { width_px, height_px } = codes.size();
            let reason = format!("has {width_px} x {height_px} pixels, line n of {DESCRIPTOR} says {width} x {height}");
            return Err(wrong(reason));
        }
        codes
    } else {
        let each = if bits > 8 { 2 } else { 1 };
        let expected = each * size.pixel_count();
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
