//! Hidden folders in which results are built, and in which earlier results wait for their removal. What a killed process left of them is
//! cleared by the next one for the same target, and only where their content says that they are this program's.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::super::disk;
use super::super::errors::io_error;
use super::manifest::{Care, FolderList, MARKER, Manifest, Survey, remove_if_empty};
use crate::error::Error;

/// What stands in `.sensel` while a folder is being built.
const BUILDING: &str =
    "sensel builds a result in this folder; the next run to the same place removes it with all in it\n";

/// A folder that is being built.
pub const NEW: &str = "building";
/// A result that was replaced.
pub const OLD: &str = "old";

/// Makes a hidden folder in `parent` whose name no other process or thread has, and marks it.
pub fn fresh(parent: &Path, name: &str) -> Result<PathBuf, Error> {
    let path = unused(parent, name, NEW)?;
    if let Err(source) = mark(&path) {
        // The error of the writing is the one to report.
        let _ = disk::remove_file(&path.join(MARKER)).and_then(|()| disk::remove_dir(&path));
        return Err(io_error(&path)(source));
    }
    Ok(path)
}

/// Makes a hidden folder in `parent`, unmarked.
pub fn unused(parent: &Path, name: &str, purpose: &str) -> Result<PathBuf, Error> {
    for attempt in 0..10_000_u32 {
        let path = parent.join(format!(".{name}.{purpose}-{}-{attempt}", std::process::id()));
        match disk::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(io_error(&path)(error)),
        }
    }
    Err(io_error(parent)(io::Error::from(ErrorKind::AlreadyExists)))
}

/// Says in a folder that all in it is this program's.
pub fn mark(folder: &Path) -> io::Result<()> {
    disk::write_new(&folder.join(MARKER), BUILDING.as_bytes())
}

/// Whether these are a mark's bytes.
pub fn is_mark(bytes: &[u8]) -> bool {
    bytes == BUILDING.as_bytes()
}

/// Whether a folder says so. A process may have been killed while it wrote the mark; nothing else is there then.
fn is_marked(folder: &Path, begin: &[u8]) -> bool {
    let is_alone = || std::fs::read_dir(folder).is_ok_and(|entries| entries.count() == 1);
    is_mark(begin) || (BUILDING.as_bytes().starts_with(begin) && is_alone())
}

/// Removes a marked folder. The mark goes last, so that what is left after a kill is still known.
pub fn remove_marked(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name() == MARKER {
            continue;
        }
        if entry.file_type()?.is_dir() {
            disk::remove_tree(&entry.path())?;
        } else {
            disk::remove_file(&entry.path())?;
        }
    }
    disk::remove_file(&folder.join(MARKER))?;
    disk::remove_dir(folder)
}

/// Removes an earlier result by its list. Files that are not this program's stay, under a visible name that is given back.
pub fn retire(old: &Path, survey: &Survey, kept_as: &Path) -> io::Result<Option<PathBuf>> {
    survey.remove(old)?;
    if remove_if_empty(old)? {
        return Ok(None);
    }
    let kept = move_beside(old, kept_as)?;
    // It lists files that are no longer there.
    let _ = disk::remove_file(&kept.join(MARKER));
    Ok(Some(kept))
}

/// Gives a folder the first free of the names `NAME-1`, `NAME-2`, ...
pub fn move_beside(folder: &Path, name: &Path) -> io::Result<PathBuf> {
    for number in 1..10_000_u32 {
        let free = PathBuf::from(format!("{}-{number}", name.display()));
        match disk::rename_new(folder, &free) {
            Ok(()) => return Ok(free),
            Err(error) if matches!(error.kind(), ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty) => {}
            Err(error) => return Err(error),
        }
    }
    Err(ErrorKind::AlreadyExists.into())
}

/// Clears what killed processes left in `parent` for `target`, whose lock is held. Gives back where files of others stand now. What cannot
/// be cleared, such as another user's, hinders nobody.
pub fn clear_stale(parent: &Path, target: &Path, name: &str) -> Vec<PathBuf> {
    let mut stale = Vec::new();
    for entry in std::fs::read_dir(parent).into_iter().flatten().filter_map(Result::ok) {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let purpose = entry.file_name().to_str().and_then(|found| purpose_of(found, name));
        if let (true, Some(purpose)) = (is_folder, purpose) {
            stale.push((purpose, entry.path()));
        }
    }
    // A result that waits to be put back is looked at before those that were to follow it.
    stale.sort_by(|one, other| other.cmp(one));
    stale.into_iter().filter_map(|(purpose, path)| clear(&path, purpose, target).ok()?).collect()
}

/// Clears one folder that is named as this program names them.
fn clear(path: &Path, purpose: &str, target: &Path) -> Result<Option<PathBuf>, Error> {
    let failed = |source| io_error(path)(source);
    match Manifest::of(path)? {
        FolderList::Whole(manifest) => {
            // Killed between the two renames that replace a result where the system cannot exchange names.
            if purpose == OLD && std::fs::symlink_metadata(target).is_err_and(|e| e.kind() == ErrorKind::NotFound) {
                return disk::rename_new(path, target).map(|()| None).map_err(failed);
            }
            let survey = manifest.survey(path, Care::Full, &[])?;
            retire(path, &survey, &kept_name(target)).map_err(failed)
        }
        FolderList::Other(_, begin) if is_marked(path, &begin) => remove_marked(path).map(|()| None).map_err(failed),
        // Empty, or not this program's.
        FolderList::Absent => remove_if_empty(path).map(|_| None).map_err(failed),
        FolderList::Other(..) => Ok(None),
    }
}

/// Where files of others go that an earlier result held.
pub fn kept_name(target: &Path) -> PathBuf {
    PathBuf::from(format!("{}.kept", target.display()))
}

/// What a hidden folder's name says it is for.
fn purpose_of(found: &str, name: &str) -> Option<&'static str> {
    let rest = found.strip_prefix('.')?.strip_prefix(name)?.strip_prefix('.')?;
    [NEW, OLD].into_iter().find(|purpose| {
        let numbers = rest.strip_prefix(purpose).and_then(|rest| rest.strip_prefix('-'));
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        numbers.and_then(|rest| rest.split_once('-')).is_some_and(|(pid, turn)| is_number(pid) && is_number(turn))
    })
}
