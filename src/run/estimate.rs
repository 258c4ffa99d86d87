//! Event counts of a sensor's frame without a scene: every pixel has the same level. Bias, clocks and traffic do not depend on
//! the picture, so the estimated power misses only the effect of counters and features.

use super::sensor::SensorSetup;
use crate::adc::{RowWork, count_conversion, count_row};
use crate::compute::Extractor;
use crate::energy::{EnergyAccount, HostEnergy, HostParams};
use crate::error::Error;
use crate::events::{Block, Event, Events};
use crate::link::{LinkParams, Mode, Traffic};
use crate::num::{f64_from_u64, low_u32, u64_from, u64_half_even};
use crate::plane::Plane;
use crate::readout::BinningMode;

/// Level of the picture that an estimate assumes, as a share of the greatest code: what automatic exposure aims at.
pub const ESTIMATED_LEVEL: f64 = 0.4;

/// Raw pictures alone on the link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawSplit {
    /// Payload bits a second in containers.
    pub bits_per_s: f64,
    /// The same without what the container adds.
    pub net_bits_per_s: f64,
    /// Power of the link in mW.
    pub mw: f64,
}

/// What raw pictures and features alone would put on the link, and what that costs one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkSplit {
    /// Of raw pictures; none where the link cannot carry their rows.
    pub raw: Option<RawSplit>,
    /// Payload bits a second of features.
    pub feature_bits_per_s: f64,
    /// Power of the link in mW with features alone.
    pub feature_mw: f64,
    /// With nothing to send: bias that flows between bursts.
    pub floor_mw: f64,
}

impl SensorSetup {
    /// Events of one frame of one sensor whose pixels all stand at a share of the greatest code, 0 to 1. Fails on a row that the link
    /// cannot carry.
    pub fn estimated_events(&self, level: f64) -> Result<Events, Error> {
        let mut events = Events::default();
        let geometry = self.schedule.geometry();
        let columns = crate::num::index(geometry.columns_read());
        let adc = &self.parameters.adc;
        let signal = u64_half_even(level * f64::from(adc.code_max()));
        let reset = u64::from(if adc.reset_counts_used() > 0 { adc.pedestal_lsb() } else { 0 });
        let resets = u64::from(adc.reset_counts_used() > 0);
        let work = RowWork {
            // A comparator is watched for one clock more, in which it flips.
            comparator_clk: u64_from(columns) * (signal + 1 + reset + resets),
            counter_steps: u64_from(columns) * (signal + reset),
        };
        let slots = u64_from(self.schedule.slots().len());
        let rows = slots * (u64::from(geometry.reads()) + u64::from(self.black.rows));
        for _ in 0..rows {
            count_row(adc, self.parameters.pixel.pixel_type, columns, work, &mut events);
            if self.second.is_some() {
                count_conversion(adc, columns, work, &mut events);
            }
        }
        if geometry.binning() > 1 && geometry.mode() == BinningMode::Charge {
            let group = u64::from(geometry.binning()) * u64::from(geometry.binning());
            let others = rows * u64_from(columns) * (group - 1);
            events.add(Event::PixelReset, others);
            events.add(Event::ChargeTransfer, others * self.parameters.pixel.pixel_type.transfers());
        }
        if self.link.mode.sends_features() {
            events.merge(&self.estimated_compute(level)?);
        }
        let features = self.extractor.features_expected(self.size);
        let traffic = self.traffic_of_cycle(features)?;
        let cycle = u64::from(self.link.frames_every.max(1));
        events.add(Event::LinkByte, traffic.link_bytes / cycle);
        events.add(Event::LinkBurst, traffic.packets * u64::from(self.link.lanes) / cycle);
        Ok(events)
    }

    /// Events of the extractor in a frame at that level, and of as many features as are expected. Fails on a picture that it refuses.
    pub(super) fn estimated_compute(&self, level: f64) -> Result<Events, Error> {
        // The extractor sees merged codes, which may have another depth than the converter's.
        let greatest = f64::from((1_u32 << self.bits()) - 1);
        let code = u16::try_from(low_u32(u64_half_even(level * greatest))).unwrap_or(u16::MAX);
        let mut extractor = Extractor::new(&self.extractor);
        let plane = Plane::filled(self.size, code);
        let mut events = super::extractor::extract_one(self, &mut extractor, &plane)?.1;
        self.extractor.count_features(self.extractor.features_expected(self.size), &mut events);
        Ok(events)
    }

    /// Energy of a frame at that level. Fails on a row that the link cannot carry.
    pub fn estimated_energy(&self, level: f64) -> Result<EnergyAccount, Error> {
        let pixels = u64_from(self.size.pixel_count());
        Ok(EnergyAccount::of(&self.estimated_events(level)?, 1, 1, pixels, &self.power))
    }

    /// Bits and power of the link by what is sent, with so many features per frame. Fails on more features than a frame can have.
    pub fn link_split(&self, features: u64) -> Result<LinkSplit, Error> {
        let rate = 1e9 / f64_from_u64(self.power.period_ns);
        let of = |mode: Mode, features: u64| -> Result<(Traffic, f64), Error> {
            let traffic = self.traffic_in(mode, features)?;
            let mut events = Events::default();
            events.add(Event::LinkByte, traffic.link_bytes);
            events.add(Event::LinkBurst, traffic.packets * u64::from(self.link.lanes));
            Ok((traffic, self.link_mw(&events)))
        };
        let (sent, feature_mw) = of(Mode::Features, features)?;
        Ok(LinkSplit {
            raw: of(Mode::Frames, 0).ok().map(|(raw, mw)| RawSplit {
                bits_per_s: rate * f64_from_u64(raw.container_bits),
                net_bits_per_s: rate * f64_from_u64(raw.net_bits),
                mw,
            }),
            feature_bits_per_s: rate * f64_from_u64(sent.feature_bits),
            feature_mw,
            floor_mw: self.link_mw(&Events::default()),
        })
    }

    /// What a frame costs the host that receives pictures alone (none where the link cannot carry their rows), and one that receives
    /// features alone. Fails on more features than a frame can have.
    pub fn host_split(&self, host: &HostParams, features: u64) -> Result<(Option<HostEnergy>, HostEnergy), Error> {
        let frame_s = 1e-9 * f64_from_u64(self.power.period_ns);
        let (pixels, found) = (f64_from_u64(u64_from(self.size.pixel_count())), f64_from_u64(features));
        let bytes = |mode, features| self.traffic_in(mode, features).map(|traffic| f64_from_u64(traffic.link_bytes));
        Ok((
            bytes(Mode::Frames, 0).ok().map(|bytes| host.frame(bytes, pixels, found, frame_s)),
            host.frame(bytes(Mode::Features, features)?, 0.0, found, frame_s),
        ))
    }

    /// Traffic of a frame whose rows or features alone are sent.
    fn traffic_in(&self, mode: Mode, features: u64) -> Result<Traffic, Error> {
        let link =
            LinkParams { mode, frames_every: 1, line_sync: self.link.line_sync && mode.sends_codes(), ..self.link };
        Self { link, ..self.clone() }.traffic_of_cycle(features)
    }

    fn link_mw(&self, events: &Events) -> f64 {
        let account = EnergyAccount::of(events, 1, 1, 1, &self.power);
        account.mean_power_mw(account.block_aj(Block::Link))
    }
}
