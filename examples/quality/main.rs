//! How well features are found and matched again, and what each bit of the extractor costs.
//!
//!     SENSEL_JUDGE_PYTHON=path/to/python cargo run --release --example quality -- [--pictures DIR | --judge] [--out DIR] [--brief]
//!
//! Pictures (PNG) are warped, blurred, made noisy and cut to fewer bits; features of the first picture are looked for in the second, for
//! our extractor at several word lengths, for the same method in floating point, and for OpenCV's ORB at one level where
//! SENSEL_JUDGE_PYTHON names a Python with OpenCV. Without --pictures they are scikit-image's, which that Python writes: those that
//! settings were chosen on, or with --judge the others. Writes quality.json and quality.svg, and prints the tables of docs/quality.md.

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
use settings::SETTINGS;
use views::{VIEWS, View};

/// Nearest position of a feature that counts, to either picture's edge: ORB's patch reaches 31 pixels.
pub const MARGIN_PX: f64 = 32.0;

/// Scores of one view: one of `SETTINGS` a column, and ORB's with as many features as each.
struct Row {
    view: &'static str,
    group: &'static str,
    ours: Vec<Option<Score>>,
    orbs: Vec<Option<Score>>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|word| word == name).map(|at| arguments[at + 1].clone());
    let out = PathBuf::from(value("--out").unwrap_or_else(|| "target/quality".to_owned()));
    std::fs::create_dir_all(&out).expect("the output folder can be made");
    let python = std::env::var("SENSEL_JUDGE_PYTHON").ok();
    let set = if arguments.iter().any(|word| word == "--judge") { "judged_on" } else { "chosen_on" };
    let folder = match (value("--pictures"), &python) {
        (Some(folder), _) => PathBuf::from(folder),
        (None, Some(python)) => orb::pictures(python, &out, set),
        (None, None) => panic!("use --pictures DIR, or SENSEL_JUDGE_PYTHON with scikit-image"),
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
    let mut ours = vec![vec![Vec::new(); settings.len()]; VIEWS.len()];
    let mut orbs = ours.clone();
    for picture in pictures {
        let all: Vec<_> = std::iter::once(&View::SAME).chain(VIEWS).map(|view| views::codes(picture, view)).collect();
        let size = all[0].size();
        let mut counts = Vec::new();
        for (column, setting) in settings.iter().enumerate() {
            let found: Vec<Features> = all.iter().map(|codes| setting.method.features(codes)).collect();
            for (row, view) in VIEWS.iter().enumerate() {
                ours[row][column].push(score(&found[0], &found[row + 1], view, size));
            }
            // As many features as ours has beyond the margin.
            counts.push(found.iter().map(|found| score::inside(found, size)).collect());
        }
        if let Some(python) = python {
            let theirs = orb::Files::write(out, all.iter()).features(python, &counts);
            for (column, found) in theirs.iter().enumerate() {
                for (row, view) in VIEWS.iter().enumerate() {
                    orbs[row][column].push(score(&found[0], &found[row + 1], view, size));
                }
            }
        }
        let number = ours[0][0].len() - 1;
        let of = |scores: &[Vec<Vec<Score>>]| {
            let rows = VIEWS.iter().zip(scores).filter(|(view, _)| HOMOGRAPHIES.contains(&view.group));
            let scores: Vec<Score> = rows.filter_map(|(_, columns)| columns[0].get(number).copied()).collect();
            Score::mean(&scores).map_or("-".to_owned(), |score| format!("{:.0}: {}", score.features, score.text()))
        };
        eprintln!("{}: homographies {}, ORB {}", picture.name, of(&ours), of(&orbs));
    }
    let means = |sums: &Vec<Vec<Score>>| sums.iter().map(|scores| Score::mean(scores)).collect();
    let rows = VIEWS.iter().zip(ours.iter().zip(&orbs));
    rows.map(|(view, (ours, orbs))| Row { view: view.name, group: view.group, ours: means(ours), orbs: means(orbs) })
        .collect()
}

/// The groups of views that are homographies: those that the bar is about.
const HOMOGRAPHIES: [&str; 3] = ["rotation", "scale", "perspective"];

/// The mean over views of some groups.
fn mean<'a>(rows: &'a [Row], groups: &[&str], of: impl Fn(&'a Row) -> Option<Score>) -> Option<Score> {
    let chosen = rows.iter().filter(|row| groups.contains(&row.group));
    Score::mean(&chosen.filter_map(of).collect::<Vec<_>>())
}

fn report(rows: &[Row], out: &Path, pictures: usize) {
    let columns = rows[0].ours.len();
    let mut groups: Vec<&str> = Vec::new();
    for row in rows {
        if !groups.contains(&row.group) {
            groups.push(row.group);
        }
    }
    println!("{pictures} pictures, {} views; repeatability / matching score in %\n", rows.len());
    println!("| extractor | features | homographies | ORB's | all | ORB's | {} |", groups.join(" | "));
    println!("|---|---|---|---|---|---|{}", "---|".repeat(groups.len()));
    let text = |score: Option<Score>| score.map_or("-".to_owned(), |score| score.text());
    let mut json = Vec::new();
    for (column, setting) in SETTINGS[..columns].iter().enumerate() {
        let (ours, orbs) = (|row: &Row| row.ours[column], |row: &Row| row.orbs[column]);
        let Some(all) = mean(rows, &groups, ours) else { continue };
        let homographies = [mean(rows, &HOMOGRAPHIES, ours), mean(rows, &HOMOGRAPHIES, orbs)].map(text);
        let each: Vec<String> = groups.iter().map(|&group| text(mean(rows, &[group], ours))).collect();
        println!(
            "| {} | {:.0} | {} | {} | {} | {} |",
            setting.name,
            all.features,
            homographies.join(" | "),
            all.text(),
            text(mean(rows, &groups, orbs)),
            each.join(" | ")
        );
        let shares = |score: Option<Score>| score.map(|score| [score.repeatability, score.matching]);
        let view = |row: &Row| {
            serde_json::json!({"view": row.view, "group": row.group, "ours": shares(row.ours[column]),
                "orb": shares(row.orbs[column])})
        };
        json.push(
            serde_json::json!({"name": setting.name, "features": all.features, "repeatability": all.repeatability,
            "matching": all.matching, "views": rows.iter().map(view).collect::<Vec<_>>()}),
        );
    }
    let costs: Vec<_> = SETTINGS[..columns].iter().filter_map(cost::of).collect();
    cost::print(&costs);
    let all = serde_json::json!({"pictures": pictures, "extractors": json,
        "costs": costs.iter().map(cost::Cost::json).collect::<Vec<_>>()});
    let text = serde_json::to_string_pretty(&all).expect("a JSON value has a text");
    std::fs::write(out.join("quality.json"), text).expect("the output folder takes files");
    let point = |column: usize| {
        let all = mean(rows, &groups, |row: &Row| row.ours[column])?;
        Some((SETTINGS[column].name, all, cost::of(&SETTINGS[column])?))
    };
    let points: Vec<_> = (0..columns).filter_map(point).collect();
    cost::draw(&points, mean(rows, &groups, |row: &Row| row.orbs[0]), &out.join("quality.svg"));
}
