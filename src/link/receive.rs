//! The host's end of the link. Decodes bytes that may be damaged into frames, and counts the errors.
//!
//! No length is trusted before its header's ECC holds and the bytes are there. After a header that cannot be corrected the
//! next packet is found by the first offset whose header holds exactly and whose payload's CRC holds too, or which ends the
//! open frame or starts one after it; a real receiver has the lane's own start of transmission for that.

mod decoded;
mod decoder;
mod frame;
mod stream;

pub use decoded::{Decoded, LinkCounts, Received};
use decoder::HostDecoder;
pub use stream::Decoder;

/// Decodes packets that stand back to back. Any bytes are taken: damage is counted, never a panic.
pub fn decode(bytes: &[u8]) -> Decoded {
    HostDecoder::new(true, None).decode_all(bytes)
}

/// The same for a host that looks at features only: frames have no picture, and everything else is as `decode` says.
pub fn decode_without_pictures(bytes: &[u8]) -> Decoded {
    HostDecoder::new(false, None).decode_all(bytes)
}
