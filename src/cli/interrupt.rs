//! Stopping a run: the first interrupt or termination ends it after the frame at hand and removes what was being built; the second
//! ends the program at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set once the user asks to stop.
pub fn watch() -> Arc<AtomicBool> {
    let asked = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&asked);
    let set = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = set {
        super::words::note(&format!("an interrupt will leave a hidden folder behind: {error}"));
    }
    asked
}
