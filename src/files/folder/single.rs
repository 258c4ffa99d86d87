//! Single files that a user names, such as a table or a waveform: whole, or what they were before.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use super::super::disk;
use super::super::errors::io_error;
use super::lock::Lock;
use super::parents::{Parents, resolve, until_parents_stay};
use super::work;
use crate::error::Error;

/// How bytes get to a target.
enum FileWriteMode {
    /// The file is written in a hidden folder beside it and renamed.
    Renamed { path: PathBuf, holder: PathBuf, parents: Parents, _lock: Lock },
    /// A pipe or a device takes them as they come; a file whose folder may not be written is overwritten.
    Direct,
}

/// Writes a file beside its target and renames it there, so that it is whole or what it was before. A file that is replaced keeps its
/// permissions. Pipes and devices are written to; they are never replaced. Fails on a write-protected file, or where the disk says no; then
/// nothing changed.
pub fn replace_file(target: &Path, bytes: &[u8]) -> Result<(), Error> {
    let existing = std::fs::metadata(target).ok();
    let mode = mode_for(target, existing.as_ref())?;
    let written = match &mode {
        FileWriteMode::Direct => write_to(target, bytes),
        FileWriteMode::Renamed { path, holder, .. } => write_beside(path, holder, bytes, existing.as_ref()),
    };
    finish(mode, written.is_ok());
    written.map_err(io_error(target))
}

/// Whether a file could be made or replaced at `target`, before long work is done for it.
pub fn check_file(target: &Path) -> Result<(), Error> {
    let existing = std::fs::metadata(target).ok();
    finish(mode_for(target, existing.as_ref())?, false);
    Ok(())
}

fn mode_for(target: &Path, existing: Option<&Metadata>) -> Result<FileWriteMode, Error> {
    match existing {
        Some(metadata) if metadata.is_dir() => return Err(io_error(target)(ErrorKind::IsADirectory.into())),
        Some(metadata) if !metadata.is_file() => return Ok(FileWriteMode::Direct),
        // A rename would take its place all the same.
        Some(metadata) if metadata.permissions().readonly() => {
            let reason = "is write-protected; name another file".to_owned();
            return Err(Error::Content { file: target.display().to_string(), reason });
        }
        _ => {}
    }
    // The option's name is the caller's to say.
    let named = |error: Error| match error {
        Error::Config { reason, .. } => Error::Content { file: target.display().to_string(), reason },
        other => other,
    };
    until_parents_stay(|| mode_for_file(target, existing.is_some())).map_err(named)
}

fn mode_for_file(target: &Path, exists: bool) -> Result<FileWriteMode, Error> {
    let (path, parents) = resolve(target)?;
    let parent = path.parent().unwrap_or(Path::new("/")).to_owned();
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lock = match Lock::take(parent.join(format!(".{name}.sensel-lock")), &path) {
        Err(Error::Io { source, .. }) if exists && disk::is_forbidden(&source) => return Ok(FileWriteMode::Direct),
        other => other?,
    };
    if lock.is_exclusive {
        work::clear_stale(&parent, &path, &name);
    }
    let holder = work::fresh(&parent, &name)?;
    Ok(FileWriteMode::Renamed { path, holder, parents, _lock: lock })
}

/// Removes what stood beside the file, and the folders that were made for it unless it is there now.
fn finish(mode: FileWriteMode, is_written: bool) {
    let FileWriteMode::Renamed { holder, mut parents, _lock, .. } = mode else { return };
    // A holder that stays is hidden, and the next run to the same target clears it.
    let _ = work::remove_marked(&holder);
    if is_written {
        parents.0.clear();
    }
    drop(_lock);
}

fn write_beside(path: &Path, holder: &Path, bytes: &[u8], existing: Option<&Metadata>) -> io::Result<()> {
    let beside = holder.join("file");
    disk::write_new(&beside, bytes)?;
    if let Some(existing) = existing {
        disk::copy_ownership(existing, &beside)?;
    }
    match disk::rename(&beside, path) {
        // A file that is mounted cannot be replaced, only overwritten.
        Err(error) if existing.is_some() && error.kind() == ErrorKind::ResourceBusy => write_to(path, bytes),
        Err(error) => Err(error),
        Ok(()) => disk::sync_folder(path.parent().unwrap_or(Path::new("/"))),
    }
}

fn write_to(target: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = open_for_writing(target)?;
    let is_file = file.metadata()?.is_file();
    if is_file {
        file.set_len(0)?;
    }
    file.write_all(bytes)?;
    if is_file { file.sync_all() } else { Ok(()) }
}

/// Opens without waiting for a reader of a pipe: one that nobody reads is an error. Once it is open, writing waits as usual.
#[cfg(unix)]
fn open_for_writing(target: &Path) -> io::Result<File> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use std::os::unix::fs::OpenOptionsExt as _;
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = OpenOptions::new().write(true).custom_flags(flags.bits().cast_signed()).open(target)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(file)
}

#[cfg(not(unix))]
fn open_for_writing(target: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(target)
}
