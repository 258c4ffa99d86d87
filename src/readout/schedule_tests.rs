//! Tests of the schedule: the numbers of published drivers, spans of rows, frames, slots and cameras, and what is refused.

use super::*;
use crate::adc::params_tests::paper_adc;
use crate::units::{CameraIndex, Clocks, FrameIndex, RowIndex, Size};

const VGA: Size = Size { width_px: 640, height_px: 480 };

fn ov7251(vts: u32, shutter: Shutter, exposure_us: f64) -> ReadoutParams {
    let (hts, pixel_rate_hz) = (928, 48_000_000);
    let plain = ReadoutParams::plain(shutter, hts, vts, pixel_rate_hz, ExposureSetting::Us(exposure_us));
    ReadoutParams { exposure_margin_lines: 20, ..plain }
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
        let plain = ReadoutParams::plain(Shutter::Global, hts, vts, pixel_rate_hz, ExposureSetting::Us(100.0));
        let params = ReadoutParams { exposure_margin_lines, ..plain };
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
    assert!(message.contains("sensor.readout.hts = 352") && message.contains("use hts = 356"), "{message}");
    let enough = ReadoutParams { hts: 356, ..short.clone() };
    assert!(Schedule::new(narrow, &enough, &paper_adc(), 0.0).is_ok());
    let message = Schedule::new(narrow, &enough, &paper_adc(), 10e-6).unwrap_err().to_string();
    assert!(message.contains("packet") && message.contains("use hts = 480"), "{message}");
    let message = Schedule::new(VGA, &enough, &paper_adc(), 0.0).unwrap_err().to_string();
    assert!(message.contains("pixels") && message.contains("use hts = 640"), "{message}");
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
    for (size, key) in [((0, 480), "sensor.width"), ((640, 0), "sensor.height"), ((640, 1725), "sensor.readout.vts")] {
        let size = Size { width_px: size.0, height_px: size.1 };
        let message = Schedule::new(size, &params, &paper_adc(), 0.0).unwrap_err().to_string();
        assert!(message.contains(key), "{message}");
    }
}

fn vga(params: &ReadoutParams) -> Schedule {
    Schedule::new(VGA, params, &paper_adc(), 0.0).unwrap()
}

fn refused(params: &ReadoutParams) -> String {
    Schedule::new(VGA, params, &paper_adc(), 0.0).unwrap_err().to_string()
}

fn rolling(lines: u32) -> ReadoutParams {
    ReadoutParams { exposure: ExposureSetting::Lines(lines), ..ov7251(1724, Shutter::Rolling, 0.0) }
}

/// Half a clock either way: clocks are integers and seconds are theirs over the rate.
fn same_instant(schedule: &Schedule, time_s: f64, clock: u64) {
    let clock_s = 1.0 / f64::from(u32::try_from(schedule.pixel_rate_hz()).unwrap());
    assert!(
        (time_s - clock_s * crate::num::f64_from_u64(clock)).abs() < 0.5 * clock_s,
        "{time_s} s is not clock {clock}"
    );
}

#[test]
fn an_exposure_of_zero_lines_is_an_instant_where_the_sensor_allows_it() {
    let none = ReadoutParams { exposure_lines_min: 0, ..rolling(0) };
    let span = vga(&none).row_exposure_clk(FrameIndex(1), 0, RowIndex(7)).unwrap();
    assert_eq!((span.length(), span.end), (Clocks(0), Clocks(2 * 1724 * 928 + 7 * 928)));
    assert_eq!(vga(&none).exposure_s(), 0.0);
    let message = refused(&rolling(0));
    assert!(message.contains("exposure_lines = 0: shorter than") && message.contains("use 1"), "{message}");
    let message = refused(&ReadoutParams { exposure: ExposureSetting::Us(0.0), ..rolling(1) });
    assert!(
        message.contains("exposure_us = 0: out of range; use 19.334 or more (sensor.readout.exposure_lines_min = 1)"),
        "{message}"
    );
}

#[test]
fn an_exposure_of_one_clock_is_one_clock() {
    let one = ReadoutParams { exposure_lines_min: 0, exposure_fine_clk: 1, ..rolling(0) };
    let schedule = vga(&one);
    for row in [0, 1, 479] {
        assert_eq!(schedule.row_exposure_clk(FrameIndex(0), 0, RowIndex(row)).unwrap().length(), Clocks(1));
    }
    assert!((schedule.exposure_s() * 48e6 - 1.0).abs() < 1e-12, "one clock in floats");
    let message = refused(&ReadoutParams { exposure_fine_clk: 928, ..one });
    assert!(message.contains("0 to 927"), "{message}");
}

#[test]
fn an_exposure_longer_than_a_frame_names_the_frame_or_makes_it() {
    let message = refused(&rolling(1705));
    assert!(message.contains("at most 1704, vts = 1725") && message.contains("extend_frame"), "{message}");
    // A fine part needs a separate line.
    let fine = ReadoutParams { exposure_fine_clk: 5, ..rolling(1704) };
    assert!(refused(&fine).contains("at most 1703, vts = 1725"));
    let long = ReadoutParams { long_exposure: LongExposure::ExtendFrame, ..rolling(5000) };
    assert_eq!((vga(&long).vts(), vga(&long).exposure_lines_max()), (5020, 5000));
    assert_eq!(vga(&ReadoutParams { exposure: ExposureSetting::Lines(1704), ..long.clone() }).vts(), 1724);
    let endless = ReadoutParams { exposure: ExposureSetting::Us(1e9), ..long };
    assert!(refused(&endless).contains("use at most 16777216 lines"));
}

#[test]
fn a_frame_rate_gives_the_nearest_vts_and_names_the_fastest_that_would_do() {
    let at = |rate_hz, lines| ReadoutParams { frame: FrameLength::RateHz(rate_hz), ..rolling(lines) };
    assert_eq!((vga(&at(30.0, 103)).vts(), vga(&at(60.0, 103)).vts()), (1724, 862));
    for (lines, needed) in [(103, 480), (500, 520)] {
        let message = refused(&at(120.0, lines));
        let fastest = message.split("; use ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
        assert_eq!(vga(&at(fastest, lines)).vts(), needed, "{message}");
        let shorter = 48e6 / (928.0 * (f64::from(u32::try_from(needed).unwrap()) - 1.0));
        assert!(refused(&at(shorter, lines)).contains("frame_rate_hz"));
    }
    assert!(refused(&at(1e-3, 103)).contains("or more"));
}

#[test]
fn a_rolling_exposure_begins_in_the_frame_before_and_ends_at_its_row_s_line() {
    let schedule = vga(&rolling(1704));
    let frame_clk = schedule.frame_clk().0;
    for frame in [0, 5] {
        for row in [0, 19, 20, 479] {
            let exposure = schedule.row_exposure_clk(FrameIndex(frame), 0, RowIndex(row)).unwrap();
            let read = schedule.row_readout_clk(FrameIndex(frame), 0, RowIndex(row)).unwrap();
            assert_eq!(exposure.end, read.start);
            // Rows below the margin wrap: they begin in their frame's own period and end in the next.
            let end = (u64::from(frame) + 1) * frame_clk + u64::from(row) * 928;
            assert_eq!((exposure.start.0, exposure.end.0), (end - 1704 * 928, end));
            let before = schedule.row_readout_clk(FrameIndex(frame + 1), 0, RowIndex(row)).unwrap();
            assert_eq!(before.start.0 - read.start.0, frame_clk);
        }
    }
    // The margin keeps the reset of a row's next exposure 20 lines after its read.
    let next = schedule.row_exposure_clk(FrameIndex(1), 0, RowIndex(3)).unwrap();
    let read = schedule.row_readout_clk(FrameIndex(0), 0, RowIndex(3)).unwrap();
    assert_eq!(next.start.0 - read.start.0, 20 * 928);
}

#[test]
fn averaged_rows_have_lines_of_their_own_and_the_output_row_their_mean() {
    let params = ReadoutParams { binning: 2, binning_mode: BinningMode::Average, ..rolling(100) };
    let schedule = vga(&params);
    assert_eq!((schedule.output_size(), schedule.frame_demand().rows), (Size { width_px: 320, height_px: 240 }, 480));
    assert_eq!(schedule.lines_per_packet(), 2);
    let (frame, row) = (FrameIndex(1), RowIndex(10));
    let rows: Vec<u64> =
        schedule.geometry().rows_of(row).map(|row| schedule.row_exposure_clk(frame, 0, row).unwrap().end.0).collect();
    assert_eq!(rows[1] - rows[0], 928);
    same_instant(&schedule, schedule.exposure(frame, row).end_s, (rows[0] + rows[1]) / 2);
    let length = schedule.exposure(frame, row).length_s() / schedule.exposure_s();
    assert!((length - 1.0).abs() < 1e-12, "an exposure is as long as its rows'");
    let charge = vga(&ReadoutParams { binning_mode: BinningMode::Charge, ..params });
    assert_eq!((charge.frame_demand().rows, charge.lines_per_packet()), (240, 1));
    same_instant(&charge, charge.readout(frame, row).start_s, 2 * 1724 * 928 + 10 * 928);
}

#[test]
fn staggered_exposures_share_no_line_and_follow_one_another() {
    let hdr = Hdr::MultiExposure { exposures: 3, ratio: 8.0 };
    let params = ReadoutParams { hdr, exposure_margin_lines: 20, ..rolling(800) };
    let schedule = vga(&params);
    assert_eq!(schedule.slots().iter().map(|slot| slot.exposure_lines).collect::<Vec<_>>(), [800, 100, 12]);
    let mut lines = std::collections::BTreeSet::new();
    let mut reads = 0;
    for frame in (0..3).map(FrameIndex) {
        for row in (0..480).map(RowIndex) {
            let of = |slot| schedule.row_exposure_clk(frame, slot, row).unwrap();
            let read = |slot| schedule.row_readout_clk(frame, slot, row).unwrap();
            for slot in 0..3 {
                assert_eq!((of(slot).end, of(slot).length()), (read(slot).start, schedule.exposure_clk(slot)));
                assert_eq!(read(slot).start.0 % 928, 0);
                assert!(lines.insert(read(slot).start.0), "two rows want one line");
                reads += 1;
                if slot > 0 {
                    assert!(of(slot).start >= read(slot - 1).end);
                }
            }
            let next = schedule.row_exposure_clk(FrameIndex(frame.0 + 1), 0, row).unwrap();
            assert!(next.start >= read(2).end, "the next frame begins before this one's last exposure is read");
        }
    }
    assert_eq!(reads, 3 * 480 * 3);
    let long = refused(&ReadoutParams { exposure: ExposureSetting::Lines(1700), ..params.clone() });
    assert!(long.contains("exposure_lines = 1700") || long.contains("vts = "), "{long}");
    assert!(refused(&ReadoutParams { shutter: Shutter::Global, ..params }).contains("use none"));
}

#[test]
fn cameras_start_by_their_skew_and_drift_by_their_clock() {
    let params = ReadoutParams { sync_skew_ns: vec![0, 1500], clock_ppb: vec![0, 50_000], ..rolling(100) };
    let [first, second] = [0, 1].map(|camera| vga(&params).for_camera(CameraIndex(camera)));
    let start = |schedule: &Schedule, frame| schedule.readout(FrameIndex(frame), RowIndex(0)).start_s;
    // 50 ppm fast: each clock is shorter by 1/1.00005.
    for frame in [0, 10, 1000] {
        let expected = 1.5e-6 + start(&first, frame) / 1.000_05;
        // Binary rounding of instants up to 40 s: some 1e-14 s.
        assert!((start(&second, frame) - expected).abs() < 1e-13, "frame {frame}");
    }
    assert_eq!(vga(&params), first);
    assert_eq!(
        first.row_exposure_clk(FrameIndex(3), 0, RowIndex(9)),
        second.row_exposure_clk(FrameIndex(3), 0, RowIndex(9))
    );
}

#[test]
fn a_trigger_starts_frames_on_the_next_clock_and_not_before_the_last_has_ended() {
    let external = |period_ns, delay_clk| Trigger::External { period_ns, delay_clk };
    let params = ReadoutParams { trigger: external(40_000_007, 12), clock_ppb: vec![0, -20_000], ..rolling(100) };
    let schedule = vga(&params);
    let mut late = 0;
    for camera in [0, 1] {
        let schedule = schedule.for_camera(CameraIndex(camera));
        for frame in 0..1000 {
            let pulse_s = 40_000_007e-9 * f64::from(frame);
            let start = schedule.frame_start_clk(FrameIndex(frame));
            let start_s = schedule.span(ClockSpan { start, end: start }).start_s;
            let wait_clk = (start_s - pulse_s) * 48e6;
            // The edge comes within a clock of the pulse, the frame 12 clocks later; floats of 40 s are good to 1e-6 clocks.
            assert!(wait_clk > 11.999 && wait_clk < 13.001, "camera {camera}, frame {frame}: {wait_clk}");
            late += u32::from(wait_clk > 12.5);
        }
    }
    assert!((500..1500).contains(&late), "{late} of 2000 pulses fell into the second half of a clock");
    assert!((schedule.fps() * 0.040_000_007 - 1.0).abs() < 1e-12);
    let message = refused(&ReadoutParams { trigger: external(33_000_000, 0), ..params.clone() });
    // 1724 * 928 clocks at 48 MHz less 20 ppm.
    assert!(message.contains("trigger_period_us = 33000.0") && message.contains("use 33331.334"), "{message}");
    assert!(
        Schedule::new(VGA, &ReadoutParams { trigger: external(33_331_334, 0), ..params.clone() }, &paper_adc(), 0.0)
            .is_ok()
    );
    assert!(refused(&ReadoutParams { trigger: external(33_331_333, 0), ..params }).contains("33331.334"));
}

#[test]
fn serial_lanes_that_do_not_empty_within_a_line_name_the_hts_that_would_do() {
    // 640 columns of 10 bits over 4 lanes at 60 MHz: 1600 lane clocks, 1280 clocks at 48 MHz.
    let lanes = ReadoutParams { lanes: 4, lane_clock_hz: 60_000_000, ..rolling(100) };
    let message = refused(&lanes);
    assert!(message.contains("readout of its lanes of 26.667 us") && message.contains("use hts = 1280"), "{message}");
    let enough = ReadoutParams { hts: 1280, ..lanes };
    assert_eq!(vga(&enough).line_limit().kind, DemandKind::ShiftOut);
    assert_eq!(vga(&enough).shift_lane_clk(), Clocks(1600));
    assert!(refused(&ReadoutParams { hts: 1279, ..enough }).contains("hts = 1280"));
}

#[test]
fn pulses_lengthen_the_conversion() {
    let pulses = Pulses { reset_clk: 24, transfer_clk: 48, latch_clk: 2 };
    // 7.4 us are 355.2 clocks.
    let params = ReadoutParams { pulses, hts: 429, ..rolling(100) };
    let narrow = Size { width_px: 320, height_px: 240 };
    let message = Schedule::new(narrow, &params, &paper_adc(), 0.0).unwrap_err().to_string();
    assert!(message.contains("use hts = 430"), "{message}");
}

#[test]
fn another_exposure_of_a_frame_moves_only_its_beginning() {
    let schedule = vga(&rolling(100));
    let longer = schedule.with_exposure(1704, 0).unwrap();
    let span = |schedule: &Schedule| schedule.row_exposure_clk(FrameIndex(4), 0, RowIndex(9)).unwrap();
    assert_eq!((span(&schedule).end, span(&longer).length()), (span(&longer).end, Clocks(1704 * 928)));
    for (lines, fine_clk) in [(1705, 0), (0, 0), (1704, 1), (5, 928)] {
        assert!(schedule.with_exposure(lines, fine_clk).is_err(), "{lines} {fine_clk}");
    }
}
