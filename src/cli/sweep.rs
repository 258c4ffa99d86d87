//! `sensel sweep`: a design space from its file to its table.

mod cell;
mod loaded;
mod plan;
mod run;
mod specs;
mod submit;

use std::path::PathBuf;

use sensel::error::Error;
use sensel::files::sweep::SweepFolder;
use sensel::sweep::gather::Table;
use sensel::sweep::{picture, report};

use super::args::{CommonOptions, SweepArguments, SweepPart};
pub use loaded::Loaded;
use loaded::{found, load, title};

pub fn main(arguments: &SweepArguments, shared: &CommonOptions) -> Result<(), Error> {
    match &arguments.part {
        SweepPart::Plan(own) => plan::main(&load(own, shared)?, shared),
        SweepPart::Run(own) => run::main(own, &load(&own.sweep, shared)?, shared),
        SweepPart::Gather(own) => gather(&load(own, shared)?, shared),
        SweepPart::Report(own) => {
            let loaded = load(&own.sweep, shared)?;
            let folder = SweepFolder::read(&loaded.target)?;
            let found = found(&loaded, &folder);
            let verdicts = specs::judged(&specs::parse(&own.spec)?, &loaded.cells, &found.records)?;
            let table = Table::new(&loaded.cells, &found.records, &loaded.text);
            let title = title(&loaded);
            let page = report::page(&title, &loaded.sweep.report, &table, &verdicts)?;
            let path = folder.write_file("report.html", page.as_bytes())?;
            let mut tables = String::new();
            for interaction in report::interactions(&loaded.sweep.report, &table)? {
                tables.push_str(&format!("{}\n", interaction.markdown()));
                if let Some(svg) = picture::svg(&interaction) {
                    folder.write_file(&format!("{}.svg", interaction.file_name()), svg.as_bytes())?;
                }
            }
            if !tables.is_empty() {
                folder.write_file("report.md", tables.as_bytes())?;
            }
            said(shared, &[("report", &path)], table.rows, loaded.cells.cells.len());
            Ok(())
        }
        SweepPart::Submit(own) => submit::main(own, &load(&own.sweep, shared)?, shared),
    }
}

fn gather(loaded: &Loaded, shared: &CommonOptions) -> Result<(), Error> {
    let folder = SweepFolder::read(&loaded.target)?;
    let found = found(loaded, &folder);
    let table = Table::new(&loaded.cells, &found.records, &loaded.text);
    let parquet = folder.write_file("cells.parquet", &table.to_parquet()?)?;
    let csv = folder.write_file("cells.csv", table.to_csv().as_bytes())?;
    said(shared, &[("parquet", &parquet), ("csv", &csv)], table.rows, loaded.cells.cells.len());
    Ok(())
}

/// Says which files were written, of how many cells.
fn said(shared: &CommonOptions, files: &[(&str, &PathBuf)], rows: usize, cells: usize) {
    if shared.json {
        let mut value = serde_json::json!({"cells": cells, "finished": rows});
        for (name, file) in files {
            value[*name] = file.display().to_string().into();
        }
        outln!("{value}");
    } else if !shared.quiet {
        for (name, file) in files {
            outln!("{name}: {} ({rows} of {cells} cells)", file.display());
        }
    }
}
