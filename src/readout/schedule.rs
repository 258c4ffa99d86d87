//! When each row is exposed and read. Enters: checked parameters. Leaves: instants in seconds of run time.
//!
//! All times are whole `pix_clk` clocks over its frequency; a float appears only at the output. Frame n is exposed in
//! (n, n + 1) frame times and read after (n + 1).

use super::{ReadoutParams, Shutter};
use crate::adc::AdcParams;
use crate::error::Error;
use crate::num::{f64_from_u64, u32_truncated, u64_truncated};
use crate::units::{Clocks, FrameIndex, RowIndex, Size, Span};

/// The timing of a run's readout.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    size: Size,
    shutter: Shutter,
    pixel_rate_hz: u64,
    line_clk: u64,
    frame_lines: u64,
    exposure_lines: u64,
    exposure_lines_max: u64,
}

impl Schedule {
    /// Checks that array, converter and link fit into a line. `packet_s` is the time of a line's packet on the link with its
    /// low-power transitions, 0 where the link does not count.
    pub fn new(size: Size, params: &ReadoutParams, adc: &AdcParams, packet_s: f64) -> Result<Self, Error> {
        params.check()?;
        if size.width_px == 0 || size.height_px == 0 {
            let (key, value) = if size.width_px == 0 { ("sensor.width", 0) } else { ("sensor.height", 0) };
            return Err(Error::key(key, value, "out of range; 1 or more would do"));
        }
        check_line(size, params, adc, packet_s)?;
        if params.vts < size.height_px {
            let reason = format!("a frame of {} rows needs at least vts = {}", size.height_px, size.height_px);
            return Err(Error::key("sensor.readout.vts", params.vts, reason));
        }
        let line_us = 1e6 * f64::from(params.hts) / f64_from_u64(params.pixel_rate_hz);
        let exposure_lines_max = params.vts - params.exposure_margin_lines;
        let exposure_lines = u32_truncated((params.exposure_us / line_us).round_ties_even()).max(1);
        if exposure_lines > exposure_lines_max {
            let most_us = f64::from(exposure_lines_max) * line_us;
            let reason = format!(
                "too long; at most {most_us:.3} (vts - margin = {exposure_lines_max} lines) or a greater vts would do"
            );
            return Err(Error::key("sensor.readout.exposure_us", params.exposure_us, reason));
        }
        Ok(Self {
            size,
            shutter: params.shutter,
            pixel_rate_hz: params.pixel_rate_hz,
            line_clk: params.hts.into(),
            frame_lines: params.vts.into(),
            exposure_lines: exposure_lines.into(),
            exposure_lines_max: exposure_lines_max.into(),
        })
    }

    /// Width and height of the array.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Whether rows are exposed together.
    pub fn shutter(&self) -> Shutter {
        self.shutter
    }

    /// Frequency of `pix_clk`, in which all clocks here count.
    pub fn pixel_rate_hz(&self) -> u64 {
        self.pixel_rate_hz
    }

    /// A line in `pix_clk`.
    pub fn line_clk(&self) -> Clocks {
        Clocks(self.line_clk)
    }

    /// A frame in `pix_clk`.
    pub fn frame_clk(&self) -> Clocks {
        Clocks(self.line_clk * self.frame_lines)
    }

    /// A line in seconds.
    pub fn line_time_s(&self) -> f64 {
        self.seconds(self.line_clk)
    }

    /// A frame in seconds.
    pub fn frame_time_s(&self) -> f64 {
        self.seconds(self.frame_clk().0)
    }

    /// Frames a second: `pixel_rate / (HTS VTS)`.
    pub fn fps(&self) -> f64 {
        f64_from_u64(self.pixel_rate_hz) / f64_from_u64(self.frame_clk().0)
    }

    /// The exposure in effect, in lines.
    pub fn exposure_lines(&self) -> u64 {
        self.exposure_lines
    }

    /// The longest exposure, in lines.
    pub fn exposure_lines_max(&self) -> u64 {
        self.exposure_lines_max
    }

    /// The exposure in effect, in seconds.
    pub fn exposure_s(&self) -> f64 {
        self.seconds(self.exposure_lines * self.line_clk)
    }

    /// When a row of a frame gathers light.
    pub fn exposure(&self, frame: FrameIndex, row: RowIndex) -> Span {
        let end_clk = self.exposure_end_clk(frame, row);
        Span { start_s: self.seconds(end_clk - self.exposure_lines * self.line_clk), end_s: self.seconds(end_clk) }
    }

    /// When a row of a frame is sampled and converted: the line that begins where its rolling exposure ends, and as many lines
    /// after the end of a global one as rows stand above it.
    pub fn readout(&self, frame: FrameIndex, row: RowIndex) -> Span {
        let start_clk = self.frame_end_clk(frame) + u64::from(row.0) * self.line_clk;
        Span { start_s: self.seconds(start_clk), end_s: self.seconds(start_clk + self.line_clk) }
    }

    /// The time of a frame: the middle between the start of the first row's exposure and the end of the last row's.
    pub fn t_frame(&self, frame: FrameIndex) -> f64 {
        let last = RowIndex(self.size.height_px - 1);
        let end_clk = self.exposure_end_clk(frame, last);
        let start_clk = self.exposure_end_clk(frame, RowIndex(0)) - self.exposure_lines * self.line_clk;
        f64_from_u64(start_clk + end_clk) / (2.0 * f64_from_u64(self.pixel_rate_hz))
    }

    /// How long a row's charge waits between the end of its exposure and its readout, in seconds.
    pub fn storage_s(&self, row: RowIndex) -> f64 {
        match self.shutter {
            Shutter::Global => self.seconds(u64::from(row.0) * self.line_clk),
            Shutter::Rolling => 0.0,
        }
    }

    /// The longest such wait of any row, in seconds.
    pub fn storage_s_max(&self) -> f64 {
        self.storage_s(RowIndex(self.size.height_px - 1))
    }

    fn frame_end_clk(&self, frame: FrameIndex) -> u64 {
        (u64::from(frame.0) + 1) * self.frame_clk().0
    }

    fn exposure_end_clk(&self, frame: FrameIndex, row: RowIndex) -> u64 {
        let row_clk = match self.shutter {
            Shutter::Global => 0,
            Shutter::Rolling => u64::from(row.0) * self.line_clk,
        };
        self.frame_end_clk(frame) + row_clk
    }

    fn seconds(&self, clocks: u64) -> f64 {
        f64_from_u64(clocks) / f64_from_u64(self.pixel_rate_hz)
    }
}

/// Refuses a line that is shorter than its pixels, its conversion or its packet, naming the HTS that would do.
fn check_line(size: Size, params: &ReadoutParams, adc: &AdcParams, packet_s: f64) -> Result<(), Error> {
    let rate_hz = f64_from_u64(params.pixel_rate_hz);
    let conversion_s = adc.settling_s() + f64_from_u64(adc.ramp_clk().0) / f64_from_u64(adc.clock_hz);
    // A millionth of a clock is forgiven: settling times are decimal fractions, which binary floats round.
    let needed = |time_s: f64| u64_truncated((time_s * rate_hz - 1e-6).ceil());
    let demands = [
        (u64::from(size.width_px), "the row's pixels".to_owned()),
        (needed(conversion_s), format!("settling and conversion of {:.3} us", 1e6 * conversion_s)),
        (needed(packet_s), format!("the line's packet of {:.3} us", 1e6 * packet_s)),
    ];
    let (needed_clk, what) = demands.into_iter().max_by_key(|(clocks, _)| *clocks).expect("there are three demands");
    if u64::from(params.hts) >= needed_clk {
        return Ok(());
    }
    let reason = format!("a line must hold {what}; hts = {needed_clk} would do");
    Err(Error::key("sensor.readout.hts", params.hts, reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params_tests::paper_adc;

    const VGA: Size = Size { width_px: 640, height_px: 480 };

    fn ov7251(vts: u32, shutter: Shutter, exposure_us: f64) -> ReadoutParams {
        let (hts, pixel_rate_hz) = (928, 48_000_000);
        ReadoutParams { shutter, hts, vts, pixel_rate_hz, exposure_us, exposure_margin_lines: 20 }
    }

    /// Published driver tables (Linux: drivers/media/i2c/ov7251.c, ov9282.c, imx219.c): width, height, hts, vts, pixel rate,
    /// margin, then fps, line time in us and greatest exposure in lines as they follow from or are stated in them.
    #[test]
    fn driver_tables_agree_in_rate_line_time_and_exposure_limit() {
        let tables = [
            (640, 480, 928, 1724, 48_000_000, 20, 30.0, 19.333, 1704),
            (640, 480, 928, 860, 48_000_000, 20, 60.14, 19.333, 840),
            (640, 480, 928, 572, 48_000_000, 20, 90.43, 19.333, 552),
            (1280, 800, 1456, 910, 160_000_000, 25, 120.758, 9.1, 885),
            (640, 400, 1456, 422, 160_000_000, 25, 260.403, 9.1, 397),
            (3280, 2464, 3448, 3526, 182_400_000, 4, 15.0, 18.904, 3522),
            (1920, 1080, 3448, 1763, 182_400_000, 4, 30.0, 18.904, 1759),
        ];
        for (width_px, height_px, hts, vts, pixel_rate_hz, exposure_margin_lines, fps, line_us, limit) in tables {
            let size = Size { width_px, height_px };
            let shutter = Shutter::Global;
            let params = ReadoutParams { shutter, hts, vts, pixel_rate_hz, exposure_us: 100.0, exposure_margin_lines };
            let schedule = Schedule::new(size, &params, &paper_adc(), 0.0).unwrap();
            assert!((schedule.fps() / fps - 1.0).abs() < 2e-4, "{} fps for {fps}", schedule.fps());
            assert!((1e6 * schedule.line_time_s() / line_us - 1.0).abs() < 2e-4, "{line_us} us");
            assert_eq!(schedule.exposure_lines_max(), limit);
        }
    }

    #[test]
    fn a_short_line_is_refused_with_the_hts_that_would_do() {
        let short = ReadoutParams { hts: 352, ..ov7251(1724, Shutter::Global, 100.0) };
        // 5 us settling + 1152 clocks at 480 MHz are 7.4 us: 355.2 clocks at 48 MHz.
        let narrow = Size { width_px: 320, height_px: 240 };
        let message = Schedule::new(narrow, &short, &paper_adc(), 0.0).unwrap_err().to_string();
        assert!(message.contains("sensor.readout.hts = 352") && message.contains("hts = 356 would do"), "{message}");
        let enough = ReadoutParams { hts: 356, ..short.clone() };
        assert!(Schedule::new(narrow, &enough, &paper_adc(), 0.0).is_ok());
        let message = Schedule::new(narrow, &enough, &paper_adc(), 10e-6).unwrap_err().to_string();
        assert!(message.contains("packet") && message.contains("hts = 480 would do"), "{message}");
        let message = Schedule::new(VGA, &enough, &paper_adc(), 0.0).unwrap_err().to_string();
        assert!(message.contains("pixels") && message.contains("hts = 640 would do"), "{message}");
    }

    #[test]
    fn exposure_is_rounded_to_lines_and_refused_beyond_the_frame() {
        let lines = |exposure_us| {
            let params = ov7251(1724, Shutter::Global, exposure_us);
            Schedule::new(VGA, &params, &paper_adc(), 0.0).map(|schedule| schedule.exposure_lines())
        };
        assert_eq!((lines(2000.0).unwrap(), lines(1e-3).unwrap()), (103, 1));
        assert_eq!(lines(1704.0 * 928.0 / 48.0).unwrap(), 1704);
        let message = lines(1705.0 * 928.0 / 48.0).unwrap_err().to_string();
        assert!(message.contains("sensor.readout.exposure_us") && message.contains("1704 lines"), "{message}");
    }

    #[test]
    fn rows_roll_or_wait_and_the_frame_time_is_their_middle() {
        let line_s = 928.0 / 48e6;
        let frame_s = 1724.0 * line_s;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} for {b}");
        for (shutter, rolls) in [(Shutter::Global, 0.0), (Shutter::Rolling, 1.0)] {
            let schedule = Schedule::new(VGA, &ov7251(1724, shutter, 2000.0), &paper_adc(), 0.0).unwrap();
            let (frame, row) = (FrameIndex(2), RowIndex(100));
            let exposure = schedule.exposure(frame, row);
            near(exposure.end_s, 3.0 * frame_s + rolls * 100.0 * line_s);
            near(exposure.length_s(), 103.0 * line_s);
            let readout = schedule.readout(frame, row);
            near(readout.start_s, 3.0 * frame_s + 100.0 * line_s);
            near(readout.length_s(), line_s);
            near(schedule.storage_s(row), readout.start_s - exposure.end_s);
            near(schedule.t_frame(frame), 3.0 * frame_s + 0.5 * (rolls * 479.0 - 103.0) * line_s);
        }
    }

    #[test]
    fn an_empty_array_and_a_frame_shorter_than_the_array_are_refused() {
        let params = ov7251(1724, Shutter::Global, 2000.0);
        for (size, key) in
            [((0, 480), "sensor.width"), ((640, 0), "sensor.height"), ((640, 1725), "sensor.readout.vts")]
        {
            let size = Size { width_px: size.0, height_px: size.1 };
            let message = Schedule::new(size, &params, &paper_adc(), 0.0).unwrap_err().to_string();
            assert!(message.contains(key), "{message}");
        }
    }
}
