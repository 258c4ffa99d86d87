//! A small part of the study of docs/compare.md: intervals of `compare` hold the mean of many seeds, and a run beside itself shows no
//! difference.

use sensel::report::compare::{Verdict, compare};

#[path = "../examples/compare_coverage/designs.rs"]
mod designs;
#[path = "../examples/compare_coverage/runs.rs"]
mod runs;

const PAIRS: usize = 2;
const SEEDS: usize = 12;

#[test]
fn intervals_of_a_single_seed_hold_the_mean_of_all_seeds() {
    let designs = designs::random(PAIRS + 1);
    let all = runs::all(&designs, SEEDS).unwrap();
    let coverage = runs::coverage(&designs, &all).unwrap();
    let (held, intervals) = coverage.values().fold((0, 0), |sum, of| (sum.0 + of.held, sum.1 + of.intervals));
    println!("draw {}: {held} of {intervals}", designs::DRAW);
    assert!(coverage.len() >= 6, "{:?}", coverage.keys());
    // 24 runs at 95 %, figures of one run dependent: a standard error of 4.4 %, and four of them.
    assert!(100 * held >= 77 * intervals, "draw {}: {held} of {intervals}", designs::DRAW);

    let itself = compare(&[all[0][0].clone(), all[0][0].clone()]).unwrap();
    for figure in &itself.others[0].figures {
        let words = figure.verdict.words();
        assert!(matches!(figure.verdict, Verdict::NoDifference | Verdict::NotMeasured), "{}: {words}", figure.key);
    }
}
