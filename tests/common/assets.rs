//! Assets of tests that run sessions in this process.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

use sensel::error::Error;
use sensel::files::verilated::Verilated;
use sensel::rtl_simulator::RtlSimulator;
use sensel::run::{Assets, NoFiles};

static BAKES: Mutex<BTreeMap<String, Arc<[u8]>>> = Mutex::new(BTreeMap::new());

/// No files, and a store of baked light in memory that all tests share: a room is not baked for each test (two that start at once may both
/// bake it).
pub struct KeptBakes;

impl Assets for KeptBakes {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        NoFiles.read(name)
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        BAKES.lock().unwrap().get(key).map(|bytes| bytes.to_vec())
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        BAKES.lock().unwrap().insert(key.to_owned(), bytes.into());
    }
}

/// The same with Verilator.
pub struct WithVerilog;

impl Assets for WithVerilog {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        KeptBakes.read(name)
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        KeptBakes.load(key)
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        KeptBakes.store(key, bytes);
    }

    fn rtl_simulator(&self) -> Result<Arc<dyn RtlSimulator>, Error> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../rtl/verilated");
        Ok(Arc::new(Verilated::new(folder)?))
    }
}
