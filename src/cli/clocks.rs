//! Clocks for the library, which reads none itself.

use std::time::Instant;

use sensel::run::Stopwatch;

/// Time since the program started.
pub struct WallTime(Instant);

impl WallTime {
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Stopwatch for WallTime {
    fn now_s(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// Processor time of all threads of this program, as the system counts it (Linux: schedstat of each thread, in nanoseconds); wall time
/// where it does not tell.
pub struct ProcessorTime(WallTime);

impl ProcessorTime {
    pub fn start() -> Self {
        Self(WallTime::start())
    }
}

impl Stopwatch for ProcessorTime {
    fn now_s(&self) -> f64 {
        thread_seconds().unwrap_or_else(|| self.0.now_s())
    }
}

/// The kernel brings a running thread's account up to date at its next tick, some milliseconds away, or when the thread yields; so it
/// yields first.
fn thread_seconds() -> Option<f64> {
    let mut sum_s = 0.0;
    std::thread::yield_now();
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
        let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
        sum_s += 1e-9 * nanoseconds;
    }
    (sum_s > 0.0).then_some(sum_s)
}

/// Processor time of the thread that asks; wall time where the system does not tell.
#[cfg_attr(unix, allow(dead_code, reason = "the clock is the system's"))]
pub struct ThreadWork(WallTime);

impl ThreadWork {
    pub fn start() -> Self {
        Self(WallTime::start())
    }
}

impl Stopwatch for ThreadWork {
    #[cfg(unix)]
    fn now_s(&self) -> f64 {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        sensel::num::f64_from_i64(time.tv_sec) + 1e-9 * sensel::num::f64_from_i64(time.tv_nsec)
    }

    #[cfg(not(unix))]
    fn now_s(&self) -> f64 {
        self.0.now_s()
    }
}
