//! What every command that runs a scenario needs: its files, its threads, its setup.

use super::args::{CommonOptions, RunArguments};
use super::paths::{self, Located};
use super::{progress, words};
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::files::input::InputFolders;
use sensel::files::photons::{PhotonFiles, gib};
use sensel::files::verilated::Verilated;
use sensel::rtl_simulator::RtlSimulator;
use sensel::run::{Assets, Setup};
use sensel::scene::images::PictureBytes;
use std::path::Path;
use std::sync::Arc;

/// Most that baked light may take of the user's disk.
pub(super) const CACHE_BYTES: u64 = 1 << 30;

/// Files of one folder, and the user's cache.
pub struct FolderAssets {
    folders: Arc<InputFolders>,
    cache: Option<Cache>,
    /// Why nothing is kept from run to run, if so.
    without_cache: Option<String>,
    photons_gib: u32,
}

impl FolderAssets {
    /// Files of a scenario's folder, and of the known scenes' folders after it, so that the effective configuration that a run
    /// wrote finds its scene again. The cache is left out where it cannot be opened.
    pub fn new(folder: &Path, shared: &CommonOptions) -> Self {
        let mut folders = vec![folder.to_path_buf()];
        folders.extend(paths::folders_of_known_scenes(shared));
        let folders = Arc::new(InputFolders::new(folders));
        let opened = Cache::open(shared.cache.as_deref(), CACHE_BYTES);
        let refused = opened.as_ref().map_or_else(|error| Some(error.to_string()), Cache::why_not_writable);
        let remedy = "light is baked anew in every run; name a folder that can be written with --cache";
        let without_cache = refused.map(|reason| format!("the cache cannot be used ({reason}): {remedy}"));
        Self { folders, cache: opened.ok(), without_cache, photons_gib: shared.photons_gib }
    }

    /// The store of mean photons in the cache; none where it cannot be opened or none is wanted.
    pub fn photons(&self) -> Option<PhotonFiles> {
        let cache = self.cache.as_ref().filter(|_| self.photons_gib > 0)?;
        let opened = PhotonFiles::open(&cache.folder().join("photons"), gib(self.photons_gib), words::note);
        opened.map_err(|error| words::note(&format!("photons are not kept: {error}"))).ok()
    }
}

impl Assets for FolderAssets {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        self.folders.read(name)
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        self.folders.list(folder)
    }

    fn during_run(&self) -> Option<Arc<dyn PictureBytes>> {
        Some(self.folders.clone())
    }

    fn rtl_simulator(&self) -> Result<Arc<dyn RtlSimulator>, Error> {
        // Not the folder of earlier versions, which others may have been able to write.
        Ok(Arc::new(Verilated::new(self.cache.as_ref().map(|cache| cache.folder().join("programs")))?))
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        self.cache.as_ref()?.get(key)
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        let cache = self.cache.as_ref().filter(|_| self.without_cache.is_none());
        if let Some(Err(error)) = cache.map(|cache| cache.put(key, bytes)) {
            words::note(&format!("baked light is not kept: {error}"));
        }
    }
}

/// The scenario of run-like verbs, with their own options laid over it.
pub fn located(arguments: &RunArguments, shared: &CommonOptions) -> Result<Located, Error> {
    let mut more = Vec::new();
    more.extend(arguments.frames.map(|frames| format!("run.frames={frames}")));
    more.extend(arguments.rung.as_ref().map(|rung| format!("run.rung='{rung}'")));
    more.extend(arguments.effects.as_ref().map(|effects| format!("run.effects='{effects}'")));
    paths::locate(arguments.scenario.as_deref(), shared, &more)
}

/// Uses as many threads as the scenario says, for the whole program.
pub fn use_threads(threads: u32) -> Result<(), Error> {
    let threads = usize::try_from(threads).unwrap_or(0);
    let made = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    made.map_err(|error| Error::Run(format!("{threads} threads: {error}")))
}

/// Everything checked and lit, ready for the first frame.
pub fn prepare(located: Located, shared: &CommonOptions) -> Result<Setup, Error> {
    let resolved = &located.resolved;
    use_threads(resolved.scenario.threads().map_err(|error| resolved.tree.locate(error))?)?;
    let assets = FolderAssets::new(&located.folder, shared);
    let bar = progress::Baking::new(shared.quiet);
    let mut setup = Setup::new(located.resolved, &assets, &bar)?;
    assets.without_cache.into_iter().for_each(|text| setup.warnings.add(text));
    Ok(setup)
}
