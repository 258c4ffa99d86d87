//! Power follows physics and every key: formulas by key, sums by block and rail to the last unit, what depends on the picture and what does
//! not, technology files, and how the estimate stands beside a run.

#![allow(clippy::unwrap_used)]

use crate::common;
#[path = "energy/technology.rs"]
mod technology;

use common::{Scratch, sensel};
use sensel::config::Resolved;
use sensel::energy::{Amount, Architecture, Constant, EnergyAccount, Rail, Technology};
use sensel::events::{Block, Event};
use sensel::num::{f64_from_u64, f64_from_u128};
use sensel::run::{ESTIMATED_LEVEL, NoClock, NoFiles, NoProgress, SensorSetup, Session, Setup};

const BASE: &str = "[scene]\ntarget = \"flat\"\n[rig]\nbaseline_mm = 0.0\n[link]\nmode = \"frames\"\n";

fn resolved(set: &[&str]) -> Resolved {
    let set: Vec<String> = set.iter().map(|one| (*one).to_owned()).collect();
    Resolved::from_layers("energy.toml", BASE, &set).unwrap_or_else(|error| panic!("{set:?}: {error}"))
}

fn account_at(set: &[&str], level: f64) -> EnergyAccount {
    SensorSetup::new(&resolved(set)).unwrap_or_else(|error| panic!("{set:?}: {error}")).estimated_energy(level).unwrap()
}

fn account(set: &[&str]) -> EnergyAccount {
    account_at(set, ESTIMATED_LEVEL)
}

/// Picojoules a frame of one item.
fn item_pj(account: &EnergyAccount, name: &str) -> f64 {
    account.pj_per_frame(account.item_aj(name))
}

/// Constants are rounded to attojoules or nanowatts, and times to nanoseconds: of values above 1e4 units that is 1e-4 at most, in a ratio
/// twice.
fn near(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 2.5e-4, "{what}: {found}, expected {expected}");
}

#[test]
fn blocks_and_rails_both_add_up_to_the_total_to_the_last_unit() {
    let mut seen = 0;
    for set in [
        &[][..],
        &["energy.port=parallel"],
        &["energy.port=lvds", "energy.adc=sar"],
        &["energy.adc=in_pixel", "energy.periphery=low_power"],
        &["energy.adc=sigma_delta", "energy.pixel_node_nm=90"],
        &["energy.technology=28nm", "link.mode=both"],
        &[
            "sensor.readout.shutter=rolling",
            "sensor.readout.hdr=multi_exposure",
            "sensor.readout.vts=3000",
            "sensor.adc.clock_hz=900000000",
        ],
        &["energy.sleep_period_ms=500.0", "energy.wake_us=300.0"],
    ] {
        let account = account(set);
        let blocks: u128 = Block::ALL.iter().map(|&block| account.block_aj(block)).sum();
        let rails: u128 = Rail::ALL.iter().map(|&rail| account.rail_aj(rail)).sum();
        assert!(account.total_aj() > 0 && blocks == account.total_aj() && rails == account.total_aj(), "{set:?}");
        for part in &account.contributions {
            assert_eq!(part.energy_aj, u128::from(part.times) * u128::from(part.item.constant));
            seen += 1;
        }
        let (range, of_blocks) = account.ranges_pj();
        assert!(range.low < account.total_pj_per_frame() && account.total_pj_per_frame() < range.high);
        assert_eq!(of_blocks.len(), Block::ALL.len());
    }
    assert!(seen > 100, "{seen} items");
}

#[test]
fn twice_the_frames_take_twice_the_energy_of_every_item() {
    let sensor = SensorSetup::new(&resolved(&["energy.port=lvds"])).unwrap();
    let once = sensor.estimated_events(0.3).unwrap();
    let mut twice = once.clone();
    twice.merge(&once);
    let one = EnergyAccount::of(&once, 1, 2, 1_000, &sensor.power);
    let two = EnergyAccount::of(&twice, 2, 2, 1_000, &sensor.power);
    assert!(one.contributions.len() > 15);
    for (one, two) in one.contributions.iter().zip(&two.contributions) {
        assert_eq!(2 * one.energy_aj, two.energy_aj, "{}", one.item.name);
    }
    assert_eq!(one.power_mw(), two.power_mw());
}

/// What each key does to the items that its formula names: (key and value, item, expected ratio of its energy in a frame).
#[test]
fn every_key_changes_power_by_what_its_formula_says() {
    let base = account(&[]);
    let mut seen = 0;
    let mut check = |set: &[&str], name: &str, ratio: f64| {
        near(item_pj(&account(set), name), ratio * item_pj(&base, name), &format!("{name} with {set:?}"));
        seen += 1;
    };
    let supply = ["sensor.supply_v=3.08", "sensor.supply_nominal_v=3.08"];
    // Bias and charge times the supply; C V^2 where a capacitance is charged to it.
    for (name, power) in [
        ("column_bias", 1.0),
        ("comparator_bias", 1.0),
        ("comparator_charge", 1.0),
        ("ramp_step", 1.0),
        ("references", 1.0),
        ("column_settle", 1.0),
        ("pixel_reset", 2.0),
        ("charge_transfer", 2.0),
        ("row_select", 2.0),
    ] {
        check(&supply, name, libm::pow(1.1, power));
    }
    let given = |ua: f64| format!("sensor.adc.column_bias_ua={ua}");
    let bias = account(&[&given(2.0)]);
    near(item_pj(&account(&[&given(6.0)]), "column_bias"), 3.0 * item_pj(&bias, "column_bias"), "column_bias_ua");
    // A converter for two columns: twice the ramps.
    check(&["sensor.adc.columns_per_adc=2", "sensor.readout.hts=2000", "sensor.readout.vts=800"], "ramp_step", 2.0);
    // A step of the ramp a clock: the reset ramp's 128 clocks and the signal's.
    check(&["sensor.adc.bits=9"], "ramp_step", (128.0 + 511.0) / (128.0 + 1023.0));
    check(&["sensor.adc.reset_counts=256"], "ramp_step", (256.0 + 1023.0) / (128.0 + 1023.0));
    check(&["sensor.adc.column_capacitance_pf=2.1"], "column_settle", 2.2 / 1.1);
    check(&["sensor.pixel.conversion_gain_uv_per_e=20.0"], "pixel_reset", (8.0109 + 2.0) / (16.0218 + 2.0));
    // Twice the columns.
    check(
        &["sensor.width=1280", "sensor.readout.hts=1856", "sensor.readout.pixel_rate_hz=96000000", "link.lanes=2"],
        "comparator_bias",
        2.0,
    );
    // Twice the rows in the same frame.
    check(&["sensor.height=960"], "ramp_step", 2.0);
    check(&["link.lanes=2"], "phy_lane", 3.0 / 2.0);
    check(&["sensor.pixel.type=4T", "sensor.readout.shutter=rolling"], "row_select", 5.0 / 7.0);
    check(&["energy.io_v=3.6", "energy.port=dphy"], "phy_lane", 1.0);
    check(
        &["energy.constant.link_byte.pj=12"],
        "link_byte",
        12.0 / Technology::by_name("65nm").unwrap().value(Constant::LinkByte),
    );
    check(&["energy.digital_v=2.4"], "datapath_bit", 2.0);
    check(&["energy.digital_v=0.6"], "datapath_bit", 0.25);
    check(&["sensor.temperature_k=325.0"], "leakage_logic", 2.0);
    check(&["sensor.pixel.pitch_um=6.0"], "row_select", (1.5 + 0.2 * 6.0) / (1.5 + 0.2 * 3.0));
    let digital = Technology::by_name("180nm").unwrap();
    let ratio =
        digital.value(Constant::DatapathBit) / Technology::by_name("65nm").unwrap().value(Constant::DatapathBit);
    check(&["energy.technology=180nm"], "datapath_bit", ratio);
    assert!(seen > 20);
}

#[test]
fn bias_follows_settling_and_clock_by_the_time_of_conversion() {
    // Bias flows for the share of a frame that converts, and at idle_bias for the rest. Part of it is that of the ramp's clock.
    let idle_bias = resolved(&[]).scenario.energy.idle_bias;
    let expected = |sensor: &SensorSetup| {
        let adc = &sensor.parameters.adc;
        let conversion_s = adc.settling_s() + f64_from_u64(adc.ramp_clk().0) / f64_from_u64(adc.clock_hz);
        let share = 480.0 * conversion_s / sensor.schedule.frame_time_s();
        let technology = Technology::by_name("65nm").unwrap();
        let bias_ua = technology.value(Constant::ComparatorBias);
        // Femtocoulombs a clock are 1e-9 uA at a hertz.
        let clocked_ua = 1e-9 * technology.value(Constant::ComparatorCharge) * f64_from_u64(adc.clock_hz);
        let comparators = 640.0 / f64::from(adc.columns_per_adc);
        [bias_ua, clocked_ua].map(|ua| {
            let mw = 1e-3 * ua * 2.8 * comparators;
            1e9 * mw * sensor.schedule.frame_time_s() * (share + idle_bias * (1.0 - share))
        })
    };
    let mut found = Vec::new();
    for set in [
        &[][..],
        &["sensor.adc.settle_signal_us=6.0"],
        &["sensor.adc.clock_hz=240000000"],
        &["sensor.adc.settle_reset_us=0.5", "sensor.adc.settle_signal_us=0.5", "sensor.adc.clock_hz=960000000"],
        &["sensor.adc.columns_per_adc=2", "sensor.readout.hts=2000", "sensor.readout.vts=800"],
    ] {
        let sensor = SensorSetup::new(&resolved(set)).unwrap();
        let account = sensor.estimated_energy(0.4).unwrap();
        let pj = ["comparator_bias", "comparator_charge"].map(|name| item_pj(&account, name));
        for (found, expected) in pj.into_iter().zip(expected(&sensor)) {
            near(found, expected, &format!("{set:?}"));
        }
        found.push(pj[0]);
    }
    // Longer settling and slower ramps bias longer, faster ones shorter.
    assert!(found[1] > found[0] && found[2] > found[0] && found[3] < found[0], "{found:?}");
    let off = account(&["energy.idle_bias=0.0"]);
    assert!(item_pj(&off, "comparator_bias") < 0.5 * found[0]);
}

#[test]
fn power_over_the_frame_rate_is_a_base_and_a_slope() {
    // Lines stay as they are; the frame grows by blanking. Counted energy stays, and so does the power of what always flows.
    let of = |vts: u32| account(&[&format!("sensor.readout.vts={vts}"), "energy.idle_bias=1.0"]);
    let (fast, mid, slow) = (of(600), of(1200), of(2400));
    let points = [&fast, &mid, &slow].map(|account| (1.0 / account.run_time_s(), account.power_mw()));
    let slope = |a: (f64, f64), b: (f64, f64)| (a.1 - b.1) / (a.0 - b.0);
    near(slope(points[0], points[1]), slope(points[1], points[2]), "slope");
    near(fast.static_power_mw(), slow.static_power_mw(), "base");
}

#[test]
fn several_exposures_are_converted_each_and_corrected_once() {
    let rolling = ["sensor.pixel.type=4T", "sensor.readout.shutter=rolling", "sensor.readout.vts=1724"];
    let exposures = |count: u32| {
        let keys = ["sensor.readout.hdr=multi_exposure".to_owned(), format!("sensor.readout.hdr_exposures={count}")];
        let set: Vec<&str> = rolling.into_iter().chain(keys.iter().map(String::as_str)).collect();
        account(&set)
    };
    let (linear, two, three) = (account(&rolling), exposures(2), exposures(3));
    // Exposures 16 times apart merge to 14 and 18 bits of codes of 10.
    for (hdr, readings, merged_bits) in [(&two, 2.0, 14.0), (&three, 3.0, 18.0)] {
        for (name, ratio) in [
            ("ramp_step", readings),
            ("column_settle", readings),
            ("readout_bit", readings),
            ("datapath_bit", merged_bits / 10.0),
            ("clock_tree", 1.0 / readings),
            ("references", 1.0),
        ] {
            near(item_pj(hdr, name), ratio * item_pj(&linear, name), &format!("{name} of {readings} exposures"));
        }
    }
}

#[test]
fn an_unlit_sensor_burns_its_columns_and_comparators_and_counts_less() {
    let (dark, lit) = (account_at(&[], 0.0), account_at(&[], 0.9));
    for name in ["column_bias", "comparator_bias", "comparator_charge", "ramp_step", "references", "row_select"] {
        assert_eq!(dark.item_aj(name), lit.item_aj(name), "{name}");
    }
    assert!(dark.item_aj("counter_step") < lit.item_aj("counter_step") / 5);
    let adc = |account: &EnergyAccount| f64_from_u128(account.block_aj(Block::Adc));
    // All of the converters' energy but counters and clock gates, which are the rest.
    let ratio = adc(&dark) / adc(&lit);
    assert!((0.80..1.0).contains(&ratio), "{ratio}");
}

#[test]
fn the_estimate_stands_where_a_run_on_a_flat_picture_does() {
    let set = [
        "run.frames=2",
        "sensor.width=128",
        "sensor.height=96",
        "sensor.readout.vts=400",
        "sensor.readout.exposure_lines=60",
    ];
    let resolved = resolved(&set);
    let sensor = SensorSetup::new(&resolved).unwrap();
    let mut session = Session::new(Setup::new(resolved, &NoFiles, &NoProgress).unwrap()).unwrap();
    let frames: Vec<_> = (0..2).map(|_| session.step(&NoClock).unwrap()).collect();
    let codes = frames[0].cameras[0].codes.values();
    let mean = codes.iter().map(|&code| f64::from(code)).sum::<f64>() / 12_288.0;
    let run = session.energy();
    let estimate = sensor.estimated_energy(mean / 1023.0).unwrap();
    // Everything but the counters' noise is equal: their share of a code's deviation is far below a percent.
    near(estimate.total_pj_per_frame(), run.total_pj_per_frame(), "total");
    for event in
        [Event::RampStep, Event::RowSelect, Event::ReadoutBit, Event::LinkByte, Event::LinkBurst, Event::PixelReset]
    {
        let of = |account: &EnergyAccount| {
            let part = account.contributions.iter().find(|part| part.item.amount == Amount::Event(event));
            part.map(|part| part.times)
        };
        assert_eq!(of(&run), of(&estimate).map(|times| 2 * times), "{}", event.name());
    }
}

#[test]
fn architectures_have_their_own_items_and_columns_where_there_are_columns() {
    let total = |name: &str| {
        let account = account(&[&format!("energy.adc={name}")]);
        (account.block_aj(Block::Adc), account.item_aj("column_bias"), account)
    };
    for architecture in Architecture::ALL {
        let (adc, column, account) = total(architecture.name());
        assert!(adc > 0, "{}", architecture.name());
        assert_eq!(column > 0, architecture != Architecture::InPixel, "{}", architecture.name());
        let ramp = account.item_aj("comparator_charge") > 0;
        assert_eq!(ramp, architecture == Architecture::SingleSlope, "{}", architecture.name());
    }
    // A single slope doubles with every bit, a SAR's array too, a cyclic converter grows by one bit, sigma-delta by the root of two.
    let of = |name: &str, bits: u32| {
        account(&[&format!("energy.adc={name}"), &format!("sensor.adc.bits={bits}"), "sensor.adc.reset_counts=128"])
    };
    near(item_pj(&of("cyclic", 10), "cyclic_bit"), 10.0 / 8.0 * item_pj(&of("cyclic", 8), "cyclic_bit"), "cyclic");
    near(item_pj(&of("sar", 10), "sar_unit"), 4.0 * item_pj(&of("sar", 8), "sar_unit"), "sar");
    let cycles = |bits: i32| libm::ceil(libm::sqrt(2.0 * libm::exp2(f64::from(bits))));
    near(
        item_pj(&of("sigma_delta", 10), "sigma_delta_cycle"),
        cycles(10) / cycles(8) * item_pj(&of("sigma_delta", 8), "sigma_delta_cycle"),
        "sigma-delta",
    );
}

#[test]
fn a_stacked_sensor_has_a_node_a_die_and_pays_for_the_way_between() {
    let one = account(&["energy.technology=28nm"]);
    let stacked = account(&["energy.technology=28nm", "energy.pixel_node_nm=90"]);
    assert!(one.item_aj("tsv_bit") == 0 && stacked.item_aj("tsv_bit") > 0);
    let ratio = libm::pow(90.0 / 28.0, Technology::by_name("28nm").unwrap().value(Constant::AnalogExponent));
    near(item_pj(&stacked, "column_bias"), ratio * item_pj(&one, "column_bias"), "bias of the pixel die");
    assert_eq!(one.item_aj("datapath_bit"), stacked.item_aj("datapath_bit"));
}

#[test]
fn a_sensor_that_sleeps_pays_standby_and_wake_up() {
    let streaming = account(&[]);
    let sleeping = account(&["energy.sleep_period_ms=1000.0", "energy.wake_us=500.0"]);
    assert!(sleeping.power_mw() < 0.1 * streaming.power_mw());
    let standby_mw = 1e-3 * Technology::by_name("65nm").unwrap().value(Constant::Standby);
    let asleep_s = 1.0 - streaming.run_time_s() - 500e-6;
    near(item_pj(&sleeping, "standby"), 1e9 * standby_mw * asleep_s, "standby");
    assert_eq!(streaming.item_aj("standby"), 0);
    let awake = (streaming.run_time_s() + 500e-6) / streaming.run_time_s();
    near(item_pj(&sleeping, "pll"), awake * item_pj(&streaming, "pll"), "wake-up");
}

#[test]
fn power_over_a_line_has_the_energy_of_a_line_and_a_peak_above_the_mean() {
    let sensor = SensorSetup::new(&resolved(&["energy.idle_bias=1.0"])).unwrap();
    let line = sensor.line_power().unwrap();
    assert!(line.spans.len() >= 5 && line.peak_over_mean > 1.0, "{line:?}");
    assert!(line.spans.windows(2).all(|pair| pair[0].end_us == pair[1].start_us));
    // Lines that convert and lines of blanking: the events of a frame belong to the former.
    let account = sensor.estimated_energy(ESTIMATED_LEVEL).unwrap();
    let line_pj: f64 = line
        .spans
        .iter()
        .map(|span| 1e3 * (span.end_us - span.start_us) * span.blocks_mw.iter().map(|(_, mw)| mw).sum::<f64>())
        .sum();
    let always: f64 = account
        .contributions
        .iter()
        .filter(|part| matches!(part.item.amount, Amount::Nanoseconds(_) | Amount::PerFrame(_)))
        .map(|part| account.pj_per_frame(part.energy_aj))
        .sum();
    let (lines, vts) = (480.0, 1724.0);
    let expected = (account.total_pj_per_frame() - always) / lines + always / vts;
    near(line_pj, expected, "a line's energy");
}

#[test]
fn two_bits_save_what_the_container_and_the_floor_allow() {
    let split = |bits: u32| {
        let set = [format!("sensor.adc.bits={bits}"), "sensor.adc.reset_counts=8".to_owned()];
        SensorSetup::new(&resolved(&[&set[0], &set[1]])).unwrap().link_split(300).unwrap()
    };
    let (ten, two) = (split(10), split(2));
    let (of_ten, of_two) = (ten.raw.unwrap(), two.raw.unwrap());
    near(of_two.net_bits_per_s / of_ten.net_bits_per_s, 0.2, "codes");
    near(of_two.bits_per_s / of_ten.bits_per_s, 0.6, "RAW6 over RAW10");
    let saved = 1.0 - of_two.mw / of_ten.mw;
    assert!(saved > 0.0 && saved < 0.4, "{saved}");
    assert!(
        two.floor_mw == ten.floor_mw
            && two.floor_mw > 0.0
            && two.feature_mw > two.floor_mw
            && two.feature_mw < of_two.mw
    );
}

#[test]
fn the_program_prints_blocks_rails_link_and_host_and_takes_the_user_s_constants() {
    let folder = Scratch::new("power");
    let scenario =
        "[scene]\ntarget = \"flat\"\n[energy]\ntechnology = \"my.toml\"\n[host]\nmodel = \"microcontroller\"\n";
    std::fs::write(folder.join("s.toml"), scenario).unwrap();
    std::fs::write(folder.join("my.toml"), "node_nm = 45\n[constant.link_byte]\npj = 20.0\n").unwrap();
    let path = &folder.join("s.toml");
    let told = sensel(&["power", path, "--estimate", "--json"]).json();
    assert_eq!(told["energy"]["technology"], "my.toml");
    let sum = |of: &str| told["energy"][of].as_object().unwrap().values().map(|pj| pj.as_f64().unwrap()).sum::<f64>();
    let total = told["energy"]["total_pj_per_frame"].as_f64().unwrap();
    // Six and three quotients, each rounded once.
    assert!((sum("blocks") / total - 1.0).abs() < 1e-14 && (sum("rails") / total - 1.0).abs() < 1e-14);
    assert!(
        told["link"]["floor_mw"].as_f64().unwrap() > 0.0
            && told["host"]["of_features"]["total_uj"].as_f64().unwrap() > 0.0
    );
    let text = sensel(&["power", path, "--estimate"]).stdout;
    for word in ["rail", "analog", "periphery", "with nothing to send", "host of one camera", "peaks at"] {
        assert!(text.contains(word), "'{word}' is not in {text}");
    }
    let set = sensel(&["power", path, "--estimate", "--json", "--set", "energy.constant.link_byte.pj=40"]).json();
    assert!(set["energy"]["total_pj_per_frame"].as_f64().unwrap() > total);
    std::fs::write(folder.join("my.toml"), "node_nm = 45\n[constant.link_byte]\npj = -20.0\n").unwrap();
    let refused = sensel(&["power", path, "--estimate"]);
    assert!(
        refused.stderr.contains("my.toml:3") && refused.stderr.contains("constant.link_byte.pj"),
        "{}",
        refused.stderr
    );
    assert!(refused.stderr.contains("use 0 to"), "{}", refused.stderr);
}

#[test]
fn a_faster_lane_is_shorter_in_high_speed_mode_and_its_clock_costs_more() {
    let of = |hz: &str| account(&[&format!("link.frequency_hz={hz}")]);
    let (slow, fast) = (of("240000000"), of("480000000"));
    let clock_mw = 1e-9 * Technology::by_name("65nm").unwrap().value(Constant::LaneClock) * 240e6;
    // The clock lane runs all the time at twice the clock; the data lane's clocks a byte stay, those of the ways in and out grow.
    let more_pj = item_pj(&fast, "lane_clock") - item_pj(&slow, "lane_clock");
    assert!(more_pj > 1e9 * clock_mw * slow.run_time_s(), "{more_pj}");
    assert!(fast.item_aj("hs_lane") < slow.item_aj("hs_lane"));
    assert_eq!(fast.item_aj("link_byte"), slow.item_aj("link_byte"));
}
