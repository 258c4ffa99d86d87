//! Peak memory of the sensor stage, from photons to codes, over what the photons take: below 32 bytes per pixel. And the peak of the
//! tracker, which is bounded over a long run.

// A counting allocator is unsafe by its trait; it only hands on to the system's.
#![allow(unsafe_code)]

#[path = "tracker/bounded.rs"]
mod bounded;
#[path = "../benches/common/mod.rs"]
mod sensor;
#[path = "tracker/synthetic.rs"]
#[allow(dead_code)]
mod synthetic;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use sensor::{HEIGHT, Sensor, WIDTH};

struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// The counters are the process', so one measurement at a time.
static ALONE: Mutex<()> = Mutex::new(());

// SAFETY: every call goes to `System` unchanged; the counters touch no memory of the caller.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps `dealloc`'s contract.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Two frames: the first draws the die's patterns and keeps them, the second meets them. Of the peak, 8 bytes per pixel are the patterns of
/// PRNU and DSNU and 2 are the codes; rows in work add a share that falls with the height.
#[test]
fn the_sensor_stage_stays_below_32_bytes_a_pixel() {
    let _alone = ALONE.lock().unwrap();
    let sensor = Sensor::new(20_000.0);
    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    for frame in 0..2 {
        std::hint::black_box(sensor.frame(frame));
    }
    let peak = PEAK.load(Ordering::Relaxed) - before;
    let pixels = WIDTH * usize::try_from(HEIGHT).expect("a VGA picture is small");
    println!("peak {peak} bytes over the photons: {:.1} bytes per pixel", peak as f64 / pixels as f64);
    assert!(peak > 10 * pixels, "patterns and codes alone take more: nothing was measured");
    assert!(peak < 32 * pixels, "{peak} bytes for {pixels} pixels");
}

#[test]
fn the_trackers_memory_does_not_grow_with_time() {
    let _alone = ALONE.lock().unwrap();
    bounded::check(|| HELD.load(Ordering::Relaxed));
}
