//! The one error of the library: what, where, and which values would do.

/// Why a request was refused or a run failed. `exit_code` says which of the program's exit codes it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A key of the configuration is unknown, of the wrong type, out of range, or does not go with the others.
    #[error("{}{key} = {value}: {reason}", place(.file, .line))]
    Config {
        /// The layer: a file's name, a preset, or `--set`.
        file: String,
        /// Counted from 1; 0 where the layer has no lines.
        line: usize,
        /// Dotted path.
        key: String,
        /// As it was written.
        value: String,
        /// What is wrong and what would do.
        reason: String,
    },
    /// A file's content is not what its name promises.
    #[error("{file}: {reason}")]
    Content {
        /// As the user named it.
        file: String,
        /// What is wrong, where, and what would do.
        reason: String,
    },
    /// A named thing does not exist; `known` lists what does.
    #[error("{what} '{name}' is not known; known: {known}")]
    Unknown {
        /// Kind of thing: "sensor preset", "verb", ...
        what: &'static str,
        /// As it was asked for.
        name: String,
        /// Comma-separated.
        known: String,
    },
    /// The disk or another device said no.
    #[error("{path}: {source}")]
    Io {
        /// File or folder.
        path: String,
        /// The operating system's word.
        source: std::io::Error,
    },
    /// The user stopped the program; nothing was left behind.
    #[error("stopped; nothing was written")]
    Interrupted,
    /// The run itself failed.
    #[error("{0}")]
    Run(String),
}

fn place(file: &str, line: &usize) -> String {
    match (file, line) {
        ("", _) => String::new(), // An option of the command line: its name is the key.
        (_, 0) => format!("{file}: "),
        _ => format!("{file}:{line}: "),
    }
}

impl Error {
    /// 1 the run failed, 2 usage or configuration, 4 input/output, 130 stopped by the user (DESIGN: exit codes).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Config { .. } | Self::Content { .. } | Self::Unknown { .. } => 2,
            Self::Io { .. } => 4,
            Self::Interrupted => 130,
            Self::Run(_) => 1,
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
}
