//! A result folder that is whole or absent, and never takes the place of what this program did not write.
//!
//! A result is built in a hidden folder beside its target and lists what it holds. It is then exchanged with the earlier result in one
//! step, and the earlier one is removed by its own list. Where the folder cannot be moved, its content is replaced instead; see `contents`.

mod contents;
pub(super) mod lock;
mod manifest;
mod parents;
mod single;
#[cfg(test)]
mod tests;
mod work;

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::disk;
use super::errors::{io_error, refused};
use crate::error::Error;
use contents::{Inside, WORK};
use lock::Lock;
use manifest::{Care, FolderList, Manifest, Survey};

pub use manifest::MARKER;
use parents::{Parents, resolve, until_parents_stay};
pub use single::{check_file, replace_file};

/// Files of others that a refusal names, at most.
const NAMED_MAX: usize = 3;

/// A folder under construction. Dropped without [`OutputFolder::commit`], it vanishes.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    /// Where it is built.
    root: PathBuf,
    is_done: bool,
    /// Where files of others stand now that stood in what a killed process left.
    kept: Vec<PathBuf>,
    mode: WriteMode,
    /// Lies beside the folder; none where nothing may be written there.
    _lock: Option<Lock>,
    // Declared last: they go once the lock in them is gone.
    parents: Parents,
}

/// How the result gets to its target.
#[derive(Debug)]
enum WriteMode {
    /// The folder is renamed.
    Beside { parent: PathBuf },
    /// What the folder holds is replaced.
    Inside(Inside),
}

/// A result that stands at its target.
#[derive(Debug)]
pub struct PlacedResult {
    /// The folder.
    pub folder: PathBuf,
    /// Files and folders of others that stood in the way and were kept under these names.
    pub kept: Vec<PathBuf>,
}

impl OutputFolder {
    /// Makes a hidden folder to be filled under [`OutputFolder::path`], and clears what killed processes left for the same target. Fails
    /// where `target` is a file, or holds something that this program did not write; another process writes there; or the disk says no.
    pub fn create(target: &Path) -> Result<Self, Error> {
        Self::create_where(target, holds_current_folder)
    }

    fn create_where(target: &Path, must_stay: fn(&Path) -> bool) -> Result<Self, Error> {
        until_parents_stay(|| Self::create_once(target, must_stay))
    }

    fn create_once(target: &Path, must_stay: fn(&Path) -> bool) -> Result<Self, Error> {
        let (target, parents) = resolve(target)?;
        let (Some(name), Some(parent)) = (target.file_name(), target.parent()) else {
            return Err(refused(&target, "has no name of its own; name a folder"));
        };
        let (name, parent) = (name.to_string_lossy().into_owned(), parent.to_owned());
        let is_there = target.is_dir();
        let must_stay = is_there && (disk::is_mount_point(&target, &parent) || must_stay(&target));
        let lock = match Lock::take(parent.join(format!(".{name}.sensel-lock")), &target) {
            Err(Error::Io { source, .. }) if is_there && (must_stay || disk::is_forbidden(&source)) => None,
            other => Some(other?),
        };
        let may_clear = lock.as_ref().is_some_and(|lock| lock.is_exclusive);
        let mut kept = if may_clear { work::clear_stale(&parent, &target, &name) } else { Vec::new() };
        let (mode, root) = if must_stay || lock.is_none() {
            let mut inside = Inside::take(&target)?;
            kept.append(&mut inside.kept);
            TargetState::of(&target, Care::Quick)?;
            let root = inside.build()?;
            (WriteMode::Inside(inside), root)
        } else {
            kept.extend(Inside::settle(&target)?);
            TargetState::of(&target, Care::Quick)?;
            let root = work::fresh(&parent, &name)?;
            (WriteMode::Beside { parent }, root)
        };
        let folder = Self { target, root, is_done: false, kept, mode, _lock: lock, parents };
        if matches!(folder.mode, WriteMode::Beside { .. }) {
            folder.copy_ownership()?;
        }
        Ok(folder)
    }

    /// Whether `target` could be made or replaced, before long work is done for it.
    pub fn check(target: &Path) -> Result<(), Error> {
        Self::create(target).map(drop)
    }

    /// Where to write.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Moves the folder to its target. What this program wrote there before is removed once the new one stands. Fails where the target
    /// holds something that is not this program's, or the disk says no. The target is as it was then, and the finished result stays beside
    /// it under the name that the error says.
    pub fn commit(self) -> Result<PlacedResult, Error> {
        self.commit_by(disk::exchange)
    }

    fn commit_by(mut self, exchange: fn(&Path, &Path) -> io::Result<()>) -> Result<PlacedResult, Error> {
        let manifest = Manifest::seal(&self.root)?;
        match self.put(&manifest, exchange) {
            Ok(()) => {
                self.is_done = true;
                self.parents.0.clear();
                Ok(PlacedResult { folder: self.target.clone(), kept: std::mem::take(&mut self.kept) })
            }
            Err(error) => Err(self.keep_finished(error)),
        }
    }

    fn put(&mut self, manifest: &Manifest, exchange: fn(&Path, &Path) -> io::Result<()>) -> Result<(), Error> {
        let state = TargetState::of(&self.target, Care::Full)?;
        let failed = |source| io_error(&self.target)(source);
        let parent = match &mut self.mode {
            WriteMode::Inside(inside) => {
                let (old, survey) = match &state {
                    TargetState::Ours(old, survey) => (Some(old), Some(survey)),
                    TargetState::Free => (None, None),
                };
                inside.swap(manifest, old, survey)?;
                self.kept.append(&mut inside.kept);
                return Ok(());
            }
            WriteMode::Beside { parent } => parent,
        };
        if let Ok(metadata) = std::fs::metadata(&self.target) {
            disk::copy_ownership(&metadata, &self.root).map_err(failed)?;
        }
        let TargetState::Ours(_, survey) = state else {
            // An empty folder is replaced in the same step; one that was filled meanwhile is not.
            disk::rename(&self.root, &self.target).map_err(failed)?;
            return disk::sync_folder(parent).map_err(failed);
        };
        let old = match exchange(&self.root, &self.target) {
            Ok(()) => self.root.clone(),
            Err(error) if disk::is_unsupported(&error) => {
                let name = self.target.file_name().expect("checked when made").to_string_lossy();
                let old = work::unused(parent, &name, work::OLD)?;
                disk::rename(&self.target, &old).map_err(failed)?;
                if let Err(source) = disk::rename(&self.root, &self.target) {
                    // The error of this rename is the one to report; the old result goes back if it can.
                    let _ = disk::rename_new(&old, &self.target);
                    return Err(failed(source));
                }
                old
            }
            Err(source) => return Err(failed(source)),
        };
        // From here on the result stands: what cannot be removed of the old one is left to the next run.
        self.is_done = true;
        let retired =
            disk::sync_folder(parent).and_then(|()| work::retire(&old, &survey, &work::kept_name(&self.target)));
        self.kept.extend(retired.unwrap_or(Some(old)));
        Ok(())
    }

    /// A finished result is not thrown away because its target is taken.
    fn keep_finished(&mut self, error: Error) -> Error {
        let beside = match &self.mode {
            WriteMode::Beside { .. } => self.target.clone(),
            WriteMode::Inside(_) => self.target.join(self.target.file_name().unwrap_or_default()),
        };
        let is_swapping = matches!(&self.mode, WriteMode::Inside(inside) if inside.is_swapping());
        let note = if is_swapping {
            "; the finished result is half in its place, and the next run to it moves the rest".to_owned()
        } else {
            let name = PathBuf::from(format!("{}.finished", beside.display()));
            let Ok(finished) = work::move_beside(&self.root, &name) else { return error };
            self.is_done = true;
            self.parents.0.clear();
            format!("; the finished result is in {}", finished.display())
        };
        match error {
            Error::Config { file, line, key, value, reason } => {
                Error::Config { file, line, key, value, reason: reason + &note }
            }
            Error::Content { file, reason } => Error::Content { file, reason: reason + &note },
            Error::Io { path, source } => {
                Error::Io { path, source: io::Error::new(source.kind(), format!("{source}{note}")) }
            }
            other => other,
        }
    }

    /// A folder that is replaced keeps its permissions and its group; files get the group from it while they are written.
    fn copy_ownership(&self) -> Result<(), Error> {
        match std::fs::metadata(&self.target) {
            Ok(metadata) => disk::copy_ownership(&metadata, &self.root).map_err(io_error(&self.root)),
            Err(_) => Ok(()),
        }
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.is_done && matches!(self.mode, WriteMode::Beside { .. }) {
            // Nobody is left to tell; a leftover is hidden, and the next run to the same target clears it.
            let _ = work::remove_marked(&self.root);
        }
    }
}

/// What stands at the target, where that may be replaced.
enum TargetState {
    /// Nothing, or an empty folder.
    Free,
    /// A result of this program, and nothing else.
    Ours(Manifest, Survey),
}

impl TargetState {
    fn of(target: &Path, care: Care) -> Result<Self, Error> {
        let metadata = match std::fs::symlink_metadata(target) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::Free),
            other => other.map_err(io_error(target))?,
        };
        if !metadata.is_dir() {
            return Err(refused(target, "is no folder; name one that does not exist yet"));
        }
        if metadata.permissions().readonly() {
            return Err(refused(target, "is write-protected; name another folder"));
        }
        match Manifest::of(target)? {
            FolderList::Whole(manifest) => {
                let survey = manifest.survey(target, care, &[WORK])?;
                check_survey(target, &survey)?;
                Ok(Self::Ours(manifest, survey))
            }
            FolderList::Other(reason, _) => {
                let reason = format!(
                    "holds a {MARKER} that {reason}, so nothing in it is replaced; remove the folder yourself or name another"
                );
                Err(refused(target, reason))
            }
            FolderList::Absent => {
                let mut entries = std::fs::read_dir(target).map_err(io_error(target))?;
                if entries.all(|entry| entry.is_ok_and(|entry| entry.file_name() == WORK)) {
                    return Ok(Self::Free);
                }
                let reason = format!(
                    "exists and was not written by this program (no {MARKER} in it); remove it or name another"
                );
                Err(refused(target, reason))
            }
        }
    }
}

fn check_survey(target: &Path, survey: &Survey) -> Result<(), Error> {
    for (names, what) in [
        (&survey.strange, "what this program did not write there"),
        (&survey.changed, "what was changed since this program wrote it"),
    ] {
        let more = names.len().saturating_sub(NAMED_MAX);
        let shown = names[..names.len() - more].join(", ");
        let named = if more > 0 { format!("{shown} and {more} more") } else { shown };
        if !names.is_empty() {
            let reason = format!("holds {what}: {named}; move it away or name another folder");
            return Err(refused(target, reason));
        }
    }
    Ok(())
}

/// Whether the folder that this process stands in is `target` or lies in it. Whoever started the process stands there too.
fn holds_current_folder(target: &Path) -> bool {
    std::env::current_dir().and_then(std::fs::canonicalize).is_ok_and(|current| current.starts_with(target))
}
