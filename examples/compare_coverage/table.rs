//! The table of docs/compare.md.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sensel::num::f64_from_usize;

use super::runs::Coverage;

const TEXT: &str = "writing to a string cannot fail";
const OPEN: [&str; 2] = ["<!-- coverage -->\n", "<!-- coverage of replicates -->\n"];
const CLOSE: [&str; 2] = ["<!-- end of coverage -->", "<!-- end of coverage of replicates -->"];

/// Coverage by figure and of all figures together.
pub fn table(
    all: &BTreeMap<String, Coverage>,
    (pairs, seeds): (usize, usize),
    (draw, replicates): (u64, usize),
) -> String {
    let runs = if replicates > 1 { format!(" in groups of {replicates}") } else { String::new() };
    let mut text = format!(
        "{pairs} random pairs, {seeds} seeds{runs}, designs of draw {draw}.\n\n\
         | figure | pairs | held the mean of all seeds | least and greatest pair | A against A: no difference |\n|---|---|---|---|---|\n"
    );
    let percent = |part: usize, of: usize| 100.0 * f64_from_usize(part) / f64_from_usize(of.max(1));
    let mut row = |name: &str, of: &Coverage| {
        writeln!(
            text,
            "| {name} | {} | {:.1} % | {:.0} to {:.0} % | {:.1} % |",
            of.pairs,
            percent(of.held, of.intervals),
            100.0 * of.range[0],
            100.0 * of.range[1],
            percent(of.no_difference, of.same)
        )
        .expect(TEXT);
    };
    let mut sum = Coverage { range: [1.0, 0.0], ..Coverage::default() };
    for (key, of) in all {
        row(key, of);
        sum = Coverage {
            pairs: sum.pairs.max(of.pairs),
            intervals: sum.intervals + of.intervals,
            held: sum.held + of.held,
            range: [sum.range[0].min(of.range[0]), sum.range[1].max(of.range[1])],
            same: sum.same + of.same,
            no_difference: sum.no_difference + of.no_difference,
        };
    }
    row("all together", &sum);
    text
}

/// The page with the table between its marks.
pub fn with_table(page: &str, table: &str, of_replicates: bool) -> String {
    let (open, close) = (OPEN[usize::from(of_replicates)], CLOSE[usize::from(of_replicates)]);
    let (before, rest) = page.split_once(open).expect("the page has the table's opening mark");
    let (_, after) = rest.split_once(close).expect("the page has the table's closing mark");
    format!("{before}{open}{table}{close}{after}")
}
