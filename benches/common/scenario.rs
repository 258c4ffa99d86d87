//! Scenarios of the repository for benches: read from their folders, lit from the cache.

// Each bench uses its part.
#![allow(dead_code)]

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::run::{Assets, NoProgress, Session, Setup};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");

/// Five scenes: furnished, the same by night, two large ones made by code, and photographs on walls.
pub const FIVE: [&str; 5] = ["bathroom", "bathroom_night", "hall", "street", "photo_box"];

struct Files {
    folder: String,
    cache: Cache,
}

impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        // The night's room is that of the day, in the folder beside.
        let read = |folder: &str| std::fs::read(format!("{SCENES}/{folder}/{name}"));
        read(&self.folder).or_else(|_| read("bathroom")).map_err(|source| Error::Io { path: name.to_owned(), source })
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        self.cache.get(key)
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        // Without room in the cache the next bench bakes again.
        let _ = self.cache.put(key, bytes);
    }
}

/// A scene's scenario with some keys set.
pub fn setup(scene: &str, set: &[&str]) -> Setup {
    let text = std::fs::read_to_string(format!("{SCENES}/{scene}/scene.toml")).expect("a scene of the repository");
    let set: Vec<String> = set.iter().map(|&key| key.to_owned()).collect();
    let resolved = Resolved::from_layers("scene.toml", &text, &set).expect("a sound scenario");
    let cache = Cache::open(None, 1 << 31).expect("a folder for the light");
    Setup::new(resolved, &Files { folder: scene.to_owned(), cache }, &NoProgress).expect("a sound scenario")
}

/// What one camera renders of a scenario's first frame: the session renders it each time that it is asked.
pub fn first_frame(scene: &str, set: &[&str]) -> Session {
    let all: Vec<&str> = ["run.frames=1", "rig.baseline_mm=0"].iter().chain(set).copied().collect();
    Session::new(setup(scene, &all)).expect("a sound scenario")
}
