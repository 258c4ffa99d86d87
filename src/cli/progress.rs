//! A bar on stderr where stderr is a terminal; silence elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};
use sensel::run::Progress;

/// A bar of `length` steps, hidden when asked to be quiet or when nobody watches.
pub fn bar(what: &'static str, length: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:>12} [{bar:32}] {pos}/{len}  {per_sec}  left {eta}")
        .expect("the template is a constant that parses");
    ProgressBar::new(length).with_style(style.progress_chars("=> ")).with_message(what)
}

/// Shows how far the light is baked.
pub struct Baking(ProgressBar);

/// Steps of the bar for light.
const STEPS: u32 = 1000;

impl Baking {
    /// A bar for light, hidden until something is baked.
    pub fn new(quiet: bool) -> Self {
        Self(bar("light", u64::from(STEPS), quiet))
    }
}

impl Progress for Baking {
    fn at(&self, what: &'static str, share: f64) {
        self.0.set_message(what);
        self.0.set_position(sensel::num::u64_truncated(share * f64::from(STEPS)));
    }
}

impl Drop for Baking {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Says on stderr which part of a study has begun: on a terminal as a bar, elsewhere a line a part.
pub struct Study {
    bar: ProgressBar,
    quiet: bool,
    last: std::sync::Mutex<&'static str>,
}

impl Study {
    /// Nothing has begun.
    pub fn new(quiet: bool) -> Self {
        Self { bar: bar("study", u64::from(STEPS), quiet), quiet, last: std::sync::Mutex::new("") }
    }
}

impl Progress for Study {
    fn at(&self, what: &'static str, share: f64) {
        self.bar.set_message(what);
        self.bar.set_position(sensel::num::u64_truncated(share * f64::from(STEPS)));
        let mut last = self.last.lock().expect("no thread panics while it holds a word");
        if *last != what && !self.quiet && self.bar.is_hidden() {
            eprintln!("sensel: {what}");
        }
        *last = what;
    }
}

impl Drop for Study {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
