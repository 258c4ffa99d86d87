//! A measurement of a simulated sensor without its defective pixels, as a fit reads one of frames that exist.

use super::defective::DefectivePixels;
use crate::characterize::bench::SensorBench;
use crate::characterize::measure::ChannelMeasurement;

/// Shoots the stacks twice: defective pixels are found in them first. `progress` is told of each frame of the second round.
pub fn sound_measurement(bench: &SensorBench, mut progress: impl FnMut()) -> (ChannelMeasurement, DefectivePixels) {
    let set = bench.set();
    let mut stacks = ChannelMeasurement::of_points(set.size, &[]);
    let mut shortest = Vec::new();
    for shot in set.shots() {
        if shot.point.is_none() {
            stacks.add(&shot, &bench.frame(&shot));
        } else if shot.point == Some(0) && !shot.is_lit && shot.is_first {
            shortest = bench.frame(&shot).values().to_vec();
        }
    }
    let mut defects = DefectivePixels::find(&stacks.bright, &stacks.dark, stacks.dark.frames, &shortest, set.bits);
    drop(stacks);
    let mut measurement = ChannelMeasurement::new(set);
    for shot in set.shots() {
        let mut codes = bench.frame(&shot);
        defects.follow(&shot, &codes);
        defects.mend(&mut codes);
        measurement.add(&shot, &codes);
        progress();
    }
    (measurement, defects)
}
