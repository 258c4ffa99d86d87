//! Lists the packets of a frame in the order in which they are sent.
//!
//! Rows are sent as they are read. Features leave in the gaps between rows: after a row's packet at most one feature packet follows,
//! with no more features than pass before the next row is read, so features never make a row wait. The rest waits for the
//! next gap, or for the end of the rows. In a frame without rows features leave as soon as they are made. The order is a
//! function of row and feature counts and of one number, the features that fit a gap, and so is the byte stream.

use crate::link::params::LinkParams;
use crate::link::records::FEATURES_PER_PACKET_MAX;
use crate::num::u32_from;

/// A packet of a frame, without its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlannedPacket {
    /// Opens the frame.
    FrameStart,
    /// The line of embedded data.
    Embedded,
    /// The number of the row that follows, counted from 0 here and from 1 on the link.
    LineStart(u32),
    /// A row of codes.
    Row(u32),
    /// Some features of the frame.
    Features {
        /// Index of the first one in its frame.
        first: u32,
        /// How many.
        count: u32,
        /// No other feature packet follows in this frame.
        last: bool,
        /// Row after whose reading the packet leaves.
        after_row: u32,
    },
    /// Closes the frame.
    FrameEnd,
}

/// Features that leave the extractor together, in the order of the frame's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// How many.
    pub features: u32,
    /// The row whose reading completes them, counted from 0 in the picture.
    pub after_row: u32,
}

/// What a frame has to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FramePlan<'a> {
    /// Rows of the picture.
    pub rows: u32,
    /// Whether their codes are sent.
    pub sends_codes: bool,
    /// Features by the rows that complete them, rows rising; `None` where features are not sent.
    pub batches: Option<&'a [Batch]>,
    /// Features that fit between two rows' packets: `LinkParams::features_per_gap`.
    pub features_per_gap: u32,
}

/// Features that wait for their packets.
struct Queue {
    next: u32,
    waiting: u32,
}

impl Queue {
    fn packet(&mut self, most: u32, after_row: u32, ends: bool) -> PlannedPacket {
        let count = self.waiting.min(most);
        let first = self.next;
        self.next += count;
        self.waiting -= count;
        PlannedPacket::Features { first, count, last: ends && self.waiting == 0, after_row }
    }
}

impl LinkParams {
    /// The packets of a frame in their order.
    pub fn packets(&self, plan: &FramePlan) -> Vec<PlannedPacket> {
        let rows = if plan.sends_codes { plan.rows } else { 0 };
        let mut packets = Vec::with_capacity(4 + crate::num::index(rows) * 2);
        packets.extend([PlannedPacket::FrameStart, PlannedPacket::Embedded]);
        let mut queue = Queue { next: 0, waiting: 0 };
        let mut batches = plan.batches.unwrap_or(&[]).iter().copied().peekable();
        let last_row = plan.rows.saturating_sub(1);
        let most = u32_from(FEATURES_PER_PACKET_MAX);
        let per_packet = if plan.sends_codes { plan.features_per_gap.min(most) } else { most };
        for row in 0..last_row {
            self.push_row(&mut packets, row, rows);
            while let Some(batch) = batches.next_if(|batch| batch.after_row <= row) {
                queue.waiting += batch.features;
            }
            // With rows one packet a gap; without them the link is free.
            while queue.waiting > 0 && per_packet > 0 {
                packets.push(queue.packet(per_packet, row, false));
                if plan.sends_codes {
                    break;
                }
            }
        }
        self.push_row(&mut packets, last_row, rows);
        if plan.batches.is_some() {
            queue.waiting += batches.map(|batch| batch.features).sum::<u32>();
            loop {
                packets.push(queue.packet(most, last_row, true));
                if queue.waiting == 0 {
                    break;
                }
            }
        }
        packets.push(PlannedPacket::FrameEnd);
        packets
    }

    fn push_row(&self, packets: &mut Vec<PlannedPacket>, row: u32, rows: u32) {
        if row < rows {
            packets.extend(self.line_sync.then_some(PlannedPacket::LineStart(row)));
            packets.push(PlannedPacket::Row(row));
        }
    }
}

/// The features of a whole list that all wait for the frame's last row: the latest that they can be.
pub fn after_the_rows(features: u32) -> [Batch; 1] {
    [Batch { features, after_row: u32::MAX }]
}

/// Features by cell row of the extractor. A cell row is complete when the rows below it that its last descriptors need are read, and
/// the frame's last ones with its last row. `rows` are the features' rows in the frame's order, which is by cell row.
pub fn by_cell_row(rows: impl Iterator<Item = u32>, cell_px: u32, margin_px: u32, height_px: u32) -> Vec<Batch> {
    assert!(cell_px > 0, "cells have a side");
    let below = |row: u32| (row / cell_px + 1).saturating_mul(cell_px).saturating_add(margin_px);
    by_row(rows.map(|row| below(row).saturating_sub(1)), height_px)
}

/// Features by the row in whose time each leaves the extractor, in the frame's order.
pub fn by_row(rows: impl Iterator<Item = u32>, height_px: u32) -> Vec<Batch> {
    let mut batches: Vec<Batch> = Vec::new();
    for row in rows {
        let after_row = row.min(height_px.saturating_sub(1));
        match batches.last_mut() {
            // A list that steps back is still sent in its own order, so what comes later waits with what came before.
            Some(batch) if batch.after_row >= after_row => batch.features += 1,
            _ => batches.push(Batch { features: 1, after_row }),
        }
    }
    batches
}

/// So many features spread evenly over the cell rows of a picture, for figures without a picture.
pub fn evenly(features: u32, cell_px: u32, margin_px: u32, height_px: u32) -> Vec<Batch> {
    let row = |feature: u32| {
        let at = u64::from(feature) * u64::from(height_px) / u64::from(features.max(1));
        u32::try_from(at).expect("below the height")
    };
    by_cell_row((0..features).map(row), cell_px, margin_px, height_px)
}
