//! The published numbers of effects, by which their draws are named.

use sensel::effects::{build_all, names};

use super::cases::{ALL_PRESENT, CASES};

/// The published numbers of all streams of draws: of the effects, and of the streams that belong to no effect of the list.
const NUMBERS: [(&str, u64); 32] = [
    ("prnu", 101),
    ("shot_noise", 102),
    ("dark_current", 103),
    ("dsnu", 104),
    ("full_well", 105),
    ("ktc_noise", 106),
    ("read_noise", 107),
    ("parasitic_light", 108),
    ("storage_leakage", 109),
    ("rts_noise", 110),
    ("flicker_noise", 111),
    ("gain_compression", 112),
    ("blooming", 113),
    ("image_lag", 114),
    ("hot_pixels", 115),
    ("dead_pixels", 116),
    ("stuck_pixels", 117),
    ("die_offset", 118),
    ("die_gain", 119),
    ("dark current of a die", 120),
    ("column_gain", 201),
    ("column_offset", 202),
    ("row_noise", 203),
    ("row_offset", 204),
    ("column_noise", 205),
    ("comparator_noise", 206),
    ("ramp_noise", 207),
    ("ramp_jitter", 208),
    ("supply_ripple", 209),
    ("column_settling", 210),
    ("delay of a column's comparator", 211),
    ("bit errors of the link", 301),
];

#[test]
fn every_effect_draws_by_its_own_published_number() {
    for (index, (name, number)) in NUMBERS.iter().enumerate() {
        assert!(NUMBERS[..index].iter().all(|(_, other)| other != number), "{name}: {number} is in use");
    }
    let mut built = Vec::new();
    for set in CASES.iter().map(|case| case.called.set).chain([ALL_PRESENT]) {
        for effect in build_all(&super::parameters(set)) {
            let (name, number) = (effect.name(), effect.identity().number.0);
            assert!(NUMBERS.contains(&(name, number)), "{name} draws by {number}");
            built.push(name);
        }
    }
    for name in names() {
        assert!(built.contains(&name), "{name} was not built, so its number was not compared");
    }
}
