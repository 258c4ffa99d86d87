//! Words with a fraction in the sensor's digital part, each with its binary point. The extractor's are those of its hardware, so they
//! stand in `rtl_models::words`; here are those of stages that have no twin.

use fixed::types::extra::{U6, U12, U16, U24};
use fixed::{FixedI64, FixedU32};

pub use rtl_models::words::{
    EdgeDistancePx, FORMATS as EXTRACTOR_FORMATS, Format, HalfScaleMean, PositionPx, ShiftPx, Significand, Sine, Slope,
    SlopeSide, TraceShare, TriangleMean, TurnedPx, Turns, rounded,
};

rtl_models::words! {
    /// All words of this file.
    FORMATS:
    BinomialColumn = FixedU32<U6>, "Sum of seven pixels of a column under the binomial weights, as their mean", "0 to 2^P - 1";
    BinomialMean = FixedU32<U12>, "Sum under the 7 x 7 binomial kernel, as the mean that it is 4096 times of", "0 to 2^P - 1";
    DecayShare = FixedI64<U24>, "Share of a kickback that is left after some clocks, and that share in nV", "-2^36 to 2^36";
    RampGain = FixedU32<U16>, "Gain of the ramp in the line of embedded data", "0 to 65535 65535/65536";
}
