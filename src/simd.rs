//! The dispatch file: one kernel, instantiated for the baseline, AVX2 and AVX-512, chosen at run time.
//!
//! A kernel is a plain loop over arrays in an `#[inline(always)]` function; wider registers never change its bits, because
//! nothing is contracted or reordered. On aarch64 and wasm the baseline is NEON or simd128 by construction.
//!
//! What several kernels call, or one calls twice, is a kernel too: inlined, it would be compiled for each, and a function twice as
//! long takes more than twice as long to compile.

use std::sync::atomic::{AtomicU8, Ordering};

/// Work that may be compiled for several instruction sets. `run` must be `#[inline(always)]`.
pub trait Kernel {
    /// What the work gives back.
    type Output;
    /// Does the work.
    fn run(self) -> Self::Output;
}

/// Instruction sets that a kernel is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// What the target has anyway: SSE2, NEON or simd128.
    Baseline,
    /// x86-64-v3 without FMA.
    Avx2,
    /// x86-64-v4 without FMA.
    Avx512,
}

const UNKNOWN: u8 = 0;
static CHOSEN: AtomicU8 = AtomicU8::new(UNKNOWN);

/// The best level of this machine, or the lower one set by `limit`.
pub fn level() -> Level {
    match CHOSEN.load(Ordering::Relaxed) {
        1 => Level::Baseline,
        2 => Level::Avx2,
        3 => Level::Avx512,
        _ => {
            let found = detect();
            limit(found);
            found
        }
    }
}

/// Uses at most this level from now on (for benches and for the test that all levels give the same bits).
pub fn limit(most: Level) {
    let chosen = most.min(detect());
    CHOSEN.store(1 + chosen as u8, Ordering::Relaxed);
}

#[cfg(target_arch = "x86_64")]
fn detect() -> Level {
    if std::is_x86_feature_detected!("avx512f")
        && std::is_x86_feature_detected!("avx512bw")
        && std::is_x86_feature_detected!("avx512dq")
        && std::is_x86_feature_detected!("avx512vl")
    {
        Level::Avx512
    } else if std::is_x86_feature_detected!("avx2") {
        Level::Avx2
    } else {
        Level::Baseline
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn detect() -> Level {
    Level::Baseline
}

/// Runs the kernel at the chosen level.
#[inline]
#[allow(unsafe_code)]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(all(target_arch = "x86_64", not(test)))]
    match level() {
        // SAFETY: `level` returns these only where `detect` found their features.
        Level::Avx512 => unsafe { kernel.avx512() },
        Level::Avx2 => unsafe { kernel.avx2() },
        Level::Baseline => kernel.baseline(),
    }
    // The library's unit tests have the baseline alone, to compile sooner; the integration tests compare the levels.
    #[cfg(any(test, not(target_arch = "x86_64")))]
    kernel.baseline()
}

/// A kernel compiled for each level. The compiler puts provided methods in the codegen unit of the kernel's own module, so kernels of
/// different modules compile in parallel, and an edit compiles only its own module's kernels again.
#[allow(unsafe_code)]
trait Compiled: Kernel + Sized {
    #[inline(never)]
    fn baseline(self) -> Self::Output {
        self.run()
    }

    /// # Safety
    ///
    /// The processor has the features of `Level::Avx2`.
    #[cfg(all(target_arch = "x86_64", not(test)))]
    #[target_feature(enable = "avx,avx2,bmi1,bmi2,lzcnt,popcnt")]
    #[inline(never)]
    unsafe fn avx2(self) -> Self::Output {
        self.run()
    }

    /// # Safety
    ///
    /// The processor has the features of `Level::Avx512`.
    #[cfg(all(target_arch = "x86_64", not(test)))]
    #[target_feature(enable = "avx,avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl")]
    #[inline(never)]
    unsafe fn avx512(self) -> Self::Output {
        self.run()
    }
}

impl<K: Kernel> Compiled for K {}

/// Defines a function whose body is a kernel. Its arguments share one lifetime; it may be generic in one type.
macro_rules! kernel {
    (@output) => { () };
    (@output $output:ty) => { $output };
    ($(#[$doc:meta])* $visibility:vis fn $name:ident<$life:lifetime $(, $word:ident: $bound:path)?>(
        $($argument:ident: $type:ty),* $(,)?
    ) $(-> $output:ty)? $body:block) => {
        $(#[$doc])*
        #[allow(clippy::needless_lifetimes, reason = "the kernel's type takes the same tokens")]
        $visibility fn $name<$life $(, $word: $bound)?>($($argument: $type),*) $(-> $output)? {
            struct Arguments<$life $(, $word: $bound)?> { $($argument: $type),* }

            impl<$life $(, $word: $bound)?> $crate::simd::Kernel for Arguments<$life $(, $word)?> {
                type Output = kernel!(@output $($output)?);

                #[inline(always)]
                fn run(self) -> Self::Output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            $crate::simd::dispatch(Arguments { $($argument),* })
        }
    };
}
pub(crate) use kernel;
