//! Automatic exposure. Sets exposure lines and gain of later frames from the mean code of each frame.
//!
//! The controller knows which exposure and gain were in effect in the frame that it looks at (its registers' history), so it estimates
//! the scene's light from them and not from its last write: light = signal / (exposure gain). Then exposure times gain = target
//! over light. Dead time therefore cannot make it oscillate: with a static scene, all frames until a write acts give the
//! same answer. A step is at most a factor of 8, so that a saturated frame (which hides how bright it is) or one near black (which is
//! mostly noise) is followed by better ones; a saturated frame gives too low a light, so exposure falls without overshoot. Inside the
//! dead band nothing is written: it is wider than what rounding to lines and to gain steps leaves.

pub use super::params::AutoExposureParams;
use super::params::TARGET_MEAN_MAX;
use super::registers::{ExposureSettings, Registers};
use super::schedule::Schedule;
use crate::error::Error;
use crate::num::{f64_from_u64, greater, lesser, u64_truncated};
use crate::units::FrameIndex;

/// What the controller must know of the converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodeRange {
    /// Black level.
    pub black_dn: f64,
    /// Greatest code.
    pub max_dn: f64,
    /// Gain at the start, and the least that is used.
    pub gain: f64,
}

/// A write to the registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegisterWrite {
    /// The frame during which it is written.
    pub written: FrameIndex,
    /// The first frame in which it acts.
    pub acts: FrameIndex,
    /// What is written.
    pub settings: ExposureSettings,
}

/// Steps of the gain, as of sensors whose gain register has four fractional bits.
const GAIN_STEPS: f64 = 16.0;
/// Greatest change of exposure times gain by one write.
const STEP_MAX: f64 = 8.0;
/// Nothing is written while signal and target differ by less: half a gain step at gain 1 is 3.1 %, and noise of a mean adds.
const DEAD_BAND: f64 = 0.05;

/// The controller with its registers.
#[derive(Clone, Debug)]
pub struct AutoExposure {
    registers: Registers,
    delay_frames: u32,
    range: CodeRange,
    target_signal_dn: f64,
    lines: [u64; 2],
    gain_max: f64,
}

impl AutoExposure {
    /// A controller that starts from the schedule's own exposure and the converter's gain. Fails on limits that contradict the schedule
    /// or the converter, by key and value, with an accepted value.
    pub fn new(params: &AutoExposureParams, schedule: &Schedule, range: CodeRange) -> Result<Self, Error> {
        params.check()?;
        let (least, most) = (u64::from(schedule.params().exposure_lines_min).max(1), schedule.exposure_lines_max());
        let lines_max = params.exposure_lines_max.map_or(most, u64::from);
        if !(least..=most).contains(&lines_max) {
            let reason = format!("out of range; use {least} to {most}");
            return Err(Error::key("sensor.readout.exposure_lines_max", lines_max, reason));
        }
        if params.gain_max < range.gain {
            let reason = format!("less than sensor.adc.gain; use {} or more", range.gain);
            return Err(Error::key("sensor.readout.gain_max", params.gain_max, reason));
        }
        let target_signal_dn = params.target_mean * range.max_dn - range.black_dn;
        if !(target_signal_dn > 0.0) {
            // Rounded up, so that what is named is accepted.
            let least = (1e4 * (range.black_dn + 1.0) / range.max_dn).ceil() / 1e4;
            let reason = if least <= TARGET_MEAN_MAX {
                format!("not above the black level; use {least} or more")
            } else {
                format!("not above the black level of {} DN; lower sensor.adc.black_level_dn", range.black_dn)
            };
            return Err(Error::key("sensor.readout.target_mean", params.target_mean, reason));
        }
        let initial = ExposureSettings {
            exposure_lines: schedule.exposure_lines(),
            fine_clk: schedule.exposure_fine_clk(),
            gain: range.gain,
        };
        let registers = Registers::new(initial, schedule.params().register_latency_frames);
        let (delay_frames, gain_max) = (params.delay_frames, params.gain_max);
        Ok(Self { registers, delay_frames, range, target_signal_dn, lines: [least, lines_max], gain_max })
    }

    /// Exposure and gain in effect in a frame.
    pub fn in_effect(&self, frame: FrameIndex) -> ExposureSettings {
        self.registers.in_effect(frame)
    }

    /// Takes the mean code of a frame, black level included; frames come in order. A frame is read while the next is exposed, so
    /// the answer is written in frame + 1 + delay. Returns the write, if one is called for.
    pub fn after_frame(&mut self, frame: FrameIndex, mean_dn: f64) -> Option<RegisterWrite> {
        let seen = self.registers.in_effect(frame);
        let signal_dn = greater(mean_dn - self.range.black_dn, self.target_signal_dn / STEP_MAX);
        let step = greater(self.target_signal_dn / signal_dn, 1.0 / STEP_MAX);
        if (step - 1.0).abs() <= DEAD_BAND {
            return None;
        }
        let settings = self.settings(seen, step);
        let written = FrameIndex(frame.0.saturating_add(1 + self.delay_frames));
        if settings == self.registers.written() {
            return None;
        }
        let acts = self.registers.write(written, settings);
        Some(RegisterWrite { written, acts, settings })
    }

    /// Settings whose exposure times gain is `step` times that of `seen`: as much exposure as possible before any gain, and gain for
    /// what whole lines leave over.
    fn settings(&self, seen: ExposureSettings, step: f64) -> ExposureSettings {
        let [least, most] = self.lines;
        // An exposure of no whole line has no product to scale; it counts as the shortest.
        let seen_lines = f64_from_u64(seen.exposure_lines.max(1));
        let product = seen_lines * seen.gain * step;
        let exposure_lines = u64_truncated(product / self.range.gain).clamp(least, most);
        let wanted = (product / f64_from_u64(exposure_lines) * GAIN_STEPS).round_ties_even() / GAIN_STEPS;
        let gain = lesser(greater(wanted, self.range.gain), self.gain_max);
        ExposureSettings { exposure_lines, fine_clk: 0, gain }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params_tests::paper_adc;
    use crate::readout::{ExposureSetting, ReadoutParams, Shutter};
    use crate::units::Size;

    const RANGE: CodeRange = CodeRange { black_dn: 64.0, max_dn: 1023.0, gain: 1.0 };
    const PARAMS: AutoExposureParams =
        AutoExposureParams { target_mean: 0.4, delay_frames: 0, exposure_lines_max: None, gain_max: 16.0 };

    fn schedule(lines: u32, latency: u32) -> Schedule {
        let plain = ReadoutParams::plain(Shutter::Rolling, 928, 1724, 48_000_000, ExposureSetting::Lines(lines));
        let params = ReadoutParams { exposure_margin_lines: 20, register_latency_frames: latency, ..plain };
        Schedule::new(Size { width_px: 640, height_px: 480 }, &params, &paper_adc(), 0.0).unwrap()
    }

    /// Mean code of an even scene that gives the stated DN per line at gain 1, clipped and quantised as a converter does.
    fn mean_dn(dn_per_line: f64, settings: ExposureSettings) -> f64 {
        let lines = f64_from_u64(settings.exposure_lines);
        (64.0 + dn_per_line * lines * settings.gain).min(1023.0).round()
    }

    /// Means of a run over frames of constant light.
    fn run(start_lines: u32, latency: u32, delay_frames: u32, dn_per_line: f64, frames: u32) -> Vec<f64> {
        let params = AutoExposureParams { delay_frames, ..PARAMS };
        let mut auto = AutoExposure::new(&params, &schedule(start_lines, latency), RANGE).unwrap();
        let step = |frame| {
            let frame = FrameIndex(frame);
            let mean = mean_dn(dn_per_line, auto.in_effect(frame));
            auto.after_frame(frame, mean);
            mean
        };
        (0..frames).map(step).collect()
    }

    #[test]
    fn it_settles_from_a_hundredfold_error_on_both_sides_without_oscillation() {
        let target = 0.4 * 1023.0;
        let mut tried = 0;
        for latency in 0..=4 {
            for delay in [0, 1, 3] {
                // 100 lines are right; the start is a hundred times too long, too short, or already right.
                for (start, dn_per_line) in [(1000, 345.0 / 10.0), (10, 345.0 / 1000.0), (100, 3.45)] {
                    let means = run(start, latency, delay, dn_per_line, 200);
                    // Signal within the dead band, half a gain step at gain 1 (1/32) and half a DN.
                    let near = |mean: &f64| (mean - target).abs() <= (DEAD_BAND + 1.0 / 32.0) * (target - 64.0) + 0.5;
                    let settled = means.iter().position(near).unwrap();
                    // Saturation allows a factor of 2.8 a write (target over range), so five writes; a write takes
                    // 1 + delay + latency frames.
                    assert!(
                        crate::num::u32_from(settled) <= 6 * (1 + delay + latency),
                        "{start} lines, {latency}: {settled} frames"
                    );
                    assert!(means[settled..].iter().all(near), "{start} lines leave the target: {means:?}");
                    let rising = means[0] < target;
                    let ordered = |pair: &[f64]| if rising { pair[1] >= pair[0] } else { pair[1] <= pair[0] };
                    assert!(means[..=settled].windows(2).all(ordered), "{start} lines do not approach: {means:?}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 45);
    }

    #[test]
    fn a_write_answers_the_frame_it_looks_at_and_not_the_one_that_is_on_its_way() {
        let mut auto = AutoExposure::new(&PARAMS, &schedule(100, 2), RANGE).unwrap();
        let dim = 64.0 + 345.2 / 2.0;
        let first = auto.after_frame(FrameIndex(0), dim).unwrap();
        assert_eq!((first.written, first.acts), (FrameIndex(1), FrameIndex(3)));
        assert_eq!((first.settings.exposure_lines, first.settings.gain), (200, 1.0));
        // Frames 1 and 2 still show the old exposure: no second doubling.
        assert_eq!(auto.after_frame(FrameIndex(1), dim), None);
        assert_eq!(auto.after_frame(FrameIndex(2), dim), None);
        assert_eq!(auto.in_effect(FrameIndex(2)).exposure_lines, 100);
        assert_eq!(auto.in_effect(FrameIndex(3)).exposure_lines, 200);
    }

    #[test]
    fn gain_comes_after_the_longest_exposure_and_both_stay_in_their_limits() {
        let means = run(1000, 2, 0, 0.345 / 1704.0 * 100.0, 60);
        // 1704 lines give 34.5 DN: a gain of 10 is needed.
        assert!((means[59] - 409.2).abs() < 0.08 * 345.2, "{means:?}");
        let mut auto = AutoExposure::new(&PARAMS, &schedule(1000, 2), RANGE).unwrap();
        for frame in (0..60).map(FrameIndex) {
            auto.after_frame(frame, 64.0);
        }
        let dark = auto.in_effect(FrameIndex(60));
        assert_eq!((dark.exposure_lines, dark.gain), (1704, 16.0));
        for frame in (60..120).map(FrameIndex) {
            auto.after_frame(frame, 1023.0);
        }
        let bright = auto.in_effect(FrameIndex(120));
        assert_eq!((bright.exposure_lines, bright.gain), (1, 1.0));
    }

    #[test]
    fn limits_that_contradict_the_sensor_are_refused() {
        let cases = [
            (AutoExposureParams { exposure_lines_max: Some(1705), ..PARAMS }, "use 1 to 1704"),
            (AutoExposureParams { exposure_lines_max: Some(0), ..PARAMS }, "use 1 to 1704"),
            (AutoExposureParams { gain_max: 0.5, ..PARAMS }, "use 1 or more"),
            (AutoExposureParams { target_mean: 0.06, ..PARAMS }, "use 0.0636 or more"),
            (AutoExposureParams { target_mean: f64::NAN, ..PARAMS }, "0.001 to 0.99"),
            (AutoExposureParams { delay_frames: 9, ..PARAMS }, "use 0 to 8"),
        ];
        for (params, words) in cases {
            let message = AutoExposure::new(&params, &schedule(100, 2), RANGE).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
