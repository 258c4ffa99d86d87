//! The packetiser of `rtl_models` against the link: the same bytes, from pixels and records, at the rate that it promises.

use rtl_models::csi2_packetiser::{Packetiser, PacketiserConfig, PacketiserIn};
use sensel::draw::mix;
use sensel::link::RawKind;

use super::csi2_cases::{Receiver, frame};

/// Plays packets; says how many clocks they took. `pause` stops either side once in so many clocks, 0 never.
fn play(lanes_log2: u32, seed: u64, kind: RawKind, pause: u64) -> u64 {
    let config = PacketiserConfig { lanes_log2 };
    let cases = frame(seed, kind);
    let mut twin = Packetiser::new();
    let mut receiver = Receiver::default();
    let (mut packet, mut beat, mut clock) = (0, 0, 0);
    while receiver.packets.len() < cases.len() {
        let stood = twin.out();
        let draw = |field: u64| pause == 0 || !mix(mix(seed ^ field) ^ clock).is_multiple_of(pause);
        let case = cases.get(packet);
        let before = packet.checked_sub(1).map(|before| &cases[before]);
        let pins = PacketiserIn {
            req_valid: case.is_some() && draw(1),
            in_valid: before.is_some_and(|case| beat < case.beats.len()) && draw(2),
            in_data: before.and_then(|case| case.beats.get(beat)).copied().unwrap_or(0),
            word_ready: draw(3),
            ..case.map(super::csi2_cases::Case::request).unwrap_or_default()
        };
        if stood.word_valid && pins.word_ready {
            receiver.take(&stood, config.lanes());
        }
        beat += usize::from(pins.in_valid && stood.in_ready);
        if pins.req_valid && stood.req_ready {
            assert!(before.is_none_or(|case| case.beats.len() == beat), "all beats of a packet are taken");
            (packet, beat) = (packet + 1, 0);
        }
        twin.tick(&config, pins);
        clock += 1;
        assert!(clock < 1 << 20, "the packetiser stands still");
    }
    for (index, (found, case)) in receiver.packets.iter().zip(&cases).enumerate() {
        assert_eq!(found, &case.bytes, "seed {seed}, {kind:?}, {} lanes, packet {index}", config.lanes());
    }
    let words: u64 = cases.iter().map(|case| (case.bytes.len() as u64).div_ceil(config.lanes().into())).sum();
    if pause == 0 && (lanes_log2 < 2 || !matches!(kind, RawKind::Raw6 | RawKind::Raw7)) {
        // A clock for the request and one for the first beat of a long packet; and a word per clock.
        assert!(clock <= words + 2 * cases.len() as u64 + 1, "{kind:?}: {clock} clocks for {words} words");
    }
    clock
}

#[test]
fn the_packetiser_sends_the_bytes_of_the_link_at_a_word_a_clock() {
    let (mut clocks, mut frames) = (0, 0);
    for kind in RawKind::ALL {
        for lanes_log2 in 0..3 {
            for seed in 0..25 {
                for pause in [0, 2, 7] {
                    clocks += play(lanes_log2, seed, kind, pause);
                    frames += 1;
                }
            }
        }
    }
    println!("{frames} frames, {clocks} clocks");
    assert_eq!(frames, 7 * 3 * 25 * 3);
}
