//! How the codes of a run use the converter's range, and what a user should know of dark and saturated pictures, and of runs without a
//! pose.

pub(super) use super::code_sums::CodeSums;
use super::setup::{FEATURES_LEAST, START_RAD};
use super::state::Session;
use crate::num::{f64_from_u64, f64_from_usize};

/// Share of the range above the black level below which a picture counts as dark.
const DARK_SHARE: f64 = 0.05;

/// Share of saturated pixels from which a picture counts as too bright.
const SATURATED_SHARE: f64 = 0.1;

/// What a person should know of the light in a run's pictures. `auto`: exposure follows the light.
fn light_words(sums: CodeSums, black_dn: u32, bits: u32, auto: bool) -> Option<String> {
    let greatest = f64::from((1_u32 << bits) - 1);
    let (mean_dn, black) = (sums.mean_dn(), f64::from(black_dn));
    let saturated = f64_from_u64(sums.saturated) / f64_from_u64(sums.pixels.max(1));
    let share = (mean_dn - black) / (greatest - black);
    if saturated >= SATURATED_SHARE {
        let keys = if auto { "lower sensor.readout.target_mean" } else { "shorten sensor.readout.exposure_us" };
        return Some(format!(
            "{:.1} % of the pixels are saturated: {keys}, or lower sensor.adc.gain or scene.illuminance_lux",
            100.0 * saturated
        ));
    }
    (share < DARK_SHARE).then(|| {
        let keys = if auto {
            "raise sensor.readout.gain_max or sensor.readout.target_mean"
        } else {
            "lengthen sensor.readout.exposure_us, set sensor.readout.exposure = \"auto\", raise sensor.adc.gain"
        };
        format!(
            "the pictures are dark: mean code {mean_dn:.1} at black level {black_dn}, {:.1} % of the range; {keys}, or raise \
             scene.illuminance_lux",
            100.0 * share
        )
    })
}

/// Why no frame has a pose, and what to change.
fn untracked_words(features: f64, cameras: usize, threshold: u16) -> String {
    let none = "0 % of the frames have a pose";
    if features < FEATURES_LEAST {
        return format!(
            "{none}: {features:.0} features per frame are too few; add light (sensor.readout.exposure_us, scene.illuminance_lux), lower \
             compute.threshold = {threshold}, or show a scene with texture"
        );
    }
    if cameras == 1 {
        return format!(
            "{none}: one camera starts a map once it has moved sideways by {START_RAD} of the depth or more; raise run.frames, move \
             faster, or set rig.baseline_mm = 65 for two cameras"
        );
    }
    format!(
        "{none} though there are {features:.0} features per frame; shorten sensor.readout.exposure_us against blur, slow the motion, or \
         let the cameras see the same (rig.baseline_mm)"
    )
}

impl Session {
    /// The warnings so far and, of all frames together, those about their light and about missing poses.
    pub(super) fn final_warnings(&self) -> Vec<String> {
        let setup = &self.setup;
        let mut all = self.warnings();
        let mut add = |text: String| {
            if !all.contains(&text) {
                all.push(text);
            }
        };
        if setup.sensor.merge.is_none() {
            let auto = setup.sensor.schedule.params().auto.is_some();
            let black_dn = setup.sensor.parameters.adc.black_level_dn;
            light_words(self.totals.codes, black_dn, setup.sensor.bits(), auto).into_iter().for_each(&mut add);
        }
        if self.notes.iter().all(|note| note.estimate.is_none()) {
            let frames = f64_from_usize(self.notes.len() * setup.cameras.len());
            let found = self.notes.iter().flat_map(|note| &note.found).map(|&count| u64::from(count)).sum::<u64>();
            let threshold = setup.sensor.extractor.threshold;
            add(untracked_words(f64_from_u64(found) / frames, setup.cameras.len(), threshold));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(mean_dn: u64, saturated: u64) -> CodeSums {
        CodeSums { pixels: 1000, sum_dn: 1000 * mean_dn, saturated }
    }

    #[test]
    fn dark_and_saturated_pictures_are_told_from_exposed_ones() {
        let mut said = 0;
        for (mean_dn, saturated, bits, black_dn, word) in [
            (77, 0, 10, 64, Some("mean code 77.0 at black level 64, 1.4 % of the range")),
            (64, 0, 10, 64, Some("dark")),
            (60, 0, 10, 64, Some("dark")),
            (300, 0, 10, 64, None),
            (300, 99, 10, 64, None),
            (800, 100, 10, 64, Some("10.0 % of the pixels are saturated")),
            (20, 0, 8, 16, Some("dark")),
            (60, 0, 8, 16, None),
        ] {
            let words = light_words(sums(mean_dn, saturated), black_dn, bits, false);
            assert_eq!(words.is_some(), word.is_some(), "{mean_dn}: {words:?}");
            if let (Some(words), Some(word)) = (&words, word) {
                assert!(words.contains(word), "{words}");
                said += 1;
            }
        }
        assert_eq!(said, 5);
        assert!(light_words(sums(70, 0), 64, 10, true).unwrap().contains("gain_max"));
    }

    #[test]
    fn a_run_without_a_pose_says_what_to_change() {
        assert!(untracked_words(3.0, 2, 20).contains("compute.threshold = 20"));
        assert!(untracked_words(300.0, 1, 20).contains("raise run.frames"));
        assert!(untracked_words(300.0, 2, 20).contains("exposure_us"));
    }
}
