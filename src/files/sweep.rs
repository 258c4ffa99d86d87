//! The folder of a sweep: one small file a cell, written whole by rename, under a lock that one process holds.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::errors::{content_error, io_error};
use super::folder::lock::Lock;
use super::{disk, make_folder, read_bytes};
use crate::error::Error;
use crate::sweep::CellRecord;

/// Names a folder as a sweep's.
const MARK: &str = ".sensel-sweep";
/// Text of the mark.
const MARK_TEXT: &str = "A sweep of sensel. Its cells lie in cells/; sensel sweep run goes on where it stopped.\n";
/// Folder of the cells.
const CELLS: &str = "cells";
/// Ending of a cell that is not yet whole.
const UNFINISHED: &str = "part";
/// Most bytes of a record.
const RECORD_BYTES_MAX: u64 = 1 << 22;

static TURN: AtomicU32 = AtomicU32::new(0);

/// A sweep's folder.
#[derive(Debug)]
pub struct SweepFolder {
    path: PathBuf,
    /// Held while cells are written; readers and shards of a cluster do without.
    _lock: Option<Lock>,
}

/// What was found in a sweep's folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundCells {
    /// Whole records by the cell's name, failed ones too.
    pub records: BTreeMap<String, CellRecord>,
    /// Files whose checksum does not hold.
    pub damaged: Vec<PathBuf>,
}

impl SweepFolder {
    /// Takes a folder for running: makes it if need be, and holds its lock. `is_shared` leaves the lock out, for processes that each run
    /// other cells of one sweep. Fails where another process runs a sweep there; files of others stand there; the disk says no.
    pub fn take(path: &Path, is_shared: bool) -> Result<Self, Error> {
        make_folder(path)?;
        let mark = path.join(MARK);
        if !mark.is_file() {
            refuse_others(path)?;
            write_whole(&mark, MARK_TEXT.as_bytes())?;
        }
        let lock = if is_shared { None } else { Some(Lock::take(path.join(".lock"), path)?) };
        make_folder(&path.join(CELLS))?;
        let this = Self { path: path.to_owned(), _lock: lock };
        if !is_shared {
            this.remove_unfinished()?;
        }
        Ok(this)
    }

    /// A folder for reading alone. Fails where it is no folder of a sweep.
    pub fn read(path: &Path) -> Result<Self, Error> {
        if path.join(MARK).is_file() {
            return Ok(Self { path: path.to_owned(), _lock: None });
        }
        let reason = "holds no sweep; run it first with 'sensel sweep run FILE', or name its folder with --out";
        Err(content_error(path, reason))
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn path_of(&self, cell: &str) -> PathBuf {
        // 256 folders keep each of them short.
        self.path.join(CELLS).join(&cell[..2]).join(format!("{cell}.json"))
    }

    /// The records of these cells. A missing file is no error; a damaged one counts as missing and is named.
    pub fn find<'a>(&self, cells: impl Iterator<Item = &'a str>) -> FoundCells {
        let mut found = FoundCells::default();
        for cell in cells {
            let path = self.path_of(cell);
            let Ok(bytes) = read_bytes(&path, RECORD_BYTES_MAX) else { continue };
            match CellRecord::from_bytes(&bytes).filter(|record| record.cell == cell) {
                Some(record) => {
                    found.records.insert(cell.to_owned(), record);
                }
                None => found.damaged.push(path),
            }
        }
        found
    }

    /// Writes a cell's record: to a file beside the cell's, synced, renamed. Fails where the disk says no; then the cell counts as not run.
    pub fn write(&self, record: &CellRecord) -> Result<(), Error> {
        let path = self.path_of(&record.cell);
        if let Some(folder) = path.parent() {
            make_folder(folder)?;
        }
        write_whole(&path, &record.to_bytes())
    }

    /// Writes a file of the whole sweep, such as the table.
    pub fn write_file(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        write_whole(&path, bytes)?;
        Ok(path)
    }

    /// What killed runs left.
    fn remove_unfinished(&self) -> Result<(), Error> {
        let cells = self.path.join(CELLS);
        let listed = |folder: &Path| -> Result<Vec<PathBuf>, Error> {
            let entries = std::fs::read_dir(folder).map_err(io_error(folder))?;
            entries.map(|entry| entry.map(|entry| entry.path()).map_err(io_error(folder))).collect()
        };
        let is_unfinished = |path: &PathBuf| path.extension().is_some_and(|ending| ending == UNFINISHED);
        let mut all = listed(&self.path)?;
        for folder in listed(&cells)?.into_iter().filter(|path| path.is_dir()) {
            all.extend(listed(&folder)?);
        }
        for path in all.into_iter().filter(is_unfinished) {
            let _ = disk::remove_file(&path);
        }
        Ok(())
    }
}

/// Refuses a folder with files that are no sweep's.
fn refuse_others(path: &Path) -> Result<(), Error> {
    for entry in std::fs::read_dir(path).map_err(io_error(path))? {
        let name = entry.map_err(io_error(path))?.file_name().to_string_lossy().into_owned();
        // Another part of the same sweep may be writing the mark, or have written it since.
        if !name.starts_with(MARK) && !path.join(MARK).is_file() {
            return Err(content_error(path, format!("holds '{name}' and no sweep; name an empty folder with --out")));
        }
    }
    Ok(())
}

/// Writes to a file beside the path, syncs, renames.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let turn = TURN.fetch_add(1, Ordering::Relaxed);
    let beside = path.with_extension(format!("{}-{turn}.{UNFINISHED}", std::process::id()));
    let write = || -> std::io::Result<()> {
        let _ = std::fs::remove_file(&beside);
        let mut file = std::fs::File::create_new(&beside)?;
        file.write_all(bytes)?;
        file.sync_data()?;
        disk::rename(&beside, path)
    };
    write().map_err(|source| {
        let _ = std::fs::remove_file(&beside);
        io_error(path)(source)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;

    fn record(cell: &str) -> CellRecord {
        CellRecord { cell: cell.to_owned(), ..CellRecord::default() }
    }

    #[test]
    fn cells_come_back_whole_and_a_damaged_one_counts_as_missing() {
        let scratch = Scratch::new();
        let folder = SweepFolder::take(&scratch.path().join("s"), false).unwrap();
        for cell in ["aa11", "aa22", "bb33"] {
            folder.write(&record(cell)).unwrap();
        }
        let path = folder.path_of("aa22");
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[80] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let found = folder.find(["aa11", "aa22", "bb33", "cc44"].into_iter());
        assert_eq!(found.records.keys().collect::<Vec<_>>(), ["aa11", "bb33"]);
        assert_eq!(found.damaged, [path]);
    }

    #[test]
    fn one_process_alone_may_run_and_others_files_are_refused() {
        let scratch = Scratch::new();
        let path = scratch.path().join("s");
        let held = SweepFolder::take(&path, false).unwrap();
        let said = SweepFolder::take(&path, false).unwrap_err().to_string();
        assert!(said.contains("another process"), "{said}");
        assert!(SweepFolder::take(&path, true).is_ok(), "shards share it");
        drop(held);
        std::fs::write(path.join("cells/x.1-2.part"), "x").unwrap();
        std::fs::write(path.join("left.1-2.part"), "x").unwrap();
        assert!(SweepFolder::take(&path, false).is_ok());
        assert!(!path.join("left.1-2.part").exists(), "what a killed run left is removed");
        let theirs = scratch.path().join("theirs");
        std::fs::create_dir(&theirs).unwrap();
        std::fs::write(theirs.join("diary.txt"), "x").unwrap();
        std::fs::write(theirs.join(".sensel-sweep.77-0.part"), "x").unwrap();
        let said = SweepFolder::take(&theirs, false).unwrap_err().to_string();
        assert!(said.contains("diary.txt") && said.contains("--out"), "{said}");
        assert!(SweepFolder::read(&theirs).is_err());
        std::fs::remove_file(theirs.join("diary.txt")).unwrap();
        assert!(SweepFolder::take(&theirs, true).is_ok(), "another part is writing the mark");
    }
}
