//! The extractor's front on one VGA frame of 8 bits: `FrontRows`, a row at a time, against Verilator's clocks. Before a row is
//! printed, the hash of every pin in every clock is that of the ticked twin, and every corner, smoothed pixel and row end of the
//! ticks is `FrontRows`', in its clock.

use std::path::{Path, PathBuf};
use std::time::Instant;

use rtl_models::fx_front::{FRONT_LATENCY, FxFront, FxFrontConfig, FxFrontIn, FxFrontMemory, FxFrontOut, line_words};
use rtl_models::fx_front_rows::{FrontRows, FrontRowsMemory, FrontSink, RowCorner, RowDone};
use sensel::draw::mix;
use sensel::files::verilator::{Build, sources, version};
use sensel::simd::{Kernel, dispatch};

use crate::{median, program, verilator_frame};

pub const WIDTH: u32 = 640;
pub const HEIGHT: u32 = 480;
const THRESHOLD: u16 = 20;
/// Pins that are hashed, in this order; the nine differences follow as three words.
const PINS: &[&str] = &[
    "in_ready",
    "req",
    "req_octave",
    "req_row",
    "req_virtual",
    "out_octave",
    "out_row",
    "sm_valid",
    "sm_x",
    "sm_y",
    "sm_pixel",
    "corner_valid",
    "corner_x",
    "corner_y",
    "corner_score",
    "corner_rank",
    "row_end",
    "row_end_virtual",
    "frame_end",
];

/// What leaves in a clock: octave, row, column and a value; a corner's nine differences stand beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Left {
    Smoothed { clock: u64, octave: u32, x: u32, y: u32, pixel: u16 },
    Corner { clock: u64, octave: u32, x: u32, y: u32, score: u16, rank: u16, resp: [u16; 9] },
    RowEnd { clock: u64, octave: u32, row: u32, is_virtual: bool, frame_end: bool },
}

/// The frame's results as they stand in memory after a run of `FrontRows`.
struct Frame {
    corners: Vec<(u64, u32, RowCorner)>,
    rows: Vec<(u64, u32, u32, bool, bool)>,
    smoothed: Vec<u8>,
    ended_corners: usize,
}

impl FrontSink<u8> for Frame {
    fn corner(&mut self, corner: &RowCorner) {
        self.corners.push((0, 0, *corner));
    }

    fn row(&mut self, done: &RowDone<'_, u8>) {
        for (start, octave, _) in &mut self.corners[self.ended_corners..] {
            (*start, *octave) = (done.start, done.octave);
        }
        self.ended_corners = self.corners.len();
        self.rows.push((done.start, done.octave, done.row, done.is_virtual, done.frame_end));
        self.smoothed.extend(done.smoothed);
    }
}

struct WholeFrame<'a, 'b> {
    front: &'a mut FrontRows<'b, u8>,
    pixels: &'a [u8],
    frame: &'a mut Frame,
}

impl Kernel for WholeFrame<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for row in self.pixels.chunks(usize::try_from(WIDTH).unwrap()) {
            self.front.row(row, u8::try_from(THRESHOLD).unwrap(), self.frame);
        }
    }
}

/// Overlapping squares of any grey under noise of 3 bits: near 2,000 corners.
pub fn picture() -> Vec<u8> {
    let square = |index: u64| {
        let word = mix(index);
        let part = |shift: u32, range: u64| u32::try_from((word >> shift) % range).unwrap();
        (part(0, WIDTH.into()), part(12, HEIGHT.into()), 4 + part(24, 24), part(36, 240))
    };
    let mut pixels: Vec<u32> = vec![100; usize::try_from(WIDTH * HEIGHT).unwrap()];
    for (left, top, side, grey) in (0..900).map(square) {
        for y in top..(top + side).min(HEIGHT) {
            for x in left..(left + side).min(WIDTH) {
                pixels[usize::try_from(y * WIDTH + x).unwrap()] = grey;
            }
        }
    }
    let noisy = (1_000..).zip(pixels).map(|(index, pixel)| pixel + u32::try_from(mix(index) % 8).unwrap());
    noisy.map(|pixel| u8::try_from(pixel).unwrap()).collect()
}

fn build(verilator: &str, octaves: u32) -> PathBuf {
    let pins: String = PINS.iter().map(|name| format!(" PIN({name})")).collect();
    program(&Build {
        verilator,
        top: "fx_front",
        sources: sources("fx_front"),
        harness: include_str!("front_harness.cpp"),
        header: &format!("#define OUTPUTS{pins}\n"),
        flags: &[&format!("-GOCTAVES={octaves}")],
    })
}

fn hash_pins(hash: &mut u64, out: &FxFrontOut) {
    let flags = |flags: &[bool]| flags.iter().map(|&flag| u64::from(flag)).collect::<Vec<_>>();
    let mut words = flags(&[out.in_ready, out.request.req]);
    words.extend([out.request.octave, out.request.row].map(u64::from));
    words.extend(flags(&[out.request.is_virtual]));
    words.extend([out.octave, out.row, out.sm_valid.into(), out.sm_x, out.sm_y, out.sm_pixel.into()].map(u64::from));
    words.extend([out.corner_valid.into(), out.corner_x, out.corner_y].map(u64::from));
    words.extend([out.corner_score, out.corner_rank].map(u64::from));
    words.extend(flags(&[out.row_end, out.row_end_virtual, out.frame_end]));
    // 72 bits, in words of 32.
    let resp = (0..).zip(out.corner_resp).fold(0_u128, |all, (index, value)| all | u128::from(value) << (8 * index));
    words.extend([0, 32, 64].map(|shift| u64::try_from(resp >> shift & 0xFFFF_FFFF).unwrap()));
    for word in words {
        *hash = (*hash ^ word).wrapping_mul(0x100_0000_01B3);
    }
}

/// The frame clock by clock: time without looking at anything but the handshake, hash of all pins, and what left.
fn ticked(config: FxFrontConfig, pixels: &[u8]) -> (f64, u64, Vec<Left>) {
    let words = line_words(config.max_width, config.octaves);
    let mut nanoseconds = 0.0;
    let (mut hash, mut left) = (0xCBF2_9CE4_8422_2325_u64, Vec::new());
    for capture in [false, true] {
        let (mut lines, mut scores, mut half_row) = (vec![[0; 6]; words], vec![[0; 2]; words], vec![0; 320]);
        let memory = FxFrontMemory { lines: &mut lines, scores: &mut scores, half_row: &mut half_row, ranks: &mut [] };
        let mut front = FxFront::new(config, memory);
        let (mut next, mut sum) = (0, 0);
        let start = Instant::now();
        for clock in 0..config.frame_slots() {
            let in_pixel = pixels.get(next).copied().unwrap_or(0).into();
            next += usize::from(front.in_ready(true));
            let pins = FxFrontIn { rst: false, in_valid: true, in_pixel, row_ok: true, threshold: THRESHOLD };
            let out = front.tick(&pins);
            sum += u64::from(out.sm_pixel);
            if capture {
                hash_pins(&mut hash, &out);
                record(&mut left, clock, &out);
            }
        }
        std::hint::black_box(sum);
        if !capture {
            nanoseconds = start.elapsed().as_secs_f64() * 1e9;
        }
    }
    left.sort();
    (nanoseconds, hash, left)
}

fn record(left: &mut Vec<Left>, clock: u64, out: &FxFrontOut) {
    let octave = out.octave;
    if out.sm_valid {
        left.push(Left::Smoothed { clock, octave, x: out.sm_x, y: out.sm_y, pixel: out.sm_pixel });
    }
    if out.corner_valid {
        let (x, y, score, rank, resp) =
            (out.corner_x, out.corner_y, out.corner_score, out.corner_rank, out.corner_resp);
        left.push(Left::Corner { clock, octave, x, y, score, rank, resp });
    }
    if out.row_end {
        let (row, is_virtual, frame_end) = (out.row, out.row_end_virtual, out.frame_end);
        left.push(Left::RowEnd { clock, octave, row, is_virtual, frame_end });
    }
}

/// The same from the rows' results.
fn recorded(config: &FxFrontConfig, frame: &Frame) -> Vec<Left> {
    let latency = u64::from(FRONT_LATENCY);
    let mut smoothed = frame.smoothed.iter();
    let mut left = Vec::new();
    for &(start, octave, row, is_virtual, frame_end) in &frame.rows {
        let width = config.width_of(octave);
        if row >= 6 && !is_virtual {
            for x in 3..width - 3 {
                let clock = start + u64::from(x) + 3 + latency;
                let pixel = (*smoothed.next().unwrap()).into();
                left.push(Left::Smoothed { clock, octave, x, y: row - 3, pixel });
            }
        }
        left.push(Left::RowEnd { clock: start + u64::from(width) + latency, octave, row, is_virtual, frame_end });
    }
    for &(start, octave, RowCorner { x, y, score, resp, rank }) in &frame.corners {
        let clock = start + u64::from(x) + 4 + latency;
        left.push(Left::Corner { clock, octave, x, y, score, rank, resp });
    }
    left.sort();
    left
}

/// One row of the table.
pub fn compare(verilator: &str, octaves: u32) {
    let config = FxFrontConfig { max_width: WIDTH, pix_bits: 8, octaves, harris: false, width: WIDTH, height: HEIGHT };
    let pixels = picture();
    let clocks = config.frame_slots();
    let program = build(verilator, octaves);
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("verilator-front.bin");
    let settings = [WIDTH, HEIGHT, THRESHOLD.into(), u32::try_from(clocks).unwrap()];
    let words = settings.into_iter().chain(pixels.iter().map(|&pixel| pixel.into()));
    std::fs::write(&file, words.flat_map(u32::to_le_bytes).collect::<Vec<_>>()).unwrap();

    let words = FrontRows::<u8>::words(&config);
    let (mut rows, mut differences) = (vec![0; 8 * words], vec![0; 3 * words]);
    let (mut scratch, mut sums) = (vec![0; 640], vec![0; 640]);
    let memory =
        FrontRowsMemory { pixels: &mut rows, differences: &mut differences, scratch: &mut scratch, sums: &mut sums };
    let mut front = FrontRows::new(config, memory);
    let mut frame = Frame { corners: Vec::new(), rows: Vec::new(), smoothed: Vec::new(), ended_corners: 0 };
    let mut run = |frame: &mut Frame| {
        frame.corners.clear();
        frame.rows.clear();
        frame.smoothed.clear();
        frame.ended_corners = 0;
        dispatch(WholeFrame { front: &mut front, pixels: &pixels, frame });
    };
    run(&mut frame);
    let (tick_ns, hash, left) = ticked(config, &pixels);
    assert_eq!(verilator_frame(&program, &file, true).1, format!("{hash:016x}"), "pins differ, {octaves} octaves");
    assert!(recorded(&config, &frame) == left, "{octaves} octaves: rows at a time differ from ticks");
    let mut ours = || {
        let time = |_| {
            let start = Instant::now();
            run(&mut frame);
            start.elapsed().as_secs_f64() * 1e9
        };
        median((0..15).map(time).collect())
    };
    // A B B A, so that a drift of the machine's speed falls on both.
    let peer = || verilator_frame(&program, &file, false).0;
    let ours_first = ours();
    let theirs = peer() + peer();
    let ours = ours_first + ours();
    let per_second = |nanoseconds: f64| (clocks as f64 * 1e3 / nanoseconds * 10.0).round() / 10.0;
    let row = serde_json::json!({
        "work": "extractor front, 640 x 480, 8 bit: FAST, suppression, smoothing",
        "octaves": octaves,
        "clocks": clocks,
        "corners": frame.corners.len(),
        "verilator": version(verilator).expect("it was just run"),
        "verilator_mclk_per_s": per_second(theirs / 2.0),
        "sensel_rows_mclk_per_s": per_second(ours / 2.0),
        "sensel_ticks_mclk_per_s": per_second(tick_ns),
        "ratio": (theirs / ours * 10.0).round() / 10.0,
        "pins_equal": true,
    });
    println!("{row}");
}
