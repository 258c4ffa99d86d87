//! The one way in which the program opens a file that others wrote: regular files only, opened without waiting, and read up to a limit.
//!
//! Pipes, devices and sockets could block or never end, so they are refused by name. `/dev/stdin` is read where it stands for a regular
//! file; a pipe on it is refused like any other.

use std::collections::BTreeSet;
use std::fs::{File, FileType, Metadata};
use std::io::Read as _;
use std::path::Path;
use std::sync::Mutex;

use super::errors::{content_error, io_error};
use crate::error::Error;

/// Identity of a file: device, number and, if known, creation time, because a new file may reuse the number of a removed one.
#[cfg(unix)]
type FileId = (u64, u64, Option<std::time::SystemTime>);
#[cfg(not(unix))]
type FileId = std::path::PathBuf;

/// The files that this process has opened as inputs.
static INPUTS: Mutex<BTreeSet<FileId>> = Mutex::new(BTreeSet::new());

/// Opens an input and remembers it, so that no output takes its place. Fails as the operating system says, or on something that is no
/// regular file.
pub fn open_input(path: &Path) -> Result<File, Error> {
    let file = open_regular(path)?;
    if let Some(id) = file_id(path, &file.metadata().map_err(io_error(path))?) {
        INPUTS.lock().expect("nobody panics while it is held").insert(id);
    }
    Ok(file)
}

/// Whether a path leads to a file that this process has read as an input, under whichever name.
pub fn is_input(path: &Path) -> bool {
    let id = std::fs::metadata(path).ok().and_then(|metadata| file_id(path, &metadata));
    id.is_some_and(|id| INPUTS.lock().expect("nobody panics while it is held").contains(&id))
}

/// Opens a regular file for reading; never waits. Fails as the operating system says, or on something that is no regular file.
pub fn open_regular(path: &Path) -> Result<File, Error> {
    // Opening some devices is an action in itself, so the kind is asked for first; what was opened is asked again.
    check_kind(path, &std::fs::metadata(path).map_err(io_error(path))?)?;
    let file = open_without_waiting(path).map_err(io_error(path))?;
    check_kind(path, &file.metadata().map_err(io_error(path))?)?;
    Ok(file)
}

/// The bytes of an opened file, refused beyond `bytes_max`, even where the file grows while it is read. Fails as the operating system
/// says, or on a file that is too long.
pub fn read_opened(file: File, path: &Path, bytes_max: u64) -> Result<Vec<u8>, Error> {
    let too_long = |length: u64| content_error(path, format!("is {length} bytes long; at most {bytes_max} are read"));
    let length = file.metadata().map_err(io_error(path))?.len();
    if length > bytes_max {
        return Err(too_long(length));
    }
    let mut bytes = Vec::new();
    let room = usize::try_from(length).ok().and_then(|length| bytes.try_reserve_exact(length).ok());
    room.ok_or_else(|| content_error(path, format!("is {length} bytes long, for which there is no memory")))?;
    file.take(bytes_max.saturating_add(1)).read_to_end(&mut bytes).map_err(io_error(path))?;
    let read = crate::num::u64_from(bytes.len());
    if read > bytes_max { Err(too_long(read)) } else { Ok(bytes) }
}

/// Whether a path leads to something that is to be read as a file: whatever is there and is no folder. What is no regular file either is
/// refused by name when it is opened.
pub fn is_there(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| !metadata.is_dir())
}

fn check_kind(path: &Path, metadata: &Metadata) -> Result<(), Error> {
    let kind = metadata.file_type();
    if kind.is_file() {
        return Ok(());
    }
    Err(content_error(path, format!("is a {}; only regular files are read", name_of(kind))))
}

#[cfg(unix)]
fn name_of(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt as _;
    match kind {
        kind if kind.is_dir() => "folder",
        kind if kind.is_fifo() => "pipe (FIFO)",
        kind if kind.is_socket() => "socket",
        _ => "device",
    }
}

#[cfg(not(unix))]
fn name_of(kind: FileType) -> &'static str {
    if kind.is_dir() { "folder" } else { "device" }
}

#[cfg(unix)]
fn open_without_waiting(path: &Path) -> std::io::Result<File> {
    use rustix::fs::{Mode, OFlags, open};
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    Ok(File::from(open(path, flags, Mode::empty())?))
}

#[cfg(not(unix))]
fn open_without_waiting(path: &Path) -> std::io::Result<File> {
    File::open(path)
}

#[cfg(unix)]
fn file_id(_: &Path, metadata: &Metadata) -> Option<FileId> {
    use std::os::unix::fs::MetadataExt as _;
    Some((metadata.dev(), metadata.ino(), metadata.created().ok()))
}

#[cfg(not(unix))]
fn file_id(path: &Path, _: &Metadata) -> Option<FileId> {
    std::fs::canonicalize(path).ok()
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "tests may stop at the first surprise")]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;
    use crate::files::{read_bytes, read_text};

    #[test]
    fn what_is_no_regular_file_is_refused_by_its_kind_and_never_waited_for() {
        let scratch = Scratch::new();
        let fifo = scratch.pipe("fifo");
        let socket = scratch.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let link = scratch.path().join("link");
        std::os::unix::fs::symlink(&fifo, &link).unwrap();
        let mut tried = 0;
        for (path, kind) in [
            (fifo.as_path(), "pipe (FIFO)"),
            (&link, "pipe (FIFO)"),
            (&socket, "socket"),
            (scratch.path(), "folder"),
            (Path::new("/dev/zero"), "device"),
            (Path::new("/dev/null"), "device"),
        ] {
            let error = read_bytes(path, 1 << 20).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(error.to_string().contains(kind), "{}: {error}", path.display());
            assert!(read_text(path, 1 << 20).is_err());
            tried += 1;
        }
        assert_eq!(tried, 6);
    }

    #[test]
    fn a_file_that_grows_while_it_is_read_is_read_up_to_its_limit() {
        use std::io::Write as _;
        let scratch = Scratch::new();
        let path = scratch.path().join("grows");
        std::fs::write(&path, [1; 10]).unwrap();
        assert_eq!(read_bytes(&path, 10).unwrap().len(), 10);
        assert!(read_bytes(&path, 9).unwrap_err().to_string().contains("10 bytes long; at most 9 are read"));
        // Its length is asked for by `read_opened` itself, so the growth is imitated by files of the kernel, which claim no length.
        let kernels = Path::new("/proc/self/maps");
        if kernels.exists() {
            assert!(read_bytes(kernels, 16).unwrap_err().to_string().contains("at most 16 are read"));
        }
        let opened = open_input(&path).unwrap();
        std::fs::File::options().append(true).open(&path).unwrap().write_all(&[2; 100]).unwrap();
        assert!(read_opened(opened, &path, 50).unwrap_err().to_string().contains("at most 50"));
    }

    #[test]
    fn an_input_is_known_under_all_its_names() {
        let scratch = Scratch::new();
        let (path, hard, soft) = (scratch.path().join("a"), scratch.path().join("b"), scratch.path().join("c"));
        std::fs::write(&path, "x").unwrap();
        std::fs::hard_link(&path, &hard).unwrap();
        std::os::unix::fs::symlink(&path, &soft).unwrap();
        std::fs::write(scratch.path().join("other"), "x").unwrap();
        read_text(&path, 10).unwrap();
        assert!([&path, &hard, &soft].into_iter().all(|path| is_input(path)));
        assert!(!is_input(&scratch.path().join("other")) && !is_input(&scratch.path().join("absent")));
    }
}
