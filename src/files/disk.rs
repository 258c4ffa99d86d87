//! Changes to folders, each one step that happens wholly or not at all, and questions about folders that std does not answer.
//!
//! Tests stop after the Nth step: from then on nothing is changed any more, as if the process had been killed.

use std::fs::File;
use std::io;
use std::path::Path;

/// Renames; what `to` names is replaced where it is a file or an empty folder.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    step()?;
    std::fs::rename(from, to)
}

/// Renames unless `to` exists.
pub fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    step()?;
    match rename_new_at_once(from, to) {
        Err(error) if is_unsupported(&error) => {
            if std::fs::symlink_metadata(to).is_ok() {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            std::fs::rename(from, to)
        }
        other => other,
    }
}

/// Exchanges two names in one step. Not every system and file system can; see [`is_unsupported`].
pub fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    step()?;
    exchange_at_once(one, other)
}

pub fn create_dir(path: &Path) -> io::Result<()> {
    step()?;
    std::fs::create_dir(path)
}

/// Writes a file that does not exist yet.
pub fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    step()?;
    let mut file = File::create_new(path)?;
    step()?;
    io::Write::write_all(&mut file, bytes)?;
    file.sync_all()
}

pub fn remove_file(path: &Path) -> io::Result<()> {
    step()?;
    std::fs::remove_file(path)
}

pub fn remove_dir(path: &Path) -> io::Result<()> {
    step()?;
    std::fs::remove_dir(path)
}

/// Removes a folder with all in it; links in it are removed, not followed.
pub fn remove_tree(path: &Path) -> io::Result<()> {
    step()?;
    std::fs::remove_dir_all(path)
}

/// Waits until a folder's names are on the disk. Not every file system offers this for folders; their names are then as safe as they get.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    step()?;
    match File::open(path).and_then(|folder| folder.sync_all()) {
        Err(error) if is_unsupported(&error) => Ok(()),
        other => other,
    }
}

/// Whether a step failed because the system or the file system does not know it.
pub fn is_unsupported(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::InvalidInput)
}

/// Whether a step failed because nothing may be written there.
pub fn is_forbidden(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem)
}

#[cfg(target_os = "linux")]
fn rename_new_at_once(from: &Path, to: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE)?)
}

#[cfg(target_os = "linux")]
fn exchange_at_once(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn rename_new_at_once(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(not(target_os = "linux"))]
fn exchange_at_once(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Whether a folder cannot be renamed because a file system is mounted there. `parent` is the folder that it lies in.
pub fn is_mount_point(folder: &Path, parent: &Path) -> bool {
    is_mount_root(folder) || device(folder) != device(parent)
}

#[cfg(target_os = "linux")]
fn is_mount_root(folder: &Path) -> bool {
    use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
    statx(CWD, folder, AtFlags::empty(), StatxFlags::empty())
        .is_ok_and(|about| about.stx_attributes.contains(StatxAttributes::MOUNT_ROOT))
}

#[cfg(not(target_os = "linux"))]
fn is_mount_root(_: &Path) -> bool {
    false
}

#[cfg(unix)]
fn device(path: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::metadata(path).ok().map(|metadata| metadata.dev())
}

#[cfg(not(unix))]
fn device(_: &Path) -> Option<u64> {
    None
}

/// Waits until everything written to the file system of `folder` is on the disk; false where the system cannot.
#[cfg(target_os = "linux")]
pub fn sync_file_system(folder: &Path) -> io::Result<bool> {
    rustix::fs::syncfs(File::open(folder)?)?;
    Ok(true)
}

/// Waits until everything written to the file system of `folder` is on the disk; false where the system cannot.
#[cfg(not(target_os = "linux"))]
pub fn sync_file_system(_: &Path) -> io::Result<bool> {
    Ok(false)
}

/// Gives a new folder or file the permissions and, as far as the user may, the owner of the one that it will replace.
pub fn copy_ownership(from: &std::fs::Metadata, to: &Path) -> io::Result<()> {
    step()?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        // Only the superuser may give files away; a group that the user is in may be given by anybody. Changing the owner takes setgid
        // away, so the mode comes last.
        let _ = std::os::unix::fs::chown(to, None, Some(from.gid()));
        let _ = std::os::unix::fs::chown(to, Some(from.uid()), None);
    }
    // Some file systems have no permissions to set, and every file has the same.
    if std::fs::metadata(to)?.permissions() == from.permissions() {
        return Ok(());
    }
    std::fs::set_permissions(to, from.permissions())
}

#[cfg(not(test))]
#[inline]
fn step() -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
use kill::step;

/// Imitates a process that is killed between two steps.
#[cfg(test)]
pub mod kill {
    use std::cell::Cell;
    use std::io;

    thread_local! {
        static STEPS_LEFT: Cell<Option<u32>> = const { Cell::new(None) };
    }

    /// Lets `count` more steps of this thread happen.
    pub fn after(count: u32) {
        STEPS_LEFT.set(Some(count));
    }

    /// Lets all steps happen again; whether the thread had been killed.
    pub fn off() -> bool {
        STEPS_LEFT.replace(None) == Some(0)
    }

    pub(super) fn step() -> io::Result<()> {
        match STEPS_LEFT.get() {
            Some(0) => Err(io::Error::other("killed")),
            Some(left) => {
                STEPS_LEFT.set(Some(left - 1));
                Ok(())
            }
            None => Ok(()),
        }
    }
}
