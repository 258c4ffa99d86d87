//! Limits of recorded motion, and the errors that name them.

/// Samples further apart than this are a gap; nothing is invented inside it. A tenth of a second and a microsecond: differences of decimal
/// time stamps at 10 Hz come out above 0.1 by their rounding.
pub const GAP_S_MAX: f64 = 0.100_001;

/// Neighbouring control poses may turn by as much; at half a turn the direction is ambiguous.
pub const TURN_DEG_MAX: f64 = 175.0;

/// Why a motion was refused. Times are seconds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages name every field.
pub enum MotionError {
    #[error("{t_s:.6} s is outside the trajectory, which covers {start_s:.6} s to {end_s:.6} s")]
    OutsideSpan { t_s: f64, start_s: f64, end_s: f64 },
    #[error(
        "the trajectory has a gap of {length_s:.3} s at {at_s:.3} s; up to {GAP_S_MAX} s is bridged unasked: \
         choose a span without it, or raise motion.bridge_gaps_s"
    )]
    Gap { at_s: f64, length_s: f64 },
    #[error("{count} poses; a spline needs at least 4")]
    TooFewSamples { count: usize },
    #[error("a knot spacing of {knot_s} s; use 0.005 to 1")]
    KnotSpacing { knot_s: f64 },
    #[error(
        "{degrees:.1} degrees from the pose before {t_s} s to the one at it; use up to {TURN_DEG_MAX}: poses in between"
    )]
    HalfTurn { t_s: f64, degrees: f64 },
    #[error("the pose at {t_s} s is not finite")]
    NotFinite { t_s: f64 },
    #[error("time does not rise at {t_s} s")]
    TimeStandsStill { t_s: f64 },
    #[error("a scale of {scale}; use 1e-9 to 100")]
    Scale { scale: f64 },
}

impl MotionError {
    /// The library's error, once the caller knows the scenario's key for this motion.
    pub fn at_key(&self, key: &str, value: impl std::fmt::Display) -> crate::error::Error {
        crate::error::Error::key(key, value, self.to_string())
    }
}
