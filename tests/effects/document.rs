//! The page of effects says what the code says.

use std::path::Path;

use sensel::effects::{ALL, costs};

/// Rows of the tables whose first cell is a code span: effect names.
fn rows(text: &str) -> Vec<Vec<String>> {
    let lines = text.lines().filter(|line| line.starts_with("| `"));
    lines.map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

#[test]
fn the_page_of_effects_names_every_effect_with_its_summary_and_its_costs() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/effects.md");
    let rows = rows(&std::fs::read_to_string(path).unwrap());
    let names: Vec<String> = rows.iter().map(|row| row[0].trim_matches('`').to_owned()).collect();
    let listed: Vec<&str> = ALL.iter().map(|entry| entry.name).collect();
    assert_eq!(names, listed, "one row for each effect, in physical order");
    for (entry, row) in ALL.iter().zip(&rows) {
        assert_eq!(row.len(), 5, "{}: name, model, bound, cost, when it is left out", entry.name);
        assert!(row[1].contains(entry.summary), "{}: '{}' is not in '{}'", entry.name, entry.summary, row[1]);
        for cost in costs::COSTS.iter().filter(|cost| cost.effect == entry.name) {
            let words = format!(
                "{}{}",
                cost.ns_per_px,
                if cost.case.is_empty() { String::new() } else { format!(" ({})", cost.case) }
            );
            assert!(row[3].split("; ").any(|cell| cell == words), "{}: '{words}' is not in '{}'", entry.name, row[3]);
        }
        assert!(row[2].len() > 3 && row[4].len() > 4, "{}: {row:?}", entry.name);
    }
}
