//! Why a figure cannot be measured.

/// Why a figure has no value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotMeasurable {
    /// Too little to align.
    #[error("{associated} poses of truth and estimate agree in time within 10 ms, at least {needed} are needed")]
    TooFewPoses {
        /// Pairs found.
        associated: usize,
        /// Pairs that are enough.
        needed: usize,
    },
    /// All positions are equal or on one line.
    #[error("all positions are equal or on one line, so no rotation aligns them; the still-rig figures need none")]
    Degenerate,
    /// The trajectory is shorter than the time a relative error spans.
    #[error("{poses} poses are too few for a relative error over {delta} frames")]
    TooShort {
        /// Pairs there are.
        poses: usize,
        /// Frames between the two poses of a relative error.
        delta: usize,
    },
    /// No three consecutive poses are evenly spaced in time.
    #[error("no three consecutive poses are evenly spaced, so there is no second difference")]
    Uneven,
    /// The tracker or the configuration gave nothing to measure.
    #[error("{0}")]
    Absent(String),
}

/// A figure in the unit of its name, or the reason why there is none.
pub type Figure = Result<f64, NotMeasurable>;
