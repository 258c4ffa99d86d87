//! The same counted events under other ways of sending: what extraction on the sensor saves.

use super::estimate::ESTIMATED_LEVEL;
use super::packet_demand::packet_demand_s;
use super::sensor::SensorSetup;
use crate::energy::{EnergyAccount, PoweredSensor, Rail, SensorPower};
use crate::error::Error;
use crate::events::{Block, Event, Events};
use crate::link::{LinkParams, Mode};
use crate::num::{f64_from_u64, f64_from_usize, u64_from, u64_half_even};
use crate::readout::Schedule;
use crate::report::alternatives_record::{Alternative, Alternatives, LeftOut};
use crate::report::latency_record::Waterfall;

/// Rows are sent in every so many frames where a scenario says nothing else.
const FRAMES_EVERY: u32 = 4;

/// What was counted, and over what.
#[derive(Clone, Copy, Debug)]
pub struct Counted<'a> {
    /// Events of all sensors and frames.
    pub events: &'a Events,
    /// Frames of the rig.
    pub frames: u32,
    /// Sensors of the rig.
    pub cameras: u32,
    /// Features of a camera's frame, in the mean.
    pub features: u64,
    /// Position error of the run.
    pub ate_m: Option<f64>,
    /// Latency of the run's slowest frame; none where nothing has run.
    pub waterfall: Option<&'a Waterfall>,
}

/// "st", "nd", "rd" or "th".
fn ordinal_suffix(number: u32) -> &'static str {
    match (number % 100, number % 10) {
        (11..=13, _) => "th",
        (_, 1) => "st",
        (_, 2) => "nd",
        (_, 3) => "rd",
        _ => "th",
    }
}

impl SensorSetup {
    /// Raw pictures, features, both, and both with rows every Nth frame. Fails only where the estimate of an extractor that has not run
    /// does.
    pub fn alternatives(&self, counted: &Counted) -> Result<Alternatives, Error> {
        let every = if self.link.frames_every > 1 { self.link.frames_every } else { FRAMES_EVERY };
        let modes = [
            ("raw".to_owned(), Mode::Frames, 1),
            ("features".to_owned(), Mode::Features, 1),
            ("both".to_owned(), Mode::Both, 1),
            (format!("both, rows every {every}{} frame", ordinal_suffix(every)), Mode::Both, every),
        ];
        let compute = self.compute_events(counted)?;
        let host = self.host.map_or("none", |host| host.name).to_owned();
        let mut table = Alternatives { features: counted.features, host, ..Alternatives::default() };
        for (name, mode, frames_every) in modes {
            match self.sending(mode, frames_every, counted.features) {
                Ok(sensor) => {
                    let is_run = (mode, frames_every) == (self.link.mode, self.link.frames_every);
                    table.rows.push(sensor.alternative(name, counted, &compute, is_run)?);
                }
                Err(error) => table.left_out.push(LeftOut { name, reason: error.to_string() }),
            }
        }
        Ok(table)
    }

    /// This sensor with another way of sending. Fails on a link that cannot carry it.
    fn sending(&self, mode: Mode, frames_every: u32, features: u64) -> Result<Self, Error> {
        let link = LinkParams { mode, frames_every, ..self.link };
        let readout = self.schedule.params();
        let packet_s = packet_demand_s(&link, self.size, self.bits(), readout)?;
        let schedule = Schedule::new(self.array, readout, &self.parameters.adc, packet_s)?;
        let powered = PoweredSensor { link, has_extractor: mode.sends_features(), ..self.power.sensor.clone() };
        let power = SensorPower::new(powered, self.power.technology.clone());
        let sensor = Self { link, schedule, power, ..self.clone() };
        if mode.sends_features() {
            sensor.check_frame(features)?;
        }
        Ok(sensor)
    }

    /// The extractor's events of all frames: counted, or of pictures of one level where it has not run.
    fn compute_events(&self, counted: &Counted) -> Result<Events, Error> {
        let mut events = Events::default();
        if self.link.mode.sends_features() {
            let of_extractor = counted.events.iter().filter(|(event, _)| event.block() == Block::Compute);
            of_extractor.for_each(|(event, times)| events.add(event, times));
            return Ok(events);
        }
        let sensor_frames = u64::from(counted.frames) * u64::from(counted.cameras);
        let one = self.estimated_compute(ESTIMATED_LEVEL)?;
        one.iter().for_each(|(event, times)| events.add(event, times * sensor_frames));
        Ok(events)
    }

    fn alternative(
        &self,
        name: String,
        counted: &Counted,
        compute: &Events,
        is_run: bool,
    ) -> Result<Alternative, Error> {
        let sensor_frames = u64::from(counted.frames) * u64::from(counted.cameras);
        let sent = self.traffic_of_cycle(counted.features)?;
        let cycle = f64::from(self.link.frames_every);
        let counted_bytes = f64_from_u64(counted.events.count(Event::LinkByte)) / f64_from_u64(sensor_frames);
        let bytes_per_frame = if is_run { counted_bytes } else { f64_from_u64(sent.link_bytes) / cycle };
        let mut events = Events::default();
        if is_run {
            events.merge(counted.events);
        } else {
            let stays =
                |event: Event| event.block() != Block::Compute && !matches!(event, Event::LinkByte | Event::LinkBurst);
            let staying = counted.events.iter().filter(|(event, _)| stays(*event));
            staying.for_each(|(event, times)| events.add(event, times));
            if self.link.mode.sends_features() {
                events.merge(compute);
            }
            let all = |a_cycle: u64| u64_half_even(f64_from_u64(a_cycle) * f64_from_u64(sensor_frames) / cycle);
            events.add(Event::LinkByte, all(sent.link_bytes));
            events.add(Event::LinkBurst, all(sent.packets * u64::from(self.link.lanes)));
        }
        let pixels = u64_from(self.size.pixel_count()) * u64::from(counted.cameras);
        let account = EnergyAccount::of(&events, counted.frames, counted.cameras, pixels, &self.power);
        let rail_mw = |rail: Rail| account.mean_power_mw(account.rail_aj(rail));
        let waterfall = match counted.waterfall.filter(|_| is_run) {
            Some(measured) => measured,
            None => &self.waterfall(counted.features, counted.cameras)?,
        };
        let link_ends = waterfall.frame.iter().rfind(|step| !step.step.starts_with("host") && step.step != "tracker");
        let frame_s = 1e-9 * f64_from_u64(self.power.period_ns);
        let cameras = f64::from(counted.cameras);
        let extracted_px = if self.link.mode.sends_features() { 0.0 } else { f64_from_usize(self.size.pixel_count()) };
        let host = self.host.map(|host| {
            let one = host.frame(bytes_per_frame, extracted_px, f64_from_u64(counted.features), frame_s);
            // Cameras share the host's idle power and the tracker's work a frame.
            1e-3 * (cameras * (one.receive_uj + one.extract_uj) + one.track_uj + one.idle_uj)
        });
        Ok(Alternative {
            name,
            is_run,
            analog_mw: rail_mw(Rail::Analog),
            digital_mw: rail_mw(Rail::Digital),
            io_mw: rail_mw(Rail::Io),
            power_mw: account.power_mw(),
            link_mbit_per_s: 8e-6 * bytes_per_frame * cameras / frame_s,
            latency_us: link_ends.map_or(0.0, |step| step.end_us),
            pose_us: waterfall.pose_us,
            host_mj_per_frame: host,
            keeps_up: self.keep_up(counted.features).map(|clocks| clocks.keeps_up),
            ate_m: counted.ate_m.filter(|_| is_run),
        })
    }
}
