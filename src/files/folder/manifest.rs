//! The list of what this program wrote into a result folder. It stands in the folder as `.sensel`: one line a folder or file, with length
//! and hash, and a hash of the lines themselves at the end. Only what it lists, and what still has the listed content, is ever removed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Metadata;
use std::io::{self, Read as _};
use std::path::{Component, Path};
use std::time::SystemTime;

use blake3::Hash;

use super::super::disk;
use super::super::errors::{content_error, io_error};
use super::super::open::{open_regular, read_opened};
use crate::error::Error;
use crate::num::u64_from;

/// The file that holds the list.
pub const MARKER: &str = ".sensel";
/// The list while it is being written.
const UNFINISHED: &str = ".sensel-part";
/// First line; a list of another form gets another number.
const HEADER: &str = "sensel manifest 1";
/// Longest list that is read: a million frames of ten files each.
const BYTES_MAX: u64 = 1 << 30;
/// Up to this many files are synchronised one by one; beyond, the whole file system at once is quicker.
const SYNCED_SINGLY_MAX: usize = 256;
/// Bytes that are hashed at once.
const PIECE_BYTES: usize = 1 << 18;

/// What was written: paths relative to the folder, with `/` between names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Manifest {
    folders: BTreeSet<String>,
    files: BTreeMap<String, ManifestContent>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct ManifestContent {
    bytes: u64,
    hash: Hash,
}

/// How well files are compared with the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Care {
    /// A file that is as long as listed and older than the list is taken for unchanged.
    Quick,
    /// Every file is read.
    Full,
}

/// What a folder holds, compared with its list.
#[derive(Debug, Default)]
pub struct Survey {
    /// Listed and unchanged, with the time of its last change.
    files: Vec<(String, Stamp)>,
    /// Listed folders that are there, each before those in it.
    folders: Vec<String>,
    /// Not listed.
    pub strange: Vec<String>,
    /// Listed, but with another content or of another kind.
    pub changed: Vec<String>,
}

#[derive(Debug, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    fn of(metadata: &Metadata) -> Self {
        Self { bytes: metadata.len(), modified: metadata.modified().ok() }
    }
}

/// The list of a folder, as far as it has one.
#[derive(Debug)]
pub enum FolderList {
    Absent,
    Whole(Manifest),
    /// A `.sensel` that is no list, with its reason and its first bytes.
    Other(String, Vec<u8>),
}

impl Manifest {
    /// Lists and hashes all that a folder holds, writes the list into it, and waits until everything is on the disk. Fails on something
    /// in the folder that this program cannot have written.
    pub fn seal(root: &Path) -> Result<Self, Error> {
        let mut manifest = Self::default();
        let mut names = Vec::new();
        let mut waiting = vec![String::new()];
        while let Some(folder) = waiting.pop() {
            for (name, path, metadata) in entries(root, &folder)? {
                let name = name.filter(|name| !name.contains('\n'));
                let name = name.ok_or_else(|| content_error(&path, "has a name that no result has"))?;
                if metadata.is_dir() {
                    manifest.folders.insert(name.clone());
                    waiting.push(name);
                } else if metadata.is_file() && name != MARKER {
                    names.push(name);
                } else if name != MARKER {
                    return Err(content_error(&path, "is neither a file nor a folder"));
                }
            }
        }
        let syncs_singly = names.len() <= SYNCED_SINGLY_MAX;
        for name in names {
            let content = content(&root.join(&name), syncs_singly)?;
            manifest.files.insert(name, content);
        }
        manifest.write(root).map_err(io_error(root))?;
        let is_synced = !syncs_singly && disk::sync_file_system(root).map_err(io_error(root))?;
        let synced = if is_synced { None } else { Some(manifest.folders.iter().rev().map(String::as_str).chain([""])) };
        for folder in synced.into_iter().flatten() {
            disk::sync_folder(&root.join(folder)).map_err(io_error(root))?;
        }
        Ok(manifest)
    }

    fn write(&self, root: &Path) -> io::Result<()> {
        let unfinished = root.join(UNFINISHED);
        disk::write_new(&unfinished, self.text().as_bytes())?;
        disk::rename(&unfinished, &root.join(MARKER))
    }

    fn text(&self) -> String {
        let mut text = format!("{HEADER}\nprogram sensel {}\n", env!("CARGO_PKG_VERSION"));
        self.folders.iter().for_each(|folder| text += &format!("folder {folder}\n"));
        for (name, ManifestContent { bytes, hash }) in &self.files {
            text += &format!("file {bytes} {} {name}\n", hash.to_hex());
        }
        let end = blake3::hash(text.as_bytes()).to_hex();
        text + &format!("end {end}\n")
    }

    fn parse(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let (lines, end) = text.strip_suffix('\n')?.rsplit_once('\n')?;
        let listed = format!("{lines}\n");
        let is_whole = end.strip_prefix("end ") == Some(blake3::hash(listed.as_bytes()).to_hex().as_str());
        if !is_whole {
            return None;
        }
        let mut lines = lines.lines();
        (lines.next() == Some(HEADER)).then_some(())?;
        let mut manifest = Self::default();
        for line in lines {
            let (kind, rest) = line.split_once(' ')?;
            match kind {
                "program" => {}
                "folder" => {
                    manifest.folders.insert(inside(rest)?);
                }
                "file" => {
                    let mut words = rest.splitn(3, ' ');
                    let (bytes, hash) = (words.next()?.parse().ok()?, Hash::from_hex(words.next()?).ok()?);
                    manifest.files.insert(inside(words.next()?)?, ManifestContent { bytes, hash });
                }
                _ => return None,
            }
        }
        Some(manifest)
    }

    pub fn of(root: &Path) -> Result<FolderList, Error> {
        let path = root.join(MARKER);
        match std::fs::symlink_metadata(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(FolderList::Absent),
            other => {
                if !other.map_err(io_error(&path))?.is_file() {
                    return Ok(FolderList::Other("is no file".to_owned(), Vec::new()));
                }
            }
        }
        let mut bytes = match read_opened(open_regular(&path)?, &path, BYTES_MAX) {
            Ok(bytes) => bytes,
            Err(Error::Content { reason, .. }) => return Ok(FolderList::Other(reason, Vec::new())),
            Err(error) => return Err(error),
        };
        if let Some(manifest) = Self::parse(&bytes) {
            return Ok(FolderList::Whole(manifest));
        }
        let reason = if bytes.starts_with(b"sensel ") && bytes.len() < 32 {
            "is an older version's and does not list what was written"
        } else {
            "is no list of what this program wrote"
        };
        bytes.truncate(1 << 10);
        Ok(FolderList::Other(reason.to_owned(), bytes))
    }

    /// Names that the folder itself holds, the list's own left out.
    pub fn top(&self) -> impl Iterator<Item = &str> {
        self.folders.iter().chain(self.files.keys()).map(String::as_str).filter(|name| !name.contains('/'))
    }

    /// Compares a folder with the list. Names of `ignored` at the top, and the list itself, are left out.
    pub fn survey(&self, root: &Path, care: Care, ignored: &[&str]) -> Result<Survey, Error> {
        let mut survey = Survey::default();
        let own = root.join(MARKER);
        let listed_at = std::fs::symlink_metadata(&own).and_then(|metadata| metadata.modified()).ok();
        let mut waiting = vec![String::new()];
        while let Some(folder) = waiting.pop() {
            for (name, path, metadata) in entries(root, &folder)? {
                if name.as_deref().is_some_and(|name| name == MARKER || ignored.contains(&name)) {
                    continue;
                }
                let shown = || path.strip_prefix(root).unwrap_or(&path).display().to_string();
                let Some(name) = name else {
                    survey.strange.push(shown());
                    continue;
                };
                let is_folder = self.folders.contains(&name);
                match self.files.get(&name) {
                    Some(content) if metadata.is_file() => {
                        if is_unchanged(&path, &metadata, content, (care, listed_at))? {
                            survey.files.push((name, Stamp::of(&metadata)));
                        } else {
                            survey.changed.push(shown());
                        }
                    }
                    None if is_folder && metadata.is_dir() => {
                        survey.folders.push(name.clone());
                        waiting.push(name);
                    }
                    None if !is_folder => survey.strange.push(shown()),
                    _ => survey.changed.push(shown()),
                }
            }
        }
        survey.strange.sort();
        survey.changed.sort();
        Ok(survey)
    }
}

impl Survey {
    /// Removes the files that were found unchanged and are so still, then the folders that this leaves empty, last the list where it is
    /// alone. A folder that is not empty is no error.
    pub fn remove(&self, root: &Path) -> io::Result<()> {
        for (name, stamp) in &self.files {
            let path = root.join(name);
            match std::fs::symlink_metadata(&path) {
                Ok(metadata) if metadata.is_file() && Stamp::of(&metadata) == *stamp => disk::remove_file(&path)?,
                _ => {}
            }
        }
        for folder in self.folders.iter().rev() {
            remove_if_empty(&root.join(folder))?;
        }
        if std::fs::read_dir(root)?.any(|entry| entry.is_ok_and(|entry| entry.file_name() != MARKER)) {
            return Ok(());
        }
        match disk::remove_file(&root.join(MARKER)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

/// Removes a folder unless it holds something; whether it is gone.
pub fn remove_if_empty(folder: &Path) -> io::Result<bool> {
    match disk::remove_dir(folder) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(false),
        Err(error) => Err(error),
    }
}

/// A listed path, where it stays in the folder.
fn inside(name: &str) -> Option<String> {
    let is_inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    (is_inside && !name.is_empty() && name != MARKER).then(|| name.to_owned())
}

/// What a folder under `root` holds: path relative to `root` where it is Unicode, whole path, and what it is, links not followed.
fn entries(root: &Path, folder: &str) -> Result<Vec<(Option<String>, std::path::PathBuf, Metadata)>, Error> {
    let path = root.join(folder);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&path).map_err(io_error(&path))? {
        let entry = entry.map_err(io_error(&path))?;
        let name = entry.file_name().into_string().ok();
        let name = name.map(|name| if folder.is_empty() { name } else { format!("{folder}/{name}") });
        let metadata = entry.metadata().map_err(io_error(&entry.path()))?;
        found.push((name, entry.path(), metadata));
    }
    Ok(found)
}

fn content(path: &Path, syncs: bool) -> Result<ManifestContent, Error> {
    let mut file = open_regular(path)?;
    let mut hasher = blake3::Hasher::new();
    let mut piece = vec![0; PIECE_BYTES];
    let mut bytes = 0;
    loop {
        let length = file.read(&mut piece).map_err(io_error(path))?;
        if length == 0 {
            break;
        }
        hasher.update(&piece[..length]);
        bytes += u64_from(length);
    }
    if syncs {
        file.sync_all().map_err(io_error(path))?;
    }
    Ok(ManifestContent { bytes, hash: hasher.finalize() })
}

fn is_unchanged(
    path: &Path,
    metadata: &Metadata,
    listed: &ManifestContent,
    (care, listed_at): (Care, Option<SystemTime>),
) -> Result<bool, Error> {
    if metadata.len() != listed.bytes {
        return Ok(false);
    }
    let is_older = metadata.modified().ok().zip(listed_at).is_some_and(|(modified, listed_at)| modified <= listed_at);
    if care == Care::Quick && is_older {
        return Ok(true);
    }
    Ok(content(path, false)? == *listed)
}
