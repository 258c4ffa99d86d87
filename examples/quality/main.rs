//! How well features are found and matched again, and what each bit of the extractor costs.
//!
//!     SENSEL_JUDGE_PYTHON=path/to/python cargo run --release --example quality -- [--pictures DIR] [--out DIR] [--brief]
//!
//! Pictures (PNG) are warped, blurred, made noisy and cut to fewer bits; features of the first picture are looked for in the second, for
//! our extractor at several word lengths, for the same method in floating point, and for OpenCV's ORB at one level where
//! SENSEL_JUDGE_PYTHON names a Python with OpenCV. Without --pictures they are scikit-image's, which that Python writes. Writes quality.json
//! and quality.svg, and prints the tables of docs/quality.md.

#![allow(missing_docs)]

mod cost;
mod orb;
mod pictures;
mod reference;
mod score;
mod settings;
mod views;

use std::path::{Path, PathBuf};

use score::{Features, Score, score};
use settings::{Method, SETTINGS};
use views::{VIEWS, View};

/// Nearest place of a feature that counts, to either picture's edge: ORB's patch reaches 31 pixels.
pub const MARGIN_PX: f64 = 32.0;

/// Scores of one view, one of `SETTINGS` a column, with ORB's behind them.
struct Row {
    view: &'static str,
    group: &'static str,
    scores: Vec<Option<Score>>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|word| word == name).map(|at| arguments[at + 1].clone());
    let out = PathBuf::from(value("--out").unwrap_or_else(|| "target/quality".to_owned()));
    std::fs::create_dir_all(&out).expect("the output folder can be made");
    let python = std::env::var("SENSEL_JUDGE_PYTHON").ok();
    let folder = match (value("--pictures"), &python) {
        (Some(folder), _) => PathBuf::from(folder),
        (None, Some(python)) => orb::pictures(python, &out),
        (None, None) => panic!("--pictures DIR, or SENSEL_JUDGE_PYTHON with scikit-image, would do"),
    };
    let pictures = pictures::read(&folder);
    assert!(!pictures.is_empty(), "{} holds no PNG picture", folder.display());
    let brief = arguments.iter().any(|word| word == "--brief");
    let rows = study(&pictures, python.as_deref(), brief, &out);
    report(&rows, &out, pictures.len());
}

/// Scores of all views, the mean over pictures.
fn study(pictures: &[pictures::Picture], python: Option<&str>, brief: bool, out: &Path) -> Vec<Row> {
    let settings = if brief { &SETTINGS[..2] } else { SETTINGS };
    let mut sums: Vec<Vec<Vec<Score>>> = vec![vec![Vec::new(); settings.len() + 1]; VIEWS.len()];
    for picture in pictures {
        let first = views::codes(picture, &View::SAME);
        let seconds: Vec<_> = VIEWS.iter().map(|view| views::codes(picture, view)).collect();
        for (column, setting) in settings.iter().enumerate() {
            let before = setting.method.features(&first);
            for (row, view) in VIEWS.iter().enumerate() {
                let after = setting.method.features(&seconds[row]);
                sums[row][column].push(score(&before, &after, view, first.size()));
            }
        }
        if let Some(python) = python {
            // As many features as ours has beyond the margin.
            let wanted = |codes: &views::Codes| score::inside(&Method::USUAL.features(codes), codes.size());
            let counts: Vec<usize> = std::iter::once(&first).chain(&seconds).map(wanted).collect();
            let all: Vec<Features> = orb::features(python, out, std::iter::once(&first).chain(&seconds), &counts);
            for (row, view) in VIEWS.iter().enumerate() {
                sums[row][settings.len()].push(score(&all[0], &all[row + 1], view, first.size()));
            }
        }
        eprintln!("{} done", picture.name);
    }
    let mean = |scores: &Vec<Score>| Score::mean(scores);
    VIEWS
        .iter()
        .zip(sums)
        .map(|(view, sums)| Row { view: view.name, group: view.group, scores: sums.iter().map(mean).collect() })
        .collect()
}

fn report(rows: &[Row], out: &Path, pictures: usize) {
    let columns = rows[0].scores.len();
    let name = |column: usize| if column + 1 == columns { "OpenCV ORB, one level" } else { SETTINGS[column].name };
    let mut groups: Vec<&str> = Vec::new();
    for row in rows {
        if !groups.contains(&row.group) {
            groups.push(row.group);
        }
    }
    let of_group = |group: Option<&str>, column: usize| {
        let scores: Vec<Score> = rows
            .iter()
            .filter(|row| group.is_none_or(|group| row.group == group))
            .filter_map(|row| row.scores[column])
            .collect();
        Score::mean(&scores)
    };
    println!("{pictures} pictures, {} views; repeatability / matching score in %\n", rows.len());
    println!("| extractor | features | all | {} |", groups.join(" | "));
    println!("|---|---|---|{}", "---|".repeat(groups.len()));
    let mut json = Vec::new();
    for column in 0..columns {
        let Some(all) = of_group(None, column) else { continue };
        let cells: Vec<String> = groups
            .iter()
            .map(|group| of_group(Some(group), column).map_or("-".to_owned(), |score| score.text()))
            .collect();
        println!("| {} | {:.0} | {} | {} |", name(column), all.features, all.text(), cells.join(" | "));
        let views: Vec<_> = rows
            .iter()
            .filter_map(|row| {
                let score = row.scores[column]?;
                Some(serde_json::json!({"view": row.view, "group": row.group, "repeatability": score.repeatability,
                    "matching": score.matching}))
            })
            .collect();
        json.push(
            serde_json::json!({"name": name(column), "features": all.features, "repeatability": all.repeatability,
            "matching": all.matching, "views": views}),
        );
    }
    let costs: Vec<_> = SETTINGS[..columns - 1].iter().filter_map(cost::of).collect();
    cost::print(&costs);
    let all = serde_json::json!({"pictures": pictures, "extractors": json, "costs": costs.iter().map(cost::Cost::json).collect::<Vec<_>>()});
    let text = serde_json::to_string_pretty(&all).expect("a JSON value has a text");
    std::fs::write(out.join("quality.json"), text).expect("the output folder takes files");
    let points: Vec<_> = (0..columns - 1)
        .filter_map(|column| Some((SETTINGS[column].name, of_group(None, column)?, cost::of(&SETTINGS[column])?)))
        .collect();
    cost::draw(&points, of_group(None, columns - 1), &out.join("quality.svg"));
}
