//! What effects cost, and what leaving them out saves. CPU time of one thread, interleaved rounds, medians.
//!
//! `cargo bench --bench effects` prints all three parts; `-- costs`, `-- saved` or `-- planning` one of them:
//! - costs: the table of `src/effects/costs.rs`, each effect's frame less the frame without it, and predicted against measured for whole
//!   sensors;
//! - saved: the plan's frames against those with all effects, sensor alone and whole frame, of an easy scene and of the worst;
//! - planning: the time of facts and plan, the scene being loaded.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, missing_docs)]

#[path = "effects/costs.rs"]
mod measured_costs;
#[path = "effects/saved.rs"]
mod saved;

/// CPU time of all threads of this process in seconds, to the nanosecond of the kernel's scheduler. The kernel brings a running thread's
/// account up to date at its next tick, some milliseconds away, or when the thread yields; so it yields first.
pub fn cpu_s() -> f64 {
    std::thread::yield_now();
    let tasks = std::fs::read_dir("/proc/self/task").expect("the kernel tells of its tasks");
    let of = |task: std::io::Result<std::fs::DirEntry>| {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    1e-9 * tasks.filter_map(of).sum::<f64>()
}

/// Median CPU seconds of each job over rounds in which all take turns, there and back.
pub fn medians_s(rounds: usize, jobs: &mut [Box<dyn FnMut() + '_>]) -> Vec<f64> {
    let mut times: Vec<Vec<f64>> = jobs.iter().map(|_| Vec::new()).collect();
    jobs.iter_mut().for_each(|job| job());
    for round in 0..rounds {
        for step in 0..jobs.len() {
            let job = if round % 2 == 0 { step } else { jobs.len() - 1 - step };
            let before_s = cpu_s();
            jobs[job]();
            times[job].push(cpu_s() - before_s);
        }
    }
    times.iter_mut().for_each(|times| times.sort_by(f64::total_cmp));
    times.iter().map(|times| times[times.len() / 2]).collect()
}

fn main() {
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    let named = |name: &str| std::env::args().any(|argument| argument == name);
    let all = !["costs", "saved", "planning"].into_iter().any(named);
    if all || named("costs") {
        measured_costs::print();
    }
    if all || named("saved") {
        saved::print();
    }
    if all || named("planning") {
        saved::print_planning();
    }
}
