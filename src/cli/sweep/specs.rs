//! Specifications on the command line, judged for each point over its replicates.

use std::collections::BTreeMap;

use sensel::error::Error;
use sensel::report::Report;
use sensel::sweep::record::CellCost;
use sensel::sweep::report::PointVerdict;
use sensel::sweep::signal::SignalSum;
use sensel::sweep::specification::Specification;
use sensel::sweep::{CellRecord, Cells};

/// Figures whose names depend on the run: they are looked for in a finished cell alone.
const OF_A_RUN: [&str; 4] = ["cameras_alone.", "energy.blocks.", "energy.rails.", "timing.extractor."];

/// Reads all `--spec` texts. A figure that no report has is refused before anything runs.
pub fn parse(texts: &[String]) -> Result<Vec<Specification>, Error> {
    let any = CellRecord::of_report("", &Report::default(), &SignalSum::default(), CellCost::default());
    let checked = |text: &String| {
        let specification = Specification::parse(text)?;
        if !OF_A_RUN.iter().any(|start| specification.figure.starts_with(start)) {
            specification.figure_in(&any)?;
        }
        Ok(specification)
    };
    texts.iter().map(checked).collect()
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
            let entry = points.entry(cell.point).or_insert_with(|| (0, 0, cell.levels(&cells.factors).join(", ")));
            entry.0 += u64::from(is_met);
            entry.1 += 1;
        }
        for (point, (met, runs, name)) in points {
            let judgement = specification.judge(met, runs);
            all.push(PointVerdict { point, name, specification: specification.text.clone(), judgement });
        }
    }
    Ok(all)
}

pub fn as_json(verdicts: &[PointVerdict]) -> Vec<serde_json::Value> {
    let one = |verdict: &PointVerdict| {
        let judgement = &verdict.judgement;
        serde_json::json!({
            "spec": verdict.specification, "point": verdict.name,
            "verdict": judgement.verdict.name(), "sequential": judgement.sequential.name(),
            "met": judgement.met, "runs": judgement.runs, "interval": judgement.interval,
            "further_if_met_and_if_missed": judgement.further,
        })
    };
    verdicts.iter().map(one).collect()
}

pub fn say(verdicts: &[PointVerdict]) {
    for verdict in verdicts {
        outln!("{} [{}] {}", verdict.specification, verdict.name, verdict.judgement.in_words());
    }
}
