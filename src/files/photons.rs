//! Photon store on disk: each exposure's mean photons, losslessly compressed, in a separate cache. Rounded photons are stored as levels.
//!
//! An entry is a header and the planes' bits. Each pixel is predicted by its left and upper neighbours; what the prediction misses is
//! coded by `pco`. A damaged entry is said once and counts as absent, so that the exposure is rendered and stored again.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use pco::ChunkConfig;

use super::cache::{Cache, CacheEntry};
use crate::error::Error;
use crate::num::u64_from;
use crate::optics::{Exposure, Rounding};
use crate::plane::Plane;
use crate::run::PhotonStore;
use crate::units::Size;

/// Of the entries' form: magic number and version.
const FORM: [u8; 4] = *b"SPh2";
/// Bytes of an entry before its coded pixels: form, width, height, rays, variance ratio, rounding step (0: none).
const HEADER_BYTES: usize = 4 + 4 + 4 + 8 + 8 + 8;
/// Effort of the coder, from 0 to 12.
const EFFORT: usize = 1;
/// Pixels of an entry, at most: no header makes this program reserve more memory.
const PIXELS_MAX: u64 = 1 << 28;

/// What a store was asked so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StoreCounts {
    /// Exposures that were there.
    pub found: u64,
    /// Exposures that were not there, or damaged.
    pub rendered: u64,
    /// Entries that were damaged.
    pub damaged: u64,
    /// Bytes that were stored.
    pub stored_bytes: u64,
}

/// A photon store in a folder.
pub struct PhotonFiles {
    cache: Cache,
    say: Box<dyn Fn(&str) + Send + Sync>,
    /// Whether it was said that nothing can be stored.
    is_refused: AtomicBool,
    found: AtomicU64,
    rendered: AtomicU64,
    damaged: AtomicU64,
    stored_bytes: AtomicU64,
}

impl PhotonFiles {
    /// Opens the store in a folder, which is made if need be. `say` is told of damage and of a disk that takes nothing. Fails where the
    /// folder cannot be made.
    pub fn open(folder: &Path, capacity_bytes: u64, say: impl Fn(&str) + Send + Sync + 'static) -> Result<Self, Error> {
        Ok(Self {
            cache: Cache::open(Some(folder), capacity_bytes)?,
            say: Box::new(say),
            is_refused: AtomicBool::new(false),
            found: AtomicU64::new(0),
            rendered: AtomicU64::new(0),
            damaged: AtomicU64::new(0),
            stored_bytes: AtomicU64::new(0),
        })
    }

    /// What it was asked so far.
    pub fn counts(&self) -> StoreCounts {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        StoreCounts {
            found: of(&self.found),
            rendered: of(&self.rendered),
            damaged: of(&self.damaged),
            stored_bytes: of(&self.stored_bytes),
        }
    }

    /// Whether an entry lies under a key; it may be damaged.
    pub fn has(&self, key: &str) -> bool {
        self.cache.has(key)
    }

    fn count(&self, counter: &AtomicU64) {
        counter.fetch_add(1, Ordering::Relaxed);
    }
}

impl PhotonStore for PhotonFiles {
    fn load(&self, key: &str) -> Option<Exposure> {
        let decoded = match self.cache.find(key) {
            CacheEntry::Whole(bytes) => decode(&bytes),
            CacheEntry::Damaged => None,
            CacheEntry::Absent => {
                self.count(&self.rendered);
                return None;
            }
        };
        if decoded.is_some() {
            self.count(&self.found);
            return decoded;
        }
        self.count(&self.damaged);
        self.count(&self.rendered);
        let folder = self.cache.folder().display();
        (self.say)(&format!("stored photons are damaged and rendered again: {folder}/{key}.entry"));
        None
    }

    fn keep(&self, key: &str, exposure: &Exposure, rounding: Option<Rounding>) {
        let bytes = encode(exposure, rounding);
        match self.cache.put(key, &bytes) {
            Ok(true) => {
                self.stored_bytes.fetch_add(u64_from(bytes.len()), Ordering::Relaxed);
            }
            Ok(false) => self.refuse("one exposure is more than the store may hold; use a larger --photons-gib"),
            Err(error) => self.refuse(&error.to_string()),
        }
    }
}

impl PhotonFiles {
    fn refuse(&self, reason: &str) {
        if !self.is_refused.swap(true, Ordering::Relaxed) {
            (self.say)(&format!("photons are not stored, every run renders them: {reason}"));
        }
    }
}

fn config() -> ChunkConfig {
    let plain = ChunkConfig::default().with_compression_level(EFFORT);
    plain.with_delta_spec(pco::DeltaSpec::NoOp).with_mode_spec(pco::ModeSpec::Classic)
}

/// An entry's bytes. Photons that are rounded so are stored as levels.
pub fn encode(exposure: &Exposure, rounding: Option<Rounding>) -> Vec<u8> {
    let photons = &exposure.photons;
    let size = photons.size();
    let stored = |&value: &f32| rounding.map_or(value.to_bits(), |rounding| rounding.level(value));
    let bits: Vec<u32> = photons.values().iter().map(stored).collect();
    let missed = missed(&bits, photons.width_px());
    let coded = pco::standalone::simple_compress(&missed, &config()).expect("the coder takes any u32");
    let mut bytes = Vec::with_capacity(HEADER_BYTES + coded.len());
    bytes.extend(FORM);
    bytes.extend(size.width_px.to_le_bytes());
    bytes.extend(size.height_px.to_le_bytes());
    bytes.extend(exposure.rays.to_le_bytes());
    bytes.extend(exposure.render_variance_ratio.to_bits().to_le_bytes());
    bytes.extend(rounding.map_or(0.0, Rounding::step_sigma).to_le_bytes());
    bytes.extend(coded);
    bytes
}

/// The exposure of an entry's bytes; none where they are no entry of this form.
pub fn decode(bytes: &[u8]) -> Option<Exposure> {
    let (header, coded) = bytes.split_at_checked(HEADER_BYTES)?;
    let mut header = Header(header);
    if header.take::<4>()? != FORM {
        return None;
    }
    let (width_px, height_px) = (u32::from_le_bytes(header.take()?), u32::from_le_bytes(header.take()?));
    let (rays, ratio) = (u64::from_le_bytes(header.take()?), u64::from_le_bytes(header.take()?));
    let step_sigma = f64::from_le_bytes(header.take()?);
    let steps = Rounding::STEP_SIGMA_MIN..=Rounding::STEP_SIGMA_MAX;
    if step_sigma != 0.0 && !steps.contains(&step_sigma) {
        return None;
    }
    let rounding = Rounding::new(step_sigma);
    let pixels = u64::from(width_px) * u64::from(height_px);
    if pixels == 0 || pixels > PIXELS_MAX {
        return None;
    }
    let size = Size { width_px, height_px };
    let missed: Vec<u32> = pco::standalone::simple_decompress(coded).ok()?;
    if missed.len() != size.pixel_count() {
        return None;
    }
    let values = restored(missed, crate::num::index(width_px));
    let photons = |stored: u32| rounding.map_or(f32::from_bits(stored), |rounding| rounding.photons(stored));
    let photons = Plane::from_values(size, values.into_iter().map(photons).collect());
    Some(Exposure { photons, render_variance_ratio: f64::from_bits(ratio), rays })
}

struct Header<'a>(&'a [u8]);

impl Header<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }
}

/// Mean of the left and the upper neighbour's bits, of whichever are there. Bits of positive floats are in the order of their values.
fn predicted(bits: &[u32], at: usize, column: usize, width: usize) -> u32 {
    match (column > 0, at >= width) {
        (true, true) => u32::midpoint(bits[at - 1], bits[at - width]),
        (true, false) => bits[at - 1],
        (false, true) => bits[at - width],
        (false, false) => 0,
    }
}

/// What the prediction misses, with its sign in the lowest bit.
fn missed(bits: &[u32], width: usize) -> Vec<u32> {
    let folded = |(at, &own): (usize, &u32)| {
        let signed = own.wrapping_sub(predicted(bits, at, at % width, width)).cast_signed();
        ((signed << 1) ^ (signed >> 31)).cast_unsigned()
    };
    bits.iter().enumerate().map(folded).collect()
}

/// The inverse of `missed`, in place.
fn restored(mut missed: Vec<u32>, width: usize) -> Vec<u32> {
    let own = |folded: u32, predicted: u32| predicted.wrapping_add((folded >> 1) ^ (folded & 1).wrapping_neg());
    let (first, rest) = missed.split_at_mut(width);
    let mut left = 0;
    for value in first.iter_mut() {
        left = own(*value, left);
        *value = left;
    }
    let mut above: &[u32] = first;
    for row in rest.chunks_exact_mut(width) {
        let mut left = above[0];
        for (value, &upper) in row.iter_mut().zip(above) {
            left = own(*value, u32::midpoint(left, upper));
            *value = left;
        }
        above = row;
    }
    missed
}

/// Bytes of a number of gibibytes.
pub fn gib(gib: u32) -> u64 {
    u64::from(gib) << 30
}

#[cfg(test)]
mod tests;
