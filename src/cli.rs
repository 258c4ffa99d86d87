//! Verbs of the command line. Data goes to stdout, progress and words to stderr.
//!
//! Exit codes: 0 done, 1 the run failed, 2 usage or configuration, 3 some cells failed, 4 input/output. With
//! `--json` every line on stderr is one JSON object (docs/machine.md).

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
mod compare;
mod draw;
mod expected;
mod failure;
mod features;
mod fit;
mod goal;
mod interrupt;
mod ladder;
mod listing;
mod output;
mod paths;
mod plan;
mod power;
mod setup;
mod progress;
mod run;
mod scene;
mod sweep;
mod timing;
mod track;
mod waves;
mod words;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use sensel::error::Error;

use args::{Arguments, Verb};

/// Parses the command line and runs the verb; without any argument it prints the help.
pub fn main() -> ExitCode {
    let words_given: Vec<_> = std::env::args_os().skip(1).take_while(|word| word != "--").collect();
    if words_given.iter().any(|word| word == "--json") {
        words::use_json();
    }
    if words_given.is_empty() {
        out!("{}", Arguments::command().render_help());
        return ExitCode::SUCCESS;
    }
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return failure::of_usage(&error),
    };
    match dispatch(&arguments) {
        Ok(()) => {
            // What stdout still holds has to go now, while a full disk can be said.
            to_stdout(format_args!(""));
            ExitCode::SUCCESS
        }
        Err(error) => failure::of_verb(&error),
    }
}

/// Writes data to stdout. All files are whole by then, so a reader that leaves ends the program well.
fn to_stdout(text: std::fmt::Arguments<'_>) {
    use std::io::Write as _;
    let mut stdout = std::io::stdout().lock();
    let Err(error) = stdout.write_fmt(text).and_then(|()| stdout.flush()) else { return };
    if error.kind() == std::io::ErrorKind::BrokenPipe {
        std::process::exit(0);
    }
    failure::of_verb(&Error::Io { path: "stdout".to_owned(), source: error });
    std::process::exit(4);
}

/// All verbs of this version.
const VERBS: &str = "run, plan, ladder, timing, waves, power, features, track, characterize, compare, sweep, fit, scene, presets, \
    schema, config";

fn dispatch(arguments: &Arguments) -> Result<(), Error> {
    let shared = &arguments.shared;
    let prints = |verb: &Verb| {
        use Verb::{Config, Plan, Power, Presets, Schema, Timing, Waves};
        matches!(verb, Plan(_) | Timing(_) | Waves(_) | Power(_) | Presets(_) | Schema | Config(_))
    };
    paths::check_shared(shared, arguments.verb.as_ref().is_some_and(|verb| !prints(verb)))?;
    match arguments.verb.as_ref() {
        None => Err(Error::key("verb", "none", format!("name one of {VERBS}"))),
        Some(Verb::Run(own)) => run::main(own, shared),
        Some(Verb::Plan(own)) => plan::main(own, shared),
        Some(Verb::Timing(own)) => timing::main(own, shared),
        Some(Verb::Waves(own)) => waves::main(own, shared),
        Some(Verb::Power(own)) => power::main(own, shared),
        Some(Verb::Features(own)) => features::main(own, shared),
        Some(Verb::Track(own)) => track::main(own, shared),
        Some(Verb::Presets(own)) => match &own.name {
            Some(name) => listing::preset(name, shared),
            None => listing::presets(shared),
        },
        Some(Verb::Schema) => listing::schema(shared),
        Some(Verb::Config(own)) => listing::config(own, shared),
        Some(Verb::Ladder(own)) => ladder::main(own, shared),
        Some(Verb::Characterize(own)) => characterize::main(own, shared),
        Some(Verb::Compare(own)) => compare::main(own, shared),
        Some(Verb::Sweep(own)) => sweep::main(own, shared),
        Some(Verb::Scene(own)) => scene::main(own, shared),
        Some(Verb::Fit(own)) => fit::main(own, shared),
    }
}
