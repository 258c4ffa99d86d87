//! Hands memory that was freed back to the system.

/// Hands back what the allocator keeps of freed memory. glibc keeps a heap for each thread, which shrinks at its end only: after a bake,
/// whose lists fill the heaps of all threads, 70 MB of the default run would stay with the process beside what the render takes. Elsewhere
/// nothing is done.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    glibc::trim();
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code)]
mod glibc {
    unsafe extern "C" {
        safe fn malloc_trim(pad: usize) -> std::ffi::c_int;
    }

    pub fn trim() {
        // Whether anything was there to hand back is nobody's question.
        malloc_trim(0);
    }
}
