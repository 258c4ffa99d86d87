//! A lock on a target, held while something is built for it. The system lets go of it when the process ends, however it ends.

use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::super::errors::{content_error, io_error, refused};
use crate::error::Error;

/// An empty file that is locked. Dropped, it is removed.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: File,
    /// False where the file system has no locks: then nobody knows whether another process lives.
    pub is_exclusive: bool,
}

impl Lock {
    /// Takes the lock at `path`, for what will be `target`. Fails where another process holds it, or what the disk says.
    pub fn take(path: PathBuf, target: &Path) -> Result<Self, Error> {
        loop {
            let file = open(&path).map_err(io_error(&path))?;
            let metadata = file.metadata().map_err(io_error(&path))?;
            if !metadata.is_file() {
                return Err(content_error(&path, "is no file; this name is needed for a lock"));
            }
            let is_exclusive = match file.try_lock() {
                Ok(()) => true,
                Err(TryLockError::WouldBlock) => return Err(busy(target)),
                Err(TryLockError::Error(_)) => false,
            };
            // Whoever held it before has removed it on leaving: then it is a lock on nothing.
            if is_same(&path, &metadata) {
                return Ok(Self { path, file, is_exclusive });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // What somebody wrote into it is not this program's.
        if self.file.metadata().is_ok_and(|metadata| metadata.len() == 0) {
            // A lock that stays is empty, and the next run takes it.
            let _ = super::super::disk::remove_file(&self.path);
        }
    }
}

/// What is said where another process builds for the same target.
pub fn busy(target: &Path) -> Error {
    refused(target, "is being written by another process; wait for its end or name another place")
}

fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
        options.custom_flags(flags.bits().cast_signed());
    }
    options.open(path)
}

#[cfg(unix)]
fn is_same(path: &Path, locked: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::symlink_metadata(path).is_ok_and(|now| (now.dev(), now.ino()) == (locked.dev(), locked.ino()))
}

#[cfg(not(unix))]
fn is_same(path: &Path, _: &Metadata) -> bool {
    path.exists()
}
