//! The host's side of the link: bytes of each camera's frame to what the tracker may know. The host uses the received bytes, the
//! configuration and its own clock only.

use super::host::HostFrame;
use super::state::Session;
use crate::error::Error;
use crate::link;

impl Session {
    /// Decodes what arrived, and gives it to the host. Fails on a picture that the host's own extractor refuses.
    pub(super) fn receive(&mut self, packets: &[Vec<u8>]) -> Result<HostFrame, Error> {
        let mut received = Vec::with_capacity(packets.len());
        // If features arrive, the pictures beside them are not decoded.
        let features_come = self.setup.sensor.link.mode.sends_features();
        for bytes in packets {
            let decoded = if features_come { link::decode_without_pictures(bytes) } else { link::decode(bytes) };
            self.totals.link.counts.merge(&decoded.counts);
            let mut frames = decoded.frames;
            let best = frames.iter().position(|frame| frame.metadata.is_some()).unwrap_or(0);
            received.push((best < frames.len()).then(|| frames.swap_remove(best)));
        }
        let number = u64::from(self.next_frame().0);
        self.host.receive(&self.setup.sensor, &mut self.extractors, (number, received))
    }
}
