//! Verbs of the command line. Data goes to stdout, progress and words to stderr.
//!
//! Exit codes: 0 done, 1 the run failed, 2 usage or configuration, 4 input/output.

/// As `print!`, for readers that may leave early: `sensel schema | head` ends in silence, not in a panic.
macro_rules! out {
    ($($part:tt)*) => { crate::cli::to_stdout(format_args!($($part)*)) };
}

/// As `println!`, like `out!`.
macro_rules! outln {
    ($($part:tt)*) => { crate::cli::to_stdout(format_args!("{}\n", format_args!($($part)*))) };
}

mod args;
mod characterize;
mod clocks;
mod draw;
mod expected;
mod features;
mod goal;
mod interrupt;
mod ladder;
mod listing;
mod output;
mod place;
mod plan;
mod power;
mod progress;
mod run;
mod timing;
mod track;
mod waves;
mod words;

use std::process::ExitCode;

use clap::Parser;
use sensel::error::Error;

use args::{Arguments, Verb};

/// Parses the command line and runs the verb; without one, `run`.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match dispatch(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sensel: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// Writes data to stdout. All files are whole by then, so a reader that leaves ends the program well.
fn to_stdout(text: std::fmt::Arguments<'_>) {
    use std::io::Write as _;
    let Err(error) = std::io::stdout().lock().write_fmt(text) else { return };
    if error.kind() == std::io::ErrorKind::BrokenPipe {
        std::process::exit(0);
    }
    eprintln!("sensel: stdout: {error}");
    std::process::exit(4);
}

fn dispatch(arguments: &Arguments) -> Result<(), Error> {
    let shared = &arguments.shared;
    match arguments.verb.as_ref() {
        None => run::main(&args::RunVerbArguments::default(), shared),
        Some(Verb::Run(own)) => run::main(own, shared),
        Some(Verb::Plan(own)) => plan::main(own, shared),
        Some(Verb::Timing(own)) => timing::main(own, shared),
        Some(Verb::Power(own)) => power::main(own, shared),
        Some(Verb::Features(own)) => features::main(own, shared),
        Some(Verb::Track(own)) => track::main(own, shared),
        Some(Verb::Presets) => listing::presets(shared),
        Some(Verb::Schema) => listing::schema(),
        Some(Verb::Config(own)) => listing::config(own, shared),
        Some(Verb::Ladder(own)) => ladder::main(own, shared),
        Some(Verb::Characterize(own)) => characterize::main(own, shared),
        Some(Verb::Sweep(_)) => later("sweep"),
    }
}

/// These verbs are part of the design but not of this version; none pretends.
fn later(verb: &'static str) -> Result<(), Error> {
    Err(Error::Unknown {
        what: "verb of this version:",
        name: verb.to_owned(),
        known: "run, plan, ladder, timing, power, features, track, characterize, presets, schema, config (sweep comes later)".to_owned(),
    })
}
