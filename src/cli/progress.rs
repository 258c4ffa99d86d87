//! A bar on stderr where stderr is a terminal; silence elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps, hidden when asked to be quiet or when nobody watches.
pub fn bar(what: &'static str, length: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:>12} [{bar:32}] {pos}/{len}  {per_sec}  left {eta}")
        .expect("the template is a constant that parses");
    ProgressBar::new(length).with_style(style.progress_chars("=> ")).with_message(what)
}
