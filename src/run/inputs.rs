//! The files that a scenario is made of, as one hash: they are no part of its configuration and decide its result all the same.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::assets::Assets;
use super::light::read_scene;
use crate::config::Resolved;
use crate::error::Error;

/// Remembers the hash of each file that is read.
struct InputRecorder<'a> {
    assets: &'a dyn Assets,
    read: Mutex<BTreeMap<String, blake3::Hash>>,
}

impl Assets for InputRecorder<'_> {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let bytes = self.assets.read(name)?;
        let mut read = self.read.lock().expect("no thread panics while it holds a hash");
        read.insert(name.to_owned(), blake3::hash(&bytes));
        Ok(bytes)
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        self.assets.list(folder)
    }
}

/// Hash of the names and contents of all files that a scenario names, directly or through its scene. Fails on a file that is missing or
/// not what it should be.
pub fn inputs_hash(resolved: &Resolved, assets: &dyn Assets) -> Result<String, Error> {
    let recorder = InputRecorder { assets, read: Mutex::new(BTreeMap::new()) };
    let scenario = &resolved.scenario;
    let located = |error: Error| resolved.tree.locate(error);
    resolved.clone().read_technology(&|name| recorder.read(name))?;
    if let Some(file) = &scenario.motion.file {
        recorder.read(file).map_err(|error| located(error.named_by("motion.file", file)))?;
    }
    match &scenario.scene.images {
        Some(folders) => {
            for folder in folders.list() {
                for name in recorder.list(folder).map_err(located)? {
                    recorder.read(&format!("{folder}/{name}")).map_err(located)?;
                }
            }
        }
        None => read_scene(scenario, &recorder).map_err(located)?,
    }
    let mut hasher = blake3::Hasher::new();
    for (name, hash) in recorder.read.into_inner().expect("no thread panics while it holds a hash") {
        hasher.update(name.as_bytes());
        hasher.update(&[0]);
        hasher.update(hash.as_bytes());
    }
    Ok(hasher.finalize().to_hex()[..32].to_owned())
}
