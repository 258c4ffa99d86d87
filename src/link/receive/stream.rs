//! The host's decoder for a stream that is longer than memory. Returns frames as they end, equal to those that `decode` finds in all bytes
//! at once.
//!
//! What a packet is may depend on as many bytes as the longest one has, so the last of them wait for the next piece. What was read of a
//! frame that has not ended is read again then.

use super::decoded::{Decoded, LinkCounts, Received};
use super::decoder::HostDecoder;
use super::frame::Open;
use crate::link::packet::{CRC_BYTES, HEADER_BYTES};

/// Bytes that decide what is at an offset: a line start, and the longest packet behind it.
const REACH_BYTES: usize = 2 * HEADER_BYTES + 65_535 + CRC_BYTES;

/// A host that listens.
#[derive(Clone, Debug)]
pub struct Decoder {
    wants_pictures: bool,
    /// Bytes that are not yet decoded.
    held: Vec<u8>,
    /// Channel and number of the frame whose start was read before these.
    open: Option<(u8, u16)>,
    counts: LinkCounts,
    /// Number of bytes from which on the decoder tries again.
    wanted_bytes: usize,
}

impl Decoder {
    /// A host before the first byte. One without pictures decodes features only.
    pub fn new(wants_pictures: bool) -> Self {
        let (held, counts) = (Vec::new(), LinkCounts::default());
        Self { wants_pictures, held, open: None, counts, wanted_bytes: REACH_BYTES }
    }

    /// Takes more bytes. Gives back the frames that ended.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Received> {
        self.held.extend_from_slice(bytes);
        if self.held.len() < self.wanted_bytes {
            return Vec::new();
        }
        let mut host = self.host();
        // After so many bytes nothing was open but a frame of which only the start was read.
        let (mut certain, mut at) = ((0, 0, host.decoded.counts, self.open), 0);
        while self.held.len() - at >= REACH_BYTES {
            at += host.step(&self.held[at..]);
            // A search that ran into the end may have passed a packet that is not whole.
            if self.held.len() - at < REACH_BYTES {
                break;
            }
            if host.open.is_none() || host.is_fresh {
                let open = host.open.as_ref().map(|open| (open.virtual_channel, open.frame_number));
                certain = (at, host.decoded.frames.len(), host.decoded.counts, open);
            }
        }
        let mut frames = host.decoded.frames;
        let (read_bytes, ended, counts, open) = certain;
        frames.truncate(ended);
        self.counts.merge(&counts);
        self.open = open;
        self.held.drain(..read_bytes);
        // Bytes that were decoded in vain are tried again once there are twice as many: the cost of a piece stays independent of the frame.
        self.wanted_bytes = if read_bytes > 0 { REACH_BYTES } else { 2 * self.held.len() };
        frames
    }

    /// What has ended of the stream is decoded; the rest is what a stream leaves that is cut short. Gives back the frames that are left,
    /// and what was right and wrong of all bytes.
    pub fn finish(mut self) -> Decoded {
        let Decoded { frames, counts } = self.host().decode_all(&self.held);
        self.counts.merge(&counts);
        Decoded { frames, counts: self.counts }
    }

    fn host<'a>(&self) -> HostDecoder<'a> {
        HostDecoder::new(self.wants_pictures, self.open.map(|(channel, number)| Open::new(channel, number)))
    }
}
