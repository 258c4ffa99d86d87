//! Replacement of what a folder holds where the folder itself cannot be moved: a mount point, the folder that a shell stands in, a
//! folder in one that may not be written.
//!
//! The result is built in the hidden folder `.sensel-work` inside. A journal says which names leave and which come; once it is whole, the
//! names are moved one by one, the list first out and last in. A process that is killed before leaves the old result; one that is killed
//! in between leaves a journal, and the next one goes on from there.

use std::collections::BTreeSet;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::super::errors::{content_error, io_error, refused};
use super::super::{disk, read_bytes};
use super::lock::Lock;
use super::manifest::{Care, FolderList, MARKER, Manifest, Survey};
use super::work;
use crate::error::Error;

/// The hidden folder.
pub const WORK: &str = ".sensel-work";
const LOCK: &str = "lock";
const NEW: &str = "new";
const OLD: &str = "old";
const JOURNAL: &str = "journal";
const JOURNAL_PART: &str = "journal-part";
/// First line of a journal.
const HEADER: &str = "sensel journal 1";
/// Longest journal that is read; it has one line a name at the top of a result.
const BYTES_MAX: u64 = 1 << 20;

/// The hidden folder, locked. Dropped, it vanishes, unless a swap is under way.
#[derive(Debug)]
pub struct Inside {
    target: PathBuf,
    folder: PathBuf,
    lock: Option<Lock>,
    /// Where files of others stand now that were met on the way.
    pub kept: Vec<PathBuf>,
}

impl Inside {
    /// Takes the hidden folder of `target` and finishes what a killed process has begun there. Fails where another process holds it, it
    /// is not this program's, or what the disk says.
    pub fn take(target: &Path) -> Result<Self, Error> {
        let folder = target.join(WORK);
        match disk::create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => check_ours(target, &folder)?,
            other => other.map_err(io_error(&folder))?,
        }
        let lock = Lock::take(folder.join(LOCK), target)?;
        let mut inside = Self { target: target.to_owned(), folder, lock: Some(lock), kept: Vec::new() };
        inside.repair()?;
        Ok(inside)
    }

    /// Finishes what a killed process has begun in `target`, if there is anything. Gives back where files of others stand now.
    pub fn settle(target: &Path) -> Result<Vec<PathBuf>, Error> {
        let is_there = std::fs::symlink_metadata(target.join(WORK)).is_ok_and(|metadata| metadata.is_dir());
        if is_there { Ok(std::mem::take(&mut Self::take(target)?.kept)) } else { Ok(Vec::new()) }
    }

    /// A new folder to build in.
    pub fn build(&self) -> Result<PathBuf, Error> {
        let new = self.folder.join(NEW);
        disk::create_dir(&new).and_then(|()| work::mark(&new)).map_err(io_error(&new))?;
        Ok(new)
    }

    /// Puts a sealed folder's content in place of what the survey found.
    pub fn swap(&mut self, manifest: &Manifest, old: Option<&Manifest>, survey: Option<&Survey>) -> Result<(), Error> {
        let journal = Journal {
            old: old.into_iter().flat_map(Manifest::top).map(str::to_owned).collect(),
            new: manifest.top().map(str::to_owned).collect(),
        };
        let swapped = journal.write(&self.folder).and_then(|()| self.go_on(&journal));
        self.kept.extend(swapped.map_err(io_error(&self.target))?);
        self.retire(survey)
    }

    pub fn is_swapping(&self) -> bool {
        [JOURNAL, OLD].iter().any(|name| std::fs::symlink_metadata(self.folder.join(name)).is_ok())
    }

    /// Moves the names that have not been moved yet.
    fn go_on(&self, journal: &Journal) -> io::Result<Vec<PathBuf>> {
        let (old, new) = (self.folder.join(OLD), self.folder.join(NEW));
        let exists = |path: &Path| std::fs::symlink_metadata(path).is_ok();
        if !exists(&old) {
            disk::create_dir(&old)?;
        }
        for name in [MARKER].into_iter().chain(journal.old.iter().map(String::as_str)) {
            // A name that has left the new folder stands in the target as the new one.
            let has_come = (journal.new.contains(name) || name == MARKER) && !exists(&new.join(name));
            if exists(&self.target.join(name)) && !exists(&old.join(name)) && !has_come {
                disk::rename(&self.target.join(name), &old.join(name))?;
            }
        }
        disk::sync_folder(&old)?;
        let mut kept = Vec::new();
        for name in journal.new.iter().map(String::as_str).chain([MARKER]) {
            let (from, to) = (new.join(name), self.target.join(name));
            if !exists(&from) {
                continue;
            }
            if exists(&to) {
                kept.push(work::move_beside(&to, &work::kept_name(&to))?);
            }
            disk::rename_new(&from, &to)?;
        }
        disk::sync_folder(&self.target)?;
        disk::remove_file(&self.folder.join(JOURNAL))?;
        Ok(kept)
    }

    fn retire(&mut self, survey: Option<&Survey>) -> Result<(), Error> {
        let old = self.folder.join(OLD);
        if std::fs::symlink_metadata(&old).is_err() {
            return Ok(());
        }
        let found = match (survey, Manifest::of(&old)?) {
            (None, FolderList::Whole(manifest)) => Some(manifest.survey(&old, Care::Full, &[])?),
            _ => None,
        };
        let nothing = Survey::default();
        let survey = survey.or(found.as_ref()).unwrap_or(&nothing);
        let name = self.target.file_name().map_or_else(|| "result".into(), |name| name.to_string_lossy());
        let kept = work::retire(&old, survey, &work::kept_name(&self.target.join(&*name)));
        self.kept.extend(kept.map_err(io_error(&old))?);
        Ok(())
    }

    fn repair(&mut self) -> Result<(), Error> {
        let failed = |source| io_error(&self.folder)(source);
        if std::fs::symlink_metadata(self.folder.join(MARKER)).is_err() {
            work::mark(&self.folder).map_err(failed)?;
        }
        if let Some(journal) = Journal::read(&self.folder)? {
            let kept = self.go_on(&journal).map_err(failed)?;
            self.kept.extend(kept);
        }
        self.retire(None)?;
        self.empty().map_err(io_error(&self.folder))
    }

    /// Removes what is neither mark nor lock; the earlier result has gone before.
    fn empty(&self) -> io::Result<()> {
        let new = self.folder.join(NEW);
        if std::fs::symlink_metadata(&new).is_ok() {
            disk::remove_tree(&new)?;
        }
        match disk::remove_file(&self.folder.join(JOURNAL_PART)) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        if self.is_swapping() {
            return;
        }
        // Nobody is left to tell; the next run to the same folder clears what stays.
        let _ = self.empty().and_then(|()| disk::remove_file(&self.folder.join(MARKER)));
        self.lock = None;
        let _ = disk::remove_dir(&self.folder);
    }
}

/// Refuses a folder of this name that somebody else made.
fn check_ours(target: &Path, folder: &Path) -> Result<(), Error> {
    let entries = || std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let is_marked = matches!(Manifest::of(folder)?, FolderList::Other(_, begin) if work::is_mark(&begin));
    let is_fresh = entries().all(|name| name == LOCK || name == MARKER) && is_short(&folder.join(LOCK));
    if is_marked || is_fresh {
        return Ok(());
    }
    Err(refused(target, format!("holds {WORK}, which this program needs and did not make; rename it")))
}

/// Whether a file is empty or absent.
fn is_short(path: &Path) -> bool {
    std::fs::symlink_metadata(path).map_or(true, |metadata| metadata.len() == 0)
}

/// Names at the top that leave and that come; the list itself, which does both, is left out.
struct Journal {
    old: BTreeSet<String>,
    new: BTreeSet<String>,
}

impl Journal {
    fn write(&self, folder: &Path) -> io::Result<()> {
        let mut text = format!("{HEADER}\n");
        self.old.iter().for_each(|name| text += &format!("old {name}\n"));
        self.new.iter().for_each(|name| text += &format!("new {name}\n"));
        let part = folder.join(JOURNAL_PART);
        disk::write_new(&part, text.as_bytes())?;
        // Renamed when it is whole, so that every journal is.
        disk::rename(&part, &folder.join(JOURNAL))?;
        disk::sync_folder(folder)
    }

    fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(JOURNAL);
        if std::fs::symlink_metadata(&path).is_err() {
            return Ok(None);
        }
        let text = String::from_utf8(read_bytes(&path, BYTES_MAX)?).unwrap_or_default();
        let mut journal = Self { old: BTreeSet::new(), new: BTreeSet::new() };
        let broken = || content_error(&path, "is no journal of this program; move it away");
        let rest = text.strip_prefix(HEADER).ok_or_else(broken)?;
        for line in rest.lines().skip(1) {
            let (kind, name) = line.split_once(' ').filter(|(_, name)| is_name(name)).ok_or_else(broken)?;
            let names = if kind == OLD { &mut journal.old } else { &mut journal.new };
            names.insert(name.to_owned());
        }
        Ok(Some(journal))
    }
}

/// A plain name, neither a path nor one of this program's own.
fn is_name(name: &str) -> bool {
    !name.contains('/') && !["", ".", "..", MARKER, WORK].contains(&name)
}
