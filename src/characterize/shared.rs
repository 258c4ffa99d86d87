//! Noise that lines share.

/// Parts of the temporal variance in the dark that all pixels of a row, and of a column, have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SharedVariance {
    /// Of a row, in DN^2.
    pub row_dn2: f64,
    /// Of a column, in DN^2.
    pub column_dn2: f64,
}
