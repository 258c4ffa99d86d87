//! Specifications on the command line, judged for each point over its replicates.

use std::collections::BTreeMap;

use sensel::error::Error;
use sensel::num::u64_from;
use sensel::sweep::report::PointVerdict;
use sensel::sweep::specification::Specification;
use sensel::sweep::{CellRecord, Cells};

use crate::cli::args::Shared;

/// Reads all `--spec` texts.
pub fn parse(texts: &[String]) -> Result<Vec<Specification>, Error> {
    texts.iter().map(|text| Specification::parse(text)).collect()
}

/// What the finished cells say of each point and specification. A failed cell does not keep its limit.
pub fn judged(
    specifications: &[Specification],
    cells: &Cells,
    records: &BTreeMap<String, CellRecord>,
) -> Result<Vec<PointVerdict>, Error> {
    let mut all = Vec::new();
    let Some(whole) = records.values().find(|record| record.error.is_none()) else { return Ok(all) };
    for specification in specifications {
        let figure = specification.figure_in(whole)?;
        let mut points: BTreeMap<usize, (u64, u64, String)> = BTreeMap::new();
        for cell in &cells.cells {
            let Some(record) = records.get(&cell.name) else { continue };
            let value = record.figures.get(&figure).copied().flatten();
            let is_met = value.is_some_and(|value| specification.is_met(value));
            let name = || {
                let shown = cells.factors.iter().zip(&cell.shown);
                let parts = shown.map(|(name, value)| format!("{name} = {}", sensel::sweep::cells::shown(value)));
                parts.collect::<Vec<_>>().join(", ")
            };
            let entry = points.entry(cell.point).or_insert_with(|| (0, 0, name()));
            entry.0 += u64::from(is_met);
            entry.1 += 1;
        }
        for (point, (met, runs, name)) in points {
            let judgement = specification.judge(met, runs);
            all.push(PointVerdict { point, name, specification: specification.text.clone(), judgement });
        }
    }
    debug_assert!(u64_from(all.len()) >= u64_from(specifications.len()) || records.is_empty());
    Ok(all)
}

/// Prints the verdicts.
pub fn say(verdicts: &[PointVerdict], shared: &Shared) {
    for verdict in verdicts {
        let judgement = &verdict.judgement;
        if shared.json {
            let value = serde_json::json!({
                "spec": verdict.specification,
                "point": verdict.name,
                "verdict": judgement.verdict.name(),
                "sequential": judgement.sequential.name(),
                "met": judgement.met,
                "runs": judgement.runs,
                "interval": judgement.interval,
                "further_if_met_and_if_missed": judgement.further,
            });
            outln!("{value}");
        } else if !shared.quiet {
            outln!("{} [{}] {}", verdict.specification, verdict.name, judgement.in_words());
        }
    }
}
