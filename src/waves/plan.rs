//! Which rows and signals of a frame are written.

use super::lanes::Lanes;
use super::lines::RowLine;
use super::selection::Selection;
use crate::adc::Converter;
use crate::effects::chain::RowSamples;
use crate::run::SensorSetup;
use rtl_models::sensor_core::CoreConfig;

/// A selection of a sensor's rows and columns with everything that its waves need, checked.
#[derive(Debug)]
pub struct WavePlan<'a> {
    pub(super) sensor: &'a SensorSetup,
    pub(super) selection: Selection,
    pub(super) converter: Converter,
    pub(super) groups: Vec<Group>,
    pub(super) lanes: Option<Lanes>,
}

/// Rows whose lines follow each other.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) lines: Vec<RowLine>,
    pub(super) config: CoreConfig,
}

/// A row to be shown.
#[derive(Clone, Debug)]
pub struct WaveRow {
    /// Samples of all its columns.
    pub samples: RowSamples,
    /// Codes of its packet; what the converters give where nothing comes behind them.
    pub sent: Option<Vec<u16>>,
}
