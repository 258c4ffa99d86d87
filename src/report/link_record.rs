//! The link's part of `report.json`.

use serde::{Deserialize, Serialize};

/// What the host's packet decoder saw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkRecord {
    /// Packets that arrived.
    pub packets: u64,
    /// Headers of which one bit was corrected.
    pub headers_corrected: u64,
    /// Packets refused for their header or checksum, or cut short: the sum of the next three.
    pub packets_refused: u64,
    /// For a header with more flipped bits than its code corrects, or of an unknown type.
    pub headers_refused: u64,
    /// For a checksum, or a layout that is not known.
    pub payloads_refused: u64,
    /// Because the bytes ended.
    pub packets_cut_short: u64,
    /// Packets that came a second time.
    pub packets_doubled: u64,
    /// Bytes skipped on the search for the next packet.
    pub bytes_skipped: u64,
    /// Frames of which something was lost.
    pub frames_damaged: u64,
    /// Announced rows that did not arrive undamaged.
    pub rows_lost: u64,
    /// Bits that were flipped on the way, which the host does not know.
    pub bits_flipped: u64,
    /// Frames that carried rows, of all cameras.
    pub frames_with_rows: u64,
    /// Rows for which the readout stood still because their FIFO was full.
    pub rows_stalled: u64,
    /// How long it stood still, mean over frames and cameras.
    pub stalled_us_per_frame: f64,
    /// Most rows in the FIFO at once.
    pub fifo_rows_most: u32,
    /// From the reading of the last row to the last feature byte, the longest of the run.
    pub feature_latency_us: Option<f64>,
    /// Features that left the extractor and that the link had no time for before the next frame; they are not in the run's features.
    pub features_dropped: u64,
}
