//! A text file that grows line by line.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;

use super::errors::io_error;
use crate::error::Error;

#[derive(Debug)]
pub struct TextFile {
    path: PathBuf,
    file: BufWriter<File>,
}

impl TextFile {
    pub fn create(path: PathBuf) -> Result<Self, Error> {
        let file = BufWriter::new(File::create(&path).map_err(io_error(&path))?);
        Ok(Self { path, file })
    }

    pub fn line(&mut self, line: &str) -> Result<(), Error> {
        writeln!(self.file, "{line}").map_err(io_error(&self.path))
    }

    /// Writes what is still in memory.
    pub fn finish(mut self) -> Result<(), Error> {
        self.file.flush().map_err(io_error(&self.path))
    }
}
