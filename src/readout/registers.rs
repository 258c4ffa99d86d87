//! Registers of exposure and gain with their latency. Tells which values are in effect in a frame.
//!
//! Real sensors latch exposure and gain for a frame that has not begun: what is written during frame n acts in frame n + 2 with
//! most (the shutter row of frame n + 1 runs already), so that exposure and gain change together (a grouped write).

use std::collections::BTreeMap;

use crate::units::FrameIndex;

/// Exposure and gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExposureSettings {
    /// Whole lines of the longest exposure.
    pub exposure_lines: u64,
    /// Clocks beyond them.
    pub fine_clk: u32,
    /// Gain of the ramp.
    pub gain: f64,
}

/// What was written and when it acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Registers {
    initial: ExposureSettings,
    latency_frames: u32,
    /// By the first frame in which it acts.
    acting: BTreeMap<u32, ExposureSettings>,
}

impl Registers {
    /// Registers that hold `initial` since long before the run.
    pub fn new(initial: ExposureSettings, latency_frames: u32) -> Self {
        Self { initial, latency_frames, acting: BTreeMap::new() }
    }

    /// Writes all of them during a frame; the last write in a frame counts. Returns the first frame in which they act.
    pub fn write(&mut self, frame: FrameIndex, settings: ExposureSettings) -> FrameIndex {
        let acts = frame.0.saturating_add(self.latency_frames);
        self.acting.insert(acts, settings);
        FrameIndex(acts)
    }

    /// What is in effect in a frame.
    pub fn in_effect(&self, frame: FrameIndex) -> ExposureSettings {
        self.acting.range(..=frame.0).next_back().map_or(self.initial, |(_, settings)| *settings)
    }

    /// What was written last, in effect or not.
    pub fn written(&self) -> ExposureSettings {
        self.acting.last_key_value().map_or(self.initial, |(_, settings)| *settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(exposure_lines: u64) -> ExposureSettings {
        ExposureSettings { exposure_lines, fine_clk: 0, gain: 1.0 }
    }

    #[test]
    fn a_write_acts_two_frames_later_and_the_last_of_a_frame_counts() {
        let mut registers = Registers::new(lines(10), 2);
        assert_eq!(registers.write(FrameIndex(3), lines(20)), FrameIndex(5));
        registers.write(FrameIndex(3), lines(30));
        registers.write(FrameIndex(4), lines(40));
        let seen: Vec<u64> = (0..8).map(|frame| registers.in_effect(FrameIndex(frame)).exposure_lines).collect();
        assert_eq!(seen, [10, 10, 10, 10, 10, 30, 40, 40]);
        assert_eq!(registers.written(), lines(40));
    }

    #[test]
    fn without_latency_a_write_acts_in_its_own_frame() {
        let mut registers = Registers::new(lines(1), 0);
        assert_eq!(registers.write(FrameIndex(u32::MAX), lines(2)), FrameIndex(u32::MAX));
        assert_eq!(registers.in_effect(FrameIndex(u32::MAX)), lines(2));
        assert_eq!(registers.in_effect(FrameIndex(0)), lines(1));
    }
}
