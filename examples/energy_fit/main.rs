//! Fits the energy model to published chips and prints the constants and the table of docs/energy.md; `--write` puts both in their places.
//!
//! ```sh
//! cargo run --release --example energy_fit             # prints
//! cargo run --release --example energy_fit -- --write  # writes src/energy/65nm.toml and docs/energy.md
//! ```

mod chips;
mod fit;
mod judge;
mod page;
mod slopes;

use std::path::Path;

use fit::{GROUPS, at_priors, moved};

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let outcome = judge::judge(root);
    let fitted = moved(&at_priors(), &outcome.parameters);
    for group in GROUPS {
        for &constant in group.constants {
            println!(
                "{:<28} {:<20} {:>12.4} {}",
                group.name,
                constant.name(),
                fitted.value(constant),
                constant.unit().name()
            );
        }
    }
    if std::env::args().any(|argument| argument == "--write") {
        let constants = root.join("src/energy/65nm.toml");
        let mut text = std::fs::read_to_string(&constants)?;
        for &constant in GROUPS.iter().flat_map(|group| group.constants) {
            text = page::with_value(&text, constant, fitted.value(constant));
        }
        std::fs::write(&constants, text)?;
        let path = root.join("docs/energy.md");
        let mut text = std::fs::read_to_string(&path)?;
        for (name, table) in page::tables(root, &outcome) {
            text = page::with_table(&text, name, &table);
        }
        std::fs::write(&path, text)?;
    } else {
        for (_, table) in page::tables(root, &outcome) {
            println!("\n{table}");
        }
    }
    Ok(())
}
