//! Where a sensor's power goes: one item for each event that is counted and each bias that flows, with block, rail and constant. Constants
//! come from the technology, everything else from the keys that timing and noise know: supply, bias, clocks, settling, sizes, lanes.
//!
//! Formulas stand in docs/energy.md. An item's energy is an integer number of attojoules: a count times attojoules, or nanoseconds times
//! nanowatts.

use super::constant::Constant;
use super::converter;
pub(super) use super::item::ItemBuilder;
pub use super::item::{Amount, Item, PoweredSensor, Rail};
use super::params::{EnergyParams, Periphery, Port};
use super::technology::Technology;
use crate::adc::AdcParams;
use crate::error::Error;
use crate::events::{Block, Event, Events};
use crate::link::LinkParams;
use crate::num::{f64_from_u64, lesser, u64_half_even};
use crate::pixel::PixelParams;
use crate::readout::{Schedule, Shutter};

/// Charge of an electron in C (CODATA 2018, exact).
const ELECTRON_C: f64 = 1.602_176_634e-19;
/// Supply for which the technology's analog overhead is stated, in V.
const ANALOG_NOMINAL_V: f64 = 2.8;
/// Kelvin over which leakage doubles; the usual figure for subthreshold leakage.
const LEAKAGE_DOUBLING_K: f64 = 25.0;
/// Lines of a row that are driven in a frame of a rolling shutter: select, reset and transfer for the readout, reset and transfer for the
/// start of the exposure.
const ROLLING_LINES: f64 = 5.0;
/// Those of a global shutter: besides the former the gates that store the charge and drain the photodiode.
const GLOBAL_LINES: f64 = 7.0;

impl PoweredSensor {
    /// What of a checked sensor decides its power. `black_rows` are read beside the picture's; `depth_bits` is the depth of the codes that
    /// leave and `merged_bits` that before companding.
    pub fn new(
        params: EnergyParams,
        (pixel, adc): (&PixelParams, &AdcParams),
        (schedule, link): (&Schedule, &LinkParams),
        supply_v: f64,
        (black_rows, depth_bits, merged_bits): (u32, u32, u32),
    ) -> Self {
        let geometry = schedule.geometry();
        let slots = crate::num::u64_from(schedule.slots().len());
        let (reads, columns) = (geometry.reads(), geometry.columns_read());
        let conversions = schedule.params().hdr.conversions();
        let ramps_s = f64_from_u64(adc.ramp_clk().0) / f64_from_u64(adc.clock_hz);
        let pulses_s = f64_from_u64(schedule.params().pulses.total_clk()) / f64_from_u64(schedule.pixel_rate_hz());
        let line_s = schedule.line_time_s();
        Self {
            params,
            pixel: pixel.clone(),
            adc: adc.clone(),
            link: *link,
            supply_v,
            has_extractor: link.mode.sends_features(),
            shutter: schedule.shutter(),
            row_px: geometry.array_size().width_px,
            columns,
            pixels: u64::from(columns) * u64::from(reads),
            depth_bits,
            exposures: slots,
            readings: slots * u64::from(conversions),
            merged_bits,
            active_lines: slots * (u64::from(reads) + u64::from(black_rows)),
            conversion_s: lesser(f64::from(conversions) * (adc.settling_s() + ramps_s + pulses_s), line_s),
            line_s,
            frame_s: schedule.frame_time_s(),
            readout_s: f64_from_u64(schedule.frame_clk().0) / f64_from_u64(schedule.pixel_rate_hz()),
            frame_clk: schedule.frame_clk().0,
        }
    }

    /// Whether a sensor that sleeps between frames can wake up and read one within its period. Fails where it cannot.
    pub fn check_sleep(&self) -> Result<(), Error> {
        let Some(period_s) = self.params.period_s else { return Ok(()) };
        let awake_ns = nanoseconds(self.readout_s) + nanoseconds(self.params.wake_s);
        if nanoseconds(period_s) >= awake_ns {
            return Ok(());
        }
        let least_ms = f64_from_u64(awake_ns) / 1e6;
        let reason = format!("waking up and reading a frame take {least_ms} ms; use that or more, or leave it out");
        Err(Error::key("energy.sleep_period_ms", 1e3 * period_s, reason))
    }

    /// Share of a frame in which columns are converted.
    pub fn conversion_share(&self) -> f64 {
        lesser(f64_from_u64(self.active_lines) * self.conversion_s / self.frame_s, 1.0)
    }

    /// Bits of a pixel that are corrected over bits that leave its column. Correction runs once, on the merged code.
    fn merged_share(&self) -> f64 {
        f64::from(self.merged_bits) / (f64::from(self.adc.bits) * f64_from_u64(self.readings))
    }

    /// Converters of all columns.
    pub fn converters(&self) -> u32 {
        self.columns.div_ceil(self.adc.columns_per_adc)
    }
}

/// The items of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorPower {
    /// What they were made from.
    pub sensor: PoweredSensor,
    /// Its constants.
    pub technology: Technology,
    /// In the order of the data.
    pub items: Vec<Item>,
    /// From frame to frame, in nanoseconds.
    pub period_ns: u64,
    lane_ps_per_byte: u64,
    lane_ns_per_burst: u64,
}

impl SensorPower {
    /// The items of a sensor in a technology.
    pub fn new(sensor: PoweredSensor, technology: Technology) -> Self {
        // A sensor that streams has no wake-up; one that sleeps reads a frame without the wait for a trigger.
        let sleeps = sensor.params.period_s.is_some();
        let sensor = if sleeps { PoweredSensor { frame_s: sensor.readout_s, ..sensor } } else { sensor };
        let frame_ns = nanoseconds(sensor.frame_s);
        let wake_ns = if sleeps { nanoseconds(sensor.params.wake_s) } else { 0 };
        let awake_ns = frame_ns + wake_ns;
        let period_ns = sensor.params.period_s.map_or(awake_ns, nanoseconds);
        let link = &sensor.link;
        let lane_ps_per_byte = u64_half_even(8e12 / (2.0 * f64_from_u64(link.frequency_hz)));
        let lane_ns_per_burst = nanoseconds(link.seconds(link.burst_overhead()));
        let pixel_die = sensor.params.pixel_node_nm.map(|node_nm| technology.scaled_to(node_nm));
        let mut build = ItemBuilder { sensor: &sensor, technology: &technology, frame_ns, wake_ns, items: Vec::new() };
        build.pixels(pixel_die.as_ref().unwrap_or(&technology));
        converter::items(&mut build);
        build.readout();
        build.compute();
        build.port();
        build.periphery(period_ns.saturating_sub(awake_ns));
        let items = build.items;
        Self { sensor, technology, items, period_ns, lane_ps_per_byte, lane_ns_per_burst }
    }

    /// The same sensor with other constants.
    #[must_use]
    pub fn with_technology(&self, technology: Technology) -> Self {
        Self::new(self.sensor.clone(), technology)
    }

    /// How often an item happens in `frames` frames of `sensors` sensors with these events.
    pub fn times(&self, amount: Amount, events: &Events, frames: u64) -> u64 {
        match amount {
            Amount::Event(event) => events.count(event),
            Amount::PerFrame(times) | Amount::Nanoseconds(times) => times.saturating_mul(frames),
            Amount::LaneNanoseconds => {
                let (bytes, bursts) = (events.count(Event::LinkByte), events.count(Event::LinkBurst));
                let ps = u128::from(bytes) * u128::from(self.lane_ps_per_byte);
                let ns = ps / 1000 + u128::from(bursts) * u128::from(self.lane_ns_per_burst);
                u64::try_from(ns).unwrap_or(u64::MAX)
            }
        }
    }
}

fn nanoseconds(seconds: f64) -> u64 {
    u64_half_even(seconds * 1e9)
}

impl ItemBuilder<'_> {
    /// An event or count that costs picojoules.
    pub fn pj(&mut self, block_and_rail: (Block, Rail), amount: Amount, of: Constant, energy_pj: f64) {
        self.add(block_and_rail, amount, of, u64_half_even(energy_pj * 1e6));
    }

    /// A bias in milliwatts for a share of a frame, and all of the time that waking up takes.
    pub fn mw(&mut self, block_and_rail: (Block, Rail), of: Constant, share: f64, power_mw: f64) {
        let ns = u64_half_even(f64_from_u64(self.frame_ns) * share) + self.wake_ns;
        self.add(block_and_rail, Amount::Nanoseconds(ns), of, u64_half_even(power_mw * 1e6));
    }

    fn add(&mut self, (block, rail): (Block, Rail), amount: Amount, of: Constant, constant: u64) {
        self.items.push(Item { name: of.name(), block, rail, amount, constant, of });
    }

    pub fn value(&self, constant: Constant) -> f64 {
        self.technology.value(constant)
    }

    /// Energy of the logic over that at the core's voltage: C V^2 below it; above it a regulator passes the core's charge.
    pub fn logic_factor(&self) -> f64 {
        let core_v = self.technology.core_voltage_v;
        let ratio = self.sensor.params.digital_v.unwrap_or(core_v) / core_v;
        if ratio < 1.0 { ratio * ratio } else { ratio }
    }

    /// Share of a frame for which bias flows, rows without conversion included.
    pub fn bias_share(&self) -> f64 {
        let active = self.sensor.conversion_share();
        active + self.sensor.params.idle_bias * (1.0 - active)
    }

    /// Bias of this class of sensor over that of a product.
    pub fn bias_class(&self) -> f64 {
        match self.sensor.params.periphery {
            Periphery::Full => 1.0,
            Periphery::LowPower => self.value(Constant::LowPowerBias),
            Periphery::External => self.value(Constant::ExternalBias),
        }
    }

    fn pixels(&mut self, die: &Technology) {
        let (sensor, supply_v) = (self.sensor, self.sensor.supply_v);
        let block_and_rail = (Block::Pixel, Rail::Analog);
        let square_pj = |capacitance_ff: f64| 1e-3 * capacitance_ff * supply_v * supply_v;
        let diffusion_ff = 1e21 * ELECTRON_C / sensor.pixel.conversion_gain_uv_per_e;
        let reset_pj = square_pj(diffusion_ff + die.value(Constant::PixelReset));
        self.pj(block_and_rail, Amount::Event(Event::PixelReset), Constant::PixelReset, reset_pj);
        let transfer_pj = square_pj(die.value(Constant::ChargeTransfer));
        self.pj(block_and_rail, Amount::Event(Event::ChargeTransfer), Constant::ChargeTransfer, transfer_pj);
        if !converter::has_columns(sensor) {
            return;
        }
        let swing_v = lesser(1e-6 * sensor.adc.full_scale_uv / sensor.adc.gain, supply_v);
        let line_ff = 1e3 * sensor.adc.column_capacitance_pf + die.value(Constant::ColumnSettle);
        let settle_pj = 1e-3 * line_ff * swing_v * supply_v;
        self.pj(block_and_rail, Amount::Event(Event::ColumnSettle), Constant::ColumnSettle, settle_pj);
        let given_ua = sensor.adc.column_bias_ua;
        let bias_ua = if given_ua > 0.0 { given_ua } else { die.value(Constant::ColumnBias) * self.bias_class() };
        let share = self.bias_share();
        self.mw(block_and_rail, Constant::ColumnBias, share, 1e-3 * bias_ua * supply_v * f64::from(sensor.columns));
    }

    fn readout(&mut self) {
        let sensor = self.sensor;
        let supply_v = sensor.supply_v;
        let pixel_ff = self.value(Constant::RowSelect) + self.value(Constant::Wire) * sensor.pixel.pitch_um;
        let lines = match sensor.shutter {
            Shutter::Rolling => ROLLING_LINES,
            Shutter::Global => GLOBAL_LINES,
        };
        let row_pj = 1e-3 * lines * f64::from(sensor.row_px) * pixel_ff * supply_v * supply_v;
        self.pj((Block::Readout, Rail::Analog), Amount::Event(Event::RowSelect), Constant::RowSelect, row_pj);
        let digital = (Block::Readout, Rail::Digital);
        let (bit, core_v) = (Amount::Event(Event::ReadoutBit), self.technology.core_voltage_v);
        // A bit travels half of the bus in the mean, and every other bit differs from the one before it: C V^2 over two of that.
        let bus_ff = self.value(Constant::Wire) * sensor.pixel.pitch_um * f64::from(sensor.columns);
        let bus_pj = 1e-3 * 0.25 * bus_ff * core_v * core_v;
        let logic = self.logic_factor();
        let shift_pj = logic * (self.value(Constant::ReadoutBit) + bus_pj);
        self.pj(digital, bit, Constant::ReadoutBit, shift_pj);
        // A test chip corrects less of its codes than a product, by the same ratio as its bias.
        let corrects = if sensor.params.periphery == Periphery::External { self.bias_class() } else { 1.0 };
        let pipeline = logic * sensor.merged_share();
        self.pj(digital, bit, Constant::DatapathBit, corrects * pipeline * self.value(Constant::DatapathBit));
        if sensor.params.image_processor {
            self.pj(digital, bit, Constant::ImageProcessorBit, pipeline * self.value(Constant::ImageProcessorBit));
        }
        if sensor.params.pixel_node_nm.is_some() {
            self.pj(digital, bit, Constant::TsvBit, self.value(Constant::TsvBit));
        }
    }

    fn compute(&mut self) {
        let block_and_rail = (Block::Compute, Rail::Digital);
        let logic = self.logic_factor();
        for (event, of) in [
            (Event::LineBufferWrite, Constant::LineBufferWrite),
            (Event::LineBufferRead, Constant::LineBufferRead),
            (Event::ComputeOp, Constant::ComputeOp),
            (Event::ComputeMac, Constant::ComputeMac),
        ] {
            self.pj(block_and_rail, Amount::Event(event), of, logic * self.value(of));
        }
        // Without an extractor nothing leaks.
        let present = if self.sensor.has_extractor { self.leakage() } else { 0.0 };
        self.mw(block_and_rail, Constant::LeakageCompute, 1.0, present * self.value(Constant::LeakageCompute));
    }

    /// Leakage over that at 300 K and the core's voltage.
    fn leakage(&self) -> f64 {
        self.logic_factor() * libm::exp2((self.sensor.pixel.temperature_k - 300.0) / LEAKAGE_DOUBLING_K)
    }

    fn port(&mut self) {
        let (sensor, block_and_rail) = (self.sensor, (Block::Link, Rail::Io));
        let class = match sensor.params.periphery {
            Periphery::Full | Periphery::External => 1.0,
            Periphery::LowPower => self.value(Constant::LowPowerPort),
        };
        let byte = Amount::Event(Event::LinkByte);
        let lanes = f64::from(sensor.params.port_lanes.unwrap_or(sensor.link.lanes));
        match sensor.params.port {
            Port::None => {}
            Port::Parallel => {
                // A data pin rises at every fourth bit of random data; the clock pin at every code.
                let rises = 0.25 + 1.0 / f64::from(sensor.depth_bits);
                let io_v = sensor.params.io_v;
                let byte_pj = 8.0 * rises * 1e-3 * self.value(Constant::Pad) * io_v * io_v;
                self.pj(block_and_rail, byte, Constant::Pad, class * byte_pj);
            }
            Port::Lvds => {
                self.pj(block_and_rail, byte, Constant::LinkByte, class * self.value(Constant::LinkByte));
                let lane_mw = 1e-3 * self.value(Constant::LvdsLane) * sensor.params.io_v;
                self.mw(block_and_rail, Constant::LvdsLane, 1.0, class * (lanes + 1.0) * lane_mw);
            }
            Port::Dphy => {
                self.pj(block_and_rail, byte, Constant::LinkByte, class * self.value(Constant::LinkByte));
                let burst = Amount::Event(Event::LinkBurst);
                self.pj(block_and_rail, burst, Constant::LinkBurst, class * self.value(Constant::LinkBurst));
                self.mw(block_and_rail, Constant::PhyLane, 1.0, class * (lanes + 1.0) * self.value(Constant::PhyLane));
                // The clock lane runs all the time; data lanes are in high-speed mode for their bytes and the ways in and out.
                let clock_mw = 1e-9 * self.value(Constant::LaneClock) * f64_from_u64(sensor.link.frequency_hz);
                for (of, lane_mw) in [(Constant::HsLane, self.value(Constant::HsLane)), (Constant::LaneClock, clock_mw)]
                {
                    self.mw(block_and_rail, of, 1.0, class * lane_mw);
                    self.add(block_and_rail, Amount::LaneNanoseconds, of, u64_half_even(1e6 * class * lane_mw));
                }
            }
        }
    }

    fn periphery(&mut self, asleep_ns: u64) {
        let class = match self.sensor.params.periphery {
            Periphery::Full => 1.0,
            Periphery::LowPower => self.value(Constant::LowPowerOverhead),
            Periphery::External => 0.0,
        };
        let (logic, analog) = (self.logic_factor(), self.sensor.supply_v / ANALOG_NOMINAL_V);
        for (of, rail, factor) in [
            (Constant::Pll, Rail::Digital, logic),
            (Constant::Sequencer, Rail::Digital, logic),
            (Constant::References, Rail::Analog, analog),
            (Constant::ChargePump, Rail::Analog, analog),
            (Constant::Regulators, Rail::Analog, analog),
            (Constant::Pads, Rail::Io, 1.0),
        ] {
            self.mw((Block::Periphery, rail), of, 1.0, class * factor * self.value(of));
        }
        let block_and_rail = (Block::Periphery, Rail::Digital);
        // The pipeline is clocked by merged pixels: readings leave the columns faster by the number of exposures.
        let clocks = Amount::PerFrame(self.sensor.frame_clk / self.sensor.exposures);
        self.pj(block_and_rail, clocks, Constant::ClockTree, class * logic * self.value(Constant::ClockTree));
        let leakage_mw = class * self.leakage() * self.value(Constant::LeakageLogic);
        self.mw(block_and_rail, Constant::LeakageLogic, 1.0, leakage_mw);
        let standby_nw = u64_half_even(1e3 * self.value(Constant::Standby));
        self.add(block_and_rail, Amount::Nanoseconds(asleep_ns), Constant::Standby, standby_nw);
    }
}
