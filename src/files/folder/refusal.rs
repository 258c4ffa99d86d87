//! Why a folder is not written.

use crate::error::Error;
use std::path::Path;

pub(super) fn refused(target: &Path, reason: impl Into<String>) -> Error {
    Error::key("out", target.display(), reason)
}
