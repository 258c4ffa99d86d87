//! Encodes a bake as versioned, checksummed bytes, and decodes it.

use super::super::light::{BANDS, Bands};
use super::settings::BAKE_VERSION;
use super::{Bake, ListedLight, SourceLight, SourceLists};
use crate::error::Error;
use crate::num::u64_from;

const MAGIC: &[u8; 8] = b"SENSELBK";
const HEADER_BYTES: usize = 8 + 4 + 32 + COUNTS * 8 + 1;
/// Counts in the header.
const COUNTS: usize = 6;
/// Words of an entry of a list of sources.
const ENTRY_WORDS: usize = 3;
const CHECKSUM_BYTES: usize = 32;

impl Bake {
    /// Key of the scene and settings that this belongs to.
    pub fn key(&self) -> [u8; 32] {
        self.key
    }

    /// Magic, version, key, counts of steady and of flickering irradiance, of the lists of sources at shadow edges and of their entries, of
    /// those on normal maps and of theirs, whether light bounced, all irradiance, then the lists' starts and entries in little-endian words
    /// of four bytes, and the blake3 of all that.
    pub fn to_bytes(&self) -> Vec<u8> {
        let irradiances = self.irradiance.len() + self.flickering.len();
        let lists = [&self.edges, &self.on_normal_maps];
        let words_of = |lists: &SourceLists| lists.starts.len() + ENTRY_WORDS * lists.lights.len();
        let words = BANDS * irradiances + words_of(lists[0]) + words_of(lists[1]);
        let mut bytes = Vec::with_capacity(HEADER_BYTES + 4 * words + CHECKSUM_BYTES);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&BAKE_VERSION.to_le_bytes());
        bytes.extend_from_slice(&self.key);
        let lengths = lists.iter().flat_map(|lists| [lists.starts.len(), lists.lights.len()]);
        let counts = [self.irradiance.len(), self.flickering.len()].into_iter().chain(lengths);
        counts.for_each(|count| bytes.extend_from_slice(&u64_from(count).to_le_bytes()));
        bytes.push(u8::from(self.bounces));
        for value in self.irradiance.iter().chain(&self.flickering).flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        for SourceLists { starts, lights } in lists {
            starts.iter().for_each(|start| bytes.extend_from_slice(&start.to_le_bytes()));
            for ListedLight { source, light } in lights {
                bytes.extend_from_slice(&source.to_le_bytes());
                bytes.extend_from_slice(&light.unoccluded.to_le_bytes());
                bytes.extend_from_slice(&light.received.to_le_bytes());
            }
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        bytes
    }

    /// Reads what `to_bytes` wrote.
    /// Fails on bytes that are not a whole bake of this version.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        let refuse = |reason: &str| Error::Content { file: name.to_owned(), reason: reason.to_owned() };
        if bytes.len() < HEADER_BYTES + CHECKSUM_BYTES || !bytes.starts_with(MAGIC) {
            return Err(refuse("not a bake; delete it and it will be made anew"));
        }
        let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM_BYTES);
        if blake3::hash(content).as_bytes() != checksum {
            return Err(refuse("damaged or cut off; delete it and it will be made anew"));
        }
        if content[8..12] != BAKE_VERSION.to_le_bytes() {
            return Err(refuse("of another version; delete it and it will be made anew"));
        }
        let key: [u8; 32] = content[12..44].try_into().expect("32 bytes were taken");
        let count = |number: usize| {
            let start = 44 + 8 * number;
            let count = u64::from_le_bytes(content[start..start + 8].try_into().expect("eight bytes were taken"));
            usize::try_from(count).unwrap_or(usize::MAX)
        };
        let counts: [usize; COUNTS] = std::array::from_fn(count);
        let [steady, flickering, ..] = counts;
        let words: Vec<u32> = content[HEADER_BYTES..]
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().expect("chunks of four")))
            .collect();
        let in_all = |each: &[(usize, usize)]| {
            each.iter().try_fold(0_usize, |sum, &(count, words)| sum.checked_add(count.checked_mul(words)?))
        };
        let [_, _, edge_starts, edges, map_starts, maps] = counts;
        let of_lists = [(edge_starts, 1), (edges, ENTRY_WORDS), (map_starts, 1), (maps, ENTRY_WORDS)];
        let fits = in_all(&[&[(steady, BANDS), (flickering, BANDS)], &of_lists[..]].concat()) == Some(words.len());
        if !fits || !(flickering == 0 || flickering == steady) {
            return Err(refuse("its counts do not fit its length"));
        }
        let (light, mut rest) = words.split_at(BANDS * (steady + flickering));
        let mut irradiance: Vec<Bands> =
            light.chunks_exact(BANDS).map(|bands| std::array::from_fn(|band| f32::from_bits(bands[band]))).collect();
        let flickering = irradiance.split_off(steady);
        let entry = |words: &[u32]| ListedLight {
            source: words[0],
            light: SourceLight { unoccluded: f32::from_bits(words[1]), received: f32::from_bits(words[2]) },
        };
        let [edges, on_normal_maps] = [(edge_starts, edges), (map_starts, maps)].map(|(starts, entries)| {
            let (starts, after) = rest.split_at(starts);
            let (entries, after) = after.split_at(ENTRY_WORDS * entries);
            rest = after;
            SourceLists { starts: starts.to_vec(), lights: entries.chunks_exact(ENTRY_WORDS).map(entry).collect() }
        });
        if !(edges.is_sound(steady) && on_normal_maps.is_sound(steady)) {
            return Err(refuse("its lists of sources do not fit its samples"));
        }
        Ok(Self { key, irradiance, flickering, bounces: content[HEADER_BYTES - 1] != 0, edges, on_normal_maps })
    }
}
