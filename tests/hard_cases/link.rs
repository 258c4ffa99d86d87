//! Hard cases of the link's checks and of energy sums in attojoules.

use sensel::config::Resolved;
use sensel::energy::{Amount, EnergyAccount, Technology};
use sensel::events::{Event, Events};
use sensel::link::{HeaderCheck, check_header, crc16, ecc};
use sensel::num::{low_u8, low_u32};
use sensel::run::SensorSetup;

use super::double_double::{dd, whole};
use super::table::{Chance, Stage};

pub fn run(stage: &mut Stage) {
    checksums(stage);
    headers(stage);
}

/// Division of the payload by x^16 + x^12 + x^5 + 1, bit by bit, most significant power first: the reflected definition turned round.
fn exact_crc(payload: &[u8]) -> u16 {
    let mut rest = 0xFFFF_u16;
    for bit in payload.iter().flat_map(|&byte| (0..8).map(move |bit| u16::from(byte >> bit & 1))) {
        let top = rest >> 15 ^ bit;
        rest = rest << 1 ^ if top == 1 { 0x1021 } else { 0 };
    }
    rest.reverse_bits()
}

/// The longest payload of a packet is 65,535 bytes; eight bytes go at once, so lengths on both sides of a multiple of eight are tried. A
/// payload with its own checksum behind it leaves nothing.
fn checksums(stage: &mut Stage) {
    let sides = &["multiples of 8", "other lengths", "its own checksum"];
    let case =
        stage.case("CRC of empty, longest, equal and random payloads", "polynomial division by bits", "bits", sides);
    let mut chance = Chance::new(601);
    for length in (0..64).chain([1000, 1001, 65_528, 65_535]) {
        for kind in 0..4_u32 {
            let byte = |chance: &mut Chance| {
                [0, 0xFF, low_u8(chance.word()), low_u8(chance.word()) & 1][usize::try_from(kind).unwrap()]
            };
            let mut payload: Vec<u8> = (0..length).map(|_| byte(&mut chance)).collect();
            let (found, exact) = (crc16(&payload), exact_crc(&payload));
            let error = f64::from((found ^ exact).count_ones());
            case.see(usize::from(length % 8 != 0), error, 0.0, || {
                format!("{length} bytes of kind {kind}: {found:04x}")
            });
            payload.extend(found.to_le_bytes());
            case.hold(2, crc16(&payload) == 0, || format!("{length} bytes of kind {kind}"));
        }
    }
}

/// A Hamming code of distance 4: every header is its own, one flipped bit of 32 is set right, two are refused. Parity by the standard's
/// table of syndromes (CSI-2, section 9.5), column by column, where the product has masks row by row.
fn headers(stage: &mut Stage) {
    const SYNDROMES: [u8; 24] = [
        0x07, 0x0B, 0x0D, 0x0E, 0x13, 0x15, 0x16, 0x19, 0x1A, 0x1C, 0x23, 0x25, 0x26, 0x29, 0x2A, 0x2C, 0x31, 0x32,
        0x34, 0x38, 0x1F, 0x2F, 0x37, 0x3B,
    ];
    let sides = &["no flip", "one flip", "two flips"];
    let case =
        stage.case("header code at all zeros, all ones and at random", "the standard's syndromes", "headers", sides);
    let mut chance = Chance::new(602);
    for number in 0..3000_u32 {
        let word = [0, 0xFF_FFFF, 1, 0x80_0000, chance.word() & 0xFF_FFFF][index(number)];
        let [a, b, c, _] = word.to_le_bytes();
        let exact = (0..24).filter(|bit| word >> bit & 1 == 1).fold(0, |code, bit| code ^ SYNDROMES[bit]);
        let sent = u32::from_le_bytes([a, b, c, exact]);
        let right = ecc([a, b, c]) == exact && check_header(sent.to_le_bytes()) == HeaderCheck::Right;
        case.hold(0, right, || format!("{word:06x}"));
        // The code's upper two bits are sent as zeros and do not count as data; all thirty-two are flipped all the same.
        let (first, second) = (chance.below(32), chance.below(32));
        let once = sent ^ 1 << first;
        let fixed = check_header(once.to_le_bytes()) == HeaderCheck::Corrected([a, b, c]);
        case.hold(1, fixed, || format!("{word:06x}, bit {first}"));
        if first != second {
            let refused = check_header((once ^ 1 << second).to_le_bytes()) == HeaderCheck::Refused;
            case.hold(2, refused, || format!("{word:06x}, bits {first} and {second}"));
        }
    }
}

fn index(number: u32) -> usize {
    usize::try_from(number.min(4)).unwrap()
}

/// Attojoules are products and sums of integers. What a person reads is a quotient in f64: the total rounds once, and the two divisions
/// once each: 3 * 2^-53, relative.
pub fn energy(stage: &mut Stage) {
    let name = "energy of 1e15 events of every kind";
    let case =
        stage.case(name, "128-bit integers, double-double", "relative", &["one frame", "millions", "count by count"]);
    let mut chance = Chance::new(603);
    let sensor = SensorSetup::new(&Resolved::from_layers("hard", "", &[]).unwrap()).unwrap();
    for (number, technology) in ["65nm", "28nm"].into_iter().flat_map(|name| [name; 40]).enumerate() {
        let power = sensor.power.with_technology(Technology::by_name(technology).unwrap());
        let mut events = Events::default();
        let mut by_ones = 0_u64;
        for &event in Event::ALL {
            let times = 1_000_000_000_000_000 + chance.below(1_000_000_000_000_000);
            events.add(event, times);
            // A part added later must not be lost in what is there.
            events.add(event, 1);
            by_ones += u64::from(events.count(event) == times + 1);
        }
        let frames = if number % 2 == 0 { 1 } else { 1 + low_u32(chance.below(4_000_000)) };
        let mut exact = 0_i128;
        for item in &power.items {
            let times = match item.amount {
                Amount::Event(event) => i128::from(events.count(event)),
                Amount::PerFrame(times) | Amount::Nanoseconds(times) => 2 * i128::from(frames) * i128::from(times),
                Amount::LaneNanoseconds => i128::from(power.times(item.amount, &events, u64::from(frames))),
            };
            exact += times * i128::from(item.constant);
        }
        let account = EnergyAccount::of(&events, frames, 2, 307_200, &power);
        let same =
            i128::try_from(account.total_aj()).unwrap() == exact && by_ones == u64::try_from(Event::ALL.len()).unwrap();
        case.hold(2, same, || format!("{} aJ for {exact}", account.total_aj()));
        let pj = whole(exact) / dd(1e6) / dd(f64::from(frames));
        let found = account.total_pj_per_frame();
        let bound = 3.0 * f64::EPSILON / 2.0;
        case.see(usize::from(frames > 1), pj.miss(found) / pj.high, bound, || format!("{frames} frames: {found} pJ"));
    }
}
