//! Timing of a frame on the link, clock by clock: packets on the lanes, waits of the readout, and an error if the frame does not fit.

use super::sensor::SensorSetup;
use crate::compute::{ExtractorParams, FrameClocks, RowByRow, RowSpacing, even_frame};
use crate::error::Error;
use crate::link::{
    Batch, FeatureReady, Flow, FramePlan, PlannedPacket, RowPeriod, Sent, Traffic, WhenFull, after_the_rows, by_row,
};
use crate::num::{f64_from_u64, index, u32_from, u64_truncated};
use crate::readout::{FrameLength, Schedule, Trigger};
use crate::units::{Clocks, FrameIndex};

/// Times of a frame's way through the link, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkTimes {
    /// How long the readout stood still for the link.
    pub stalled_s: f64,
    /// From the reading of the last row to the end of the frame's last burst.
    pub tail_s: f64,
    /// From the reading of the last row to the end of its burst; 0 where rows are not sent.
    pub rows_tail_s: f64,
    /// From the reading of the last row to the last bit of the frame's last packet.
    pub last_bit_s: f64,
    /// From the reading of the last row to the start of the first burst of features behind it; none where features are not sent.
    pub features_from_s: Option<f64>,
    /// From the reading of the first row to the extractor's last feature; none without features.
    pub last_feature_s: Option<f64>,
    /// From the reading of the last row to the last feature byte; none where features are not sent.
    pub feature_latency_s: Option<f64>,
}

impl SensorSetup {
    /// Time from one row's readout to the next one's, in `byte_clk`.
    pub fn row_period(&self) -> RowPeriod {
        let lines_clk = self.schedule.line_clk().0 * self.schedule.lines_per_packet();
        RowPeriod::new(Clocks(lines_clk), self.schedule.pixel_rate_hz(), &self.link)
    }

    /// Features that pass between two rows' packets; 0 where rows are not sent. Fails on a row that the link cannot carry.
    pub fn features_per_gap(&self) -> Result<u32, Error> {
        if !self.link.mode.sends_codes() {
            return Ok(0);
        }
        self.link.features_per_gap(self.size.width_px, self.bits(), self.row_period())
    }

    /// A frame's features by the row during whose readout each is complete. `out_clk` has the clock in which each is taken. Features
    /// that are complete after the last row are put with it; `flow_at` adds their delay.
    pub fn batches(&self, out_clk: &[u64]) -> Vec<Batch> {
        let spacing = self.row_spacing();
        let row_of = |&clk: &u64| u32::try_from(spacing.rows_until(clk + 1)).unwrap_or(u32::MAX);
        by_row(out_clk.iter().map(row_of), self.size.height_px)
    }

    /// The packets of a frame whose features leave in these batches. Fails on a row that the link cannot carry.
    pub fn packets(&self, frame: FrameIndex, batches: &[Batch]) -> Result<Vec<PlannedPacket>, Error> {
        let link = &self.link;
        Ok(link.packets(&FramePlan {
            rows: self.size.height_px,
            sends_codes: link.sends_codes_in(frame),
            batches: link.mode.sends_features().then_some(batches),
            features_per_gap: self.features_per_gap()?,
        }))
    }

    /// When each feature is complete: the row that was read last, and the time since then. `out_clk` has the clocks in which the
    /// extractor gives them.
    pub fn features_ready(&self, out_clk: &[u64]) -> Vec<FeatureReady> {
        let (spacing, last_row) = (self.row_spacing(), u64::from(self.size.height_px.saturating_sub(1)));
        let ready_of = |&clk: &u64| {
            let row = spacing.row_at(clk).min(last_row);
            let row_number = u32::try_from(row).expect("not above the last row");
            let (parts, of) = spacing.since(row, clk + 1);
            let after = RowPeriod::of_parts(parts, of, self.compute_hz, &self.link).clocks(1);
            FeatureReady { row: row_number, after }
        };
        out_clk.iter().map(ready_of).collect()
    }

    /// The packets of a frame in time, its features taken from the extractor in these clocks; a stalled readout delays both rows and
    /// features. Features without a clock are whole when their row is read. Fails on a row that the link cannot carry.
    pub fn flow_at(&self, packets: &[PlannedPacket], out_clk: &[u64]) -> Result<Flow, Error> {
        let ready = self.features_ready(out_clk);
        let payload_bytes = self.link.row_payload_bytes(self.size.width_px, self.bits());
        // Without rows nothing asks for their bytes.
        let payload_bytes = if self.link.mode.sends_codes() { payload_bytes? } else { 0 };
        let (rows, period) = (self.size.height_px, self.row_period());
        Ok(self.link.flow_of_ready(packets, rows, payload_bytes, period, &ready))
    }

    /// The extractor's clocks in a frame of so many features spread evenly over the picture; none where the sensor has no extractor.
    pub fn extractor_clocks(&self, features: u64) -> Option<FrameClocks> {
        self.link.mode.sends_features().then(|| self.even_clocks(&self.extractor, self.compute_hz, features))
    }

    /// The same of an extractor with these parameters on a clock of this frequency.
    pub(super) fn even_clocks(&self, extractor: &ExtractorParams, compute_hz: u64, features: u64) -> FrameClocks {
        let spacing = RowSpacing::new(self.row_clk(), self.schedule.pixel_rate_hz(), compute_hz);
        even_frame(extractor, self.size, (features, self.bits()), &mut RowByRow { first_clk: 0, spacing })
    }

    /// Clocks from frame to frame, which the extractor has for one.
    pub fn extractor_clk_available(&self) -> u64 {
        self.clk_available(self.compute_hz)
    }

    /// Clocks of a frequency from frame to frame.
    pub(super) fn clk_available(&self, hz: u64) -> u64 {
        match self.schedule.params().trigger {
            Trigger::Free => {
                let parts = u128::from(self.schedule.frame_clk().0) * u128::from(hz);
                let whole = parts / u128::from(self.schedule.pixel_rate_hz());
                u64::try_from(whole).expect("a frame is shorter than 2^64 clocks")
            }
            // A millionth of a clock is rounding.
            Trigger::External { .. } => u64_truncated(self.schedule.frame_time_s() * f64_from_u64(hz) + 1e-6),
        }
    }

    /// A frame with so many features spread evenly over the picture, with its rows where the mode sends them, in time. Fails on a row
    /// that the link cannot carry.
    pub fn flow_of(&self, features: u64) -> Result<Flow, Error> {
        let out_clk = self.extractor_clocks(features).map_or_else(Vec::new, |clocks| clocks.out_clk);
        self.flow_at(&self.packets(FrameIndex(0), &self.batches(&out_clk))?, &out_clk)
    }

    /// What `frames_every` frames in a row put on the link, one with rows and the others without, each with so many features spread evenly
    /// over the picture. Fails on a row that the link cannot carry.
    pub fn traffic_of_cycle(&self, features: u64) -> Result<Traffic, Error> {
        let out_clk = self.extractor_clocks(features).map_or_else(Vec::new, |clocks| clocks.out_clk);
        let batches = self.batches(&out_clk);
        let of = |frame: u32| {
            let packets = self.packets(FrameIndex(frame), &batches)?;
            self.link.traffic_of(&packets, self.size, self.bits())
        };
        let (mut cycle, others) = (of(0)?, u64::from(self.link.frames_every.max(1) - 1));
        if others > 0 {
            cycle.add(&of(1)?.times(others));
        }
        Ok(cycle)
    }

    /// What `flow_of` says, in seconds. Fails on a row that the link cannot carry.
    pub fn link_times(&self, features: u64) -> Result<LinkTimes, Error> {
        let flow = self.flow_of(features)?;
        let seconds = |clocks: Clocks| self.link.seconds(clocks);
        Ok(LinkTimes {
            stalled_s: seconds(flow.stalled),
            tail_s: seconds(flow.tail()),
            rows_tail_s: seconds(flow.rows_tail()),
            last_bit_s: seconds(flow.last_bit()),
            features_from_s: flow.features_behind_rows().map(seconds),
            last_feature_s: self
                .extractor_clocks(features)
                .and_then(|clocks| clocks.out_clk.last().copied())
                .map(|clk| f64_from_u64(clk + 1) / f64_from_u64(self.compute_hz)),
            feature_latency_s: flow.feature_latency().map(seconds),
        })
    }

    /// How much later than its schedule each array row of the window is read because rows before it wait for the link; empty where
    /// none waits. Fails on a row that the link cannot carry.
    pub fn row_delays_s(&self) -> Result<Vec<f64>, Error> {
        if self.link.when_full == WhenFull::Refuse || !self.link.mode.sends_codes() {
            return Ok(Vec::new());
        }
        let flow = self.flow_of(0)?;
        if flow.stalled.0 == 0 {
            return Ok(Vec::new());
        }
        let delays = flow.delays(self.row_period());
        let (rows, height) = (index(self.schedule.geometry().window().height_px), delays.len());
        // Rows of the window that are binned into one are late together.
        Ok((0..rows).map(|row| self.link.seconds(delays[(row * height / rows).min(height - 1)])).collect())
    }

    /// Whether a frame with so many features, all of which may come with the last rows, passes within a frame's time. Fails where it does
    /// not; the error names a frame length that suffices.
    pub(super) fn check_frame(&self, features: u64) -> Result<(), Error> {
        let most = u32::try_from(features).expect("a configuration's number");
        let packets = self.packets(FrameIndex(0), &after_the_rows(most))?;
        self.check_passes(&self.flow_at(&packets, &[])?, features, &self.schedule)
    }

    /// Whether these packets pass within a frame's time of this schedule. Fails where they do not; the error names a frame length that
    /// suffices.
    pub(super) fn check_passes(&self, flow: &Flow, features: u64, schedule: &Schedule) -> Result<(), Error> {
        let last_row = flow.sent.iter().rposition(|sent| matches!(sent.packet, PlannedPacket::Row(_)));
        // Time on the lanes; waiting for the extractor is its own matter.
        let busy_clk = |sent: &[Sent]| sent.iter().map(|sent| sent.end.0 - sent.start.0).sum::<u64>();
        // Rows leave as they are read, and the last one in the line after it; everything else needs the lines that are left: rows that
        // wait in the FIFO when the last one is read, and what follows the rows.
        let (rows_lines, rest_clk) = match last_row {
            Some(row) => {
                let behind = busy_clk(&flow.sent[row + 1..]);
                let left_clk = |sent: &Sent| sent.end.0.saturating_sub(sent.start.0.max(flow.rows_end.0));
                let queued =
                    flow.sent[..=row].iter().map(left_clk).sum::<u64>().saturating_sub(self.row_period().clocks(1).0);
                (f64_from_u64(schedule.frame_demand().rows), flow.lead.0 + flow.stalled.0 + queued + behind)
            }
            None => (0.0, busy_clk(&flow.sent)),
        };
        let lines = rows_lines + (self.link.seconds(Clocks(rest_clk)) / schedule.line_time_s()).ceil();
        // A triggered frame has its trigger's period; a millionth of a line is rounding.
        if lines <= schedule.frame_time_s() / schedule.line_time_s() + 1e-6 {
            return Ok(());
        }
        let needed = format!("rows and {features} features per frame need {lines:.0} lines on this link");
        if let FrameLength::RateHz(rate_hz) = schedule.params().frame {
            // Rounded down, so that what is named is slow enough.
            let fastest_hz = (1e3 / (lines * schedule.line_time_s())).floor() / 1e3;
            let reason = format!("{needed}; use {fastest_hz} or less, fewer features or a faster link");
            return Err(Error::key("sensor.readout.frame_rate_hz", rate_hz, reason));
        }
        let reason = format!("{needed}; use vts = {lines:.0}, fewer features or a faster link");
        Err(Error::key("sensor.readout.vts", schedule.vts(), reason))
    }
}

/// Rows as the report counts them.
pub(super) fn rows_in(packets: &[PlannedPacket]) -> u32 {
    u32_from(packets.iter().filter(|packet| matches!(packet, PlannedPacket::Row(_))).count())
}
