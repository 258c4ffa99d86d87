//! Counted events: what the sensor, its compute, its link and the host did, before any constant of energy is applied.

use crate::text::named;

named! {
    /// A part of the system that energy and bandwidth are accounted to.
    pub enum Block {
        /// Photodiodes, transfer gates, source followers and column lines.
        Pixel = "pixel",
        /// Comparators, ramp generator and counters.
        Adc = "adc",
        /// Row sequencer, latches and shift-out.
        Readout = "readout",
        /// The feature extractor and its line buffers.
        Compute = "compute",
        /// CSI-2 packetiser and D-PHY, or another port.
        Link = "link",
        /// What serves all: phase-locked loop, references, charge pumps, regulators, clock tree, sequencer; standby.
        Periphery = "periphery",
    }
}

macro_rules! events {
    ($($(#[$doc:meta])* $variant:ident, $name:literal, $block:ident;)*) => {
        /// Something that happens a countable number of times and costs energy each time.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Event { $($(#[$doc])* $variant,)* }

        impl Event {
            /// Every event, in the data's order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The one name of this event in reports and technology files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// The block that pays for it.
            pub fn block(self) -> Block {
                match self { $(Self::$variant => Block::$block,)* }
            }
        }
    };
}

events! {
    /// A photodiode or floating diffusion is reset.
    PixelReset, "pixel_reset", Pixel;
    /// A transfer gate moves a pixel's charge.
    ChargeTransfer, "charge_transfer", Pixel;
    /// A source follower drives its column line to a new level (reset and signal count apart).
    ColumnSettle, "column_settle", Pixel;
    /// A column's comparator is active for one `adc_clk`.
    ComparatorClock, "comparator_clock", Adc;
    /// A binary counter advances by one.
    CounterStep, "counter_step", Adc;
    /// A Gray counter advances by one.
    GrayCounterStep, "gray_counter_step", Adc;
    /// A line of a count shared by all columns toggles.
    CountLineToggle, "count_line_toggle", Adc;
    /// A column writes one bit of the shared count into its latch.
    CountLatchBit, "count_latch_bit", Adc;
    /// The shared ramp generator makes one step.
    RampStep, "ramp_step", Adc;
    /// A row is selected and sequenced.
    RowSelect, "row_select", Readout;
    /// One bit is latched or shifted out of a column.
    ReadoutBit, "readout_bit", Readout;
    /// A word is written to a line buffer of the extractor.
    LineBufferWrite, "line_buffer_write", Compute;
    /// A word is read from a line buffer of the extractor.
    LineBufferRead, "line_buffer_read", Compute;
    /// An add, subtract or compare of one pipeline word.
    ComputeOp, "compute_op", Compute;
    /// A multiply-accumulate of one pipeline word.
    ComputeMac, "compute_mac", Compute;
    /// A byte is sent in high-speed mode.
    LinkByte, "link_byte", Link;
    /// A lane goes from low-power to high-speed mode and back.
    LinkBurst, "link_burst", Link;
}

/// How often each event happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Events {
    counts: Vec<u64>,
}

impl Default for Events {
    fn default() -> Self {
        Self { counts: vec![0; Event::ALL.len()] }
    }
}

impl Events {
    /// Counts an event `times` more. Panics on overflow: 2^64 events are more than any run has.
    pub fn add(&mut self, event: Event, times: u64) {
        let count = &mut self.counts[event as usize];
        *count = count.checked_add(times).expect("fewer than 2^64 events");
    }

    /// How often it happened.
    pub fn count(&self, event: Event) -> u64 {
        self.counts[event as usize]
    }

    /// Adds all counts of another part of the run.
    pub fn merge(&mut self, other: &Self) {
        for &event in Event::ALL {
            self.add(event, other.count(event));
        }
    }

    /// Events with their counts, in the data's order.
    pub fn iter(&self) -> impl Iterator<Item = (Event, u64)> + '_ {
        Event::ALL.iter().map(|&event| (event, self.count(event)))
    }
}
