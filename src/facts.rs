//! Facts about a scene and a sensor that are cheap to know before anything is simulated. The planner decides from these.

/// What is known of one region (or of a whole frame) before it is simulated. Intervals are bounds, not estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Least mean photoelectrons of a pixel of the region.
    pub signal_e_min: f64,
    /// Greatest mean photoelectrons of a pixel of the region, parasitic light included.
    pub signal_e_max: f64,
    /// Greatest mean photoelectrons of any pixel of any frame: what neighbours and the frame before can bring.
    pub frame_e_max: f64,
    /// Root mean square of what a pixel holds beside its own light, in electrons: dark charge, its pattern, charge of neighbours
    /// and of the frame before, and noise before the column's gain.
    pub dark_rms_e: f64,
    /// Exposure in seconds.
    pub exposure_s: f64,
    /// Longest wait between the end of an exposure and the row's readout, in seconds.
    pub storage_s_max: f64,
    /// Temperature of the die in kelvin.
    pub temperature_k: f64,
    /// Pixels of a frame; tails are taken at one pixel in this many.
    pub pixels: f64,
    /// Conversion gain from electrons to the ADC's input, in microvolts per electron.
    pub conversion_gain_uv_per_e: f64,
    /// Greatest slope of a pixel's charge over what the array gathers: above 1 where charge may spill over.
    pub spill_slope_max: f64,
    /// Greatest slope of the samples over the charge, relative to the conversion gain: above 1 where dies differ in gain.
    pub gain_slope_max: f64,
}
