//! The user's cache: bytes under a key (a hash in hexadecimal of all that made them).
//!
//! Entries are written by rename and carry a checksum. The least recently used go when the cache outgrows its size. Damaged and
//! absent entries give different errors; neither gives bytes.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use super::errors::io_error;
use super::open::{open_regular, read_opened};
use crate::error::Error;

/// Ending of an entry's file.
const ENTRY: &str = "entry";
/// Ending of a file that is still being written.
const UNFINISHED: &str = "part";
/// An unfinished file this old belongs to a process that died.
const UNFINISHED_AGE_MAX: Duration = Duration::from_secs(24 * 3600);
/// Bytes of the checksum at an entry's head.
const CHECKSUM_BYTES: usize = 32;

/// Numbers the unfinished files of this process, so that two threads never write to one.
static TURN: AtomicU32 = AtomicU32::new(0);

/// A folder of entries. Several processes may share it.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    capacity_bytes: u64,
    /// Bytes that this process has stored since it last looked at the whole folder; none looked at yet: the capacity.
    unseen_bytes: Arc<AtomicU64>,
}

/// What lies under a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CacheEntry {
    /// The bytes as they were stored.
    Whole(Vec<u8>),
    /// A file whose checksum does not hold, or that cannot be read.
    Damaged,
    /// Nothing.
    Absent,
}

/// Share of the capacity that is stored between two looks at the whole folder: a look takes some microseconds an entry.
const UNSEEN_SHARE: u64 = 64;

impl Cache {
    /// Opens a cache in `folder`, or in the user's: `$XDG_CACHE_HOME/sensel`, else `$HOME/.cache/sensel`. Fails where no folder is given
    /// and neither variable is set, or the folder cannot be made.
    pub fn open(folder: Option<&Path>, capacity_bytes: u64) -> Result<Self, Error> {
        let folder = match folder {
            Some(folder) => folder.to_owned(),
            None => user_folder(std::env::var_os("XDG_CACHE_HOME"), std::env::var_os("HOME"))
                .ok_or_else(|| Error::key("cache", "", "neither XDG_CACHE_HOME nor HOME is set; name a folder"))?,
        };
        super::make_folder(&folder)?;
        Ok(Self { folder, capacity_bytes, unseen_bytes: Arc::new(AtomicU64::new(capacity_bytes)) })
    }

    /// Why nothing can be stored, if so, in the system's words. What is there already can be read all the same.
    pub fn why_not_writable(&self) -> Option<String> {
        let turn = TURN.fetch_add(1, Ordering::Relaxed);
        let probe = self.folder.join(format!("probe-{}-{turn}.{UNFINISHED}", std::process::id()));
        let written = fs::write(&probe, b"x");
        let _ = fs::remove_file(&probe);
        written.err().map(|error| format!("{}: {error}", self.folder.display()))
    }

    /// Where the entries lie.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The bytes under a key, if they are there and whole. Marks them as used now.
    pub fn get(&self, key: &str) -> Option<Vec<u8>> {
        if let CacheEntry::Whole(bytes) = self.find(key) { Some(bytes) } else { None }
    }

    /// Whether something lies under a key, whole or not.
    pub fn has(&self, key: &str) -> bool {
        self.path(key).is_file()
    }

    /// What lies under a key. Marks it as used now.
    pub fn find(&self, key: &str) -> CacheEntry {
        let path = self.path(key);
        let file = match open_regular(&path) {
            Ok(file) => file,
            // A file that another process has put there since is one of the next look.
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                let is_broken_link = fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_symlink());
                return if is_broken_link { CacheEntry::Damaged } else { CacheEntry::Absent };
            }
            Err(_) if fs::symlink_metadata(&path).is_ok() => return CacheEntry::Damaged,
            Err(_) => return CacheEntry::Absent,
        };
        let used = file.try_clone();
        let Ok(mut bytes) = read_opened(file, &path, self.capacity_bytes) else { return CacheEntry::Damaged };
        match bytes.split_at_checked(CHECKSUM_BYTES) {
            Some((checksum, content)) if checksum_of(key, content) == checksum => {}
            _ => return CacheEntry::Damaged,
        }
        // The time of use matters for the order of eviction only: a read-only cache works as well.
        let _ = used.and_then(|file| file.set_modified(SystemTime::now()));
        bytes.drain(..CHECKSUM_BYTES);
        CacheEntry::Whole(bytes)
    }

    /// Stores bytes under a key, then removes the least recently used entries beyond the capacity. Bytes that alone are
    /// more than the capacity are not stored: false.
    pub fn put(&self, key: &str, content: &[u8]) -> Result<bool, Error> {
        if crate::num::u64_from(content.len() + CHECKSUM_BYTES) > self.capacity_bytes {
            return Ok(false);
        }
        let path = self.path(key);
        let turn = TURN.fetch_add(1, Ordering::Relaxed);
        let unfinished = path.with_extension(format!("{}-{turn}.{UNFINISHED}", std::process::id()));
        let mut bytes = Vec::with_capacity(content.len() + CHECKSUM_BYTES);
        bytes.extend_from_slice(&checksum_of(key, content));
        bytes.extend_from_slice(content);
        let written = write_new(&unfinished, &bytes).and_then(|()| fs::rename(&unfinished, &path));
        if let Err(source) = written {
            let _ = fs::remove_file(&unfinished);
            return Err(io_error(&path)(source));
        }
        let stored = crate::num::u64_from(bytes.len());
        let unseen = self.unseen_bytes.fetch_add(stored, Ordering::Relaxed).saturating_add(stored);
        if unseen > self.capacity_bytes / UNSEEN_SHARE {
            self.unseen_bytes.store(0, Ordering::Relaxed);
            self.evict()?;
        }
        Ok(true)
    }

    /// Removes the least recently used entries beyond the capacity, and what dead processes left.
    fn evict(&self) -> Result<(), Error> {
        let now = SystemTime::now();
        let mut entries = Vec::new();
        for entry in fs::read_dir(&self.folder).map_err(io_error(&self.folder))? {
            let path = entry.map_err(io_error(&self.folder))?.path();
            // Another process may have removed it since: then there is nothing to do.
            let Ok(metadata) = fs::symlink_metadata(&path) else { continue };
            let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            match path.file_name().and_then(|name| kind_of(name.to_str()?)) {
                Some(_) if !metadata.is_file() => {}
                Some(ENTRY) => entries.push((modified, path, metadata.len())),
                Some(UNFINISHED) if now.duration_since(modified).is_ok_and(|age| age > UNFINISHED_AGE_MAX) => {
                    let _ = fs::remove_file(&path);
                }
                _ => {}
            }
        }
        entries.sort();
        // Other processes store between two looks of this one; what this one may store until then is made room for.
        let room_bytes = self.capacity_bytes - self.capacity_bytes / UNSEEN_SHARE;
        let mut total_bytes: u64 = entries.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, bytes) in entries {
            if total_bytes <= room_bytes {
                break;
            }
            let _ = fs::remove_file(&path);
            total_bytes -= bytes;
        }
        Ok(())
    }

    fn path(&self, key: &str) -> PathBuf {
        assert!(is_key(key), "a cache key is a hash in lower-case hexadecimal");
        self.folder.join(format!("{key}.{ENTRY}"))
    }
}

/// Of an entry's bytes under its key, so that an entry that was copied or renamed to another key is damaged too.
fn checksum_of(key: &str, content: &[u8]) -> [u8; CHECKSUM_BYTES] {
    *blake3::Hasher::new().update(key.as_bytes()).update(content).finalize().as_bytes()
}

/// Writes a file that is not there yet: nothing that somebody else put there is followed or filled.
fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    use std::io::Write as _;
    // A process of the same number may have died here.
    let _ = fs::remove_file(path);
    fs::File::create_new(path)?.write_all(bytes)
}

fn is_key(key: &str) -> bool {
    (8..=128).contains(&key.len()) && key.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Whether a file of this name is an entry or an unfinished one. Others that lie in the folder are a user's: they are neither counted nor
/// removed.
fn kind_of(name: &str) -> Option<&'static str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let mut parts = name.split('.');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(key), Some(ENTRY), None, None) if is_key(key) => Some(ENTRY),
        (Some(key), Some(turn), Some(UNFINISHED), None) if is_key(key) => {
            let (process, turn) = turn.split_once('-')?;
            (is_number(process) && is_number(turn)).then_some(UNFINISHED)
        }
        _ => None,
    }
}

fn user_folder(xdg: Option<std::ffi::OsString>, home: Option<std::ffi::OsString>) -> Option<PathBuf> {
    // The standard says that relative or empty values of XDG_CACHE_HOME are to be ignored.
    let xdg = xdg.map(PathBuf::from).filter(|path| path.is_absolute());
    let home = home.filter(|home| !home.is_empty()).map(|home| Path::new(&home).join(".cache"));
    Some(xdg.or(home)?.join("sensel"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;

    const KEYS: [&str; 3] = ["00000000aa", "11111111bb", "22222222cc"];

    #[test]
    fn entries_return_whole_or_not_at_all() {
        let scratch = Scratch::new();
        let cache = Cache::open(Some(scratch.path()), 1 << 20).unwrap();
        assert_eq!(cache.get(KEYS[0]), None);
        assert!(cache.put(KEYS[0], b"light").unwrap());
        assert_eq!(cache.get(KEYS[0]).unwrap(), b"light");
        let path = cache.path(KEYS[0]);
        let whole = fs::read(&path).unwrap();
        let mut tried = 0;
        for cut in 0..whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            assert_eq!(cache.get(KEYS[0]), None, "cut to {cut} bytes");
            let mut flipped = whole.clone();
            flipped[cut] ^= 0x10;
            fs::write(&path, &flipped).unwrap();
            assert_eq!(cache.get(KEYS[0]), None, "byte {cut} flipped");
            tried += 1;
        }
        assert_eq!(tried, 37);
        cache.put(KEYS[0], b"again").unwrap();
        assert_eq!(cache.get(KEYS[0]).unwrap(), b"again");
        fs::copy(&path, cache.path(KEYS[1])).unwrap();
        assert_eq!(cache.find(KEYS[1]), CacheEntry::Damaged, "an entry of another key");
    }

    #[test]
    fn the_least_recently_used_entry_goes_first() {
        let scratch = Scratch::new();
        let cache = Cache::open(Some(scratch.path()), 300).unwrap();
        for (age, key) in KEYS.iter().enumerate().take(2) {
            cache.put(key, &[7; 100]).unwrap();
            let file = fs::File::options().append(true).open(cache.path(key)).unwrap();
            let ago = Duration::from_secs(1000 - crate::num::u64_from(age));
            file.set_modified(SystemTime::now() - ago).unwrap();
        }
        assert!(cache.get(KEYS[0]).is_some(), "the older one is used again");
        cache.put(KEYS[2], &[7; 100]).unwrap();
        assert_eq!(KEYS.map(|key| cache.get(key).is_some()), [true, false, true]);
        assert!(!cache.put(KEYS[1], &[0; 300]).unwrap(), "more than the cache holds");
    }

    #[test]
    fn files_of_others_in_the_folder_are_neither_counted_nor_removed() {
        let scratch = Scratch::new();
        let cache = Cache::open(Some(scratch.path()), 300).unwrap();
        let theirs = ["film.part", "diary.entry", "ABCDEF0123.entry", "00000000aa.1-x.part", "00000000aa.old.entry"];
        for name in theirs {
            let path = scratch.path().join(name);
            fs::write(&path, [0; 1000]).unwrap();
            let file = fs::File::options().append(true).open(&path).unwrap();
            file.set_modified(SystemTime::now() - 3 * UNFINISHED_AGE_MAX).unwrap();
        }
        let dead = scratch.path().join("00000000aa.123-4.part");
        fs::write(&dead, "x").unwrap();
        fs::File::options().append(true).open(&dead).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
        for key in KEYS {
            cache.put(key, &[7; 100]).unwrap();
        }
        assert!(theirs.iter().all(|name| scratch.path().join(name).is_file()));
        assert!(!dead.exists());
        assert_eq!(KEYS.iter().filter(|key| cache.get(key).is_some()).count(), 2, "two of three fit");
    }

    #[test]
    fn the_users_folder_follows_the_standard() {
        let xdg = |value: &str| user_folder(Some(value.into()), Some("/home/u".into()));
        assert_eq!(xdg("/x").unwrap(), Path::new("/x/sensel"));
        assert_eq!(xdg("").unwrap(), Path::new("/home/u/.cache/sensel"));
        assert_eq!(xdg("relative").unwrap(), Path::new("/home/u/.cache/sensel"));
        assert_eq!(user_folder(None, None), None);
    }
}
