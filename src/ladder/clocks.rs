//! Times a piece of work by two external clocks: processor time and wall time, in milliseconds.

use crate::num::lesser;
use crate::run::Stopwatch;

/// The clocks of a study; the library reads none itself.
#[derive(Clone, Copy)]
pub struct StudyClocks<'a> {
    /// What a person waits.
    pub wall: &'a dyn Stopwatch,
    /// Processor time of all threads; where the system does not give it, the same as `wall`.
    pub work: &'a dyn Stopwatch,
}

/// What something took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredCost {
    /// Processor time of all threads.
    pub work_ms: f64,
    /// Wall time.
    pub wall_ms: f64,
}

impl MeasuredCost {
    /// Longer than anything: nothing was measured yet.
    pub const UNKNOWN: Self = Self { work_ms: f64::INFINITY, wall_ms: f64::INFINITY };

    /// Both times.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { work_ms: self.work_ms + other.work_ms, wall_ms: self.wall_ms + other.wall_ms }
    }

    /// Times as long.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { work_ms: factor * self.work_ms, wall_ms: factor * self.wall_ms }
    }

    /// The lesser of each.
    #[must_use]
    pub fn best(self, other: Self) -> Self {
        Self { work_ms: lesser(self.work_ms, other.work_ms), wall_ms: lesser(self.wall_ms, other.wall_ms) }
    }
}

impl StudyClocks<'_> {
    /// Does a piece of work and says what it took.
    pub fn time<T>(&self, work: impl FnOnce() -> T) -> (T, MeasuredCost) {
        let (wall_s, work_s) = (self.wall.now_s(), self.work.now_s());
        let done = work();
        let cost =
            MeasuredCost { work_ms: 1e3 * (self.work.now_s() - work_s), wall_ms: 1e3 * (self.wall.now_s() - wall_s) };
        (done, cost)
    }
}
