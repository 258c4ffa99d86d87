//! From what a user wrote to what stages take: ranges and relations are checked here, once. Stages see checked types only.

use std::fmt::Display;
use std::ops::RangeBounds;

use glam::DQuat;

use super::scenario::Scenario;
use crate::adc::{AdcParams, Cds, Counter, Counting, Ramp};
use crate::effects::chain::BlackRows;
use crate::effects::plan::EffectChoice;
use crate::effects::variation::{ProcessCorner, Variation};
use crate::error::Error;
use crate::fidelity::{Fidelity, Rung};
use crate::link::{LinkParams, Mode, RawKind, WhenFull};
use crate::optics::Mosaic;
use crate::optics::mosaic::FILTER_BANDS;
use crate::pixel::{PixelParams, PixelType};
use crate::tracker::TrackerParams;
use crate::units::Size;

/// The value, if it lies in the range; NaN lies in none.
pub fn within<T: PartialOrd + Display + Copy>(
    key: &str,
    value: T,
    range: impl RangeBounds<T>,
    would_do: &str,
) -> Result<T, Error> {
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(Error::key(key, value, format!("out of range; use {would_do}")))
    }
}

/// One filter's efficiencies; near infrared is 0 where it is not written.
fn filter_efficiencies(letter: &str, bands: &[f64]) -> Result<(char, [f64; FILTER_BANDS]), Error> {
    let key = format!("sensor.pixel.qe_by_filter.{letter}");
    let mut letters = letter.chars();
    let (Some(letter), None) = (letters.next(), letters.next()) else {
        return Err(Error::key(&key, format!("{bands:?}"), "a filter is one letter of the pattern"));
    };
    if !(3..=FILTER_BANDS).contains(&bands.len()) {
        let reason = "use [red, green, blue] or [red, green, blue, near infrared]";
        return Err(Error::key(&key, format!("{bands:?}"), reason));
    }
    let mut efficiencies = [0.0; FILTER_BANDS];
    for (efficiency, &band) in efficiencies.iter_mut().zip(bands) {
        *efficiency = within(&key, band, 0.0..=1.0, "0 to 1 in each band")?;
    }
    Ok((letter, efficiencies))
}

/// The member of a closed set that the text names.
pub fn one_of<T: Copy>(key: &str, text: &str, members: &[(&str, T)]) -> Result<T, Error> {
    members.iter().find(|(name, _)| *name == text).map(|(_, member)| *member).ok_or_else(|| {
        let names: Vec<&str> = members.iter().map(|(name, _)| *name).collect();
        Error::key(key, text, format!("not known; use one of {}", names.join(", ")))
    })
}

/// The member of an enum that a key's word names. Fails on a word that names none, with those that are known.
pub fn member<T: Copy>(key: &str, word: &str, members: &[T], name: fn(T) -> &'static str) -> Result<T, Error> {
    one_of(key, word, &members.iter().map(|&member| (name(member), member)).collect::<Vec<_>>())
}

impl Scenario {
    /// Width and height of the array. Fails on a side outside 16 to 4096 pixels (the extractor's positions have 12 bits).
    pub fn size(&self) -> Result<Size, Error> {
        let width_px = within("sensor.width", self.sensor.width, 16..=4096, "16 to 4096")?;
        let height_px = within("sensor.height", self.sensor.height, 16..=4096, "16 to 4096")?;
        Ok(Size { width_px, height_px })
    }

    /// Knobs of accuracy. Fails on values out of range and on an unknown rung.
    pub fn fidelity(&self) -> Result<Fidelity, Error> {
        let rungs = [Rung::Expected, Rung::Sampled, Rung::Clocked, Rung::Rtl].map(|rung| (rung.name(), rung));
        let rung = one_of("run.rung", &self.run.rung, &rungs)?;
        let accuracy = within("run.accuracy", self.run.accuracy, 0.0..=10.0, "0 to 10")?;
        Ok(Fidelity { rung, accuracy, render: self.render_settings()? })
    }

    /// Threads of the run; 0: as many as cores. Fails on over 1024.
    pub fn threads(&self) -> Result<u32, Error> {
        within("run.threads", self.run.threads, 0..=1024, "0 (all cores) to 1024")
    }

    /// Frames of the run, 1 to a million.
    pub fn frames(&self) -> Result<u32, Error> {
        within("run.frames", self.run.frames, 1..=1_000_000, "1 to 1,000,000")
    }

    /// Which effects the user asked for. Fails on a name that is no effect's.
    pub fn effects(&self, known: &[&str]) -> Result<EffectChoice, Error> {
        EffectChoice::parse(&self.run.effects, known)
            .map_err(|reason| Error::key("run.effects", &self.run.effects, reason))
    }

    /// Photodiode to column line. Fails on values out of range, unknown names.
    pub fn pixel(&self) -> Result<PixelParams, Error> {
        let pixel = &self.sensor.pixel;
        let params = PixelParams {
            pixel_type: member("sensor.pixel.type", &pixel.kind, &PixelType::ALL, PixelType::name)?,
            pitch_um: pixel.pitch_um,
            quantum_efficiency: self.mosaic()?.1,
            fill_factor: pixel.fill_factor,
            conversion_gain_uv_per_e: pixel.conversion_gain_uv_per_e,
            full_well_e: pixel.full_well_e,
            dark_current_e_per_s: pixel.dark_current_e_per_s,
            dark_doubling_k: pixel.dark_doubling_k,
            temperature_k: self.sensor.temperature_k,
            read_noise_uv: pixel.read_noise_uv,
            ktc_noise_uv: pixel.ktc_noise_uv,
            prnu: pixel.prnu,
            dsnu_e: pixel.dsnu_e,
            dcnu: pixel.dcnu,
            storage_dark_e_per_s: pixel.storage_dark_e_per_s,
            storage_leakage_per_s: pixel.storage_leakage_per_s,
            parasitic_light: pixel.parasitic_light,
            rts_ppm: pixel.rts_ppm,
            rts_amplitude_uv: pixel.rts_amplitude_uv,
            rts_rate_hz: pixel.rts_rate_hz,
            flicker_uv_per_rthz: pixel.flicker_uv_per_rthz,
            follower_bandwidth_hz: pixel.follower_bandwidth_hz,
            gain_compression: pixel.gain_compression,
            blooming: pixel.blooming,
            image_lag: pixel.image_lag,
            hot_ppm: pixel.hot_ppm,
            hot_dark_e_per_s: pixel.hot_dark_e_per_s,
            dead_ppm: pixel.dead_ppm,
            stuck_ppm: pixel.stuck_ppm,
            defect_cluster_share: pixel.defect_cluster_share,
            low_conversion_gain_uv_per_e: pixel.low_conversion_gain_uv_per_e,
            overflow_capacity_e: pixel.overflow_capacity_e,
            die_gain_sigma: self.sensor.die_gain_sigma,
            die_offset_uv: self.sensor.die_offset_uv,
            die_dark_sigma: self.sensor.die_dark_sigma,
        };
        params.check()?;
        Ok(params)
    }

    /// Optical-black rows, which lie beyond the array's own. Fails on more than 64, an unknown clamp, or a clamp without rows.
    pub fn black_rows(&self) -> Result<BlackRows, Error> {
        let rows = within("sensor.optical_black_rows", self.sensor.optical_black_rows, 0..=64, "0 to 64")?;
        let clamp = one_of("sensor.black_clamp", &self.sensor.black_clamp, &[("none", false), ("frame", true)])?;
        if clamp && rows == 0 {
            let reason = "a clamp needs optical_black_rows; use 1 or more of these, or black_clamp = none";
            return Err(Error::key("sensor.black_clamp", &self.sensor.black_clamp, reason));
        }
        Ok(BlackRows { rows, first_row: self.sensor.height, clamp })
    }

    /// Colour filters, and the photodiode's quantum efficiency behind them. Fails on no pattern, filters and efficiencies that do not go
    /// together, values out of range.
    pub fn mosaic(&self) -> Result<(Mosaic, f64), Error> {
        let pixel = &self.sensor.pixel;
        let key = "sensor.pixel.quantum_efficiency";
        let mut efficiencies = Vec::new();
        if let Some(one) = pixel.quantum_efficiency {
            if pixel.qe_by_filter.is_some() {
                return Err(Error::key(key, one, "qe_by_filter is written too; use one of the two"));
            }
            if pixel.cfa != "mono" {
                let reason =
                    "only \"mono\" has one efficiency; use \"mono\", or a pattern of capital letters with qe_by_filter";
                return Err(Error::key("sensor.pixel.cfa", &pixel.cfa, reason));
            }
            efficiencies.push(('M', [within(key, one, 0.0..=1.0, "0 to 1")?; FILTER_BANDS]));
        }
        for (letter, bands) in pixel.qe_by_filter.iter().flatten() {
            efficiencies.push(filter_efficiencies(letter, bands)?);
        }
        if efficiencies.is_empty() {
            return Err(Error::key(key, "", "is missing; give this, or qe_by_filter for each filter"));
        }
        Mosaic::parse(&pixel.cfa, &efficiencies)
    }

    /// Process corner and supply of the die. Fails on an unknown corner, a supply out of range or too far from the one that the figures
    /// are given for.
    pub fn variation(&self) -> Result<Variation, Error> {
        let sensor = &self.sensor;
        Variation {
            corner: member("sensor.corner", &sensor.corner, &ProcessCorner::ALL, ProcessCorner::name)?,
            supply_v: within("sensor.supply_v", sensor.supply_v, 0.5..=10.0, "0.5 to 10")?,
            supply_nominal_v: within("sensor.supply_nominal_v", sensor.supply_nominal_v, 0.5..=10.0, "0.5 to 10")?,
        }
        .checked()
    }

    /// Column converters. Fails on values out of range, unknown names, a black level that is no code below the greatest.
    pub fn adc(&self) -> Result<AdcParams, Error> {
        let adc = &self.sensor.adc;
        let params = AdcParams {
            bits: adc.bits,
            clock_hz: adc.clock_hz,
            full_scale_uv: adc.full_scale_uv,
            gain: adc.gain,
            black_level_dn: adc.black_level_dn.unwrap_or((1 << adc.bits.min(16)) / 16),
            column_offset_uv: adc.column_offset_uv,
            column_offset_residual_uv: adc.column_offset_residual_uv,
            column_gain_sigma: adc.column_gain_sigma,
            reset_counts: adc.reset_counts,
            settle_reset_us: adc.settle_reset_us,
            settle_signal_us: adc.settle_signal_us,
            cds: member("sensor.adc.cds", &adc.cds, &Cds::ALL, Cds::name)?,
            ramp: member("sensor.adc.ramp", &adc.ramp, &Ramp::ALL, Ramp::name)?,
            counter: member("sensor.adc.counter", &adc.counter, &Counter::ALL, Counter::name)?,
            counting: member("sensor.adc.counting", &adc.counting, &Counting::ALL, Counting::name)?,
            ramp_points: adc.ramp_points.clone(),
            ramp_table_uv: adc.ramp_table_uv.clone(),
            ramp_inl_lsb: adc.ramp_inl_lsb,
            ramp_settling_clk: adc.ramp_settling_clk,
            ramp_noise_uv: adc.ramp_noise_uv,
            ramp_jitter_ps: adc.ramp_jitter_ps,
            supply_ripple_uv: adc.supply_ripple_uv,
            supply_ripple_hz: adc.supply_ripple_hz,
            comparator_noise_uv: adc.comparator_noise_uv,
            comparator_delay_clk: adc.comparator_delay_clk,
            comparator_delay_sigma_clk: adc.comparator_delay_sigma_clk,
            kickback_uv: adc.kickback_uv,
            kickback_decay_clk: adc.kickback_decay_clk,
            row_noise_uv: adc.row_noise_uv,
            row_offset_uv: adc.row_offset_uv,
            column_noise_uv: adc.column_noise_uv,
            column_capacitance_pf: adc.column_capacitance_pf,
            column_bias_ua: adc.column_bias_ua,
            column_overdrive_v: adc.column_overdrive_v,
            columns_per_adc: adc.columns_per_adc,
            pitch_um: adc.pitch_um,
            sides: adc.sides,
        };
        params.check()?;
        let code_max = params.code_max();
        let would_do = format!("0 to {}", code_max - 1);
        within("sensor.adc.black_level_dn", params.black_level_dn, 0..code_max, &would_do)?;
        Ok(params)
    }

    /// The link. Fails on values out of range, unknown names, a container too small for the codes.
    pub fn link(&self) -> Result<LinkParams, Error> {
        let link = &self.link;
        let mut formats = vec![("auto", None)];
        formats.extend(RawKind::ALL.iter().map(|kind| (kind.name(), Some(*kind))));
        LinkParams {
            lanes: link.lanes,
            frequency_hz: link.frequency_hz,
            mode: member("link.mode", &link.mode, &Mode::ALL, Mode::name)?,
            format: one_of("link.format", &link.format, &formats)?,
            frames_every: link.frames_every,
            line_sync: link.line_sync,
            fifo_rows: link.fifo_rows,
            when_full: member("link.when_full", &link.when_full, &WhenFull::ALL, WhenFull::name)?,
        }
        .checked()
    }

    /// Share of bits that arrive flipped. Fails on a value out of range.
    pub fn bit_error_rate(&self) -> Result<f64, Error> {
        within("link.bit_error_rate", self.link.bit_error_rate, 0.0..=0.01, "0 to 0.01")
    }

    /// The host's tracker. Fails on a window out of range, a switch that is none.
    pub fn tracker_params(&self) -> Result<TrackerParams, Error> {
        let window = within("tracker.window", self.tracker.window, 2..=50, "2 to 50")?;
        // Where all rows have one time, both ways give the same.
        let rolling_shutter = self.tracker.rolling_shutter.is_on("tracker.rolling_shutter", true)?;
        let loop_closing = self.tracker.loop_closing.is_on("tracker.loop_closing", true)?;
        Ok(TrackerParams { window, rolling_shutter, loop_closing, ..TrackerParams::room(self.seed) })
    }

    /// Whether the tracker takes an IMU's readings, where there are any or none. Fails on an unknown word; "on" without an IMU.
    pub fn tracker_uses_imu(&self, has_unit: bool) -> Result<bool, Error> {
        let choice =
            one_of("tracker.imu", &self.tracker.imu, &[("auto", None), ("on", Some(true)), ("off", Some(false))])?;
        if choice == Some(true) && !has_unit {
            let reason = "there is no IMU to take readings from; use auto or off";
            return Err(Error::key("tracker.imu", "on", reason));
        }
        Ok(choice.unwrap_or(has_unit))
    }
}

/// A rotation from its four numbers x y z w.
pub fn unit_quaternion(key: &str, xyzw: [f64; 4]) -> Result<DQuat, Error> {
    let rotation = DQuat::from_array(xyzw);
    let norm = rotation.length();
    if (norm - 1.0).abs() <= crate::pose::QUATERNION_NORM_TOLERANCE {
        return Ok(rotation.normalize());
    }
    Err(Error::key(key, format!("{xyzw:?}"), format!("a quaternion x y z w of norm {norm:.4}; use norm 1")))
}
