//! The extractor on codes of few bits: smoothed words, their least threshold, their time and their work.

// Test data are small numbers, and a test fails by panicking.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss, clippy::unwrap_used)]

use std::collections::BTreeSet;

use sensel::compute::{AlwaysReady, Extracted, Extractor, ExtractorParams, Pixels, Records, RowByRow, Smoothing};
use sensel::draw::mix;
use sensel::events::{Event, Events};
use sensel::fidelity::Rung;
use sensel::plane::Plane;
use sensel::units::Size;

/// Round hills of many heights and widths on a grid, with 16-bit codes: few levels cut each at another line.
fn hills(width_px: u32, height_px: u32) -> Plane<u16> {
    let value = |i: u32| {
        let (x, y) = (i % width_px, i / width_px);
        let cell = mix(u64::from(x / 24 + 100 * (y / 24)));
        let (dx, dy) = ((x % 24) as i32 - 8 - (cell % 8) as i32, (y % 24) as i32 - 8 - (cell / 8 % 8) as i32);
        let (height, width2) = (100 + (cell / 64 % 100) as i32, 12 + (cell / 8192 % 30) as i32);
        let noise = (mix(u64::from(i)) % 9) as i32;
        let hill = (height * (width2 - dx * dx - dy * dy) / width2).max(0);
        ((40 + noise + hill) as u16) << 8
    };
    Plane::from_values(Size { width_px, height_px }, (0..width_px * height_px).map(value).collect())
}

/// Functions and the hardware's twin give the same of few bits, at the least threshold of such codes, and later by the rows that the
/// kernel waits for. Without smoothing two bits give FAST three scores at most.
#[test]
fn codes_of_few_bits_are_smoothed_in_functions_and_twin_and_finer_ones_are_not() {
    let codes = hills(160, 120);
    let usual = ExtractorParams { target_features: 0, ..ExtractorParams::USUAL };
    let off = ExtractorParams { smoothing: Smoothing::Off, ..usual };
    let row_clk = 400;
    let show = |codes: &Plane<u16>, bits: u32, params: &ExtractorParams, rung: Rung| {
        let mut events = Events::default();
        let io = (
            &mut RowByRow { first_clk: 0, spacing: row_clk.into() } as &mut dyn Pixels,
            &mut AlwaysReady as &mut dyn Records,
        );
        let found = Extractor::new(params).on_rung(rung).frame(codes, bits, (1, 1), io, &mut events).unwrap();
        (found, events)
    };
    for (bits, levels) in [(2, 3), (3, 7), (4, 15)] {
        let few = codes.map(|code| code >> (16 - bits));
        let (smoothed, events) = show(&few, bits, &usual, Rung::Sampled);
        assert_eq!(show(&few, bits, &usual, Rung::Clocked), (smoothed.clone(), events.clone()), "{bits} bits");
        assert_eq!(smoothed.threshold, usual.for_codes(bits).threshold, "{bits} bits");
        let (raw, raw_events) = show(&few, bits, &off, Rung::Sampled);
        let scores = |found: &Extracted| found.features.iter().map(|f| f.score).collect::<BTreeSet<_>>().len();
        assert!(scores(&raw) <= levels, "{bits} bits: {} scores", scores(&raw));
        assert!(scores(&smoothed) > 5, "{bits} bits: {} scores", scores(&smoothed));
        // Six rows more are written, whatever is found.
        let writes = |events: &Events| events.count(Event::LineBufferWrite);
        let own = |found: &Extracted, events: &Events| {
            let engines = 729 * found.features.len() as u64;
            let lists = 13 * 4 * found.counts.corners;
            writes(events) - engines - lists
        };
        assert_eq!(own(&smoothed, &events), own(&raw, &raw_events) + 6 * 160 * 120, "{bits} bits");
        // The fourth row from below waits for the last code's row and three columns; three rows of 161 positions follow it.
        assert_eq!(smoothed.end_clk, raw.end_clk + 3 + 3 * 161, "{bits} bits");
    }
    for bits in [5, 8, 10] {
        let fine = codes.map(|code| code >> (16 - bits));
        assert_eq!(show(&fine, bits, &usual, Rung::Sampled), show(&fine, bits, &off, Rung::Sampled), "{bits} bits");
    }
}
