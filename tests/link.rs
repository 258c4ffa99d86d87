//! The link through its front door: frames that come back as they were sent, damage that is caught, and its bandwidth.

// Test data are small numbers, and a test fails by panicking.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss, clippy::unwrap_used)]

#[path = "link/damage.rs"]
mod damage;
#[path = "link/flow.rs"]
mod flow;
#[path = "link/packetiser.rs"]
mod packetiser;
#[path = "link/runs.rs"]
mod runs;
#[path = "link/in_time.rs"]
mod in_time;

use crate::csi2_cases;
use sensel::compute::Feature;
use sensel::draw::mix;
use sensel::events::{Event, Events};
use sensel::link::{
    FEATURES_PER_PACKET_MAX, FrameMetadata, FrameOut, LinkParams, Mode, RawKind, decode, distribute, frame_number,
    merge, pack_frame,
};
use sensel::plane::Plane;
use sensel::units::{FrameIndex, Size};
use sensel::words::{PositionPx, RampGain, Turns};

const OV7251: LinkParams = LinkParams::new(1, 240_000_000, Mode::Both);

fn codes(width_px: u32, height_px: u32, bits: u32) -> Plane<u16> {
    let size = Size { width_px, height_px };
    let value = |i: usize| (mix(i as u64 + u64::from(bits)) & ((1 << bits) - 1)) as u16;
    Plane::from_values(size, (0..size.pixel_count()).map(value).collect())
}

fn features(count: usize) -> Vec<Feature> {
    let feature = |i: usize| {
        let draw = mix(i as u64).to_le_bytes();
        let descriptor = std::array::from_fn(|byte| mix((i * 32 + byte) as u64).to_le_bytes()[0]);
        let [x_low, x_high, y_low, y_high, score, angle, octave, _] = draw;
        let (x, y) = (PositionPx::from_le_bytes([x_low, x_high]), PositionPx::from_le_bytes([y_low, y_high]));
        Feature { x, y, score: score.into(), angle: Turns::from_bits(angle), octave, descriptor }
    };
    (0..count).map(feature).collect()
}

fn metadata(frame: u32) -> FrameMetadata {
    FrameMetadata {
        frame: FrameIndex(frame),
        timestamp_ns: 1_234_567_890_123 + u64::from(frame),
        exposure_ns: 2_000_000,
        row_time_ns: 19_333,
        temperature_mk: Some(300_150),
        gain: RampGain::lit("1.5"),
    }
}

fn frame<'a>(number: u32, codes: &'a Plane<u16>, bits: u32, features: &'a [Feature]) -> FrameOut<'a> {
    FrameOut {
        virtual_channel: 1,
        metadata: metadata(number),
        codes: Some(codes),
        bits,
        features: Some(features),
        batches: &[],
        features_per_gap: 0,
    }
}

fn packed(frame: &FrameOut, params: &LinkParams) -> Vec<u8> {
    pack_frame(frame, params, &mut Events::default()).unwrap()
}

#[test]
fn frames_of_every_depth_and_container_come_back_as_they_were_sent() {
    let mut tried = 0;
    for bits in 1..=16 {
        for kind in RawKind::ALL.into_iter().filter(|kind| kind.bits() >= bits) {
            let width_px = if matches!(kind, RawKind::Raw8 | RawKind::Raw16) { 41 } else { 40 };
            let (codes, features) = (codes(width_px, 5, bits), features(7));
            let params = LinkParams { format: Some(kind), ..OV7251 };
            let bytes = packed(&frame(3, &codes, bits, &features), &params);
            let decoded = decode(&bytes);
            assert!(decoded.counts.clean(), "{bits} bits in {kind:?}: {:?}", decoded.counts);
            assert_eq!(decoded.frames.len(), 1);
            let received = &decoded.frames[0];
            assert!(received.whole && received.damaged_rows.is_empty());
            assert_eq!((received.virtual_channel, received.frame_number), (1, 4));
            assert_eq!(received.picture.as_ref().unwrap(), &codes, "{bits} bits in {kind:?}");
            assert_eq!(received.features, features);
            let (found, shape) = (received.metadata.unwrap(), received.shape.unwrap());
            assert_eq!((found, shape.bits), (metadata(3), bits as u8));
            assert_eq!(shape.size(), Some(codes.size()));
            tried += 1;
        }
    }
    // 7 containers hold 1 to 6 bits, 6 hold 7, 5 hold 8, 4 hold 9 and 10, and so on.
    assert_eq!(tried, 6 * 7 + 6 + 5 + 2 * 4 + 2 * 3 + 2 * 2 + 2);
}

#[test]
fn the_container_is_the_smallest_that_holds_the_codes() {
    let kinds: Vec<u32> = (1..=16).map(|bits| OV7251.raw_kind(bits).unwrap().bits()).collect();
    assert_eq!(kinds, [6, 6, 6, 6, 6, 6, 7, 8, 10, 10, 12, 12, 14, 14, 16, 16]);
    assert!(OV7251.raw_kind(0).is_err() && OV7251.raw_kind(17).is_err());
    let narrow = LinkParams { format: Some(RawKind::Raw8), ..OV7251 };
    assert!(narrow.raw_kind(10).unwrap_err().to_string().contains("raw10"));
}

#[test]
fn the_mode_decides_what_is_sent() {
    let (codes, features) = (codes(16, 4, 10), features(3));
    for mode in Mode::ALL {
        let params = LinkParams { mode, ..OV7251 };
        let received = decode(&packed(&frame(0, &codes, 10, &features), &params)).frames.remove(0);
        assert!(received.whole, "{mode:?}");
        assert_eq!(received.picture.is_some(), mode.sends_codes(), "{mode:?}");
        assert_eq!(received.features.len(), if mode.sends_features() { 3 } else { 0 }, "{mode:?}");
    }
    let without = FrameOut { features: None, ..frame(0, &codes, 10, &features) };
    assert!(pack_frame(&without, &OV7251, &mut Events::default()).is_err());
}

#[test]
fn more_features_than_a_packet_holds_go_in_several() {
    for count in [0, 1, FEATURES_PER_PACKET_MAX, FEATURES_PER_PACKET_MAX + 1, 2 * FEATURES_PER_PACKET_MAX + 5] {
        let (codes, features) = (codes(4, 1, 8), features(count));
        let bytes = packed(&frame(9, &codes, 8, &features), &OV7251);
        let decoded = decode(&bytes);
        assert!(decoded.counts.clean() && decoded.frames[0].whole, "{count} features");
        assert_eq!(decoded.frames[0].features, features, "{count} features");
    }
}

#[test]
fn the_drivers_link_use_comes_out_of_the_formula() {
    // Size, hts, vts, pixel rate, lanes, link frequency and utilisation as the drivers' tables give them, in 10 bits.
    let modes = [
        ((640, 480), 928, 1724, 48_000_000, 1, 240_000_000, 0.192),
        ((640, 480), 928, 860, 48_000_000, 1, 240_000_000, 0.385),
        ((640, 480), 928, 572, 48_000_000, 1, 240_000_000, 0.579),
        ((1280, 800), 1456, 910, 160_000_000, 2, 400_000_000, 0.773),
        ((640, 400), 1456, 422, 160_000_000, 2, 400_000_000, 0.417),
        ((3280, 2464), 3448, 3526, 182_400_000, 2, 456_000_000, 0.665),
        ((1920, 1080), 3448, 1763, 182_400_000, 2, 456_000_000, 0.341),
    ];
    for ((width_px, height_px), hts, vts, pixel_rate_hz, lanes, frequency_hz, stated) in modes {
        let params = LinkParams::new(lanes, frequency_hz, Mode::Frames).checked().unwrap();
        let traffic = params.traffic(Size { width_px, height_px }, 10, 0).unwrap();
        let frame_time_s = f64::from(hts * vts) / f64::from(pixel_rate_hz);
        let found = params.mean_utilisation(&traffic, frame_time_s);
        // The table has three digits.
        assert!((found - stated).abs() <= 0.0005, "{width_px} x {height_px}: {found}, stated {stated}");
        let line_time_s = f64::from(hts) / f64::from(pixel_rate_hz);
        let burst = params.burst_utilisation(width_px, 10, line_time_s).unwrap();
        assert!(burst > found && burst < 1.0, "{width_px} x {height_px}: burst {burst}");
    }
}

#[test]
fn traffic_counts_the_bytes_and_packets_that_are_packed() {
    let mut tried = 0;
    for mode in [Mode::Frames, Mode::Features, Mode::Both] {
        for (bits, count) in [(2, 0), (8, 1), (10, 500), (12, FEATURES_PER_PACKET_MAX + 1), (16, 3)] {
            for lanes in 1..=4 {
                let params = LinkParams { lanes, mode, ..OV7251 };
                let (codes, features) = (codes(40, 6, bits), features(count));
                let mut events = Events::default();
                let bytes = pack_frame(&frame(0, &codes, bits, &features), &params, &mut events).unwrap();
                let traffic = params.traffic(codes.size(), bits, count as u64).unwrap();
                assert_eq!(traffic.link_bytes, bytes.len() as u64, "{mode:?}, {bits} bits, {count} features");
                assert_eq!(events.count(Event::LinkByte), traffic.link_bytes);
                assert_eq!(events.count(Event::LinkBurst), traffic.packets * u64::from(lanes));
                assert_eq!(merge(&distribute(&bytes, lanes as usize)), bytes);
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 60);
}

#[test]
fn a_line_takes_its_bytes_and_the_way_into_and_out_of_high_speed() {
    // One lane at 480 Mbit/s: a byte clock is 16.67 ns and a UI 2.083 ns. LP-01 50 ns: 3 clocks. Preparation 145 ns + 10 UI,
    // 165.8 ns: 10. Synchronisation: 1. Trail 60 ns + 4 UI, 68.3 ns: 5. Exit 100 ns: 6. Row: 800 + 6 bytes.
    assert_eq!(OV7251.burst_overhead().0, 3 + 10 + 1 + 5 + 6);
    let time = OV7251.line_packet_time(640, 10).unwrap();
    assert_eq!(time.0, 806 + 25);
    assert!((OV7251.seconds(time) - 831.0 / 60e6).abs() < 1e-15);
    // On four lanes the bytes are shared, the way is not.
    let four = LinkParams { lanes: 4, ..OV7251 };
    assert_eq!(four.line_packet_time(640, 10).unwrap().0, 202 + 25);
    assert_eq!(four.capacity_bits_per_s(), 1_920_000_000);
}

#[test]
fn what_the_link_cannot_carry_is_refused_by_name() {
    let empty: [Feature; 0] = [];
    for (width_px, bits, key) in [(642, 10, "sensor.width"), (641, 12, "sensor.width"), (40, 17, "sensor.adc.bits")] {
        let codes = codes(width_px, 1, bits.min(16));
        let error = pack_frame(&frame(0, &codes, bits, &empty), &OV7251, &mut Events::default()).unwrap_err();
        assert!(error.to_string().contains(key), "{error}");
        assert!(OV7251.line_packet_time(width_px, bits).is_err());
    }
    let codes = codes(8, 1, 8);
    let channel = FrameOut { virtual_channel: 4, ..frame(0, &codes, 8, &empty) };
    assert!(pack_frame(&channel, &OV7251, &mut Events::default()).is_err());
    for params in
        [LinkParams { lanes: 0, ..OV7251 }, LinkParams { lanes: 5, ..OV7251 }, LinkParams { frequency_hz: 1, ..OV7251 }]
    {
        assert!(params.checked().is_err(), "{params:?}");
    }
}

#[test]
fn the_number_in_short_packets_wraps_past_zero_and_the_counter_does_not() {
    let (codes, empty) = (codes(4, 1, 8), []);
    let mut sent = Vec::new();
    for number in 65_533..65_537 {
        sent.extend(packed(&frame(number, &codes, 8, &empty), &OV7251));
    }
    let decoded = decode(&sent);
    assert!(decoded.counts.clean());
    let numbers: Vec<u16> = decoded.frames.iter().map(|frame| frame.frame_number).collect();
    let counters: Vec<u32> = decoded.frames.iter().map(|frame| frame.metadata.unwrap().frame.0).collect();
    assert_eq!(numbers, [65_534, 65_535, 1, 2]);
    assert_eq!(counters, [65_533, 65_534, 65_535, 65_536]);
    assert_eq!(frame_number(FrameIndex(0)), 1);
}
