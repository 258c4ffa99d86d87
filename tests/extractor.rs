//! The clocked extractor, tick by tick and by rows, is the functional one: the same features in the same order, the clock of each,
//! the same losses, waits and thresholds, over random hardware, settings, pictures, gaps and takers. And the pattern's tables are those
//! of the published rule.

#![allow(clippy::unwrap_used)]

use crate::{cases, extractor_forms, extractor_play};
use cases::Random;
use extractor_forms::{Told, compare};
use extractor_play::{Takes, case_on, hardware, picture, play};
use rtl_models::fx_back::{FxBackConfig, engine_clocks, points};
use sensel::compute::blocks::{ENGINE_FIXED_CLK, START_GAP_CLK, symmetric_pattern};
use sensel::compute::pattern;

/// Any hardware that both forms know.
fn any_hardware(random: &mut Random) -> FxBackConfig {
    let cell_log2 = random.within(4, 6);
    FxBackConfig {
        max_width: 200,
        pix_bits: [8, 8, 9, 10, 12, 16][usize::try_from(random.below(6)).unwrap()],
        octaves: random.within(1, 4),
        harris: random.one_in(3),
        cell_log2,
        per_cell: random.within(1, 4),
        ring_log2: if cell_log2 == 6 { 7 } else { 6 },
        engines: random.within(1, 4),
        fifo_depth: if random.one_in(3) { random.within(1, 3) } else { random.within(4, 64) },
        desc_bits: 64 * random.within(1, 4),
        symmetric: random.one_in(3),
        subpixel: !random.one_in(3),
        width: 0,
        height: 0,
    }
}

#[test]
fn the_clocked_extractor_gives_the_functional_ones_features_in_its_clocks() {
    const SEED: u64 = 61;
    const CASES: u32 = 72;
    let mut random = Random::new(SEED);
    let mut met = Told::default();
    for number in 0..CASES {
        let built = if number < 24 { hardware(number % 3) } else { any_hardware(&mut random) };
        let mut case = case_on(built, number, 3, &mut random);
        (case.resets, case.settings.angle_bits) = (0, case.settings.angle_bits.max(3));
        let pictures: Vec<Vec<u16>> = (0..case.frames).map(|_| picture(&mut random, &case.config)).collect();
        let found = compare(&case, &pictures, &format!("seed {SEED}, case {number}"));
        met.features.extend(found.features);
        met.corners += found.corners;
        met.unselected += found.unselected;
        met.dropped += found.dropped;
        met.late += found.late;
        met.stalled += found.stalled;
    }
    let Told { features, corners, unselected, dropped, late, stalled, .. } = met;
    let features = features.len();
    println!(
        "seed {SEED}: {CASES} cases, {corners} corners, {features} features, {unselected} unselected, {dropped} dropped, {late} late"
    );
    println!("{stalled} clocks stalled");
    assert!(features > 1000 && unselected > 1000 && dropped > 100 && late > 20 && stalled > 10_000);
}

#[test]
fn both_forms_state_the_same_clocks() {
    for bits in [64, 128, 192, 256] {
        assert_eq!(u64::from(engine_clocks(bits)), ENGINE_FIXED_CLK + u64::from(bits));
    }
    assert_eq!(u64::from(rtl_models::fx_back::START_GAP_CLK), START_GAP_CLK);
}

#[test]
fn toggles_of_the_descriptor_are_those_on_the_pins() {
    const SEED: u64 = 62;
    let mut random = Random::new(SEED);
    let built = FxBackConfig { engines: 1, ..hardware(3) };
    let mut case = case_on(built, 0, 3, &mut random);
    (case.resets, case.times.takes) = (0, Takes::Always);
    let (mut before, mut flipped) = ([0; 32], 0);
    let make = |random: &mut Random| picture(random, &case.config);
    let (_, toggles) = play(&case, &mut random, make, |clock| {
        let bits = clock.out.back.record.descriptor;
        flipped += before.iter().zip(&bits).map(|(a, b): (&u8, &u8)| u64::from((a ^ b).count_ones())).sum::<u64>();
        before = bits;
    });
    assert!(flipped > 1000, "{flipped} bits flipped");
    assert_eq!(toggles.descriptors, flipped, "seed {SEED}");
    assert!(toggles.column > 0 && toggles.moments > 0);
}

/// The table of a pattern in the Verilog file: words of five-bit coordinates, x1, y1, x2, y2.
fn verilog_table(branch: &str) -> Vec<u32> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/rtl_models/verilog/fx_pattern.sv");
    let text = std::fs::read_to_string(path).unwrap();
    let part = text.split_once(&format!("begin : {branch}")).unwrap().1;
    let part = part.split("end").next().unwrap();
    let mut words = vec![u32::MAX; 256];
    for line in part.split(';').filter(|line| line.contains("pairs[")) {
        let (index, word) = line.trim().trim_start_matches(|c: char| c != '[').split_once("] = 20'h").unwrap();
        words[index.trim_start_matches('[').parse::<usize>().unwrap()] = u32::from_str_radix(word, 16).unwrap();
    }
    words
}

#[test]
fn the_pattern_in_hardware_is_the_published_rules() {
    for (symmetric, branch, rule) in [(false, "drawn", pattern()), (true, "turned", symmetric_pattern(0))] {
        let low = |coordinate: i32| u32::from_ne_bytes(coordinate.to_ne_bytes()) & 31;
        let word =
            |&((x1, y1), (x2, y2)): &((i32, i32), (i32, i32))| low(x1) << 15 | low(y1) << 10 | low(x2) << 5 | low(y2);
        let words: Vec<u32> = rule.iter().map(word).collect();
        let twin: Vec<_> = (0..=255).map(|pair| points(symmetric, pair)).map(|[a, b]| (a, b)).collect();
        assert_eq!(twin, rule, "fx_pattern.rs; the rule's words are {words:#07x?}");
        assert_eq!(verilog_table(branch), words, "fx_pattern.sv, {branch}; the rule's words are {words:#07x?}");
    }
}
