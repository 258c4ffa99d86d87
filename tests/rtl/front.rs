//! The front's Verilog is its twin, on every pin in every clock: random and committed pictures, gaps between pixels, rows that may
//! not start, resets in mid-frame, several sets of parameters.

use std::ops::AddAssign;

use super::cases::Random;
use super::front_pictures::{KINDS, committed, made};
use super::front_reference::{Buffers, Picture};
use super::judge::{Judge, Pin, bit, bus};
use rtl_models::fx_front::{FxFront, FxFrontConfig, FxFrontIn, FxFrontOut};

fn front_in(config: &FxFrontConfig, pins: &FxFrontIn) -> [Pin<'static>; 7] {
    [
        bit("rst", pins.rst),
        bus("width", 16, config.width),
        bus("height", 16, config.height),
        bus("threshold", config.pix_bits, pins.threshold),
        bit("in_valid", pins.in_valid),
        bus("in_pixel", config.pix_bits, pins.in_pixel),
        bit("row_ok", pins.row_ok),
    ]
}

/// The nine differences side by side, as the port has them.
fn resp_bytes(config: &FxFrontConfig, resp: &[u16; 9]) -> [u8; 24] {
    let mut bytes = [0; 24];
    for (element, &value) in (0..).zip(resp) {
        for bit in 0..config.pix_bits {
            let at = element * config.pix_bits + bit;
            bytes[usize::try_from(at / 8).unwrap()] |= u8::try_from(value >> bit & 1).unwrap() << (at % 8);
        }
    }
    bytes
}

fn front_out<'a>(config: &FxFrontConfig, pins: &FxFrontOut, resp: &'a [u8]) -> Vec<Pin<'a>> {
    vec![
        bit("in_ready", pins.in_ready),
        bit("req", pins.request.req),
        bus("req_octave", 2, pins.request.octave),
        bus("req_row", 16, pins.request.row),
        bit("req_virtual", pins.request.is_virtual),
        bus("out_octave", 2, pins.octave),
        bus("out_row", 16, pins.row),
        bit("sm_valid", pins.sm_valid),
        bus("sm_x", 16, pins.sm_x),
        bus("sm_y", 16, pins.sm_y),
        bus("sm_pixel", config.pix_bits, pins.sm_pixel),
        bit("corner_valid", pins.corner_valid),
        bus("corner_x", 16, pins.corner_x),
        bus("corner_y", 16, pins.corner_y),
        bus("corner_score", config.pix_bits, pins.corner_score),
        Pin::Wide("corner_resp", 9 * config.pix_bits, resp),
        bus("corner_rank", 16, pins.corner_rank),
        bit("row_end", pins.row_end),
        bit("row_end_virtual", pins.row_end_virtual),
        bit("frame_end", pins.frame_end),
    ]
}

/// What a set of parameters has seen.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    frames: u32,
    resets: u32,
    stalls: u32,
    corners: u32,
    deepest: u32,
}

impl AddAssign<&FxFrontOut> for Seen {
    fn add_assign(&mut self, out: &FxFrontOut) {
        self.frames += u32::from(out.frame_end);
        self.corners += u32::from(out.corner_valid);
        self.deepest = self.deepest.max(out.octave);
    }
}

/// Plays one picture, three frames of it unless resets come between.
fn play(judge: &mut Judge, config: &FxFrontConfig, picture: &Picture, random: &mut Random, seen: &mut Seen) {
    let mut buffers = Buffers::new(config, 0xAA & ((1 << config.pix_bits) - 1));
    let mut front = FxFront::new(*config, buffers.memory());
    let threshold = u16::try_from(random.within(1, 30 << (config.pix_bits - 8))).unwrap();
    let (slow_pixels, slow_rows) = (random.within(1, 4), random.within(1, 3));
    let clocks = u32::try_from(config.frame_slots() * 2).unwrap();
    let (mut next, mut rst) = (0, true);
    for _ in 0..clocks {
        let row_ok = slow_rows == 1 || !random.one_in(slow_rows);
        let in_valid = slow_pixels == 1 || !random.one_in(slow_pixels);
        let takes = front.in_ready(row_ok) && in_valid && !rst;
        let in_pixel = if in_valid { picture.pixels[next] } else { 0 };
        seen.stalls += u32::from(front.request().req && !row_ok);
        let pins = FxFrontIn { rst, in_valid, in_pixel, row_ok, threshold };
        let out = front.tick(&pins);
        *seen += &out;
        judge.clock(&front_in(config, &pins), &front_out(config, &out, &resp_bytes(config, &out.corner_resp)));
        next = if rst { 0 } else { (next + usize::from(takes)) % picture.pixels.len() };
        rst = random.one_in(3 * clocks);
        seen.resets += u32::from(rst);
    }
}

fn compare(seed: u64, pix_bits: u32, octaves: u32, harris: bool) {
    const MAX_WIDTH: u32 = 150;
    let mut random = Random::new(seed);
    let mut config = FxFrontConfig { max_width: MAX_WIDTH, pix_bits, octaves, harris, width: 7, height: 7 };
    let parameters = [
        format!("-GMAX_WIDTH={MAX_WIDTH}"),
        format!("-GPIX_BITS={pix_bits}"),
        format!("-GOCTAVES={octaves}"),
        format!("-GHARRIS={}", u32::from(harris)),
    ];
    let flags: Vec<_> = parameters.iter().map(String::as_str).collect();
    let (inputs, outputs) = (front_in(&config, &FxFrontIn::default()), FxFrontOut::default());
    let mut judge = Judge::new("fx_front", &flags, &inputs, &front_out(&config, &outputs, &[0; 24]));
    let mut seen = Seen::default();
    for case in 0..26 {
        let (width, height) = match case % 4 {
            0 => (random.within(7, 40), random.within(7, 40)),
            1 => (random.within(33, MAX_WIDTH), random.within(33, 70)),
            2 => (random.within(132, MAX_WIDTH), random.within(132, 140)),
            _ => (random.within(66, MAX_WIDTH), random.within(66, 90)),
        };
        let photograph =
            ["scene_noisy.png", "scene_clean.png", "scene_2bit.png"][usize::try_from(case / 4 % 3).unwrap()];
        let picture = if case % 4 == 3 {
            committed(photograph, width, height, pix_bits)
        } else {
            made(&mut random, case % KINDS, width, height, pix_bits)
        };
        (config.width, config.height) = (u32::try_from(picture.width).unwrap(), u32::try_from(picture.height).unwrap());
        play(&mut judge, &config, &picture, &mut random, &mut seen);
    }
    println!("{pix_bits} bits, {octaves} octaves, Harris {harris}: {seen:?}");
    assert!(seen.frames >= 20 && seen.resets > 2 && seen.stalls > 500 && seen.corners > 1000, "{seen:?}");
    assert_eq!(seen.deepest + 1, octaves);
    judge.finish_after(seed, 300_000);
}

#[test]
fn the_front_of_8_bits_and_3_octaves_equals_its_twin_on_every_clock() {
    compare(41, 8, 3, false);
}

#[test]
fn the_front_of_10_bits_with_harris_equals_its_twin_on_every_clock() {
    compare(42, 10, 1, true);
}

#[test]
fn the_front_of_12_bits_and_3_octaves_with_harris_equals_its_twin_on_every_clock() {
    compare(43, 12, 3, true);
}
