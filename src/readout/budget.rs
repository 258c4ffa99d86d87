//! The demands on a line in whole `pix_clk`: conversion, serial lanes and packet. The greatest is the shortest HTS that is accepted.
//!
//! All of them run at once on different rows: while row n converts, row n - 1 leaves the columns' memory over the serial lanes (if
//! there are any) and a packet is on the link. So the shortest line is the greatest demand, not the sum.

use super::geometry::Geometry;
use super::params::{BinningMode, ReadoutParams};
use crate::adc::AdcParams;
use crate::num::{f64_from_u64, u64_truncated};
use crate::text::named;

named! {
    /// Why a line needs its clocks.
    pub enum DemandKind {
        /// A pixel clock for every conversion of the row.
        Pixels = "pixels",
        /// Pulses, settling and ramps of a row.
        Conversion = "conversion",
        /// The row's bits over the serial lanes.
        ShiftOut = "shift out",
        /// The packet of a picture's row on the link, low-power transitions included.
        Packet = "packet",
    }
}

/// A demand on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineDemand {
    /// Why.
    pub kind: DemandKind,
    /// Its own time in seconds.
    pub time_s: f64,
    /// Shortest line in `pix_clk` that is accepted.
    pub needed_clk: u64,
}

impl LineDemand {
    /// What makes this demand shorter.
    pub(super) fn remedy(&self) -> &'static str {
        match self.kind {
            DemandKind::Pixels => "read a narrower window",
            DemandKind::Conversion => {
                "use a faster sensor.adc.clock_hz, fewer sensor.adc.bits, shorter settling or a slower pixel_rate_hz"
            }
            DemandKind::ShiftOut => "use more or faster lanes (sensor.readout.lanes, lane_clock_hz)",
            DemandKind::Packet => "use a faster link (link.frequency_hz, link.lanes)",
        }
    }

    pub(super) fn words(&self) -> String {
        let time_us = 1e6 * self.time_s;
        match self.kind {
            DemandKind::Pixels => "the row's pixels".to_owned(),
            DemandKind::Conversion => format!("settling and conversion of {time_us:.3} us"),
            DemandKind::ShiftOut => format!("the readout of its lanes of {time_us:.3} us"),
            DemandKind::Packet => format!("the line's packet of {time_us:.3} us"),
        }
    }
}

/// Lines from one packet to the next: slots are merged and averaged rows are added up on the sensor, and a line memory evens out
/// their flow.
pub(super) fn lines_per_packet(geometry: &Geometry, params: &ReadoutParams) -> u64 {
    let averaged = if geometry.mode() == BinningMode::Average { geometry.binning() } else { 1 };
    u64::from(averaged) * u64::from(params.hdr.exposures())
}

/// All demands on a line, in the order of the data.
pub(super) fn line_demands(
    geometry: &Geometry,
    params: &ReadoutParams,
    adc: &AdcParams,
    packet_s: f64,
) -> [LineDemand; 4] {
    let rate_hz = f64_from_u64(params.pixel_rate_hz);
    let columns = u64::from(geometry.columns_read());
    let pulses_clk = params.pulses.total_clk();
    let conversion_s = f64::from(params.hdr.conversions())
        * (adc.settling_s() + f64_from_u64(adc.ramp_clk().0) / f64_from_u64(adc.clock_hz));
    // A millionth of a clock is forgiven: settling times are decimal fractions, which binary floats round.
    let needed = |time_s: f64| u64_truncated((time_s * rate_hz - 1e-6).ceil());
    let shift_lane_clk = shift_lane_clk(geometry, params, adc.bits);
    let shift_clk =
        (u128::from(shift_lane_clk) * u128::from(params.pixel_rate_hz)).div_ceil(params.lane_clock_hz.into());
    let demand = |kind, time_s, needed_clk| LineDemand { kind, time_s, needed_clk };
    [
        demand(DemandKind::Pixels, f64_from_u64(columns) / rate_hz, columns),
        demand(
            DemandKind::Conversion,
            f64_from_u64(pulses_clk) / rate_hz + conversion_s,
            pulses_clk + needed(conversion_s),
        ),
        demand(
            DemandKind::ShiftOut,
            f64_from_u64(shift_lane_clk) / f64_from_u64(params.lane_clock_hz),
            u64::try_from(shift_clk).unwrap_or(u64::MAX),
        ),
        demand(DemandKind::Packet, packet_s, needed(packet_s / f64_from_u64(lines_per_packet(geometry, params)))),
    ]
}

/// Lane clocks of a row's bits; 0 where the readout is parallel. A lane carries a bit per clock, and the last may run short.
pub(super) fn shift_lane_clk(geometry: &Geometry, params: &ReadoutParams, bits: u32) -> u64 {
    if params.lanes == 0 {
        return 0;
    }
    (u64::from(geometry.columns_read()) * u64::from(bits)).div_ceil(params.lanes.into())
}

/// The demand that decides; the first of equals.
pub(super) fn greatest(demands: &[LineDemand; 4]) -> LineDemand {
    *demands.iter().rev().max_by_key(|demand| demand.needed_clk).expect("a line has demands")
}
