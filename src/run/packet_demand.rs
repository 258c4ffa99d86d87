//! Time that the link demands of a row.

use crate::error::Error;
use crate::link::WhenFull;
use crate::num::{f64_from_u64, index, u64_from};
use crate::readout::{Hdr, ReadoutParams, Shutter};

/// The shortest line time in seconds at which the FIFO never overflows: with D slots and n rows, n - D packets must pass while n - 1 rows
/// are read. 0 where the readout waits for the link instead, or where no rows are sent. Fails on a row that
/// the link cannot carry; a readout that cannot wait.
pub(super) fn packet_demand_s(
    link: &crate::link::LinkParams,
    size: crate::units::Size,
    bits: u32,
    readout: &ReadoutParams,
) -> Result<f64, Error> {
    if !link.mode.sends_codes() {
        return Ok(0.0);
    }
    let packet_s = link.seconds(link.line_packet_time(size.width_px, bits)?);
    if link.when_full == WhenFull::Stall {
        return can_stall(readout).map(|()| 0.0);
    }
    let (rows, slots) = (u64_from(index(size.height_px)), u64::from(link.fifo_rows));
    let packets = f64_from_u64(rows.saturating_sub(slots));
    Ok(if slots == 1 { packet_s } else { packet_s * packets / f64_from_u64(rows.max(2) - 1) })
}

/// A readout that stands still holds its electronic shutter too: under a rolling shutter, rows would be exposed for longer, each by a
/// different time, and several exposures a row would no longer stand in their ratio.
pub(super) fn can_stall(readout: &ReadoutParams) -> Result<(), Error> {
    let reason = if readout.shutter == Shutter::Rolling {
        "a stall would lengthen the exposures of a rolling shutter, by a different time in each row"
    } else if matches!(readout.hdr, Hdr::MultiExposure { .. }) {
        "a stall would change the ratio of several exposures"
    } else {
        return Ok(());
    };
    Err(Error::key("link.when_full", "stall", format!("{reason}; use \"refuse\"")))
}
