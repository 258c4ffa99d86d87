//! Files that a scenario names. Enters: folders to look in, names within them. Leaves: bytes, and names of what lies in a folder.

use std::path::{Component, Path, PathBuf};

use super::io_error;
use crate::error::Error;
use crate::scene::images::PictureBytes;

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
            let reason = "leads out of the scenario's folder; a name within it would do".to_owned();
            return Err(Error::Content { file: name.to_owned(), reason });
        }
        let found = self.0.iter().map(|folder| folder.join(relative)).find(|path| is_there(path));
        Ok(found.unwrap_or_else(|| self.0[0].join(relative)))
    }

    /// Names of the files in a folder, sorted; "" is the first of the folders itself. Names that are no Unicode are left out.
    ///
    /// # Errors
    /// A name that leads out; a folder that is not there; what the disk says.
    pub fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        let path = self.find(folder, Path::is_dir)?;
        let entries = std::fs::read_dir(&path).map_err(|source| missing(folder, &path, source))?;
        let mut names = Vec::new();
        for entry in entries {
            let entry = entry.map_err(io_error(&path))?;
            if let (true, Ok(name)) = (entry.path().is_file(), entry.file_name().into_string()) {
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
        let path = self.find(name, Path::is_file)?;
        std::fs::read(&path).map_err(|source| match source.kind() {
            std::io::ErrorKind::NotFound => Error::Content {
                file: path.display().to_string(),
                reason: "is not there; the scenario names it".to_owned(),
            },
            _ => io_error(&path)(source),
        })
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
}
