//! Waveforms of the sensor for selected rows and columns: signals and their changes at instants in whole picoseconds. Writes no file.
//!
//! Time 0 is the first clock of the frame; its rows are exposed before one frame length has passed, or soon after, and read from then on.
//! Pins of the converters are unknown outside the lines that are shown; real signals hold there.

mod analog;
mod clocks;
#[cfg(feature = "waveforms")]
pub mod encode;
mod frame;
mod lanes;
mod lines;
mod plan;
pub mod plot;
mod power;
mod rows;
mod selection;
mod signals;

pub use selection::{Asked, Selection};
pub use signals::{Signal, SignalChange, SignalId, SignalKind, Value, Waves};

use crate::adc::{Cds, Columns, Converter};
use crate::effects::chain::RowSamples;
use crate::error::Error;
use crate::link::WhenFull;
use crate::num::{f32_nearest, f64_from_u64, f64_from_usize, index, u32_from};
use crate::readout::BinningMode;
use crate::run::SensorSetup;
use analog::Analog;
use clocks::{Frequency, instant_ps};
use frame::FrameSignals;
use lanes::{LaneSignals, Lanes, LinkSignals};
use lines::{RowLine, pix_clk, row_line};
use plan::Group;
pub use plan::{WavePlan, WaveRow};
use power::PowerSignals;
use rows::{CoreSignals, LineClocks, PulseTimes, core_config, run_rows, tail_clk};
use signals::Recorder;

impl<'a> WavePlan<'a> {
    /// Prepares what was asked for. Fails on rows, columns or a frame that are not there; a sensor whose lines the clocked core does not
    /// hold.
    pub fn new(sensor: &'a SensorSetup, asked: Asked<'_>, frames: u32) -> Result<Self, Error> {
        let (adc, schedule) = (&sensor.parameters.adc, &sensor.schedule);
        let selection = Selection::new(asked, schedule.output_size(), frames)?;
        check_readout(sensor)?;
        let (line_clk, pix) = (schedule.line_clk().0, pix_clk(schedule));
        let line_adc_clk = Frequency::hz(adc.clock_hz).clocks_within(line_clk, pix);
        let readout = schedule.params();
        let pulse_s = |clocks: u32| f64::from(clocks) / f64_from_u64(schedule.pixel_rate_hz());
        let pulses =
            PulseTimes { reset_s: pulse_s(readout.pulses.reset_clk), transfer_s: pulse_s(readout.pulses.transfer_clk) };
        let lines: Vec<RowLine> = selection.rows.iter().map(|&row| row_line(schedule, selection.frame, row)).collect();
        let mut groups = Vec::new();
        for lines in lines::groups(&lines) {
            let row_step = lines.get(1).map_or(1, |second| second.array_row - lines[0].array_row);
            let (first_row, rows) = (lines[0].array_row, u32_from(lines.len()));
            let line = LineClocks { line_adc_clk, first_row, row_step, rows };
            let config = core_config(adc, line, u32_from(selection.columns.len()), pulses)?;
            groups.push(Group { lines, config });
        }
        let line_lane_clk = Frequency::hz(readout.lane_clock_hz).clocks_within(line_clk, pix);
        let lanes = Lanes::new(adc, schedule.output_size().width_px, readout, line_lane_clk)?;
        Ok(Self { sensor, selection, converter: Converter::new(adc), groups, lanes })
    }

    /// What is shown.
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// A test picture, for a sensor without a scene: a wedge from no signal in the first column to the least signal of the greatest
    /// code in the last, without noise; every row is like it.
    pub fn wedge(&self) -> Vec<WaveRow> {
        let adc = &self.sensor.parameters.adc;
        let width = index(self.width_px());
        // Half an LSB beyond the last edge, so that the ramp's rounding decides nothing.
        let full_uv = (f64::from(adc.code_max() - adc.black_level_dn) + 0.5) * adc.lsb_uv();
        let share = |column: usize| f64_from_usize(column) / f64_from_usize((width - 1).max(1));
        let signal_uv: Vec<f32> = (0..width).map(|column| f32_nearest(full_uv * share(column))).collect();
        let reset_uv = if adc.cds == Cds::Digital { vec![0.0; width] } else { Vec::new() };
        let row =
            || WaveRow { samples: RowSamples { signal_uv: signal_uv.clone(), reset_uv: reset_uv.clone() }, sent: None };
        self.selection.rows.iter().map(|_| row()).collect()
    }

    /// The waves of the chosen rows. `columns` are the converters of the camera's die. Fails on a row that the link cannot carry.
    pub fn waves(&self, columns: &Columns<'_>, rows: &[WaveRow]) -> Result<Waves, Error> {
        assert!(rows.len() == self.selection.rows.len(), "every chosen row has its samples");
        let mut recorder = Recorder::default();
        let signals = Signals::add(&mut recorder, self)?;
        signals.frame.show(&mut recorder, self);
        let mut rest = rows;
        let mut end_ps = 0;
        for group in &self.groups {
            let (own, after) = rest.split_at(group.lines.len());
            end_ps = self.show_group(group, columns, own, &signals, &mut recorder)?.max(end_ps);
            rest = after;
        }
        Ok(recorder.finish(end_ps))
    }

    fn width_px(&self) -> u32 {
        self.sensor.schedule.output_size().width_px
    }

    fn at_ps(&self, line_clk: u64, domain: Frequency, halves: u64) -> u64 {
        instant_ps(pix_clk(&self.sensor.schedule), line_clk, domain, halves)
    }

    /// Shows rows that follow each other; gives back when the last of them has left.
    fn show_group(
        &self,
        group: &Group,
        columns: &Columns<'_>,
        rows: &[WaveRow],
        signals: &Signals,
        recorder: &mut Recorder,
    ) -> Result<u64, Error> {
        let (adc, schedule) = (&self.sensor.parameters.adc, &self.sensor.schedule);
        let adc_clk = Frequency::hz(adc.clock_hz);
        let start_clk = |line: u32| group.lines[0].start_clk + u64::from(line) * schedule.line_clk().0;
        let instant = |line: u32, clock: u32| self.at_ps(start_clk(line), adc_clk, 2 * u64::from(clock));
        let analog = Analog::new(&self.converter, columns, self.width_px());
        let latched = run_rows(group.config, analog, rows, &signals.core, recorder, &instant);
        let mut end_ps = instant(u32_from(rows.len()), tail_clk(&group.config.seq));
        recorder.forget(signals.core.bits(), end_ps);
        let mut lanes_end_ps = None;
        for ((line, row), latch) in group.lines.iter().zip(rows).zip(&latched) {
            signals.frame.line_shown(recorder, self, line);
            signals.power.show(recorder, &|ns| self.at_ps(line.start_clk, Frequency::hz(power::CLOCK_HZ), 2 * ns));
            let mut codes = vec![0; row.samples.signal_uv.len()];
            columns.convert_row(&row.samples.signal_uv, &row.samples.reset_uv, &mut codes);
            for (&column, &code) in self.selection.columns.iter().zip(&latch.codes) {
                assert!(codes[index(column)] == code, "the clocked core and the closed form give one code");
            }
            if let (Some(lanes), Some(pins)) = (&self.lanes, &signals.lanes) {
                let first = lanes.clock.first_edge_after(u64::from(latch.clock) + 1, adc_clk);
                let edge_ps = |halves| self.at_ps(start_clk(latch.line), lanes.clock, halves);
                lanes_end_ps = Some(pins.shift(recorder, lanes, &codes, first, &edge_ps));
            }
            end_ps = end_ps.max(self.send(line, row.sent.as_ref().unwrap_or(&codes), signals, recorder)?);
        }
        if let (Some(end), Some(pins)) = (lanes_end_ps, &signals.lanes) {
            recorder.forget(pins.all(), end);
            end_ps = end_ps.max(end);
        }
        if let Some(link) = &signals.link {
            recorder.forget(link.all(), end_ps);
        }
        Ok(end_ps)
    }

    /// The row's packet, from the end of its line on; behind serial lanes a line later, when all its codes are out.
    fn send(&self, line: &RowLine, codes: &[u16], signals: &Signals, recorder: &mut Recorder) -> Result<u64, Error> {
        let Some(pins) = &signals.link else { return Ok(0) };
        let link = &self.sensor.link;
        let packet = crate::link::pack_row(codes, self.sensor.bits(), 0, link)?;
        let lines = if self.lanes.is_some() { 2 } else { 1 };
        let start_clk = line.start_clk + lines * self.sensor.schedule.line_clk().0;
        let byte_ps = |halves| self.at_ps(start_clk, LinkSignals::byte_clk(link), halves);
        let bit_ps = |halves| self.at_ps(start_clk, Frequency::hz(2 * link.frequency_hz), halves);
        Ok(pins.send(recorder, link, &packet, &byte_ps, &bit_ps))
    }
}

/// Refuses readouts in which a row of the picture is not one line of conversions, or whose exposure only the run knows.
fn check_readout(sensor: &SensorSetup) -> Result<(), Error> {
    let (geometry, readout) = (sensor.schedule.geometry(), sensor.schedule.params());
    let refuse_key = |key: &str, would_do: &str| Err(Error::key(key, "", format!("has no waves; use {would_do}")));
    let refuse = |key: &str, would_do: &str| refuse_key(&format!("sensor.readout.{key}"), would_do);
    // Each row's packet follows its line here, in every frame and at once.
    let link = &sensor.link;
    if link.when_full == WhenFull::Stall {
        return refuse_key("link.when_full", "refuse");
    }
    for (key, is_set, would_do) in [
        ("link.line_sync", link.line_sync, "false"),
        ("link.frames_every", link.frames_every > 1, "1"),
        ("link.fifo_rows", link.fifo_rows > 1, "1"),
    ] {
        if is_set {
            return refuse_key(key, would_do);
        }
    }
    if sensor.merge.is_some() {
        return refuse("hdr", "none");
    }
    if readout.auto.is_some() {
        return refuse("exposure", "fixed");
    }
    if geometry.binning() > 1 && geometry.mode() == BinningMode::Average {
        return refuse("binning_mode", "charge or skip");
    }
    Ok(())
}

/// All signals, in the order of the data.
struct Signals {
    frame: FrameSignals,
    core: CoreSignals,
    lanes: Option<LaneSignals>,
    link: Option<LinkSignals>,
    power: PowerSignals,
}

impl Signals {
    fn add(recorder: &mut Recorder, plan: &WavePlan<'_>) -> Result<Self, Error> {
        let (adc, link) = (&plan.sensor.parameters.adc, &plan.sensor.link);
        Ok(Self {
            frame: FrameSignals::add(recorder, plan),
            core: CoreSignals::add(recorder, adc, &plan.selection.columns),
            lanes: plan.lanes.as_ref().map(|lanes| LaneSignals::add(recorder, lanes)),
            link: link.mode.sends_codes().then(|| LinkSignals::add(recorder, link)),
            power: PowerSignals::add(recorder, plan.sensor.line_power()?),
        })
    }
}
