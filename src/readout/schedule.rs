//! When each row is exposed and read: spans in whole clocks of a camera, and in seconds of run time.
//!
//! A frame of VTS lines starts at clock `start`. Every row's exposure ends with the frame (global shutter), or with the line in
//! which the row is read (rolling shutter); row i is read in line `n i + offset` after the frame's end, where n is the number of
//! exposures a frame (`slots`). So a frame is read while the next one is exposed.

use super::budget::{self, LineDemand};
use super::clock::{ClockSpan, FrameClock};
use super::geometry::Geometry;
use super::limits;
use super::params::{ReadoutParams, Shutter};
use super::slots::{FrameDemand, Slot, frame_demand, longest_exposure, slots};
use crate::adc::AdcParams;
use crate::error::Error;
use crate::num::u64_from;
use crate::units::{CameraIndex, Clocks, FrameIndex, RowIndex, Size, Span};

/// The timing of a camera's readout.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    params: ReadoutParams,
    geometry: Geometry,
    demands: [LineDemand; 4],
    shift_lane_clk: u64,
    frame_lines: u64,
    slots: Vec<Slot>,
    fine_clk: u32,
    exposure_lines_max: u64,
    clock: FrameClock,
}

impl Schedule {
    /// The parameters with the shortest frame that holds their rows and exposures. Fails on what no frame holds.
    pub fn with_shortest_frame(array: Size, params: &ReadoutParams) -> Result<ReadoutParams, Error> {
        params.check()?;
        let frame = limits::shortest_frame(&Geometry::new(array, params)?, params)?;
        Ok(ReadoutParams { frame, ..params.clone() })
    }

    /// Checks that array, converter and link fit into a line, and rows and exposures into a frame. `packet_s` is the time of an
    /// output row's packet on the link with its low-power transitions, 0 where the link does not count. Fails on what does not fit, by
    /// key and value, with the shortest line or frame (or the fastest rate) that is accepted.
    pub fn new(array: Size, params: &ReadoutParams, adc: &AdcParams, packet_s: f64) -> Result<Self, Error> {
        params.check()?;
        let geometry = Geometry::new(array, params)?;
        let demands = budget::line_demands(&geometry, params, adc, packet_s);
        limits::check_line(params, &demands)?;
        let lines = limits::exposure_lines(params)?;
        let frame_lines = limits::frame_lines(lines, &geometry, params)?;
        let frame_clk = Clocks(frame_lines * u64::from(params.hts));
        limits::check_trigger(params, frame_clk)?;
        let clock = FrameClock::new(params, CameraIndex(0), frame_clk);
        Ok(Self {
            geometry,
            demands,
            shift_lane_clk: budget::shift_lane_clk(&geometry, params, adc.bits),
            frame_lines,
            slots: slots(lines, params),
            fine_clk: params.exposure_fine_clk,
            exposure_lines_max: longest_exposure(frame_lines, geometry.reads(), 0, params),
            clock,
            params: params.clone(),
        })
    }

    /// The same readout by another camera's clock: its skew and its deviation. `new` gives camera 0's.
    #[must_use]
    pub fn for_camera(&self, camera: CameraIndex) -> Self {
        Self { clock: FrameClock::new(&self.params, camera, self.frame_clk()), ..self.clone() }
    }

    /// The same readout with another exposure: what registers say that were written while it ran. Lines are those of the longest
    /// slot; frames keep their length and start. Fails on fewer lines than the sensor's least, or more than its frame holds.
    pub fn with_exposure(&self, lines: u64, fine_clk: u32) -> Result<Self, Error> {
        let changed = slots(lines, &self.params);
        let demand = frame_demand(&changed, self.geometry.reads(), fine_clk, &self.params).lines();
        let least = u64::from(self.params.exposure_lines_min);
        if lines < least || demand > self.frame_lines || fine_clk >= self.params.hts {
            let reason = format!("out of range; use {least} to {}", self.exposure_lines_max);
            return Err(Error::key("sensor.readout.exposure_lines", lines, reason));
        }
        Ok(Self { slots: changed, fine_clk, ..self.clone() })
    }

    /// What it was made from.
    pub fn params(&self) -> &ReadoutParams {
        &self.params
    }

    /// Which pixels are read, and what they become.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The picture: window over binning.
    pub fn output_size(&self) -> Size {
        self.geometry.output_size()
    }

    /// Whether rows are exposed together.
    pub fn shutter(&self) -> Shutter {
        self.params.shutter
    }

    /// Frequency of `pix_clk`, in which all clocks here count, as the sensor's registers have it (deviation aside).
    pub fn pixel_rate_hz(&self) -> u64 {
        self.params.pixel_rate_hz
    }

    /// HTS.
    pub fn hts(&self) -> u32 {
        self.params.hts
    }

    /// VTS in effect: derived from a rate, or grown with a long exposure.
    pub fn vts(&self) -> u64 {
        self.frame_lines
    }

    /// A line in `pix_clk`.
    pub fn line_clk(&self) -> Clocks {
        Clocks(self.params.hts.into())
    }

    /// A frame in `pix_clk`. Frames that wait for a trigger are further apart.
    pub fn frame_clk(&self) -> Clocks {
        Clocks(self.line_clk().0 * self.frame_lines)
    }

    /// A line in seconds.
    pub fn line_time_s(&self) -> f64 {
        self.clock.length_s(self.line_clk())
    }

    /// From frame to frame in seconds.
    pub fn frame_time_s(&self) -> f64 {
        self.clock.frame_time_s()
    }

    /// Frames a second: `pixel_rate / (HTS VTS)`, or the trigger's rate.
    pub fn fps(&self) -> f64 {
        self.clock.fps()
    }

    /// The exposures of a frame, the longest first.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The (longest) exposure in effect, in whole lines.
    pub fn exposure_lines(&self) -> u64 {
        self.slots[0].exposure_lines
    }

    /// What the exposure in effect has beyond its whole lines, in `pix_clk`.
    pub fn exposure_fine_clk(&self) -> u32 {
        self.fine_clk
    }

    /// The longest (slot 0) exposure of this frame length, in lines.
    pub fn exposure_lines_max(&self) -> u64 {
        self.exposure_lines_max
    }

    /// The exposure in effect of a slot in `pix_clk`.
    pub fn exposure_clk(&self, slot: usize) -> Clocks {
        let fine_clk = if slot == 0 { self.fine_clk } else { 0 };
        Clocks(self.slots[slot].exposure_lines * self.line_clk().0 + u64::from(fine_clk))
    }

    /// The (longest) exposure in effect, in seconds.
    pub fn exposure_s(&self) -> f64 {
        self.clock.length_s(self.exposure_clk(0))
    }

    /// What a line must hold, in the order of the data.
    pub fn line_demands(&self) -> &[LineDemand; 4] {
        &self.demands
    }

    /// The demand on a line that decides.
    pub fn line_limit(&self) -> LineDemand {
        budget::greatest(&self.demands)
    }

    /// What a frame must hold with the exposure in effect.
    pub fn frame_demand(&self) -> FrameDemand {
        frame_demand(&self.slots, self.geometry.reads(), self.fine_clk, &self.params)
    }

    /// Lines from one packet of a picture's row to the next.
    pub fn lines_per_packet(&self) -> u64 {
        budget::lines_per_packet(&self.geometry, &self.params)
    }

    /// Lane clocks in which a row leaves the columns' memory; 0 where it takes no time.
    pub fn shift_lane_clk(&self) -> Clocks {
        Clocks(self.shift_lane_clk)
    }

    /// First clock of a frame.
    pub fn frame_start_clk(&self, frame: FrameIndex) -> Clocks {
        self.clock.frame_start(frame)
    }

    /// When an array row gathers light in a slot, in this camera's clocks; none where the row is not read.
    pub fn row_exposure_clk(&self, frame: FrameIndex, slot: usize, array_row: RowIndex) -> Option<ClockSpan> {
        let read = self.geometry.read_of(array_row)?;
        let lines = match self.shutter() {
            Shutter::Global => 0,
            Shutter::Rolling => self.read_line(slot, read),
        };
        let end = self.frame_end_clk(frame) + lines * self.line_clk().0;
        Some(ClockSpan { start: Clocks(end - self.exposure_clk(slot).0), end: Clocks(end) })
    }

    /// When an array row is sampled and converted in a slot, in this camera's clocks; none where the row is not read.
    pub fn row_readout_clk(&self, frame: FrameIndex, slot: usize, array_row: RowIndex) -> Option<ClockSpan> {
        let read = self.geometry.read_of(array_row)?;
        let start = self.frame_end_clk(frame) + self.read_line(slot, read) * self.line_clk().0;
        Some(ClockSpan { start: Clocks(start), end: Clocks(start + self.line_clk().0) })
    }

    /// A span of this camera's clocks in run time.
    pub fn span(&self, span: ClockSpan) -> Span {
        Span { start_s: self.clock.instant_s(span.start), end_s: self.clock.instant_s(span.end) }
    }

    /// When an output row gathers light in its longest exposure.
    pub fn exposure(&self, frame: FrameIndex, row: RowIndex) -> Span {
        self.slot_exposure(frame, 0, row)
    }

    /// When an output row gathers light in a slot. Where codes of array rows with different times are averaged, the span is the
    /// mean of theirs: as long, and at their middle.
    pub fn slot_exposure(&self, frame: FrameIndex, slot: usize, row: RowIndex) -> Span {
        self.mean_of(row, |array_row| self.row_exposure_clk(frame, slot, array_row))
    }

    /// When an output row is sampled and converted in its longest exposure: the line that begins where its rolling exposure ends,
    /// and as many lines after the end of a global one as are read before it.
    pub fn readout(&self, frame: FrameIndex, row: RowIndex) -> Span {
        self.slot_readout(frame, 0, row)
    }

    /// When an output row is sampled and converted in a slot, from its first array row's line to the end of its last's.
    pub fn slot_readout(&self, frame: FrameIndex, slot: usize, row: RowIndex) -> Span {
        let (first, last) = self.ends_of(row);
        let of = |array_row| self.row_readout_clk(frame, slot, array_row).expect("rows of the picture are read");
        self.span(ClockSpan { start: of(first).start, end: of(last).end })
    }

    /// The time of a frame: the middle between the start of the first row's first exposure and the end of the last row's last.
    pub fn t_frame(&self, frame: FrameIndex) -> f64 {
        self.clock.instant_s(Clocks(0)) + 0.5 * self.clock.length_s(self.frame_window_clk(frame).twice_middle())
    }

    /// From the start of the first row's first exposure to the end of the last row's last.
    pub fn frame_window_clk(&self, frame: FrameIndex) -> ClockSpan {
        let last_slot = self.slots.len() - 1;
        let (first, last) = (self.ends_of(RowIndex(0)).0, self.ends_of(self.last_row()).1);
        let of = |slot, row| self.row_exposure_clk(frame, slot, row).expect("rows of the picture are read");
        ClockSpan { start: of(0, first).start, end: of(last_slot, last).end }
    }

    /// How long an output row's charge waits between the end of its exposure and its readout, in seconds.
    pub fn storage_s(&self, row: RowIndex) -> f64 {
        match self.shutter() {
            Shutter::Rolling => 0.0,
            Shutter::Global => {
                let frame = FrameIndex(0);
                let end = self.frame_end_clk(frame);
                let waits = self.mean_of_twice(row, |array_row| {
                    self.row_readout_clk(frame, 0, array_row).map(|read| Clocks(read.start.0 - end))
                });
                0.5 * self.clock.length_s(waits)
            }
        }
    }

    /// The longest such wait of any row, in seconds.
    pub fn storage_s_max(&self) -> f64 {
        self.storage_s(self.last_row())
    }

    /// The picture's last row.
    pub fn last_row(&self) -> RowIndex {
        RowIndex(self.output_size().height_px - 1)
    }

    fn frame_end_clk(&self, frame: FrameIndex) -> u64 {
        self.clock.frame_start(frame).0 + self.frame_clk().0
    }

    /// Lines from the end of the frame to the line that reads this row of this slot.
    fn read_line(&self, slot: usize, read: u32) -> u64 {
        u64_from(self.slots.len()) * u64::from(read) + self.slots[slot].offset_lines
    }

    /// First and last array row of an output row.
    fn ends_of(&self, row: RowIndex) -> (RowIndex, RowIndex) {
        let mut rows = self.geometry.rows_of(row);
        let first = rows.next().expect("an output row has at least one array row");
        (first, rows.last().unwrap_or(first))
    }

    /// The mean over an output row's array rows, which stand evenly: that of the first and the last.
    fn mean_of(&self, row: RowIndex, of: impl Fn(RowIndex) -> Option<ClockSpan>) -> Span {
        let start = self.mean_of_twice(row, |array_row| of(array_row).map(|span| span.start));
        let end = self.mean_of_twice(row, |array_row| of(array_row).map(|span| span.end));
        let zero_s = self.clock.instant_s(Clocks(0));
        let at = |twice: Clocks| zero_s + 0.5 * self.clock.length_s(twice);
        Span { start_s: at(start), end_s: at(end) }
    }

    fn mean_of_twice(&self, row: RowIndex, of: impl Fn(RowIndex) -> Option<Clocks>) -> Clocks {
        let (first, last) = self.ends_of(row);
        let clock = |row| of(row).expect("rows of the picture are read").0;
        Clocks(clock(first) + clock(last))
    }
}
