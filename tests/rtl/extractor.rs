//! The extractor's twins equal Verilog on every pin in every clock: the back by itself, behind the front's twin, and the whole
//! core; all policies, one to three engines, gaps, stalls, resets; descriptor bits and angles too.

use super::cases::Random;
use super::extractor_forms::compare;
use super::extractor_play::{Case, Clock, case_on, hardware, picture, play, widest};
use super::judge::{Judge, Pin, bit, bus};
use super::photographs::photographs;
use rtl_models::extractor_core::{ExtractorIn, ExtractorOut};
use rtl_models::fx_back::{FxBackConfig, FxBackIn, FxBackOut, FxCounts, FxSettings, Record};
use sensel::files::verilated::extractor_parameters;

fn setting_pins(config: &FxBackConfig, settings: &FxSettings) -> Vec<Pin<'static>> {
    vec![
        bus("width", 16, config.width),
        bus("height", 16, config.height),
        bus("threshold", config.pix_bits, settings.threshold),
        bus("policy", 2, settings.policy.code()),
        bus("target", 16, settings.target),
        bus("angle_bits", 4, settings.angle_bits),
    ]
}

fn record_pins<'a>(config: &FxBackConfig, valid: bool, record: &'a Record) -> Vec<Pin<'a>> {
    vec![
        bit("out_valid", valid),
        bus("out_x_q4", 16, record.x_q4.to_bits()),
        bus("out_y_q4", 16, record.y_q4.to_bits()),
        bus("out_score", config.pix_bits, record.score),
        bus("out_angle", 8, record.angle.to_bits()),
        bus("out_octave", 2, record.octave),
        bit("out_frame", record.frame),
        Pin::Wide("out_descriptor", config.desc_bits, &record.descriptor),
    ]
}

fn count_pins(counts: &FxCounts) -> Vec<Pin<'static>> {
    let FxCounts { corners, without_patch, unselected, dropped, late, features, stalled } = *counts;
    vec![
        bus("n_corners", 32, corners),
        bus("n_without_patch", 32, without_patch),
        bus("n_unselected", 32, unselected),
        bus("n_dropped", 32, dropped),
        bus("n_late", 32, late),
        bus("n_features", 32, features),
        bus("n_stalled", 32, stalled),
    ]
}

fn core_in(config: &FxBackConfig, pins: &ExtractorIn) -> Vec<Pin<'static>> {
    let mut all = vec![bit("rst", pins.rst)];
    all.extend(setting_pins(config, &pins.settings));
    all.extend([bit("in_valid", pins.in_valid), bus("in_pixel", config.pix_bits, pins.in_pixel)]);
    all.push(bit("out_ready", pins.out_ready));
    all
}

fn core_out<'a>(config: &FxBackConfig, out: &'a ExtractorOut) -> Vec<Pin<'a>> {
    let mut all = vec![bit("in_ready", out.in_ready), bus("threshold_now", config.pix_bits, out.back.threshold)];
    all.extend(record_pins(config, out.back.valid, &out.back.record));
    all.extend(count_pins(&out.back.counts));
    all.push(bus("n_not_ready", 32, out.not_ready));
    all
}

/// The nine differences as the bus holds them, bytes from the lowest.
fn resp_bytes(config: &FxBackConfig, resp: &[u16; 9]) -> Vec<u8> {
    let mut bytes = vec![0; 20];
    for (element, &value) in resp.iter().enumerate() {
        for bit in 0..config.pix_bits {
            let at = element * usize::try_from(config.pix_bits).unwrap() + usize::try_from(bit).unwrap();
            bytes[at / 8] |= u8::from(value >> bit & 1 == 1) << (at % 8);
        }
    }
    bytes
}

fn back_in<'a>(config: &FxBackConfig, pins: &FxBackIn, resp: &'a [u8]) -> Vec<Pin<'a>> {
    let (x, y, pixel) = pins.smoothed.unwrap_or_default();
    let corner = pins.corner.unwrap_or_default();
    let octave = |octave: usize| u8::try_from(octave).unwrap();
    let mut all = vec![bit("rst", pins.rst)];
    all.extend(setting_pins(config, &pins.settings));
    all.extend([
        bit("req", pins.req),
        bus("req_octave", 2, octave(pins.request.octave)),
        bus("req_row", 16, pins.request.row),
        bit("req_virtual", pins.request.is_virtual),
        bus("in_octave", 2, octave(pins.octave)),
        bus("in_row", 16, pins.row),
        bit("sm_valid", pins.smoothed.is_some()),
        bus("sm_x", 16, x),
        bus("sm_y", 16, y),
        bus("sm_pixel", config.pix_bits, pixel),
        bit("corner_valid", pins.corner.is_some()),
        bus("corner_x", 16, corner.x_px),
        bus("corner_y", 16, corner.y_px),
        bus("corner_score", config.pix_bits, corner.score),
        Pin::Wide("corner_resp", 9 * config.pix_bits, resp),
        bus("corner_rank", 16, corner.rank),
        bit("row_end", pins.row_end),
        bit("row_end_virtual", pins.row_end_virtual),
        bit("frame_end", pins.frame_end),
        bit("out_ready", pins.out_ready),
    ]);
    all
}

fn back_out<'a>(config: &FxBackConfig, out: &'a FxBackOut) -> Vec<Pin<'a>> {
    let mut all = vec![bit("row_ok", out.row_ok), bus("threshold_now", config.pix_bits, out.threshold)];
    all.extend(record_pins(config, out.valid, &out.record));
    all.extend(count_pins(&out.counts));
    all
}

fn empty_out() -> FxBackOut {
    FxBackOut { row_ok: false, threshold: 0, valid: false, record: Record::default(), counts: FxCounts::default() }
}

/// What a run met; zero of anything would be a hole in the proof.
#[derive(Debug, Default)]
struct Met {
    frames: u32,
    counts: FxCounts,
    resets: u32,
    waits: u32,
    policies: [u32; 3],
}

impl Met {
    fn add(&mut self, case: &Case, out: &ExtractorOut) {
        let counts = out.back.counts;
        self.frames += case.frames;
        self.counts.corners += counts.corners;
        self.counts.without_patch += counts.without_patch;
        self.counts.unselected += counts.unselected;
        self.counts.dropped += counts.dropped;
        self.counts.late += counts.late;
        self.counts.features += counts.features;
        self.counts.stalled += counts.stalled;
        self.policies[usize::from(case.settings.policy.code())] += 1;
    }

    fn look(&mut self, clock: &Clock<'_>) {
        self.resets += u32::from(clock.pins.rst);
        self.waits += u32::from(clock.out.back.valid && !clock.pins.out_ready);
    }

    /// Nothing that can happen on this hardware was left out.
    fn check(&self, config: &FxBackConfig) {
        println!("{config:?}\n{self:?}");
        let FxCounts { without_patch, unselected, dropped, late, features, stalled, .. } = self.counts;
        let events = [without_patch, unselected, dropped, stalled, self.resets, self.waits];
        assert!(
            self.frames >= 20 && features > 100 && late > 0 && events.iter().all(|&count| count > 5),
            "something was not met"
        );
        assert!(self.policies.iter().all(|&count| count > 0), "a policy was not met");
    }
}

fn play_core(kind: u32, seed: u64, cases: u32) {
    let mut random = Random::new(seed);
    let built = hardware(kind);
    let mut judge = core_judge(&built);
    let mut met = Met::default();
    for number in 0..cases {
        let case = case_on(built, number, 3, &mut random);
        let make = |random: &mut Random| picture(random, &case.config);
        let (last, _) = play(&case, &mut random, make, |clock| {
            met.look(clock);
            judge.clock(&core_in(&case.config, clock.pins), &core_out(&case.config, clock.out));
        });
        met.add(&case, &last);
    }
    met.check(&built);
    judge.finish_after(seed, 300_000);
}

#[test]
fn the_core_with_three_octaves_equals_its_twin_on_every_clock() {
    play_core(0, 51, 12);
}

#[test]
fn the_core_with_one_engine_and_the_symmetric_pattern_equals_its_twin_on_every_clock() {
    play_core(1, 52, 12);
}

/// Plays cases of given pictures to Verilog and its twin; gives back what was met.
fn play_given(judge: &mut Judge, case: &Case, pictures: &[Vec<u16>], met: &mut Met) {
    let mut next = pictures.iter();
    let make = |_: &mut Random| next.next().unwrap_or(&pictures[0]).clone();
    let (last, _) = play(case, &mut Random::new(0), make, |clock| {
        met.look(clock);
        judge.clock(&core_in(&case.config, clock.pins), &core_out(&case.config, clock.out));
    });
    met.add(case, &last);
}

/// A judge of the core on this hardware.
fn core_judge(built: &FxBackConfig) -> Judge {
    let flags = extractor_parameters(built);
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let nothing = ExtractorOut { in_ready: false, back: empty_out(), not_ready: 0 };
    Judge::new("extractor_core", &flags, &core_in(built, &ExtractorIn::default()), &core_out(built, &nothing))
}

/// Two frames a case, under each policy with each way of taking records, gaps between pixels: functions over whole pictures, the twin
/// by rows, the twin tick by tick, and Verilog.
#[test]
fn photographs_give_the_same_in_all_forms() {
    const SEED: u64 = 55;
    let mut random = Random::new(SEED);
    let built = hardware(0);
    let mut judge = core_judge(&built);
    let photographs = photographs(built.max_width, 136);
    let (mut met, mut features, mut upper) = (Met::default(), 0, 0);
    for (number, pictures) in (0..12).zip(photographs.chunks(2).cycle()) {
        let mut case = case_on(built, number, 2, &mut random);
        (case.config.width, case.config.height, case.resets) = (built.max_width, 136, 0);
        case.settings.angle_bits = case.settings.angle_bits.max(3);
        let told = compare(&case, pictures, &format!("seed {SEED}, photographs {number}"));
        features += told.features.len();
        upper += told.features.iter().filter(|(feature, ..)| feature.octave == 2).count();
        play_given(&mut judge, &case, pictures, &mut met);
    }
    println!("{} photographs, {features} features, {upper} of octave 2: {met:?}", photographs.len());
    assert!(photographs.len() >= 16 && met.frames >= 20 && features > 500 && upper > 0);
    assert!(met.counts.dropped > 0 && met.counts.stalled > 0 && met.waits > 0);
    judge.finish_after(SEED, 300_000);
}

/// The most hardware there is: 16 bits, Harris, four octaves, four corners per cell, four engines, a queue of 64.
#[test]
fn the_widest_core_equals_its_twin_on_every_clock() {
    const SEED: u64 = 56;
    let mut random = Random::new(SEED);
    let built = widest();
    let mut judge = core_judge(&built);
    let (mut met, mut octaves) = (Met::default(), [0; 4]);
    for number in 0..1 {
        let mut case = case_on(built, number, 1, &mut random);
        (case.config.width, case.config.height, case.resets) = (built.max_width, 390, 0);
        (case.settings.threshold, case.settings.angle_bits) = (3000, 8);
        let pictures = [picture(&mut random, &case.config)];
        let told = compare(&case, &pictures, &format!("seed {SEED}, case {number}"));
        told.features.iter().for_each(|(feature, ..)| octaves[usize::from(feature.octave)] += 1);
        play_given(&mut judge, &case, &pictures, &mut met);
    }
    println!("features by octave {octaves:?}: {met:?}");
    assert!(octaves.iter().all(|&count| count > 0), "features by octave {octaves:?}");
    judge.finish_after(SEED, 150_000);
}

#[test]
fn the_back_alone_with_three_engines_and_one_entry_in_its_queue_equals_its_twin_on_every_clock() {
    const SEED: u64 = 54;
    let mut random = Random::new(SEED);
    let built = hardware(2);
    let flags = extractor_parameters(&built);
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let (nothing, resp) = (empty_out(), [0; 20]);
    let inputs = back_in(&built, &FxBackIn::default(), &resp);
    let mut judge = Judge::new("fx_back", &flags, &inputs, &back_out(&built, &nothing));
    let mut met = Met::default();
    for number in 0..12 {
        let case = case_on(built, number, 3, &mut random);
        let make = |random: &mut Random| picture(random, &case.config);
        let (last, _) = play(&case, &mut random, make, |clock| {
            met.look(clock);
            let resp = resp_bytes(&case.config, &clock.back_pins.corner.unwrap_or_default().resp);
            judge.clock(&back_in(&case.config, clock.back_pins, &resp), &back_out(&case.config, clock.back_out));
        });
        met.add(&case, &last);
    }
    met.check(&built);
    judge.finish_after(SEED, 300_000);
}
