//! What a configuration says of power beside what timing and noise know already: port, architecture of the converters, class of the
//! periphery, supplies, duty cycle.

use crate::text::named;

named! {
    /// Architecture of the converters, for energy alone: times and codes stay those of the single-slope converter.
    pub enum Architecture {
        /// A ramp for all columns, a comparator and a count per column.
        SingleSlope = "single_slope",
        /// Successive approximation with a capacitor array a column.
        Sar = "sar",
        /// Cyclic (algorithmic): a residue amplifier a column.
        Cyclic = "cyclic",
        /// Incremental sigma-delta of second order with a decimation filter a column.
        SigmaDelta = "sigma_delta",
        /// A comparator and a memory in every pixel; no column lines.
        InPixel = "in_pixel",
        /// One fast converter for `columns_per_adc` columns.
        MultiColumn = "multi_column",
    }
}

named! {
    /// What carries bits out of the chip, for energy alone: times stay those of the D-PHY link.
    pub enum Port {
        /// D-PHY lanes and a clock lane.
        Dphy = "dphy",
        /// LVDS lanes and a clock lane, driven all the time.
        Lvds = "lvds",
        /// A pin a bit and a pixel clock.
        Parallel = "parallel",
        /// Nothing that the figure counts.
        None = "none",
    }
}

named! {
    /// What stands on the chip beside array, converters and port.
    pub enum Periphery {
        /// A product: phase-locked loop, references, charge pumps, regulators, sequencer.
        Full = "full",
        /// A product sold as an always-on or ultra-low-power sensor: slow clocks, no loop or PHY that runs all the time.
        LowPower = "low_power",
        /// A test chip: clocks, references and port stand outside, and the published figure leaves them out.
        External = "external",
    }
}

/// Checked keys of `[energy]`.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyParams {
    /// Architecture of the converters.
    pub adc_architecture: Architecture,
    /// The port.
    pub port: Port,
    /// LVDS lanes, clock lane apart, 1 to 128; not given: those of the link.
    pub port_lanes: Option<u32>,
    /// Class of the periphery.
    pub periphery: Periphery,
    /// Whether the chip demosaics and processes pictures before it sends them.
    pub image_processor: bool,
    /// Supply of the logic in V, 0.2 to 5.5; above the core's voltage a linear regulator stands between. Not given: the core's.
    pub digital_v: Option<f64>,
    /// Supply of the port in V, 0.2 to 5.5.
    pub io_v: f64,
    /// Share of column and converter bias that flows while no row is converted, 0 to 1.
    pub idle_bias: f64,
    /// Node of the pixel die of a stacked sensor in nm, 5 to 1000; not given: one die.
    pub pixel_node_nm: Option<f64>,
    /// From frame to frame of a sensor that sleeps between frames, in seconds, up to 86,400; not given: frames follow one another.
    pub period_s: Option<f64>,
    /// From sleep to the first row of a frame, in seconds, 0 to 10: all bias flows.
    pub wake_s: f64,
}

impl Default for EnergyParams {
    /// A product with one die, single-slope converters and a D-PHY that streams.
    fn default() -> Self {
        Self {
            adc_architecture: Architecture::SingleSlope,
            port: Port::Dphy,
            port_lanes: None,
            periphery: Periphery::Full,
            image_processor: false,
            digital_v: None,
            io_v: 1.8,
            idle_bias: 0.75,
            pixel_node_nm: None,
            period_s: None,
            wake_s: 0.0,
        }
    }
}
