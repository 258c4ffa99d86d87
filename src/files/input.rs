//! Files that a scenario names: their bytes, and the names in a folder. A name stays within the scenario's folder, by its path and by the
//! links on it.

use std::path::{Component, Path, PathBuf};

use super::errors::{content_error, io_error};
use super::open::is_there;
use super::read_bytes;
use crate::error::Error;
use crate::scene::images::PictureBytes;

/// Longest file that is read.
const BYTES_MAX: u64 = 1 << 31;
/// How the text begins that a clone without Git LFS has in place of a large file.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Folders in which names are looked for, the first one that has a name first.
#[derive(Debug)]
pub struct InputFolders(Vec<PathBuf>);

impl InputFolders {
    /// Looks in these folders. Panics without one.
    pub fn new(folders: Vec<PathBuf>) -> Self {
        assert!(!folders.is_empty(), "names need a folder to be looked for in");
        Self(folders)
    }

    fn find(&self, name: &str, is_there: impl Fn(&Path) -> bool) -> Result<PathBuf, Error> {
        let relative = Path::new(name);
        if !relative.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(content_error(relative, "leads out of the scenario's folder; use a name within it"));
        }
        let Some(folder) = self.0.iter().find(|folder| is_there(&folder.join(relative))) else {
            return Ok(self.0[0].join(relative));
        };
        let path = folder.join(relative);
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let real = |path: &Path| std::fs::canonicalize(path).map_err(io_error(path));
        let (found, folder) = (real(&path)?, real(folder)?);
        if !found.starts_with(&folder) {
            let (to, folder) = (found.display(), folder.display());
            let reason =
                format!("is a link that leads out of the scenario's folder, to {to}; put a copy into {folder}");
            return Err(content_error(relative, reason));
        }
        Ok(path)
    }

    /// Names of the files in a folder, sorted; "" is the first of the folders itself. Names that are no Unicode are left
    /// out. Fails on a name that leads out; a folder that is not there, or as the disk says.
    pub fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        let path = self.find(folder, Path::is_dir)?;
        let entries = std::fs::read_dir(&path).map_err(|source| missing(folder, &path, source))?;
        let mut names = Vec::new();
        for entry in entries {
            let entry = entry.map_err(io_error(&path))?;
            // A pipe or a broken link is listed: whoever reads it learns its name.
            if let (false, Ok(name)) = (entry.path().is_dir(), entry.file_name().into_string()) {
                names.push(name);
            }
        }
        names.sort();
        Ok(names)
    }
}

fn missing(name: &str, path: &Path, source: std::io::Error) -> Error {
    match source.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => Error::Content {
            file: if name.is_empty() { path.display().to_string() } else { name.to_owned() },
            reason: format!("is not there; the scenario names it, and {} would be its place", path.display()),
        },
        _ => io_error(path)(source),
    }
}

impl PictureBytes for InputFolders {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let path = self.find(name, is_there)?;
        let bytes = read_bytes(&path, BYTES_MAX).map_err(|error| match error {
            Error::Io { path, source } if source.kind() == std::io::ErrorKind::NotFound => {
                Error::Content { file: path, reason: "is not there; the scenario or its glTF file names it".to_owned() }
            }
            other => other,
        })?;
        if bytes.starts_with(LFS_POINTER) {
            let reason = "is a pointer of Git LFS in place of the file; fetch the file by 'git lfs pull'";
            return Err(content_error(&path, reason));
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scratch::Scratch;

    #[test]
    fn names_stay_within_the_folders_and_are_sorted() {
        let scratch = Scratch::new();
        std::fs::create_dir_all(scratch.path().join("a/inner")).unwrap();
        std::fs::create_dir_all(scratch.path().join("b/other")).unwrap();
        for file in ["a/inner/2", "a/inner/1", "b/other/3", "b/own"] {
            std::fs::write(scratch.path().join(file), file).unwrap();
        }
        let folders = InputFolders::new(vec![scratch.path().join("a"), scratch.path().join("b")]);
        assert_eq!(folders.list("inner").unwrap(), ["1", "2"]);
        assert_eq!(folders.list("other").unwrap(), ["3"]);
        assert_eq!(folders.list("").unwrap(), Vec::<String>::new());
        assert_eq!(folders.read("own").unwrap(), b"b/own");
        let mut tried = 0;
        for bad in ["..", "../b", "inner/../..", "/", "inner/1", "none"] {
            assert_eq!(folders.list(bad).unwrap_err().exit_code(), 2, "{bad}");
            tried += 1;
        }
        assert_eq!(folders.read("../b/own").unwrap_err().exit_code(), 2);
        assert_eq!(tried, 6);
    }

    #[test]
    fn a_file_that_is_not_there_and_a_pointer_of_git_lfs_are_told_apart() {
        let scratch = Scratch::new();
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n";
        std::fs::write(scratch.path().join("wall.png"), pointer).unwrap();
        let folders = InputFolders::new(vec![scratch.path().to_owned()]);
        let reason = |name: &str| folders.read(name).unwrap_err().to_string();
        assert!(reason("wall.png").contains("git lfs pull"), "{}", reason("wall.png"));
        assert!(reason("floor.png").contains("its glTF file names it"), "{}", reason("floor.png"));
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_within_the_folder_too() {
        use std::os::unix::fs::symlink;
        let scratch = Scratch::new();
        let at = |name: &str| scratch.path().join(name);
        std::fs::create_dir_all(at("scene/textures")).unwrap();
        std::fs::create_dir_all(at("scene-other")).unwrap();
        std::fs::write(at("secret"), "x").unwrap();
        std::fs::write(at("scene-other/secret"), "x").unwrap();
        std::fs::write(at("scene/textures/own"), "own").unwrap();
        symlink("textures/own", at("scene/inside")).unwrap();
        symlink(at("scene/textures/own"), at("scene/absolute")).unwrap();
        symlink("../secret", at("scene/out")).unwrap();
        symlink("../scene-other", at("scene/sibling")).unwrap();
        symlink("out", at("scene/chain")).unwrap();
        // The scenario's folder may itself be reached through a link.
        symlink("scene", at("alias")).unwrap();
        for folder in ["scene", "alias"] {
            let folders = InputFolders::new(vec![at(folder)]);
            for good in ["inside", "absolute", "textures/own"] {
                assert_eq!(folders.read(good).unwrap(), b"own", "{good}");
            }
            for bad in ["out", "chain", "sibling/secret"] {
                let error = folders.read(bad).unwrap_err();
                assert!(error.exit_code() == 2 && error.to_string().contains("leads out"), "{bad}: {error}");
            }
            assert!(folders.list("sibling").unwrap_err().to_string().contains("leads out"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_that_a_scenario_names_is_refused_and_listed() {
        let scratch = Scratch::new();
        scratch.pipe("0001.png");
        let folders = InputFolders::new(vec![scratch.path().to_owned()]);
        assert_eq!(folders.list("").unwrap(), ["0001.png"]);
        assert!(folders.read("0001.png").unwrap_err().to_string().contains("pipe"));
    }
}
