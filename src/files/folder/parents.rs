//! Parent folders of an output, held open while it is written.

use super::super::disk;
use super::super::errors::{io_error, refused};
use crate::error::Error;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Folders that were made on the way to a target. Dropped, those that are still empty vanish.
#[derive(Debug, Default)]
pub(super) struct Parents(pub(super) Vec<PathBuf>);

impl Parents {
    fn make(folder: &Path) -> Result<Self, Error> {
        let mut parents = Self::default();
        let missing: Vec<&Path> = folder
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && std::fs::symlink_metadata(path).is_err())
            .collect();
        for path in missing.into_iter().rev() {
            match disk::create_dir(path) {
                Ok(()) => parents.0.push(path.to_owned()),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(io_error(path)(error)),
            }
        }
        Ok(parents)
    }
}

/// Tries again where another process has just removed the empty folders that it had made on the way to its own target.
pub(super) fn until_parents_stay<T>(attempt: impl Fn() -> Result<T, Error>) -> Result<T, Error> {
    for _ in 0..20 {
        match attempt() {
            Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {}
            other => return other,
        }
    }
    attempt()
}

impl Drop for Parents {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            let _ = disk::remove_dir(folder);
        }
    }
}

/// The path without links, and the folders that were made for it. A link keeps pointing where it did: what it points at is replaced.
pub(super) fn resolve(target: &Path) -> Result<(PathBuf, Parents), Error> {
    match std::fs::canonicalize(target) {
        Ok(path) => return Ok((path, Parents::default())),
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(io_error(target)(error)),
    }
    if std::fs::symlink_metadata(target).is_ok() {
        return Err(refused(target, "is a link that leads nowhere; name another place"));
    }
    let name = target.file_name().ok_or_else(|| refused(target, "has no name of its own; name another place"))?;
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let parents = Parents::make(&parent)?;
    let parent = std::fs::canonicalize(&parent).map_err(io_error(&parent))?;
    Ok((parent.join(name), parents))
}
