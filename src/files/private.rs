//! Folders that only this user can write: what is run from them is what this user put there.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::errors::{content_error, io_error};
use crate::error::Error;

/// Makes a folder that nobody else may enter, with those above it, or checks that the one that is there is this user's own. Fails where the
/// folder, or one above it, could be changed by somebody else, or as the disk says.
pub fn make_private(folder: &Path) -> Result<(), Error> {
    if let Some(parent) = folder.parent() {
        super::make_folder(parent)?;
    }
    match create(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        other => other.map_err(io_error(folder))?,
    }
    check_private(folder)
}

/// A folder for programs where the user has no cache: this user's own among those of all users.
pub fn temporary_folder() -> PathBuf {
    #[cfg(unix)]
    let user = rustix::process::geteuid().as_raw();
    #[cfg(not(unix))]
    let user = "user";
    std::env::temp_dir().join(format!("sensel-programs-{user}"))
}

#[cfg(unix)]
fn create(folder: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::DirBuilderExt as _;
    std::fs::DirBuilder::new().mode(0o700).create(folder)
}

#[cfg(not(unix))]
fn create(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir(folder)
}

/// Refuses a folder whose content, or whose path, another user could change. Says why it is refused.
#[cfg(unix)]
pub fn check_private(folder: &Path) -> Result<(), Error> {
    use std::os::unix::fs::MetadataExt as _;
    const OTHERS_WRITE: u32 = 0o002;
    const GROUP_OR_OTHERS_WRITE: u32 = 0o022;
    /// Of a folder with this bit, only a file's owner may rename or remove it.
    const STICKY: u32 = 0o1000;
    let me = rustix::process::geteuid().as_raw();
    let own = std::fs::symlink_metadata(folder).map_err(io_error(folder))?;
    let refused = |why: &str| {
        let reason = format!("{why}; programs are run from it, so remove it or name another place with --cache");
        Err(content_error(folder, reason))
    };
    if !own.is_dir() {
        return refused("is no folder");
    }
    if own.uid() != me {
        return refused("belongs to another user");
    }
    if own.mode() & GROUP_OR_OTHERS_WRITE != 0 {
        return refused("can be written by other users");
    }
    let path = std::fs::canonicalize(folder).map_err(io_error(folder))?;
    for above in path.ancestors().skip(1) {
        let mode = std::fs::symlink_metadata(above).map_err(io_error(above))?.mode();
        if mode & OTHERS_WRITE != 0 && mode & STICKY == 0 {
            return refused(&format!("lies in {}, where every user may replace it", above.display()));
        }
    }
    Ok(())
}

/// Refuses a folder whose content, or whose path, another user could change; this system is not asked.
#[cfg(not(unix))]
pub fn check_private(_: &Path) -> Result<(), Error> {
    Ok(())
}

/// Takes the right to write a file from everybody but its owner.
pub fn take_from_others(file: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = std::fs::metadata(file)?.permissions().mode() & 0o755;
        std::fs::set_permissions(file, std::fs::Permissions::from_mode(mode))?;
    }
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}

/// Whether a file is this user's own and nobody else may write it.
#[cfg(unix)]
pub fn is_private_file(file: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let me = rustix::process::geteuid().as_raw();
    std::fs::symlink_metadata(file).is_ok_and(|about| about.is_file() && about.uid() == me && about.mode() & 0o022 == 0)
}

/// Whether a file is this user's own and nobody else may write it.
#[cfg(not(unix))]
pub fn is_private_file(file: &Path) -> bool {
    file.is_file()
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "tests may stop at the first surprise")]
mod tests {
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;
    use crate::files::scratch::Scratch;

    #[test]
    fn a_folder_that_others_could_change_is_refused() {
        let scratch = Scratch::new();
        let mode = |name: &str, mode: u32| {
            let path = scratch.path().join(name);
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            path
        };
        let own = scratch.path().join("deep/own");
        make_private(&own).unwrap();
        assert_eq!(std::fs::metadata(&own).unwrap().permissions().mode() & 0o7777, 0o700);
        make_private(&own).unwrap();
        let mut tried = 0;
        for open in [0o777, 0o770, 0o702, 0o1777] {
            let error = make_private(&mode("deep/own", open)).unwrap_err();
            assert!(error.to_string().contains("written by other users"), "{open:o}: {error}");
            tried += 1;
        }
        mode("deep/own", 0o755);
        make_private(&own).unwrap();
        mode("deep", 0o777);
        assert!(make_private(&own).unwrap_err().to_string().contains("every user may replace it"));
        mode("deep", 0o1777);
        make_private(&own).unwrap();
        symlink(&own, scratch.path().join("link")).unwrap();
        assert!(make_private(&scratch.path().join("link")).unwrap_err().to_string().contains("is no folder"));
        if rustix::process::geteuid().is_root() {
            std::os::unix::fs::chown(&own, Some(12_345), None).unwrap();
            assert!(make_private(&own).unwrap_err().to_string().contains("belongs to another user"));
            tried += 1;
        }
        assert!(tried >= 4);
    }
}
