//! The CSI-2 packetiser: Verilog against its twin on every pin, and the twin's bytes against the link's.

use rtl_models::csi2_packetiser::{Packetiser, PacketiserConfig, PacketiserIn, PacketiserOut};
use sensel::link::RawKind;

use super::cases::Random;
use super::csi2_cases::{Case, Receiver, frame};
use super::judge::{Judge, Pin, bit, bus};

fn pins_in<'a>(config: &PacketiserConfig, pins: &PacketiserIn, data: &'a [u8; 8]) -> [Pin<'a>; 9] {
    [
        bit("rst", pins.rst),
        bus("lanes_log2", 2, config.lanes_log2),
        bit("req_valid", pins.req_valid),
        bus("channel", 2, pins.channel),
        bus("data_type", 6, pins.data_type),
        bus("word_count", 16, pins.word_count),
        bit("in_valid", pins.in_valid),
        Pin::Wide("in_data", 64, data),
        bit("word_ready", pins.word_ready),
    ]
}

fn pins_out(out: &PacketiserOut) -> [Pin<'static>; 7] {
    [
        bit("req_ready", out.req_ready),
        bit("in_ready", out.in_ready),
        bit("word_valid", out.word_valid),
        bus("word", 32, out.word),
        bus("word_keep", 4, out.word_keep),
        bit("word_first", out.word_first),
        bit("word_last", out.word_last),
    ]
}

/// The block, its twin, and what was counted.
struct Bench {
    judge: Judge,
    twin: Packetiser,
    packets: u32,
    resets: u32,
    stalls: u32,
}

impl Bench {
    fn clock(&mut self, config: &PacketiserConfig, pins: PacketiserIn) {
        let out = self.twin.tick(config, pins);
        self.judge.clock(&pins_in(config, &pins, &pins.in_data.to_le_bytes()), &pins_out(&out));
    }

    fn reset(&mut self, config: &PacketiserConfig) {
        self.clock(config, PacketiserIn { rst: true, ..PacketiserIn::default() });
        self.resets += 1;
    }

    /// The packets of a frame, with pauses of all three sides; a reset in the midst of it ends the case.
    fn play(&mut self, config: &PacketiserConfig, cases: &[Case], random: &mut Random) {
        self.reset(config);
        let mut receiver = Receiver::default();
        let pauses: [u32; 3] = std::array::from_fn(|_| if random.one_in(3) { 1000 } else { random.within(2, 6) });
        let reset_in = if random.one_in(6) { random.below(600) } else { u32::MAX };
        let (mut packet, mut beat, mut clock) = (0, 0, 0);
        while receiver.packets.len() < cases.len() {
            if clock == reset_in {
                return;
            }
            let stood = self.twin.out();
            let next = cases.get(packet);
            let open = packet.checked_sub(1).map(|open| &cases[open]);
            let noise = random.next();
            let pins = PacketiserIn {
                req_valid: next.is_some() && !random.one_in(pauses[0]),
                in_valid: open.is_some_and(|case| beat < case.beats.len()) && !random.one_in(pauses[1]),
                // What stands on the pins without its valid is anything.
                in_data: open.and_then(|case| case.beats.get(beat)).copied().unwrap_or(noise),
                word_ready: !random.one_in(pauses[2]),
                ..next.map(Case::request).unwrap_or_default()
            };
            if stood.word_valid && pins.word_ready {
                receiver.take(&stood, config.lanes());
            }
            self.stalls += u32::from(stood.word_valid && !pins.word_ready);
            beat += usize::from(pins.in_valid && stood.in_ready);
            if pins.req_valid && stood.req_ready {
                (packet, beat) = (packet + 1, 0);
            }
            self.clock(config, pins);
            clock += 1;
        }
        for (found, case) in receiver.packets.iter().zip(cases) {
            assert_eq!(found, &case.bytes, "{config:?}, data type {:#x}", case.data_type);
            self.packets += 1;
        }
    }

    /// Any pins at all, and short payloads so that packets end.
    fn play_wild(&mut self, config: &PacketiserConfig, clocks: u32, random: &mut Random) {
        self.reset(config);
        for _ in 0..clocks {
            let pins = PacketiserIn {
                rst: random.one_in(400),
                req_valid: random.one_in(2),
                channel: u8::try_from(random.below(4)).unwrap(),
                data_type: u8::try_from(random.below(64)).unwrap(),
                word_count: u16::try_from(random.below(40)).unwrap(),
                in_valid: random.one_in(2),
                in_data: random.next(),
                word_ready: !random.one_in(3),
            };
            self.clock(config, pins);
        }
    }
}

#[test]
fn the_packetiser_equals_its_twin_on_every_clock() {
    const SEED: u64 = 36;
    let mut random = Random::new(SEED);
    let config = PacketiserConfig { lanes_log2: 0 };
    let (inputs, outputs) = (pins_in(&config, &PacketiserIn::default(), &[0; 8]), pins_out(&PacketiserOut::default()));
    let judge = Judge::new("csi2_packetiser", &[], &inputs, &outputs);
    let mut bench = Bench { judge, twin: Packetiser::new(), packets: 0, resets: 0, stalls: 0 };
    for case in 0..2200 {
        let config = PacketiserConfig { lanes_log2: case % 3 };
        if case % 10 == 9 {
            bench.play_wild(&config, 2000, &mut random);
            continue;
        }
        let kind = RawKind::ALL[usize::try_from(random.below(7)).unwrap()];
        bench.play(&config, &frame(random.next(), kind), &mut random);
    }
    println!("{} packets, {} resets, {} clocks of waiting words", bench.packets, bench.resets, bench.stalls);
    assert!(bench.packets > 12_000 && bench.resets > 2000 && bench.stalls > 100_000);
    bench.judge.finish(SEED);
}
