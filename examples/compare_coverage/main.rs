//! Coverage of the 95 % intervals of `sensel compare`: random pairs of designs in a small room, the difference that the mean of many seeds
//! gives, and how often the interval of one seed holds it.
//!
//! ```sh
//! cargo run --release --example compare_coverage                          # 20 pairs, 200 seeds: prints a table of docs/compare.md
//! cargo run --release --example compare_coverage -- --write               # the same, written there
//! cargo run --release --example compare_coverage -- 4 20                  # fewer pairs and seeds
//! cargo run --release --example compare_coverage -- 20 200 --replicates   # intervals over eight runs of each design
//! ```

mod designs;
mod runs;
mod table;

use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: usize| words.get(at).and_then(|word| word.parse().ok()).unwrap_or(default);
    let (pairs, seeds) = (number(0, designs::PAIRS), number(1, designs::SEEDS));
    let over_runs = words.iter().any(|word| word == "--replicates");
    let (draw, replicates) =
        if over_runs { (designs::REPLICATES_DRAW, designs::REPLICATES) } else { (designs::DRAW, 1) };
    let designs = designs::random(pairs + 1, draw);
    let runs = runs::all(&designs, seeds)?;
    let outcome = runs::coverage(&designs, &runs, replicates)?;
    let text = table::table(&outcome, (pairs, seeds), (draw, replicates));
    println!("{text}");
    if words.iter().any(|word| word == "--write") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/compare.md");
        let page = std::fs::read_to_string(&path)?;
        std::fs::write(&path, table::with_table(&page, &text, over_runs))?;
    }
    Ok(())
}
