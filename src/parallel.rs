//! Loops over independent pieces of work, on all cores where the feature is on. Results do not depend on the order of the work.

/// Results by number.
pub fn collected<T: Send>(count: usize, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(of).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..count).map(of).collect()
    }
}

/// Results of work on chunks of a list, by number of the chunk.
pub fn chunks_collected<T: Send, R: Send>(
    all: &mut [T],
    length: usize,
    work: impl Fn(usize, &mut [T]) -> R + Send + Sync,
) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        all.par_chunks_mut(length).enumerate().map(|(number, chunk)| work(number, chunk)).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        all.chunks_mut(length).enumerate().map(|(number, chunk)| work(number, chunk)).collect()
    }
}

/// Work on chunks of a list, by number of the chunk.
pub fn over_chunks<T: Send>(all: &mut [T], length: usize, work: impl Fn(usize, &mut [T]) + Send + Sync) {
    chunks_collected(all, length, work);
}
