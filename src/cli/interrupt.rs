//! Stopping a run: the first interrupt, termination or hang-up ends it after the frame at hand and removes what was being built; the
//! second ends the program at once. A signal that was ignored when the program started, as `nohup` does, stays ignored.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

/// Longest account of a process that is read.
const STATUS_BYTES_MAX: u64 = 1 << 16;
/// Exit code of a program that its user stopped.
const STOPPED: i32 = 130;
#[cfg(unix)]
const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
#[cfg(not(unix))]
const SIGNALS: [i32; 2] = [SIGINT, SIGTERM];

/// Set once the user asks to stop.
pub fn watch() -> Arc<AtomicBool> {
    let asked = Arc::new(AtomicBool::new(false));
    let status = sensel::files::read_text(Path::new("/proc/self/status"), STATUS_BYTES_MAX);
    let ignored = status.map_or(0, |status| ignored_in(&status));
    let watched = SIGNALS.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let set = |signal: i32| -> io::Result<()> {
        // The second one meets the flag set.
        register_conditional_shutdown(signal, STOPPED, Arc::clone(&asked))?;
        register(signal, Arc::clone(&asked)).map(drop)
    };
    for signal in watched {
        if let Err(error) = set(signal) {
            super::words::note(&format!("an interrupt will leave a hidden folder behind: {error}"));
        }
    }
    asked
}

/// Signals that a process ignores by Linux's account of it: bit n - 1 for signal n.
fn ignored_in(status: &str) -> u64 {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::ignored_in;

    #[test]
    fn the_mask_of_ignored_signals_is_hexadecimal() {
        // SIGHUP is 1, SIGPIPE 13: what nohup and Rust ignore.
        assert_eq!(ignored_in("Name:\tsensel\nSigIgn:\t0000000000001001\nSigCgt:\t0\n"), 1 | 1 << 12);
        assert_eq!(ignored_in("Name:\tsensel\n"), 0);
    }
}
