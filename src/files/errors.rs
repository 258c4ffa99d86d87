//! Errors that name a file.

use crate::error::Error;
use std::path::Path;

/// The library's error for what the operating system said about a path.
pub fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> Error {
    let path = path.display().to_string();
    move |source| Error::Io { path, source }
}

/// Why a result is not written to a target.
pub(super) fn refused(target: &Path, reason: impl Into<String>) -> Error {
    Error::key("out", target.display(), reason)
}

/// A file whose content is not what its name promises.
pub fn content_error(path: &Path, reason: impl Into<String>) -> Error {
    Error::Content { file: path.display().to_string(), reason: reason.into() }
}
