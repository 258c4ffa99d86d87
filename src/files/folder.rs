//! An output folder that is whole or absent. Enters: the place a user named. Leaves: that folder, filled beside and renamed
//! into place. A folder this program did not write is never replaced.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::io_error;
use crate::error::Error;

/// The file that marks a folder as written by this program.
pub const MARKER: &str = ".sensel";

/// A folder under construction. Dropped without [`OutputFolder::commit`], it vanishes.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    beside: PathBuf,
    is_done: bool,
}

impl OutputFolder {
    /// Makes a hidden folder beside `target`, to be filled under [`OutputFolder::path`].
    ///
    /// # Errors
    /// `target` exists and is not ours (no marker, and not empty) or is a file; or the disk says no.
    pub fn create(target: &Path) -> Result<Self, Error> {
        // A link keeps pointing where it did: what it points at is replaced.
        let target = std::fs::canonicalize(target).unwrap_or_else(|_| target.to_owned());
        check_replaceable(&target)?;
        let name = target.file_name().ok_or_else(|| refused(&target, "has no name of its own; name a folder"))?;
        let parent = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        std::fs::create_dir_all(&parent).map_err(io_error(&parent))?;
        let beside = fresh_folder(&parent, &name.to_string_lossy(), "building")?;
        let folder = Self { target, beside, is_done: false };
        let marker = folder.beside.join(MARKER);
        std::fs::write(&marker, concat!("sensel ", env!("CARGO_PKG_VERSION"), "\n")).map_err(io_error(&marker))?;
        Ok(folder)
    }

    /// Whether `target` could be made or replaced, before long work is done for it.
    ///
    /// # Errors
    /// As [`OutputFolder::create`]; nothing is left behind.
    pub fn check(target: &Path) -> Result<(), Error> {
        Self::create(target).map(drop)
    }

    /// Where to write.
    pub fn path(&self) -> &Path {
        &self.beside
    }

    /// Renames the folder into place. What stood there before is removed only once the new one stands.
    ///
    /// # Errors
    /// The place was taken by something that is not ours in the meantime, or the disk says no; then nothing changed.
    pub fn commit(mut self) -> Result<PathBuf, Error> {
        check_replaceable(&self.target)?;
        let old = if self.target.exists() {
            let parent = self.beside.parent().expect("the folder was made in its parent").to_owned();
            let name = self.target.file_name().expect("checked when made").to_string_lossy().into_owned();
            let old = fresh_folder(&parent, &name, "old")?.join("folder");
            std::fs::rename(&self.target, &old).map_err(io_error(&self.target))?;
            Some(old)
        } else {
            None
        };
        if let Err(source) = std::fs::rename(&self.beside, &self.target) {
            if let Some(old) = &old {
                // The error of the first rename is the one to report; the old folder goes back if it can.
                let _ = std::fs::rename(old, &self.target);
            }
            return Err(io_error(&self.target)(source));
        }
        self.is_done = true;
        if let Some(holder) = old.as_deref().and_then(Path::parent) {
            std::fs::remove_dir_all(holder).map_err(io_error(holder))?;
        }
        Ok(self.target.clone())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.is_done {
            // Nobody is left to tell; a leftover is hidden and harmless.
            let _ = std::fs::remove_dir_all(&self.beside);
        }
    }
}

/// Writes a file beside its place and renames it there, so that it is whole or what it was before.
///
/// # Errors
/// The disk says no; then nothing changed.
pub fn replace_file(target: &Path, bytes: &[u8]) -> Result<(), Error> {
    // A link keeps pointing where it did: what it points at is replaced.
    let target = std::fs::canonicalize(target).unwrap_or_else(|_| target.to_owned());
    let holder = folder_beside(&target)?;
    let beside = holder.join("file");
    let written = std::fs::write(&beside, bytes).and_then(|()| std::fs::rename(&beside, &target));
    // The error of the writing is the one to report; an empty folder that stays is hidden and harmless.
    let _ = std::fs::remove_dir_all(&holder);
    written.map_err(io_error(&target))
}

/// Whether a file could be made beside `target`, before long work is done for it.
///
/// # Errors
/// The disk says no.
pub fn check_file(target: &Path) -> Result<(), Error> {
    let holder = folder_beside(target)?;
    std::fs::remove_dir(&holder).map_err(io_error(&holder))
}

/// A hidden folder in the folder of a file, which is made where it is not there.
fn folder_beside(target: &Path) -> Result<PathBuf, Error> {
    let name = target.file_name().ok_or_else(|| refused(target, "has no name of its own; name a file"))?;
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(io_error(parent))?;
    fresh_folder(parent, &name.to_string_lossy(), "building")
}

fn refused(target: &Path, reason: &str) -> Error {
    Error::key("out", target.display(), reason)
}

/// Ours, empty, or absent.
fn check_replaceable(target: &Path) -> Result<(), Error> {
    let metadata = match std::fs::symlink_metadata(target) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        other => other.map_err(io_error(target))?,
    };
    if !metadata.is_dir() {
        return Err(refused(target, "is no folder; name one that does not exist yet"));
    }
    let is_ours = target.join(MARKER).is_file();
    let is_empty = std::fs::read_dir(target).map_err(io_error(target))?.next().is_none();
    if is_ours || is_empty {
        return Ok(());
    }
    Err(refused(target, "exists and was not written by this program (no .sensel in it); remove it or name another"))
}

/// A new hidden folder whose name no other process or thread has.
fn fresh_folder(parent: &Path, name: &str, purpose: &str) -> Result<PathBuf, Error> {
    for attempt in 0..10_000_u32 {
        let path = parent.join(format!(".{name}.{purpose}-{}-{attempt}", std::process::id()));
        match std::fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(io_error(&path)(error)),
        }
    }
    Err(io_error(parent)(std::io::Error::from(ErrorKind::AlreadyExists)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_appears_whole_and_replaces_its_own_kind() {
        let scratch = Scratch::new();
        let target = scratch.path().join("deep/run");
        for content in ["first", "second"] {
            let folder = OutputFolder::create(&target).unwrap();
            std::fs::write(folder.path().join("a"), content).unwrap();
            let before = std::fs::read_to_string(target.join("a")).unwrap_or_default();
            assert_ne!(before, content, "nothing shows before the commit");
            folder.commit().unwrap();
            assert_eq!(std::fs::read_to_string(target.join("a")).unwrap(), content);
        }
        assert_eq!(names(target.parent().unwrap()), ["run"], "nothing is left beside it");
        assert_eq!(names(&target), [MARKER, "a"]);
    }

    #[test]
    fn a_file_is_replaced_whole_and_leaves_nothing_beside_it() {
        let scratch = Scratch::new();
        let target = scratch.path().join("deep/wave.vcd");
        for content in ["first", "second"] {
            replace_file(&target, content.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(&target).unwrap(), content);
        }
        assert_eq!(names(target.parent().unwrap()), ["wave.vcd"]);
        assert_eq!(replace_file(target.parent().unwrap(), b"").unwrap_err().exit_code(), 4);
        assert_eq!(names(target.parent().unwrap()), ["wave.vcd"]);
    }

    #[test]
    fn a_dropped_folder_leaves_nothing_and_keeps_the_old_one() {
        let scratch = Scratch::new();
        let target = scratch.path().join("run");
        drop(OutputFolder::create(&target).unwrap());
        assert!(names(scratch.path()).is_empty());
        OutputFolder::create(&target).unwrap().commit().unwrap();
        drop(OutputFolder::create(&target).unwrap());
        assert_eq!(names(scratch.path()), ["run"]);
        assert_eq!(names(&target), [MARKER]);
    }

    #[test]
    fn folders_and_files_of_others_are_refused_untouched() {
        let scratch = Scratch::new();
        let target = scratch.path().join("photos");
        std::fs::create_dir(&target).unwrap();
        std::fs::write(target.join("cat.jpg"), "x").unwrap();
        let error = OutputFolder::create(&target).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("photos"), "{error}");
        assert_eq!(names(&target), ["cat.jpg"]);
        assert_eq!(OutputFolder::create(&target.join("cat.jpg")).unwrap_err().exit_code(), 2);
        // Taken by somebody else between creation and commit.
        let late = scratch.path().join("late");
        let folder = OutputFolder::create(&late).unwrap();
        std::fs::create_dir(&late).unwrap();
        std::fs::write(late.join("theirs"), "x").unwrap();
        assert!(folder.commit().is_err());
        assert_eq!(names(&late), ["theirs"]);
        assert_eq!(names(scratch.path()), ["late", "photos"]);
    }
}
