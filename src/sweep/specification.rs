//! Specifications: a figure, a limit, and the share of runs that must keep it, as in `ate_m < 0.010 for 99 %`.

use super::record::{CellRecord, find_figure};
use crate::error::Error;
use crate::num::f64_from_u64;
use crate::statistics::{CONFIDENCE, SequentialTest, SequentialVerdict, binomial_interval};

/// Probability of a wrong verdict of the sequential test, on either side.
pub const SEQUENTIAL_ERROR: f64 = 0.05;

/// Share of the runs that may miss, over the share at which a design must not fail: with "for 99 %" a design that meets the limit in
/// 99.75 % of the runs fails with a probability of at most `SEQUENTIAL_ERROR`.
const GOOD_RATIO: f64 = 4.0;

/// Most further runs that are looked for.
const RUNS_MAX: u64 = 1_000_000;

/// How a figure stands to its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Below,
    AtMost,
    Above,
    AtLeast,
}

/// A specification.
#[derive(Clone, Debug, PartialEq)]
pub struct Specification {
    /// As it was written.
    pub text: String,
    /// Name of the figure, or its last part.
    pub figure: String,
    relation: Relation,
    limit: f64,
    /// Share of the runs that must keep the limit.
    pub share: f64,
}

/// What the runs so far say of a specification.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecificationJudgement {
    /// Runs that keep the limit.
    pub met: u64,
    /// All finished runs; one whose figure could not be measured does not keep it.
    pub runs: u64,
    /// Exact 95 % interval of the share.
    pub interval: [f64; 2],
    /// By the interval.
    pub verdict: SequentialVerdict,
    /// By the sequential test, which may be asked after every run.
    pub sequential: SequentialVerdict,
    /// Further runs that would decide an open case if all of them keep the limit, and if all of them miss it.
    pub further: Option<[u64; 2]>,
}

impl Specification {
    /// Reads `FIGURE < LIMIT for SHARE %`, with <, <=, > or >=. Fails on another form.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let refused =
            |reason: &str| Error::key("--spec", text, format!("{reason}; write --spec \"ate_m < 0.010 for 99 %\""));
        let (rule, share) = text.split_once(" for ").ok_or_else(|| refused("the share of runs is missing"))?;
        let percent = share.trim().strip_suffix('%').ok_or_else(|| refused("the share has no %"))?;
        let percent: f64 = percent.trim().parse().map_err(|_| refused("the share is no number"))?;
        if !(percent > 0.0 && percent < 100.0) {
            return Err(refused("the share must be above 0 and below 100 %"));
        }
        let share = percent / 100.0;
        let signs =
            [("<=", Relation::AtMost), (">=", Relation::AtLeast), ("<", Relation::Below), (">", Relation::Above)];
        let found = signs.into_iter().find_map(|(sign, relation)| Some((rule.split_once(sign)?, relation)));
        let ((figure, limit), relation) = found.ok_or_else(|| refused("there is no <, <=, > or >="))?;
        let limit: f64 = limit.trim().parse().map_err(|_| refused("the limit is no number"))?;
        let figure = figure.trim();
        if figure.is_empty() || !limit.is_finite() {
            return Err(refused("a figure and a finite limit are needed"));
        }
        Ok(Self { text: text.trim().to_owned(), figure: figure.to_owned(), relation, limit, share })
    }

    /// The full name of its figure among those of a record. Fails on no or several figures of this name.
    pub fn figure_in(&self, record: &CellRecord) -> Result<String, Error> {
        find_figure(&self.figure, record.figures.keys()).cloned().map_err(|near| Error::Unknown {
            what: "figure of --spec",
            name: self.figure.clone(),
            known: near.join(", "),
        })
    }

    /// Whether a value keeps the limit.
    pub fn is_met(&self, value: f64) -> bool {
        match self.relation {
            Relation::Below => value < self.limit,
            Relation::AtMost => value <= self.limit,
            Relation::Above => value > self.limit,
            Relation::AtLeast => value >= self.limit,
        }
    }

    /// The sequential test of its share.
    pub fn sequential_test(&self) -> SequentialTest {
        SequentialTest {
            poor: self.share,
            good: 1.0 - (1.0 - self.share) / GOOD_RATIO,
            pass_error: SEQUENTIAL_ERROR,
            fail_error: SEQUENTIAL_ERROR,
        }
    }

    /// What the given runs say.
    pub fn judge(&self, met: u64, runs: u64) -> SpecificationJudgement {
        let verdict = self.verdict(met, runs);
        let further = (verdict == SequentialVerdict::Open).then(|| {
            let keep = |more: u64| self.verdict(met + more, runs + more) == SequentialVerdict::Pass;
            let miss = |more: u64| self.verdict(met, runs + more) == SequentialVerdict::Fail;
            [least(keep), least(miss)]
        });
        SpecificationJudgement {
            met,
            runs,
            interval: binomial_interval(met, runs, CONFIDENCE),
            verdict,
            sequential: self.sequential_test().verdict(met, runs),
            further,
        }
    }

    fn verdict(&self, met: u64, runs: u64) -> SequentialVerdict {
        let [low, high] = binomial_interval(met, runs, CONFIDENCE);
        if low >= self.share {
            SequentialVerdict::Pass
        } else if high < self.share {
            SequentialVerdict::Fail
        } else {
            SequentialVerdict::Open
        }
    }
}

/// Least number from 1 on for which a rule holds that, once it holds, goes on holding.
fn least(holds: impl Fn(u64) -> bool) -> u64 {
    let mut high = 1;
    while high < RUNS_MAX && !holds(high) {
        high *= 2;
    }
    let mut low = high / 2;
    while high - low > 1 {
        let middle = u64::midpoint(low, high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

impl SpecificationJudgement {
    /// In one sentence.
    pub fn in_words(&self) -> String {
        let [low, high] = self.interval.map(|end| 100.0 * end);
        let percent = 100.0 * f64_from_u64(self.met) / f64_from_u64(self.runs.max(1));
        let further = self.further.map_or_else(String::new, |[keep, miss]| {
            format!("; {keep} further runs decide if all keep the limit, {miss} if all miss it")
        });
        format!(
            "{}: {} of {} runs ({percent:.2} %, 95 % interval {low:.2} to {high:.2} %){further}; \
             sequential test against a quarter of the misses: {}",
            self.verdict.name(),
            self.met,
            self.runs,
            self.sequential.name()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_read_and_what_is_none_is_refused() {
        let spec = Specification::parse("ate_m < 0.010 for 99 %").unwrap();
        assert_eq!((spec.figure.as_str(), spec.limit, spec.share), ("ate_m", 0.010, 0.99));
        assert!(spec.is_met(0.009) && !spec.is_met(0.010));
        let most = Specification::parse("power_mw<=12 for 95%").unwrap();
        assert!(most.is_met(12.0) && !most.is_met(12.1));
        let least = Specification::parse("tracked_fraction >= 0.9 for 90 %").unwrap();
        assert!(least.is_met(0.9) && !least.is_met(0.89));
        let mut refused = 0;
        for text in [
            "",
            "ate_m",
            "ate_m < 0.01",
            "ate_m < x for 9 %",
            "ate_m < 1 for 100 %",
            "< 1 for 9 %",
            "a = 1 for 9 %",
            "a < 1 for 9",
        ] {
            let error = Specification::parse(text).unwrap_err().to_string();
            assert!(error.contains("ate_m < 0.010 for 99 %"), "{error}");
            refused += 1;
        }
        assert_eq!(refused, 8);
    }

    #[test]
    fn an_open_case_names_the_least_number_of_runs_that_decides_it() {
        let spec = Specification::parse("ate_m < 0.010 for 90 %").unwrap();
        let open = spec.judge(20, 20);
        assert_eq!(open.verdict, SequentialVerdict::Open);
        let [keep, miss] = open.further.unwrap();
        // 0.025^(1/n) >= 0.9 first at n = 36: 16 more than 20.
        assert_eq!(keep, 16);
        assert_eq!(spec.judge(20 + keep, 20 + keep).verdict, SequentialVerdict::Pass);
        assert_eq!(spec.judge(20 + keep - 1, 20 + keep - 1).verdict, SequentialVerdict::Open);
        assert_eq!(spec.judge(20, 20 + miss).verdict, SequentialVerdict::Fail);
        assert_eq!(spec.judge(20, 20 + miss - 1).verdict, SequentialVerdict::Open);
        assert!(open.in_words().contains("16 further runs"), "{}", open.in_words());
        assert_eq!(spec.judge(2, 20).verdict, SequentialVerdict::Fail);
        assert!(spec.judge(200, 200).further.is_none());
    }
}
