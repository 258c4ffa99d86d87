//! The generated tables of docs/energy.md.

use std::fmt::Write as _;
use std::path::Path;

use sensel::energy::Constant;
use sensel::run::ESTIMATED_LEVEL;

use super::judge::{JudgedSlope, Outcome, blanked, sensor};

const TEXT: &str = "writing to a string cannot fail";

/// Tables by the name of their marks.
pub fn tables(root: &Path, outcome: &Outcome) -> Vec<(&'static str, String)> {
    vec![("chips", chips(outcome)), ("slopes", slopes(outcome)), ("trends", trends(root)), ("link", link(root))]
}

/// A page's text with the table between its marks replaced.
pub fn with_table(text: &str, name: &str, table: &str) -> String {
    let (from, to) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->"));
    let (before, rest) = text.split_once(&from).unwrap_or_else(|| panic!("the page has no mark {from}"));
    let (_, after) = rest.split_once(&to).unwrap_or_else(|| panic!("the page has no mark {to}"));
    format!("{before}{from}{table}{to}{after}")
}

/// A technology file's text with the value of a constant replaced, to three digits.
pub fn with_value(text: &str, constant: Constant, value: f64) -> String {
    let head = format!("[constant.{}]\n{} = ", constant.name(), constant.unit().name());
    let (before, rest) = text.split_once(&head).unwrap_or_else(|| panic!("the file has no {head}"));
    let (_, after) = rest.split_once('\n').expect("a line ends");
    format!("{before}{head}{}\n{after}", three_digits(value))
}

/// A number to three significant digits, as TOML wants a float.
pub fn three_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().expect("a number");
    format!("{rounded:?}")
}

fn chips(outcome: &Outcome) -> String {
    let mut table = String::from(
        "| chip | vendor | published, mW | evidence | fitted to all, mW | vendor unseen, mW | over published | 95 % range, mW |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for chip in &outcome.chips {
        let (facts, ratio) = (&chip.prepared.chip, chip.unseen_mw / chip.prepared.chip.published_mw);
        let [low, high] = chip.range_mw.map(three_digits);
        writeln!(
            table,
            "| {} | {} | {} | {} | {} | {} | {ratio:.2} | {low} to {high} |",
            facts.name,
            facts.vendor,
            facts.published_mw,
            facts.evidence.name(),
            three_digits(chip.all_mw),
            three_digits(chip.unseen_mw)
        )
        .expect(TEXT);
    }
    writeln!(
        table,
        "\n| | median error | within 2 times | rms of the logarithm | in the 95 % range |\n|---|---|---|---|---|"
    )
    .expect(TEXT);
    let all = outcome.score(true, |chip| chip.all_mw);
    let unseen = outcome.score(true, |chip| chip.unseen_mw);
    let unsourced = outcome.score(false, |chip| chip.unseen_mw);
    for (name, score, held) in [
        ("fitted to all", all, None),
        ("vendor unseen", unseen, Some(outcome.held(true))),
        ("vendor unseen, figures from memory", unsourced, Some(outcome.held(false))),
    ] {
        let (median, rms, number) = (100.0 * score.median_error, score.rms_log, score.number);
        let held = held.map_or_else(String::new, |held| format!("{held} of {number}"));
        writeln!(table, "| {name} | {median:.0} % | {} of {number} | {rms:.2} | {held} |", score.within_two)
            .expect(TEXT);
    }
    writeln!(table, "| vendor unseen, all | | | {:.2} | |", outcome.rms_of_all()).expect(TEXT);
    table
}

/// Power in mW and pJ per pixel of a chip's scenario with some keys changed, by the constants of the program.
fn power(root: &Path, file: &str, set: &[&str]) -> (f64, f64) {
    let set: Vec<String> = set.iter().map(|one| (*one).to_owned()).collect();
    let account = sensor(root, file, &set).estimated_energy(ESTIMATED_LEVEL).unwrap_or_else(|error| panic!("{error}"));
    (account.power_mw(), account.pj_per_pixel())
}

fn slopes(outcome: &Outcome) -> String {
    let mut table = String::from(
        "| slope | published | fitted to all | vendor unseen | unseen over published | source |\n|---|---|---|---|---|---|\n",
    );
    for JudgedSlope { slope, all, unseen } in &outcome.slopes {
        let (what, source, published) = (slope.what, slope.source, slope.ratio());
        let over = unseen / published;
        writeln!(table, "| {what} | {published:.2} | {all:.2} | {unseen:.2} | {over:.2} | {source} |").expect(TEXT);
    }
    for slope in outcome.slopes.iter().map(|judged| judged.slope) {
        if let Some(reason) = slope.reason {
            writeln!(table, "\n{}: {reason}.", slope.what).expect(TEXT);
        }
    }
    table
}

fn trends(root: &Path) -> String {
    let mut table = String::from("| OV7251 | expected | model |\n|---|---|---|\n");
    let mut row = |what: &str, expected: &str, model: String| {
        writeln!(table, "| {what} | {expected} | {model} |").expect(TEXT);
    };
    for fps in [100.0, 30.0, 3.0] {
        let pixel = power(root, "ov7251", &[&blanked(root, "ov7251", fps)]).1;
        row(
            &format!("{fps} fps"),
            "grows as 1 / fps (LiKamWa et al. 2013)",
            format!("{pixel:.0} pJ per pixel and frame"),
        );
    }
    for width in [640, 320, 160, 80] {
        let window = format!("sensor.readout.window=[0, 0, {width}, 480]");
        let (mw, pixel) = power(root, "ov7251", &[&window]);
        row(
            &format!("a width of {width}"),
            "pJ per pixel grows as the picture shrinks (LiKamWa et al. 2013)",
            format!("{mw:.1} mW, {pixel:.0} pJ per pixel"),
        );
    }
    for bits in [12, 10, 8] {
        let clock = format!("sensor.adc.clock_hz={}", 98_304_000_u64 * (1 << bits) / 1024);
        let set = [&format!("sensor.adc.bits={bits}"), &format!("sensor.adc.reset_counts={}", (1 << bits) / 8), &clock];
        let (mw, _) = power(root, "ov7251", &set.map(String::as_str));
        row(&format!("{bits} bits in the same line time"), "single slope: 2^bits", format!("{mw:.1} mW"));
    }
    table
}

fn link(root: &Path) -> String {
    let mut table = String::from(
        "| codes | container | Mbit/s of codes | Mbit/s in containers | link, mW | of which flows while idle, mW |\n\
         |---|---|---|---|---|---|\n",
    );
    for (bits, container) in [(10, "RAW10"), (8, "RAW8"), (6, "RAW6"), (4, "RAW6"), (2, "RAW6")] {
        let clock = format!("sensor.adc.clock_hz={}", 98_304_000_u64 * (1 << bits) / 1024);
        let set =
            [format!("sensor.adc.bits={bits}"), format!("sensor.adc.reset_counts={}", (1_u32 << bits) / 8), clock];
        let sensor = sensor(root, "ov7251", &set);
        let split = sensor.link_split(500).unwrap_or_else(|error| panic!("{error}"));
        let raw = split.raw.expect("the preset's link carries its rows");
        writeln!(
            table,
            "| {bits} bit | {container} | {:.1} | {:.1} | {:.2} | {:.2} |",
            1e-6 * raw.net_bits_per_s,
            1e-6 * raw.bits_per_s,
            raw.mw,
            split.floor_mw
        )
        .expect(TEXT);
        if bits == 2 {
            writeln!(
                table,
                "| 500 features | feature packets | | {:.1} | {:.2} | {:.2} |",
                1e-6 * split.feature_bits_per_s,
                split.feature_mw,
                split.floor_mw
            )
            .expect(TEXT);
        }
    }
    table
}
