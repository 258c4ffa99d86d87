//! Why the program ends without its result: one line for a person or, with `--json`, one JSON object (docs/machine.md).

use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use sensel::error::Error;
use sensel::text::{self, sentence_shown};
use serde_json::{Map, Value, json};

use super::words;

/// Exit code of a command line that is not understood.
const USAGE: u8 = 2;

pub fn of_verb(error: &Error) -> ExitCode {
    let code = error.exit_code();
    if words::is_json() {
        words::to_stderr(&as_json(error).to_string());
    } else {
        // The message of a failed tool may span several lines.
        let lines: Vec<String> = error.to_string().lines().map(text::escaped).collect();
        words::to_stderr(&format!("sensel: {}", lines.join("\n")));
    }
    ExitCode::from(code)
}

/// The error as an object. Values are cut as in messages; a part that an error does not have is left out.
fn as_json(error: &Error) -> Value {
    let mut parts = Map::new();
    let mut put = |name: &str, part: &str| {
        if !part.is_empty() {
            parts.insert(name.to_owned(), text::shown(part, text::PATH_CHARS).into());
        }
    };
    put("kind", error.kind());
    match error {
        Error::Config { file, key, value, reason, .. } => {
            put("file", file);
            put("key", key);
            put("value", &text::shown(value, text::VALUE_CHARS));
            parts.insert("reason".to_owned(), sentence_shown(reason).into());
        }
        Error::Content { file, reason } => {
            put("file", file);
            parts.insert("reason".to_owned(), sentence_shown(reason).into());
        }
        Error::Unknown { what, name, known } => {
            put("what", what);
            put("value", &text::shown(name, text::VALUE_CHARS));
            // Two lists may stand one after the other.
            let known: Vec<&str> = known.split("; scenarios: ").flat_map(|list| list.split(", ")).collect();
            parts.insert("known".to_owned(), known.into());
        }
        Error::Io { path, source } => {
            put("file", path);
            put("reason", &source.to_string());
        }
        _ => {}
    }
    if let Error::Config { line: line @ 1.., .. } = error {
        parts.insert("line".to_owned(), (*line).into());
    }
    parts.insert("message".to_owned(), error.to_string().into());
    parts.insert("exit_code".to_owned(), error.exit_code().into());
    json!({ "error": parts })
}

/// Says what is wrong with the command line, or prints the help or version that it asks for.
pub fn of_usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        out!("{}", error.render());
        return ExitCode::SUCCESS;
    }
    let plain: Vec<String> = error.render().to_string().lines().map(sentence_shown).collect();
    if words::is_json() {
        let first = plain.first().map_or("", String::as_str);
        let mut parts = Map::from_iter([("kind".to_owned(), Value::from("usage"))]);
        for (name, kind) in [
            ("key", ContextKind::InvalidArg),
            ("value", ContextKind::InvalidValue),
            ("value", ContextKind::InvalidSubcommand),
        ] {
            if let Some(ContextValue::String(given)) = error.get(kind) {
                parts.insert(name.to_owned(), text::shown(given, text::VALUE_CHARS).into());
            }
        }
        parts.insert("message".to_owned(), first.strip_prefix("error: ").unwrap_or(first).into());
        let help: Vec<&str> = plain.iter().skip(1).map(|line| line.trim()).filter(|line| !line.is_empty()).collect();
        parts.insert("help".to_owned(), help.join("; ").into());
        parts.insert("exit_code".to_owned(), USAGE.into());
        words::to_stderr(&json!({ "error": parts }).to_string());
    } else {
        words::to_stderr(&plain.join("\n"));
    }
    ExitCode::from(USAGE)
}
