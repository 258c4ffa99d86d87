//! The library's error type: what is wrong, where, and which values are accepted.

use crate::text::{PATH_CHARS, VALUE_CHARS, sentence_shown, shown};

/// Why a request was refused or a run failed. `exit_code` says which of the program's exit codes it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A key of the configuration is unknown, of the wrong type, out of range, or does not go with the others.
    #[error("{}{} = {}: {}", location(.file, .line), value_shown(.key), value_shown(.value), sentence_shown(.reason))]
    Config {
        /// The layer: a file's name, a preset, or `--set`.
        file: String,
        /// Counted from 1; 0 where the layer has no lines.
        line: usize,
        /// Dotted path.
        key: String,
        /// As it was written.
        value: String,
        /// What is wrong, and an accepted value.
        reason: String,
    },
    /// A file's content is not what its name promises.
    #[error("{}: {}", path_shown(.file), sentence_shown(.reason))]
    Content {
        /// As the user named it.
        file: String,
        /// What is wrong, where, and an accepted value.
        reason: String,
    },
    /// A named thing does not exist; `known` lists what does.
    #[error("{what} '{}' is not known; known: {known}", value_shown(.name))]
    Unknown {
        /// Kind of thing: "sensor preset", "verb", ...
        what: &'static str,
        /// As it was asked for.
        name: String,
        /// Comma-separated.
        known: String,
    },
    /// The disk or another device said no.
    #[error("{}: {source}", path_shown(.path))]
    Io {
        /// File or folder.
        path: String,
        /// The operating system's word.
        source: std::io::Error,
    },
    /// The user stopped the program; nothing was left behind.
    #[error("stopped; nothing was written")]
    Interrupted,
    /// The user stopped the program; what was finished is kept.
    #[error("{0}")]
    Stopped(String),
    /// Some of many runs failed; the others are kept.
    #[error("{0}")]
    SomeFailed(String),
    /// The run itself failed.
    #[error("{0}")]
    Run(String),
}

/// Values come from outside: none reaches a terminal as it is, and none fills it.
fn value_shown(value: &str) -> String {
    shown(value, VALUE_CHARS)
}

fn path_shown(path: &str) -> String {
    shown(path, PATH_CHARS)
}

fn location(file: &str, line: &usize) -> String {
    let file = path_shown(file);
    match (file.as_str(), line) {
        ("", _) => String::new(), // An option of the command line: its name is the key.
        (_, 0) => format!("{file}: "),
        _ => format!("{file}:{line}: "),
    }
}

/// Refuses a value outside `least..=most`, NaN included.
pub(crate) fn within(key: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if value >= least && value <= most {
        return Ok(());
    }
    Err(Error::key(key, value, format!("out of range; use {least} to {most}")))
}

/// Refuses a clock that no sensor has.
pub(crate) fn check_clock(key: &str, clock_hz: u64) -> Result<(), Error> {
    if (1_000..=100_000_000_000).contains(&clock_hz) {
        return Ok(());
    }
    Err(Error::key(key, clock_hz, "out of range; use 1000 to 100000000000 (1 kHz to 100 GHz)"))
}

impl Error {
    /// 1 the run failed, 2 usage or configuration, 3 some runs of many failed, 4 input/output, 130 stopped by the user
    /// (docs/machine.md).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Config { .. } | Self::Content { .. } | Self::Unknown { .. } => 2,
            Self::Io { .. } => 4,
            Self::Interrupted | Self::Stopped(_) => 130,
            Self::SomeFailed(_) => 3,
            Self::Run(_) => 1,
        }
    }

    /// The kind of this error in one word, for programs.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Config { .. } => "config",
            Self::Content { .. } => "content",
            Self::Unknown { .. } => "unknown",
            Self::Io { .. } => "io",
            Self::Interrupted | Self::Stopped(_) => "interrupted",
            Self::SomeFailed(_) => "some_failed",
            Self::Run(_) => "run",
        }
    }

    /// The same, about the key that named the file: so that the message leads to the line to change.
    #[must_use]
    pub fn named_by(self, key: &str, name: &str) -> Self {
        match self {
            Self::Content { file, reason } if file == name => Self::key(key, name, reason),
            Self::Content { file, reason } => Self::key(key, name, format!("{file}: {reason}")),
            other => other,
        }
    }

    /// The same where a section's keys stand within another: `motion.kind` under `scene.object.0`.
    #[must_use]
    pub fn under(self, prefix: &str, section: &str) -> Self {
        match self {
            Self::Config { file, line, key, value, reason } if key.split('.').next() == Some(section) => {
                Self::Config { file, line, key: format!("{prefix}.{key}"), value, reason }
            }
            other => other,
        }
    }

    /// A range or relation that does not hold, found by a stage that knows keys but not files; the configuration layer
    /// adds file, line and value.
    pub fn key(key: &str, value: impl std::fmt::Display, reason: impl Into<String>) -> Self {
        Self::Config {
            file: String::new(),
            line: 0,
            key: key.to_owned(),
            value: value.to_string(),
            reason: reason.into(),
        }
    }

    /// A file whose content is not what its name promises.
    pub fn content(file: &str, reason: impl Into<String>) -> Self {
        Self::Content { file: file.to_owned(), reason: reason.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::Error;

    #[test]
    fn no_message_repeats_a_control_character_or_a_value_of_any_length() {
        let hostile = format!("\u{1b}[2J{}", "x".repeat(100_000));
        let errors = [
            Error::key(&hostile, &hostile, &hostile),
            Error::Content { file: hostile.clone(), reason: hostile.clone() },
            Error::Unknown { what: "scenario", name: hostile.clone(), known: "box".to_owned() },
            Error::Io { path: hostile.clone(), source: std::io::Error::other("full") },
        ];
        for error in errors {
            let said = error.to_string();
            assert!(said.chars().all(|letter| !letter.is_control()), "{said}");
            assert!(said.chars().count() < 2500 && said.contains("characters)"), "{said}");
        }
    }
}
