//! Progress on stderr: a bar on a terminal, elsewhere a plain line now and then; nothing with `--quiet`.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use sensel::num::{f64_from_u64, u64_truncated};
use sensel::run::Progress;
use serde_json::json;

use super::words;

/// Least time from line to line, so that a log stays short.
const LEAST_S: f64 = 1.0;

/// Time after which a line comes although little was done.
const MOST_S: f64 = 5.0;

/// Share of the work after which a line comes.
const STEP: f64 = 0.1;

/// Steps of what tells its progress as a share.
const STEPS: u32 = 1000;

/// What the last line said, and when.
struct Said {
    what: &'static str,
    done: u64,
    at_s: f64,
    /// When the work began; none before.
    begun_s: Option<f64>,
}

/// Least share of the work from which the remaining time is estimated.
const SHARE_KNOWN: f64 = 0.02;

/// Work of a known number of steps.
pub struct StepsBar {
    what: &'static str,
    length: u64,
    /// Whether the steps are thousandths of the work rather than frames.
    is_share: bool,
    /// Whether a line says that the work begins.
    says_begin: bool,
    /// On a terminal.
    bar: Option<ProgressBar>,
    /// Elsewhere.
    lines: Option<(Instant, Mutex<Said>)>,
    done: std::sync::atomic::AtomicU64,
}

/// Whether a line is due, so long and so much work after the last one.
fn is_due(since_s: f64, share: f64) -> bool {
    since_s >= MOST_S || (since_s >= LEAST_S && share >= STEP)
}

/// Estimate of the seconds that remain, from those that passed.
fn left_s(passed_s: f64, done: u64, length: u64) -> Option<f64> {
    let share = f64_from_u64(done) / f64_from_u64(length.max(1));
    (share >= SHARE_KNOWN).then(|| passed_s * (1.0 - share) / share)
}

/// One line about the work.
fn line(what: &str, done: u64, length: u64, is_share: bool, left_s: Option<f64>) -> String {
    if words::is_json() {
        return json!({"progress": {"what": what, "done": done, "of": length, "left_s": left_s}}).to_string();
    }
    let percent = 100 * done / length.max(1);
    // A share has no steps that a person could count.
    let steps = if is_share { String::new() } else { format!(" {done} of {length},") };
    let left = left_s.map_or_else(String::new, |left_s| format!(", about {left_s:.0} s left"));
    format!("sensel: {what}:{steps} {percent} %{left}")
}

/// The progress of `length` steps; silent when asked to be quiet.
pub fn bar(what: &'static str, length: u64, quiet: bool) -> StepsBar {
    let is_bar = std::io::stderr().is_terminal() && !words::is_json();
    let style = || {
        let style = ProgressStyle::with_template("{msg:>12} [{bar:32}] {pos}/{len}  {per_sec}  left {eta}");
        style.expect("the template is a constant that parses").progress_chars("=> ")
    };
    let said = Said { what, done: 0, at_s: 0.0, begun_s: None };
    StepsBar {
        what,
        length,
        is_share: false,
        says_begin: false,
        bar: (is_bar && !quiet).then(|| ProgressBar::new(length).with_style(style()).with_message(what)),
        lines: (!is_bar && !quiet).then(|| (Instant::now(), Mutex::new(said))),
        done: 0.into(),
    }
}

impl StepsBar {
    /// Counts one step more.
    pub fn inc(&self) {
        let before = self.done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        self.show(self.what, before + 1);
    }

    fn show(&self, what: &'static str, done: u64) {
        if let Some(bar) = &self.bar {
            bar.set_message(what);
            bar.set_position(done);
        }
        let Some((started, said)) = &self.lines else { return };
        let mut said = said.lock().expect("no thread panics while it holds a word");
        let now_s = started.elapsed().as_secs_f64();
        if said.what != what || said.begun_s.is_none() {
            // Frames are counted when they end: the first one began with the bar.
            let begun_s = if said.begun_s.is_none() && done > 0 { 0.0 } else { now_s };
            *said = Said { what, done: 0, at_s: now_s, begun_s: Some(begun_s) };
            if self.says_begin {
                words::to_stderr(&line(what, 0, self.length, self.is_share, None));
            }
        }
        let share = f64_from_u64(done.saturating_sub(said.done)) / f64_from_u64(self.length.max(1));
        if done < self.length && is_due(now_s - said.at_s, share) {
            let left_s = said.begun_s.and_then(|begun_s| left_s(now_s - begun_s, done, self.length));
            words::to_stderr(&line(what, done, self.length, self.is_share, left_s));
            (said.done, said.at_s) = (done, now_s);
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Drop for StepsBar {
    fn drop(&mut self) {
        self.finish();
    }
}

/// The progress of what tells it as a share.
fn share_bar(what: &'static str, quiet: bool) -> StepsBar {
    let mut bar = bar(what, u64::from(STEPS), quiet);
    bar.is_share = true;
    bar
}

/// Shows how far the light is baked.
pub struct Baking(StepsBar);

impl Baking {
    /// Nothing is shown until something is baked.
    pub fn new(quiet: bool) -> Self {
        let mut bar = share_bar("light", quiet);
        bar.says_begin = true;
        Self(bar)
    }
}

impl Progress for Baking {
    fn at(&self, what: &'static str, share: f64) {
        self.0.show(what, u64_truncated(share * f64::from(STEPS)));
    }
}

/// Says on stderr which part of a study has begun, and how far it is.
pub struct Study {
    bar: StepsBar,
    last: Mutex<&'static str>,
}

impl Study {
    /// Nothing has begun.
    pub fn new(quiet: bool) -> Self {
        Self { bar: share_bar("study", quiet), last: Mutex::new("") }
    }
}

impl Progress for Study {
    fn at(&self, what: &'static str, share: f64) {
        let mut last = self.last.lock().expect("no thread panics while it holds a word");
        if *last != what && self.bar.lines.is_some() {
            words::note(what);
        }
        *last = what;
        self.bar.show(what, u64_truncated(share * f64::from(STEPS)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_gets_a_line_every_tenth_of_the_work_or_after_some_seconds_and_not_more_often_than_one_a_second() {
        for (since_s, share, expected) in
            [(0.1, 0.9, false), (1.5, 0.05, false), (1.5, 0.1, true), (5.0, 0.0, true), (4.9, 0.09, false)]
        {
            assert_eq!(is_due(since_s, share), expected, "{since_s} s, {share}");
        }
        assert_eq!(line("frames", 30, 300, false, None), "sensel: frames: 30 of 300, 10 %");
        assert_eq!(line("light", 250, 1000, true, Some(7.6)), "sensel: light: 25 %, about 8 s left");
        assert_eq!(left_s(3.0, 250, 1000), Some(9.0));
        assert_eq!(left_s(3.0, 10, 1000), None);
    }

    #[test]
    fn who_asks_for_silence_gets_neither_bar_nor_lines() {
        let silent = bar("frames", 10, true);
        assert!(silent.bar.is_none() && silent.lines.is_none());
        let heard = bar("frames", 10, false);
        assert!(heard.bar.is_some() != heard.lines.is_some());
    }
}
