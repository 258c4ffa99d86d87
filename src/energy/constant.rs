//! The constants of the energy model by name and unit.

use crate::text::named;

named! {
    /// Unit of a constant; its name is the key that holds the value in a technology file.
    pub enum Unit {
        /// Picojoules a time.
        Picojoule = "pj",
        /// Femtofarads.
        Femtofarad = "ff",
        /// Microamperes.
        Microampere = "ua",
        /// Femtocoulombs a clock.
        Femtocoulomb = "fc",
        /// Milliwatts.
        Milliwatt = "mw",
        /// Microwatts.
        Microwatt = "uw",
        /// A plain number.
        Ratio = "ratio",
    }
}

macro_rules! constants {
    ($($(#[$doc:meta])* $variant:ident, $name:literal, $unit:ident;)*) => {
        /// A constant of the model.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Constant { $($(#[$doc])* $variant,)* }

        impl Constant {
            /// Every constant, in the data's order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The one name of this constant in technology files and reports.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Its unit.
            pub fn unit(self) -> Unit {
                match self { $(Self::$variant => Unit::$unit,)* }
            }
        }
    };
}

constants! {
    /// Capacitance that a reset charges beside q over the conversion gain.
    PixelReset, "pixel_reset", Femtofarad;
    /// Capacitance of a transfer gate.
    ChargeTransfer, "charge_transfer", Femtofarad;
    /// Capacitance at a column's end beside the column line's own.
    ColumnSettle, "column_settle", Femtofarad;
    /// A column's clock gate passes one `adc_clk` until its comparator flips.
    ComparatorClock, "comparator_clock", Picojoule;
    /// A binary counter advances by one.
    CounterStep, "counter_step", Picojoule;
    /// A Gray counter advances by one.
    GrayCounterStep, "gray_counter_step", Picojoule;
    /// A line of the shared count toggles along 640 columns.
    CountLineToggle, "count_line_toggle", Picojoule;
    /// A column writes one bit of the shared count.
    CountLatchBit, "count_latch_bit", Picojoule;
    /// The ramp generator makes one step for 640 columns.
    RampStep, "ramp_step", Picojoule;
    /// Gate of one pixel on one row line.
    RowSelect, "row_select", Femtofarad;
    /// One micrometre of wire.
    Wire, "wire", Femtofarad;
    /// A bit is latched and shifted, its bus apart.
    ReadoutBit, "readout_bit", Picojoule;
    /// A bit of a code passes correction, gain and formatting.
    DatapathBit, "datapath_bit", Picojoule;
    /// A bit of a code passes the image processor of chips that have one.
    ImageProcessorBit, "image_processor_bit", Picojoule;
    /// A word is written to a line buffer.
    LineBufferWrite, "line_buffer_write", Picojoule;
    /// A word is read from a line buffer.
    LineBufferRead, "line_buffer_read", Picojoule;
    /// An add, subtract or compare of the extractor.
    ComputeOp, "compute_op", Picojoule;
    /// A multiply-accumulate of the extractor.
    ComputeMac, "compute_mac", Picojoule;
    /// A byte is sent.
    LinkByte, "link_byte", Picojoule;
    /// A lane goes to high speed and back.
    LinkBurst, "link_burst", Picojoule;
    /// Bias of a column's source follower where the configuration gives none.
    ColumnBias, "column_bias", Microampere;
    /// Bias of a column's converter that does not depend on its clock.
    ComparatorBias, "comparator_bias", Microampere;
    /// Charge that a comparator's bias passes in one `adc_clk`.
    ComparatorCharge, "comparator_charge", Femtocoulomb;
    /// Decision and logic of a bit of a SAR converter.
    SarBit, "sar_bit", Picojoule;
    /// Unit capacitor of a SAR converter.
    SarUnit, "sar_unit", Femtofarad;
    /// A bit of a cyclic converter.
    CyclicBit, "cyclic_bit", Picojoule;
    /// A cycle of an incremental sigma-delta converter.
    SigmaDeltaCycle, "sigma_delta_cycle", Picojoule;
    /// A bit of the decimation filter in one cycle.
    DecimatorBit, "decimator_bit", Picojoule;
    /// A bit of a converter that several columns share.
    SharedBit, "shared_bit", Picojoule;
    /// Bias of the comparator in a digital pixel.
    PixelComparator, "pixel_comparator", Microampere;
    /// A bit is written into a digital pixel's memory.
    PixelMemoryBit, "pixel_memory_bit", Picojoule;
    /// A bit passes from die to die.
    TsvBit, "tsv_bit", Picojoule;
    /// Phase-locked loop.
    Pll, "pll", Milliwatt;
    /// Timing generator and registers.
    Sequencer, "sequencer", Milliwatt;
    /// Band gap and bias tree.
    References, "references", Milliwatt;
    /// Charge pumps of the row drivers.
    ChargePump, "charge_pump", Milliwatt;
    /// Regulators.
    Regulators, "regulators", Milliwatt;
    /// Pads beside the port.
    Pads, "pads", Milliwatt;
    /// Flip-flops and clock buffers in one `pix_clk`.
    ClockTree, "clock_tree", Picojoule;
    /// Leakage of the sensor's logic at 300 K.
    LeakageLogic, "leakage_logic", Milliwatt;
    /// Leakage of the extractor at 300 K.
    LeakageCompute, "leakage_compute", Milliwatt;
    /// Bias of a D-PHY lane at all times.
    PhyLane, "phy_lane", Milliwatt;
    /// Bias of a D-PHY lane in high-speed mode, beside `phy_lane`.
    HsLane, "hs_lane", Milliwatt;
    /// A D-PHY lane's serialiser in one clock of the lane.
    LaneClock, "lane_clock", Picojoule;
    /// Bias of an LVDS lane.
    LvdsLane, "lvds_lane", Microampere;
    /// Load of a pin of a parallel port.
    Pad, "pad", Femtofarad;
    /// The sensor asleep.
    Standby, "standby", Microwatt;
    /// Overhead of an always-on sensor over that of another.
    LowPowerOverhead, "low_power_overhead", Ratio;
    /// Bias of an always-on sensor's columns over that of another.
    LowPowerBias, "low_power_bias", Ratio;
    /// Port of an always-on sensor over that of another.
    LowPowerPort, "low_power_port", Ratio;
    /// Bias of a test chip's columns over that of a product.
    ExternalBias, "external_bias", Ratio;
    /// Exponent of the node in analog bias.
    AnalogExponent, "analog_exponent", Ratio;
    /// Exponent of the node in digital energy.
    DigitalExponent, "digital_exponent", Ratio;
}

impl Constant {
    /// The constant of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|constant| constant.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_constant_is_found_by_its_name() {
        assert!(Constant::ALL.len() > 40);
        for &constant in Constant::ALL {
            assert_eq!(Constant::from_name(constant.name()), Some(constant));
            assert!(Unit::ALL.contains(&constant.unit()));
        }
        assert_eq!(Constant::from_name("comparator"), None);
    }
}
