//! Damage on the link: whatever is flipped, cut, doubled, lost or swapped, what the host believes is what was sent.

use sensel::compute::Feature;
use sensel::draw::{RowId, mix};
use sensel::link::{
    Batch, Decoded, Decoder, FrameOut, LinkCounts, LinkParams, Mode, Received, decode, distribute, flip_bits, merge,
};
use sensel::plane::Plane;
use sensel::units::{CameraIndex, FrameIndex, RowIndex};

use super::{OV7251, codes, features, frame, packed};

/// Three frames whose features leave between the rows: 3 rows of 8 pixels in RAW10, 5 features of which 2 fit a gap.
struct Sent {
    codes: Plane<u16>,
    features: Vec<Feature>,
    bytes: Vec<u8>,
    one: usize,
}

const BATCHES: [Batch; 2] = [Batch { features: 4, after_row: 0 }, Batch { features: 1, after_row: 2 }];

fn sent(params: &LinkParams, frames: u32) -> Sent {
    let (codes, features) = (codes(8, 3, 10), features(5));
    let mut bytes = Vec::new();
    let mut one = 0;
    for number in 0..frames {
        let out = FrameOut { batches: &BATCHES, features_per_gap: 2, ..frame(number, &codes, 10, &features) };
        bytes.extend(packed(&out, params));
        one = one.max(bytes.len() / (number as usize + 1));
    }
    Sent { codes, features, bytes, one }
}

/// Where packets start, with their lengths.
fn packets(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut at, mut found) = (0, Vec::new());
    while at < bytes.len() {
        let long = bytes[at] & 0x3F >= 0x10;
        let count = usize::from(u16::from_le_bytes([bytes[at + 1], bytes[at + 2]]));
        let length = if long { 4 + count + 2 } else { 4 };
        found.push((at, length));
        at += length;
    }
    found
}

/// Everything that a frame claims is what was sent, and what it does not claim is named as lost.
fn assert_true(received: &Received, sent: &Sent, case: &str) {
    for (index, feature) in received.feature_indices.iter().zip(&received.features) {
        assert_eq!(*feature, sent.features[*index as usize], "{case}: feature {index}");
    }
    let mut rising = received.feature_indices.windows(2);
    assert!(rising.all(|pair| pair[0] < pair[1]), "{case}: {:?}", received.feature_indices);
    if let Some(picture) = &received.picture {
        assert_eq!(picture.size(), sent.codes.size(), "{case}");
        for row in 0..3 {
            let lost = received.damaged_rows.iter().chain(&received.missing_rows).any(|&lost| lost as usize == row);
            let expected = if lost { [0; 8].as_slice() } else { sent.codes.row(row) };
            assert_eq!(picture.row(row), expected, "{case}: row {row}, lost {lost}");
        }
    }
    if received.whole {
        assert_eq!(received.features, sent.features, "{case}");
        assert!(received.picture.is_some() && received.damaged_rows.is_empty(), "{case}");
    }
}

fn assert_all_true(found: &Decoded, sent: &Sent, case: &str) {
    found.frames.iter().for_each(|frame| assert_true(frame, sent, case));
}

fn flipped(bytes: &[u8], bits: &[usize]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bits.iter().for_each(|bit| bytes[bit / 8] ^= 1 << (bit % 8));
    bytes
}

const NUMBERED: LinkParams = LinkParams { line_sync: true, ..OV7251 };

#[test]
fn every_single_flipped_bit_is_corrected_or_caught_and_counted() {
    for params in [OV7251, NUMBERED] {
        let sent = sent(&params, 3);
        let clean = decode(&sent.bytes);
        assert!(clean.counts.clean() && clean.frames.len() == 3 && clean.frames.iter().all(|frame| frame.whole));
        let (mut corrected, mut caught) = (0, 0);
        for bit in 0..sent.bytes.len() * 8 {
            let found = decode(&flipped(&sent.bytes, &[bit]));
            assert!(!found.counts.clean(), "bit {bit} went unseen");
            if found.counts.headers_corrected == 1 {
                assert_eq!(found.frames, clean.frames, "bit {bit} was not set right");
                corrected += 1;
            } else {
                assert_eq!(found.counts.payloads_refused, 1, "bit {bit}: {:?}", found.counts);
                assert_eq!(found.frames.iter().filter(|frame| !frame.whole).count(), 1, "bit {bit}");
                assert_all_true(&found, &sent, &format!("bit {bit}"));
                caught += 1;
            }
        }
        let headers = packets(&sent.bytes).len();
        // Frame start, embedded line, three rows, three feature packets, frame end; and three line starts.
        assert_eq!(headers, 3 * if params.line_sync { 12 } else { 9 });
        assert_eq!((corrected, caught), (headers * 32, sent.bytes.len() * 8 - headers * 32));
    }
}

#[test]
fn two_flipped_bits_in_a_header_lose_that_packet_and_not_the_stream() {
    let sent = sent(&OV7251, 2);
    let (mut tried, mut named) = (0, 0);
    for (at, length) in packets(&sent.bytes[..sent.one]) {
        let is_row = sent.bytes[at] & 0x3F == 0x2B;
        for (a, b) in (0..32).flat_map(|a| (a + 1..32).map(move |b| (a, b))) {
            let case = format!("bits {a} and {b} of the header at {at}");
            let found = decode(&flipped(&sent.bytes, &[8 * at + a, 8 * at + b]));
            assert_eq!(found.counts.headers_refused, 1, "{case}");
            let last = found.frames.last().unwrap();
            assert!(last.whole && last.frame_number == 2, "{case}: {:?}", found.counts);
            assert!(found.frames.iter().all(|frame| frame.frame_number == 2 || !frame.whole), "{case}");
            assert_all_true(&found, &sent, &case);
            if is_row {
                // The hole is as long as a row's packet, so which row is missing is known without numbers.
                let first = &found.frames[0];
                assert_eq!((first.missing_rows.len(), found.counts.rows_lost), (1, 1), "{case}");
                assert_eq!(found.counts.bytes_skipped, length as u64, "{case}");
                named += 1;
            }
            tried += 1;
        }
    }
    assert_eq!((tried, named), (9 * 496, 3 * 496));
}

#[test]
fn rows_that_vanish_are_named_by_their_numbers_and_without_numbers_nothing_is_guessed() {
    let mut tried = 0;
    for params in [OV7251, NUMBERED] {
        let sent = sent(&params, 2);
        for (index, (at, length)) in packets(&sent.bytes[..sent.one]).into_iter().enumerate() {
            let mut bytes = sent.bytes.clone();
            bytes.drain(at..at + length);
            let case = format!("packet {index} lost with its synchronisation byte, numbers: {}", params.line_sync);
            let found = decode(&bytes);
            assert!(!found.counts.clean(), "{case}");
            assert!(found.frames.iter().all(|frame| frame.frame_number == 2 || !frame.whole), "{case}");
            assert!(found.frames.last().unwrap().whole, "{case}");
            assert_all_true(&found, &sent, &case);
            let data_type = sent.bytes[at] & 0x3F;
            if data_type == 0x2B {
                let first = &found.frames[0];
                assert_eq!(first.missing_rows.len(), usize::from(params.line_sync), "{case}");
                assert_eq!(first.picture.is_some(), params.line_sync, "{case}");
                assert_eq!(found.counts.rows_lost, if params.line_sync { 1 } else { 3 }, "{case}");
            }
            tried += 1;
        }
    }
    assert_eq!(tried, 9 + 12);
}

#[test]
fn doubled_and_exchanged_packets_never_pass_as_whole() {
    let mut tried = 0;
    for params in [OV7251, NUMBERED] {
        let sent = sent(&params, 1);
        let all = packets(&sent.bytes);
        for &(at, length) in &all {
            // At once, and after everything else of the frame.
            for offset in [at + length, sent.bytes.len() - 4] {
                let mut bytes = sent.bytes.clone();
                let packet = bytes[at..at + length].to_vec();
                bytes.splice(offset..offset, packet);
                let found = decode(&bytes);
                let case = format!("packet at {at} again at {offset}");
                assert_all_true(&found, &sent, &case);
                assert!(!found.counts.clean(), "{case}: {:?}", found.counts);
                tried += 1;
            }
        }
        for pair in all[1..all.len() - 1].windows(2) {
            let [(a, first), (b, second)] = [pair[0], pair[1]];
            let mut bytes = sent.bytes.clone();
            bytes[a..a + first + second].rotate_left(first);
            let found = decode(&bytes);
            // Features may come before or after a row; rows without numbers cannot tell their order, and none stand side by side here.
            assert_all_true(&found, &sent, &format!("packets at {a} and {b} exchanged"));
            tried += 1;
        }
    }
    assert_eq!(tried, 2 * 9 + 6 + 2 * 12 + 9);
}

#[test]
fn swapped_and_dead_lanes_bring_no_frame() {
    let sent = sent(&OV7251, 2);
    let mut tried = 0;
    for lanes in 2..=4 {
        let right = distribute(&sent.bytes, lanes);
        for (a, b) in (0..lanes).flat_map(|a| (a + 1..lanes).map(move |b| (a, b))) {
            let mut swapped = right.clone();
            // The last bytes stay where they are, so that lanes keep their lengths.
            let length = swapped[b].len();
            let (low, high) = swapped.split_at_mut(b);
            low[a][..length].swap_with_slice(&mut high[0]);
            let found = decode(&merge(&swapped));
            assert!(found.frames.iter().all(|frame| !frame.whole), "{lanes} lanes, {a} and {b} swapped");
            assert!(!found.counts.clean());
            assert_all_true(&found, &sent, &format!("{lanes} lanes, {a} and {b} swapped"));
            tried += 1;
        }
        for dead in 0..lanes {
            let mut bytes = sent.bytes.clone();
            bytes.iter_mut().skip(dead).step_by(lanes).for_each(|byte| *byte = 0);
            let found = decode(&bytes);
            assert!(found.frames.iter().all(|frame| !frame.whole), "{lanes} lanes, {dead} dead");
            tried += 1;
        }
    }
    assert_eq!(tried, 1 + 2 + 3 + 3 + 6 + 4);
}

#[test]
fn long_payloads_are_refused_whatever_two_of_their_bits_are_flipped() {
    const SEED: u64 = 5;
    let (codes, list) = (codes(640, 2, 12), features(0));
    let params = LinkParams { mode: Mode::Frames, ..OV7251 };
    let bytes = packed(&frame(0, &codes, 12, &list), &params);
    let (at, length) = packets(&bytes)[2];
    assert_eq!(length, 4 + 960 + 2);
    let bits = 8 * (length - 4);
    let draw = |i: usize| mix(mix(SEED) ^ i as u64) as usize % bits;
    let mut tried = 0;
    for i in 0..2000 {
        let (a, b) = (draw(2 * i), draw(2 * i + 1));
        if a == b {
            continue;
        }
        // This CRC sees every two flipped bits that are less than 32,767 apart: the order of its polynomial.
        let found = decode(&flipped(&bytes, &[8 * (at + 4) + a, 8 * (at + 4) + b]));
        assert_eq!(found.counts.payloads_refused, 1, "seed {SEED}, bits {a} and {b}");
        assert_eq!(found.frames[0].damaged_rows, [0], "seed {SEED}, bits {a} and {b}");
        tried += 1;
    }
    println!("seed {SEED}: {tried} pairs");
    assert!(tried > 1990);
}

#[test]
fn bursts_of_errors_leave_only_what_was_sent() {
    // What is believed by chance: a damaged payload of CRC-16 once in 65,536. In 400 streams of 3 frames with some 30 damaged payloads
    // a false one is expected once in 400 * 30 / 65,536 = 0.2 streams at the highest rate; the seed is fixed, and it has none.
    const SEED: u64 = 11;
    let mut sum = LinkCounts::default();
    let sent = sent(&NUMBERED, 3);
    for stream in 0..400_u64 {
        let mut bytes = sent.bytes.clone();
        for (i, byte) in (0..).zip(bytes.iter_mut()) {
            let draw = mix(mix(SEED ^ stream << 32) ^ i);
            // One byte in 16, 64 or 256 is another one.
            if draw >> 40 & ((16 << (2 * (stream % 3))) - 1) == 0 {
                *byte ^= (draw as u8).max(1);
            }
        }
        let found = decode(&bytes);
        assert_all_true(&found, &sent, &format!("seed {SEED}, stream {stream}"));
        sum.merge(&found.counts);
    }
    println!("seed {SEED}: {sum:?}");
    assert!(sum.headers_corrected > 100 && sum.headers_refused > 100 && sum.payloads_refused > 1000);
    assert!(sum.rows_lost > 200);
}

#[test]
fn streams_that_are_cut_or_made_of_noise_never_panic_and_claim_no_whole_frame() {
    let sent = sent(&OV7251, 1);
    for length in 0..sent.bytes.len() {
        let found = decode(&sent.bytes[..length]);
        assert!(found.frames.iter().all(|frame| !frame.whole), "{length} bytes");
        assert!(length == 0 || !found.counts.clean(), "{length} bytes");
        assert_all_true(&found, &sent, &format!("{length} bytes"));
    }
    for seed in 0..200_u64 {
        let bytes: Vec<u8> = (0..600).map(|i| mix(mix(seed) ^ i).to_le_bytes()[0]).collect();
        assert!(decode(&bytes).frames.iter().all(|frame| !frame.whole), "seed {seed}");
    }
}

#[test]
fn a_row_with_a_broken_checksum_is_named_and_the_others_stand() {
    let sent = sent(&OV7251, 1);
    let rows: Vec<_> = packets(&sent.bytes).into_iter().filter(|&(at, _)| sent.bytes[at] & 0x3F == 0x2B).collect();
    let found = decode(&flipped(&sent.bytes, &[8 * (rows[1].0 + 4 + 2) + 4]));
    let received = &found.frames[0];
    assert_eq!((received.damaged_rows.as_slice(), received.whole), ([1].as_slice(), false));
    assert!(received.missing_rows.is_empty() && found.counts.rows_lost == 1);
    let picture = received.picture.as_ref().unwrap();
    let codes = &sent.codes;
    assert_eq!((picture.row(0), picture.row(1), picture.row(2)), (codes.row(0), [0; 8].as_slice(), codes.row(2)));
}

#[test]
fn bits_flip_at_the_rate_that_is_asked_for_anywhere_and_by_their_own_draws() {
    let row_id = |camera, frame| RowId {
        seed: 3,
        camera: CameraIndex(camera),
        frame: FrameIndex(frame),
        slot: 0,
        row: RowIndex(0),
    };
    let clean = vec![0_u8; 1 << 18];
    let bits = 8.0 * clean.len() as f64;
    let mut tried = 0;
    for rate in [1e-5, 1e-3, 0.01] {
        let mut bytes = clean.clone();
        let flipped = flip_bits(&mut bytes, rate, row_id(0, 0));
        let ones = |part: &[u8]| part.iter().map(|byte| u64::from(byte.count_ones())).sum::<u64>();
        assert_eq!(ones(&bytes), flipped, "a bit flips once");
        // Binomial: five standard deviations, once in a million; the seed is fixed.
        for (part, share) in
            [(&bytes[..], 1.0), (&bytes[..clean.len() / 4], 0.25), (&bytes[3 * clean.len() / 4..], 0.25)]
        {
            let expected = bits * share * rate;
            let found = ones(part) as f64;
            assert!((found - expected).abs() < 5.0 * expected.sqrt(), "rate {rate}: {found}, {expected} expected");
            tried += 1;
        }
        for lane in 0..8 {
            let found = bytes.iter().filter(|&&byte| byte >> lane & 1 == 1).count() as f64;
            let expected = bits / 8.0 * rate;
            assert!((found - expected).abs() < 5.0 * expected.sqrt().max(1.0), "bit {lane}: {found}, {expected}");
        }
        // A shorter frame has the same errors, as far as it goes; another camera and another frame have their own.
        let mut shorter = clean[..clean.len() / 2].to_vec();
        flip_bits(&mut shorter, rate, row_id(0, 0));
        assert_eq!(shorter, bytes[..clean.len() / 2]);
        for other in [row_id(1, 0), row_id(0, 1)] {
            let mut others = clean.clone();
            flip_bits(&mut others, rate, other);
            assert_ne!(others, bytes);
        }
    }
    let mut same = clean.clone();
    assert_eq!((flip_bits(&mut same, 0.0, row_id(0, 0)), same == clean, tried), (0, true, 9));
}

/// `decode` in pieces whose lengths are drawn up to `piece_bytes`, and the pieces after which frames came.
fn in_pieces(bytes: &[u8], piece_bytes: usize, seed: u64) -> (Decoded, usize) {
    let mut decoder = Decoder::new(true);
    let (mut frames, mut rest, mut pieces, mut brought) = (Vec::new(), bytes, 0_u64, 0);
    while !rest.is_empty() {
        let length = (mix(seed + pieces) as usize % piece_bytes).min(rest.len());
        let (piece, after) = rest.split_at(length);
        let ended = decoder.push(piece);
        brought += usize::from(!ended.is_empty());
        frames.extend(ended);
        rest = after;
        pieces += 1;
    }
    let Decoded { frames: last, counts } = decoder.finish();
    frames.extend(last);
    (Decoded { frames, counts }, brought)
}

#[test]
fn a_stream_in_pieces_is_the_stream_at_once() {
    // Rows of 1,280 bytes, so that 24 frames are several times as long as the longest packet.
    let (codes, features) = (codes(1_024, 20, 10), features(40));
    let batches = [Batch { features: 40, after_row: 9 }];
    let mut cases = 0;
    for (params, share) in [(OV7251, 0.0), (NUMBERED, 0.0), (OV7251, 1e-5), (NUMBERED, 1e-4), (OV7251, 1e-3)] {
        for seed in 0..6 {
            let mut bytes = Vec::new();
            for number in 0..24 {
                let out = FrameOut { batches: &batches, features_per_gap: 40, ..frame(number, &codes, 10, &features) };
                bytes.extend(packed(&out, &params));
            }
            let row_id = RowId { seed, camera: CameraIndex(0), frame: FrameIndex(0), slot: 0, row: RowIndex(0) };
            flip_bits(&mut bytes, share, row_id);
            // Cut at the end, and somewhere within.
            bytes.truncate(bytes.len() - mix(seed) as usize % 3_000);
            let hole = mix(seed + 1) as usize % bytes.len();
            let hole_bytes = (mix(seed + 2) as usize % 5_000).min(bytes.len() - hole);
            bytes.drain(hole..hole + hole_bytes);
            let whole = decode(&bytes);
            for piece_bytes in [2_000, 70_000, 1 << 20] {
                let (found, brought) = in_pieces(&bytes, piece_bytes, seed);
                let case = format!("seed {seed}, share {share}, pieces below {piece_bytes}");
                assert_eq!(found.counts, whole.counts, "{case}");
                assert!(found.frames == whole.frames, "{case}");
                // Frames come as they end, not all at the last.
                assert!(brought >= if piece_bytes < 100_000 { 3 } else { 1 } || share > 1e-4, "{case}: {brought}");
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 5 * 6 * 3);
}
