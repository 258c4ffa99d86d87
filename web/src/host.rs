//! What the page gives the core: a clock for the cost of stages, and a function that is told the progress of long work.

use std::cell::RefCell;
use std::collections::VecDeque;

use sensel::error::Error;
use sensel::run::{Assets, NoFiles, Progress, Stopwatch};
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    fn now_ms() -> f64;
    #[wasm_bindgen(js_namespace = globalThis, js_name = senselProgress)]
    fn told(what: &str, share: f64);
}

/// The browser's monotonic clock.
pub struct PageStopwatch;

impl Stopwatch for PageStopwatch {
    fn now_s(&self) -> f64 {
        1e-3 * now_ms()
    }
}

/// Calls the page's `globalThis.senselProgress(what, share)`.
pub struct Tell;

impl Progress for Tell {
    fn at(&self, what: &'static str, share: f64) {
        told(what, share);
    }
}

/// Bakes that are kept: a scene's light does not change with the sensor.
const KEPT: usize = 4;

thread_local! {
    static BAKES: RefCell<VecDeque<(String, Vec<u8>)>> = const { RefCell::new(VecDeque::new()) };
}

/// No files; baked light is kept in memory for the next session.
pub struct Memory;

impl Assets for Memory {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        NoFiles.read(name)
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        BAKES.with_borrow(|kept| kept.iter().find(|(name, _)| name == key).map(|(_, bytes)| bytes.clone()))
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        BAKES.with_borrow_mut(|kept| {
            kept.retain(|(name, _)| name != key);
            kept.push_back((key.to_owned(), bytes.to_vec()));
            if kept.len() > KEPT {
                kept.pop_front();
            }
        });
    }
}
