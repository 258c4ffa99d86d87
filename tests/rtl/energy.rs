//! Area, leakage and switching energy of every block in the library that SENSEL_LIBERTY names (`./check --liberty FILE`), from the mapped
//! netlists and the twins' toggles. Prints the table of docs/rtl.md and writes it to target/rtl/liberty.md.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use super::cases::{Random, comparators, core_config};
use super::front_pictures::committed;
use super::front_reference::Buffers;
use super::judge::Pin;
use super::liberty::{Library, clock_pj};
use super::pins::{cds_out, lane_out, ramp_out, seq_out};
use super::synthesis::{BLOCKS, netlist};
use rtl_models::cds::Cds;
use rtl_models::fx_front::{FrontToggles, FxFront, FxFrontConfig, FxFrontIn};
use rtl_models::readout_seq::SeqIn;
use rtl_models::sensor_core::SensorCore;

/// Bits flipped and bits there were to flip, of one block.
#[derive(Clone, Default)]
struct Activity {
    flipped: u64,
    bits: u64,
    before: Vec<u8>,
}

impl Activity {
    /// The next clock's pins.
    fn add(&mut self, pins: &[Pin<'_>]) {
        let mut record = Vec::new();
        pins.iter().for_each(|pin| pin.write(&mut record));
        let flips = record.iter().zip(&self.before).map(|(a, b)| u64::from((a ^ b).count_ones()));
        self.flipped += flips.sum::<u64>();
        self.bits += pins.iter().map(|pin| u64::from(pin.bits())).sum::<u64>();
        self.before = record;
    }

    fn share(&self) -> f64 {
        self.flipped as f64 / self.bits as f64
    }
}

/// Shares of pins that flip in a clock, while a core of 16 columns and 10 bits reads rows: of each block of the readout, by its
/// output pins.
fn readout_activity() -> BTreeMap<&'static str, f64> {
    const COLUMNS: usize = 16;
    let mut random = Random::new(61);
    let mut config = core_config(&mut random, 10, 16, u32::MAX);
    (config.columns, config.lanes, config.cds.bits) = (16, 4, 10);
    (config.seq.n_ramp_signal, config.seq.hts) = (1024, config.seq.hts.max(1400));
    let (mut columns, mut codes, mut held) = ([Cds::new(); COLUMNS], [0; COLUMNS], [0; COLUMNS]);
    let mut core = SensorCore::new(config, &mut columns, &mut codes, &mut held);
    let [mut ramp, mut cds, mut seq, mut lane] = [(); 4].map(|()| Activity::default());
    let mut crossings = [0; COLUMNS];
    for clock in 0..config.seq.hts * config.seq.vts * 3 {
        let out = core.out();
        if out.seq.ramp_start || clock == 0 {
            crossings = std::array::from_fn(|_| random.crossing(1024));
        }
        let mut bits = [0];
        comparators(&out.ramp, &crossings, &mut bits);
        let out = core.tick(SeqIn { rst: clock == 0, enable: true, stall: false }, &bits);
        ramp.add(&ramp_out(&out.ramp));
        seq.add(&seq_out(&out.seq));
        lane.add(&lane_out(&out.lane));
        cds.add(&cds_out(&core.columns()[3].out(&config.cds)));
    }
    let mut all = Activity::default();
    for (of, count) in [(&ramp, 1), (&seq, 1), (&lane, 1), (&cds, 16)] {
        (all.flipped, all.bits) = (all.flipped + count * of.flipped, all.bits + count * of.bits);
    }
    let blocks =
        [("ramp_counter", ramp), ("cds", cds), ("readout_seq", seq), ("lane_shift", lane), ("sensor_core", all)];
    blocks.map(|(name, activity)| (name, activity.share())).into()
}

/// Bits flipped in a clock in the registers of the front's blocks, over a committed picture without stalls, and over all of it.
fn front_toggles(octaves: u32, harris: bool) -> (FrontToggles, f64) {
    let picture = committed("scene_noisy.png", 640, 480, 8);
    let [width, height] = [picture.width, picture.height].map(|side| u32::try_from(side).unwrap());
    let config = FxFrontConfig { max_width: 640, pix_bits: 8, octaves, harris, width, height };
    let mut buffers = Buffers::new(&config, 0);
    let mut front = FxFront::new(config, buffers.memory());
    let mut next = 0;
    for _ in 0..config.frame_slots() {
        let in_pixel = picture.pixels.get(next).copied().unwrap_or(0);
        next += usize::from(front.in_ready(true));
        front.tick(&FxFrontIn { rst: false, in_valid: true, in_pixel, row_ok: true, threshold: 20 });
    }
    (front.toggles(), front.enabled_clocks() as f64)
}

/// Share of a block's nets that switch in a clock: of its registers' bits, or of those of the whole front where it has none.
fn front_activity(name: &str, flops: u32) -> f64 {
    let (toggles, clocks) = front_toggles(if name.contains("3 octaves") { 3 } else { 1 }, name == "fx_harris");
    let FrontToggles { rows, window, fast, nms, smooth, harris, top } = toggles;
    let flipped = match name {
        "fx_rows" => rows,
        "fx_window" => window,
        "fx_fast" => fast,
        "fx_nms" => nms,
        "fx_smooth" => smooth,
        "fx_harris" => harris,
        // It has no registers: pixels pass through it as they do through the window, whose 344 bits are pixels.
        "fx_half" => return window as f64 / clocks / 344.0,
        _ => rows + window + fast + nms + smooth + top,
    };
    flipped as f64 / clocks / f64::from(flops)
}

#[test]
fn every_block_maps_to_the_library_that_was_named() {
    let Some(file) = std::env::var_os("SENSEL_LIBERTY") else {
        println!("SENSEL_LIBERTY names no library: ./check --liberty FILE");
        return;
    };
    let file = Path::new(&file);
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let library = Library::parse(&text);
    let readout = readout_activity();
    let mut table = format!(
        "| {} at {} V | area | leakage | nets that switch | energy per clock |\n|---|---|---|---|---|\n",
        library.name, library.voltage_v
    );
    for block in &BLOCKS {
        let path = file.display();
        let mapped = netlist(
            block,
            &format!("read_liberty -lib {path}; dfflibmap -liberty {path}; opt; abc -liberty {path}; opt_clean"),
        );
        let total = library.total(&mapped.cells);
        let activity = match readout.get(block.name) {
            Some(&share) => Some(share),
            None if block.name.starts_with("fx_") => Some(front_activity(block.name, mapped.count("DFF"))),
            // Nobody counts what flips in the packetiser.
            None => None,
        };
        let in_range = activity.is_none_or(|activity| (0.0..1.0).contains(&activity));
        assert!(total.area > 0.0 && in_range, "{}: {total:?}, {activity:?}", block.name);
        let switching = activity.map_or("- | -".to_owned(), |activity| {
            let energy = clock_pj(&total, library.voltage_v, activity);
            format!("{:.2} % | {energy:.1} pJ", activity * 100.0)
        });
        let (name, leakage_uw) = (block.name, total.leakage_nw / 1e3);
        writeln!(table, "| `{name}` | {:.0} | {leakage_uw:.2} uW | {switching} |", total.area).unwrap();
    }
    println!("{table}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../rtl");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("liberty.md"), table).unwrap();
}
