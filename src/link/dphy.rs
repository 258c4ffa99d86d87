//! D-PHY's times: clocks of `byte_clk` for a burst, including the exit from and the return to low power.
//!
//! Every packet is a separate burst: LP-01, LP-00 with the lane's preparation, synchronisation byte, bytes, trail, exit to
//! LP-11. Times are the specification's minima (D-PHY 1.2, table "global operation timing parameters"), each rounded up to
//! whole byte clocks as a transmitter's counters do. The clock lane runs all the time.

use super::packet::{CRC_BYTES, HEADER_BYTES};
use super::params::LinkParams;
use crate::num::{f64_from_u64, u64_from};
use crate::units::Clocks;

/// T_LPX, the length of LP-01: at least 50 ns.
pub const LPX_NS: u64 = 50;
/// T_HS-PREPARE + T_HS-ZERO: at least 145 ns + 10 UI.
pub const HS_PREPARE_ZERO_NS: u64 = 145;
/// The part of T_HS-PREPARE + T_HS-ZERO that is counted in unit intervals.
pub const HS_PREPARE_ZERO_UI: u64 = 10;
/// T_HS-TRAIL: at least the greater of 8 UI and 60 ns + 4 UI.
pub const HS_TRAIL_NS: u64 = 60;
/// The part of T_HS-TRAIL that is counted in unit intervals, beside `HS_TRAIL_NS`.
pub const HS_TRAIL_UI: u64 = 4;
/// T_HS-EXIT, the least LP-11 before the next burst: 100 ns.
pub const HS_EXIT_NS: u64 = 100;
/// Bits of a byte: unit intervals of one byte clock.
const BYTE_UI: u64 = 8;
const NS_PER_S: u64 = 1_000_000_000;

impl LinkParams {
    /// Bits per second of all lanes in high-speed mode.
    pub fn capacity_bits_per_s(&self) -> u64 {
        2 * self.frequency_hz * u64::from(self.lanes)
    }

    /// Seconds of so many byte clocks; a byte clock is four clocks of the double-data-rate clock.
    pub fn seconds(&self, clocks: Clocks) -> f64 {
        f64_from_u64(clocks.0 * 4) / f64_from_u64(self.frequency_hz)
    }

    /// `byte_clk` clocks from LP-11 to LP-11 around the bytes of a burst, synchronisation byte included.
    pub fn burst_overhead(&self) -> Clocks {
        Clocks(self.burst_entry().0 + self.burst_exit().0)
    }

    /// `byte_clk` clocks from LP-11 to the first byte: LP-01, preparation, synchronisation byte.
    pub fn burst_entry(&self) -> Clocks {
        Clocks(self.byte_clocks(LPX_NS, 0) + self.byte_clocks(HS_PREPARE_ZERO_NS, HS_PREPARE_ZERO_UI) + 1)
    }

    /// `byte_clk` clocks from the last byte to the next burst's LP-01: trail, exit.
    pub fn burst_exit(&self) -> Clocks {
        Clocks(self.byte_clocks(HS_TRAIL_NS, HS_TRAIL_UI).max(1) + self.byte_clocks(HS_EXIT_NS, 0))
    }

    /// `byte_clk` clocks of a long packet of so many payload bytes, with its burst's overhead.
    pub fn long_packet_time(&self, payload_bytes: u64) -> Clocks {
        self.burst_time(payload_bytes + u64_from(HEADER_BYTES + CRC_BYTES))
    }

    /// `byte_clk` clocks of a frame-start or frame-end packet, with its burst's overhead.
    pub fn short_packet_time(&self) -> Clocks {
        self.burst_time(u64_from(HEADER_BYTES))
    }

    /// `byte_clk` clocks of a burst of so many bytes, with its overhead.
    pub fn burst_time(&self, bytes: u64) -> Clocks {
        Clocks(bytes.div_ceil(self.lanes.into()) + self.burst_overhead().0)
    }

    /// The time in byte clocks, rounded up.
    fn byte_clocks(&self, time_ns: u64, unit_intervals: u64) -> u64 {
        // One UI is 1 / (2 f): in units of 1 / (2 f) the time is 2 f ns / 1e9, kept as a fraction over 1e9.
        let above =
            2 * u128::from(self.frequency_hz) * u128::from(time_ns) + u128::from(unit_intervals) * u128::from(NS_PER_S);
        u64::try_from(above.div_ceil(u128::from(BYTE_UI * NS_PER_S))).expect("under a microsecond")
    }
}
