//! The only module that touches a disk: it reads inputs, and writes folders that other programs read (EuRoC, EMVA 1288), result folders
//! that are whole or absent, and a cache that may lose an entry but never gives back a wrong one. It computes nothing.

pub mod cache;
mod disk;
pub mod emva;
pub mod emva_reader;
mod errors;
pub mod euroc;
pub mod finished;
pub mod folder;
pub mod grey;
pub mod input;
pub mod map;
pub mod open;
pub mod photons;
pub mod picture;
mod private;
pub mod sweep;
mod text_file;
pub mod truth;
pub mod tum;
pub mod verilated;
pub mod verilator;
pub mod waves;

use std::path::Path;

use crate::error::Error;
pub use errors::{content_error, io_error};

/// A file's whole text without a byte order mark, refused beyond `bytes_max` (hostile or mistaken inputs are named before they fill the
/// memory). Fails as the operating system says, or on something that is no regular file, a file that is too long, or bytes that are no
/// UTF-8.
pub fn read_text(path: &Path, bytes_max: u64) -> Result<String, Error> {
    let bytes = read_bytes(path, bytes_max)?;
    crate::text::from_bytes(bytes).map_err(|reason| content_error(path, reason))
}

/// A file's bytes, refused beyond `bytes_max`. Fails as the operating system says, or on something that is no regular file, or a file
/// that is too long.
pub fn read_bytes(path: &Path, bytes_max: u64) -> Result<Vec<u8>, Error> {
    open::read_opened(open::open_input(path)?, path, bytes_max)
}

/// Writes a file anew. Fails as the operating system says.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(io_error(path))
}

/// Makes a folder with those above it, or leaves the one that is there. Fails as the operating system says.
pub fn make_folder(path: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(path).map_err(io_error(path))
}

#[cfg(test)]
pub(crate) mod scratch {
    use std::path::{Path, PathBuf};
    use std::sync::atomic::{AtomicU32, Ordering};

    /// A temporary folder for one test, removed when dropped.
    pub struct Scratch(PathBuf);

    static COUNT: AtomicU32 = AtomicU32::new(0);

    impl Scratch {
        pub fn new() -> Self {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = std::env::temp_dir().join(format!("sensel-test-{}-{count}", std::process::id()));
            std::fs::create_dir_all(&path).expect("the machine has a folder for temporary files");
            Self(path)
        }

        pub fn path(&self) -> &Path {
            &self.0
        }

        /// A pipe of that name in it.
        #[cfg(unix)]
        pub fn pipe(&self, name: &str) -> PathBuf {
            let path = self.0.join(name);
            rustix::fs::mknodat(rustix::fs::CWD, &path, rustix::fs::FileType::Fifo, 0o600.into(), 0)
                .expect("folders for temporary files take pipes");
            path
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}
