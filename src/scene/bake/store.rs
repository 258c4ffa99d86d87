//! Encodes a bake as versioned, checksummed bytes, and decodes it.

use super::super::light::{BANDS, Bands};
use super::Bake;
use super::settings::BAKE_VERSION;
use crate::error::Error;
use crate::num::u64_from;

const MAGIC: &[u8; 8] = b"SENSELBK";
const HEADER_BYTES: usize = 8 + 4 + 32 + 8 + 8 + 1;
const CHECKSUM_BYTES: usize = 32;

impl Bake {
    /// Key of the scene and settings that this belongs to.
    pub fn key(&self) -> [u8; 32] {
        self.key
    }

    /// Magic, version, key, counts of steady and of flickering irradiance, whether light bounced, all irradiance in little-endian
    /// `f32`, and the blake3 of all that.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(
            HEADER_BYTES + 4 * BANDS * (self.irradiance.len() + self.flickering.len()) + CHECKSUM_BYTES,
        );
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&BAKE_VERSION.to_le_bytes());
        bytes.extend_from_slice(&self.key);
        bytes.extend_from_slice(&u64_from(self.irradiance.len()).to_le_bytes());
        bytes.extend_from_slice(&u64_from(self.flickering.len()).to_le_bytes());
        bytes.push(u8::from(self.bounces));
        for value in self.irradiance.iter().chain(&self.flickering).flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        bytes
    }

    /// Reads what `to_bytes` wrote.
    ///
    /// # Errors
    /// Bytes that are not a whole bake of this version.
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
        let values: Vec<f32> = content[HEADER_BYTES..]
            .chunks_exact(4)
            .map(|word| f32::from_le_bytes(word.try_into().expect("chunks of four")))
            .collect();
        let mut irradiance: Vec<Bands> =
            values.chunks_exact(BANDS).map(|bands| bands.try_into().expect("chunks of a sample")).collect();
        let count = |at: usize| u64::from_le_bytes(content[at..at + 8].try_into().expect("eight bytes were taken"));
        let (steady, flickering) = (count(44), count(52));
        let fits = steady.checked_add(flickering) == Some(u64_from(irradiance.len()));
        if !fits || !(flickering == 0 || flickering == steady) {
            return Err(refuse("its counts do not fit its length"));
        }
        let flickering = irradiance.split_off(usize::try_from(steady).expect("it was compared with a length"));
        Ok(Self { key, irradiance, flickering, bounces: content[60] != 0 })
    }
}
