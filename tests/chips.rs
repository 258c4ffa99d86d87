//! Published sensors against the model of power: the page of docs/energy.md and the constants of 65nm.toml are what the fit gives, and the
//! files of chips hold public facts and one rule.

// A test fails by panicking; not every item of the study is used here.
#![allow(clippy::unwrap_used, dead_code)]

#[path = "../examples/energy_fit/chips.rs"]
#[allow(clippy::module_inception, reason = "the example that shares these files has this name")]
mod chips;
#[path = "../examples/energy_fit/fit.rs"]
mod fit;
#[path = "../examples/energy_fit/judge.rs"]
mod judge;
#[path = "../examples/energy_fit/page.rs"]
mod page;
#[path = "../examples/energy_fit/slopes.rs"]
mod slopes;

use std::path::Path;
use std::sync::LazyLock;

use sensel::config::Resolved;
use sensel::energy::{DISCREPANCY, Technology};
use sensel::num::{f64_from_u64, u64_half_even};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

static OUTCOME: LazyLock<judge::Outcome> = LazyLock::new(|| judge::judge(root()));

#[test]
fn the_page_and_the_constants_are_what_the_fit_gives() {
    let page = std::fs::read_to_string(root().join("docs/energy.md")).unwrap();
    for (name, table) in page::tables(root(), &OUTCOME) {
        let remedy = "cargo run --release --example energy_fit -- --write";
        assert!(page::with_table(&page, name, &table) == page, "the table '{name}' is stale: {remedy}\n{table}");
    }
    let (base, fitted) = (Technology::by_name("65nm").unwrap(), fit::moved(&fit::at_priors(), &OUTCOME.parameters));
    for &constant in fit::GROUPS.iter().flat_map(|group| group.constants) {
        let ratio = base.value(constant) / fitted.value(constant);
        // The file holds three significant digits: half a unit of the last is 0.5 % at most.
        assert!(
            (ratio - 1.0).abs() < 0.006,
            "{} is {} in the file and {} in the fit",
            constant.name(),
            base.value(constant),
            fitted.value(constant)
        );
    }
}

/// Of all chips, those without a public source among them: the wider of the two, because a stranger's chip is no better known.
#[test]
fn the_model_s_discrepancy_is_that_of_vendors_that_the_fit_has_not_seen() {
    let measured = OUTCOME.rms_of_all();
    assert!((DISCREPANCY - measured).abs() < 0.03, "stated {DISCREPANCY}, measured {measured}");
}

/// The bars: a median under 30 %, nine of ten within two times and nine of ten in their ranges, for vendors that the fit has not seen.
#[test]
fn published_chips_are_met_by_a_model_that_has_not_seen_their_vendor() {
    let all = OUTCOME.score(true, |chip| chip.all_mw);
    let unseen = OUTCOME.score(true, |chip| chip.unseen_mw);
    let held = OUTCOME.held(true);
    println!(
        "all {:.3} {}, unseen {:.3} {}, held {held} of {}",
        all.median_error, all.within_two, unseen.median_error, unseen.within_two, unseen.number
    );
    assert!(unseen.number >= 15, "{} chips with a public source", unseen.number);
    for score in [&all, &unseen] {
        assert!(score.median_error < 0.30, "{}", score.median_error);
        assert!(10 * score.within_two >= 9 * score.number, "{} of {}", score.within_two, score.number);
    }
    assert!(10 * held >= 9 * unseen.number, "{held} of {}", unseen.number);
}

/// The bar of ratios: within a quarter, by the constants that stand. Those that miss it have a reason, which the page prints; no reason
/// outlives its miss.
#[test]
fn published_slopes_are_met_within_a_quarter_or_say_why_not() {
    assert!(OUTCOME.slopes.len() >= 14, "{} ratios", OUTCOME.slopes.len());
    let is_near = |ratio: f64, slope: &slopes::Slope| (0.75..=1.25).contains(&(ratio / slope.ratio()));
    for judge::JudgedSlope { slope, all, .. } in &OUTCOME.slopes {
        assert_eq!(is_near(*all, slope), slope.reason.is_none(), "{}: {all}, published {}", slope.what, slope.ratio());
    }
    let near = |of: fn(&judge::JudgedSlope) -> f64| {
        OUTCOME.slopes.iter().filter(|slope| is_near(of(slope), slope.slope)).count()
    };
    let (all, unseen) = (near(|slope| slope.all), near(|slope| slope.unseen));
    println!("{all} and, of vendors unseen, {unseen} of {} ratios within a quarter", OUTCOME.slopes.len());
    assert!(4 * all >= 3 * OUTCOME.slopes.len() && 4 * unseen >= 3 * OUTCOME.slopes.len(), "{all}, {unseen}");
}

/// The values marked "rule" in the files, from the public ones.
#[test]
fn what_is_not_public_of_a_chip_follows_one_rule() {
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join("scenes/chips")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let name = path.display();
        assert!(text.contains("Published: ") && text.contains(" mW at "), "{name} has no published figure");
        let resolved = Resolved::from_layers("chip", &text, &[]).unwrap();
        let sensor = &resolved.scenario.sensor;
        let (adc, readout) = (&sensor.adc, &sensor.readout);
        let exposures = if readout.hdr == "multi_exposure" { readout.hdr_exposures } else { 1 };
        assert_eq!(readout.hts, 16 * (sensor.width * 11).div_ceil(160), "{name}");
        assert_eq!(readout.vts, Some(exposures * sensor.height + sensor.height / 20 + 8), "{name}");
        assert_eq!(adc.reset_counts, ((1 << adc.bits) / 8).max(1), "{name}");
        let line_s = f64::from(readout.hts) / f64_from_u64(readout.pixel_rate_hz);
        let least_hz = (f64::from(1_u32 << adc.bits) + f64::from(adc.reset_counts)) / (0.6 * line_s);
        let above_hz = f64_from_u64(adc.clock_hz) - least_hz;
        // Rounded up to a kilohertz, and a millionth for the decimal's rounding.
        assert!((-1.0..=1001.0).contains(&above_hz), "{name}: {above_hz}");
        for (settle_us, share) in [(adc.settle_reset_us, 0.1), (adc.settle_signal_us, 0.2)] {
            let below_us = share * line_s * 1e6 - settle_us;
            assert!((-1e-9..0.001_001).contains(&below_us), "{name}: {below_us}");
        }
        // Whole frames a second, or the published rate of the comment.
        let fps: f64 = text.split(" mW at ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let rate = fps * f64::from(readout.hts) * f64::from(readout.vts.unwrap());
        assert_eq!(readout.pixel_rate_hz, u64_half_even(rate), "{name}");
        let link = &resolved.scenario.link;
        assert!(link.mode == "frames" && (resolved.scenario.energy.port == "dphy" || link.lanes == 4), "{name}");
        assert_eq!(resolved.scenario.energy.technology, "auto", "{name}");
        assert!(resolved.scenario.energy.constant.is_empty(), "{name}");
        seen += 1;
    }
    assert!(seen > 35, "{seen} files were read");
    for chip in chips::CHIPS {
        let text = std::fs::read_to_string(root().join(format!("scenes/chips/{}.toml", chip.file))).unwrap();
        let figure: f64 = text.split("Published: ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert_eq!(figure, chip.published_mw, "{}", chip.file);
    }
}
