//! Where the bytes of a scene's files come from.

use crate::error::Error;

/// Reads a file by a path within the scene's folder.
pub type Read<'a> = &'a dyn Fn(&str) -> Result<Vec<u8>, Error>;

/// Where files are read from while a run goes on.
pub trait PictureBytes: Send + Sync {
    /// The bytes of a file of the scenario. Fails where the file is not there any more, or the disk says no.
    fn read(&self, name: &str) -> Result<Vec<u8>, Error>;
}
