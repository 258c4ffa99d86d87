//! Checks a sensor's parameters and times without a scene. `timing` and `characterize` need only this.

use super::packet_demand::packet_demand_s;
use crate::adc::AdcParams;
use crate::compute::{ExtractorParams, RowSpacing, frame_clk};
use crate::config::Resolved;
use crate::effect::Effect;
use crate::effects::chain::{BlackRows, Chain};
use crate::effects::{self, Parameters};
use crate::energy::{HostParams, PoweredSensor, SensorPower};
use crate::error::Error;
use crate::link::LinkParams;
use crate::num::f64_from_u64;
use crate::optics::Mosaic;
use crate::pixel::{PixelParams, PixelType};
use crate::readout::{
    AutoExposure, CodeRange, Geometry, Hdr, HdrMerge, MERGED_BITS_MAX, ReadoutParams, Schedule, Window,
};
use crate::units::Size;

/// Everything between light and link of one camera.
#[derive(Clone, Debug)]
pub struct SensorSetup {
    /// The array.
    pub array: Size,
    /// The picture: what is read of the array.
    pub size: Size,
    /// Colour filters, as they lie over the picture's pixels.
    pub mosaic: Mosaic,
    /// Pixel and converters, at the higher gain where there are two.
    pub parameters: Parameters,
    /// The same at the lower of two conversion gains.
    pub second: Option<Parameters>,
    /// How several readings of a pixel become one code.
    pub merge: Option<HdrMerge>,
    /// Rows behind metal.
    pub black: BlackRows,
    /// The sequencer's times, of the first camera.
    pub schedule: Schedule,
    /// The link.
    pub link: LinkParams,
    /// Share of its bits that arrive flipped.
    pub bit_error_rate: f64,
    /// The extractor.
    pub extractor: ExtractorParams,
    /// Its clock in Hz.
    pub compute_hz: u64,
    /// Where its power goes.
    pub power: SensorPower,
    /// The host behind the link; none where none is modelled.
    pub host: Option<HostParams>,
}

impl SensorSetup {
    /// Checks sensor, extractor, link and technology. Fails on any value out of range or impossible combination; the error names file,
    /// line, key, value and an accepted value.
    pub fn new(resolved: &Resolved) -> Result<Self, Error> {
        Self::build(resolved).map_err(|error| resolved.tree.locate(error))
    }

    /// Depth of the codes that leave the sensor.
    pub fn bits(&self) -> u32 {
        self.merge.as_ref().map_or(self.parameters.adc.bits, HdrMerge::bits)
    }

    /// Clocks of the pixel clock from row to row of a picture.
    pub fn row_clk(&self) -> u64 {
        self.schedule.line_clk().0 * self.schedule.lines_per_packet()
    }

    /// The same in the extractor's own clocks.
    pub fn row_spacing(&self) -> RowSpacing {
        RowSpacing::new(self.row_clk(), self.schedule.pixel_rate_hz(), self.compute_hz)
    }

    /// Mean photons of its longest exposure that fill a pixel in its least sensitive reading, or its converter's range where that is
    /// less; infinite for a pixel that sees no light.
    pub fn saturation_photons(&self) -> f64 {
        Self::saturation_of(self.second.as_ref().unwrap_or(&self.parameters))
    }

    /// The same of one reading.
    pub fn saturation_of(parameters: &Parameters) -> f64 {
        let (pixel, adc) = (&parameters.pixel, &parameters.adc);
        let range_e = adc.saturation_uv() / pixel.conversion_gain_uv_per_e;
        crate::num::lesser(range_e, pixel.full_well_e) / (pixel.quantum_efficiency * pixel.fill_factor)
    }

    /// Electrons that a photon leaves in a pixel, in the mean.
    pub fn electrons_per_photon(&self) -> f64 {
        self.parameters.pixel.quantum_efficiency * self.parameters.pixel.fill_factor
    }

    /// The controller of an automatic exposure, as it stands before the first frame; none where the exposure is fixed. Fails on limits
    /// that contradict schedule or converter.
    pub fn auto_exposure(&self) -> Result<Option<AutoExposure>, Error> {
        let Some(params) = &self.schedule.params().auto else { return Ok(None) };
        let adc = &self.parameters.adc;
        AdcParams { gain: params.gain_max, ..adc.clone() }.check()?;
        let max_dn = f64::from((1_u32 << self.bits()) - 1);
        let range = CodeRange { black_dn: adc.black_level_dn.into(), max_dn, gain: adc.gain };
        AutoExposure::new(params, &self.schedule, range).map(Some)
    }

    /// Columns and rows after which the colour filters repeat.
    pub fn pattern_px(&self) -> (usize, usize) {
        (self.mosaic.width_px(), self.mosaic.height_px())
    }

    /// How readings become one with the exposures of this schedule.
    pub fn merge_of(&self, schedule: &Schedule) -> Option<HdrMerge> {
        self.merge.clone().map(|merge| with_exposures(merge, schedule))
    }

    /// Everything between photons and codes at a gain of the ramp, with the effects of these names in the first and in the second
    /// reading.
    pub fn chain(&self, gain: f64, chosen: [&[&str]; 2], seed: u64, die_seed: u64) -> Chain {
        let at_gain = |parameters: &Parameters| {
            let mut parameters = parameters.clone();
            parameters.adc.gain = gain;
            parameters
        };
        let first = at_gain(&self.parameters);
        let built = effects_named(&first, chosen[0]);
        let mut chain = Chain::new(first, built, seed, die_seed).with_black_rows(self.black);
        if let (Some(second), Some(merge)) = (&self.second, &self.merge) {
            let second = at_gain(second);
            let built = effects_named(&second, chosen[1]);
            chain = chain.with_second_reading(second, built, merge.clone());
        }
        let geometry = *self.schedule.geometry();
        if geometry.output_size() == geometry.array_size() { chain } else { chain.with_geometry(geometry) }
    }

    fn build(resolved: &Resolved) -> Result<Self, Error> {
        let scenario = &resolved.scenario;
        let array = scenario.size()?;
        let parameters = scenario.variation()?.of(Parameters { pixel: scenario.pixel()?, adc: scenario.adc()? })?;
        parameters.adc.check_pitch(&parameters.pixel)?;
        let link = scenario.link()?;
        let whole = scenario.mosaic()?.0;
        let mut readout = scenario.readout()?;
        readout.check()?;
        let (columns, rows) = (whole.width_px(), whole.height_px());
        readout.mosaic_px = crate::num::u32_from(columns.max(rows));
        if readout.binning > 1 && columns.max(rows) % columns.min(rows) != 0 {
            let reason = format!("a pattern of {columns} x {rows} filters cannot be binned by colour; use 1");
            return Err(Error::key("sensor.readout.binning", readout.binning, reason));
        }
        let geometry = Geometry::new(array, &readout)?;
        let (size, window) = (geometry.output_size(), geometry.window());
        let second = (readout.hdr == Hdr::DualGain).then(|| second_reading(&parameters)).transpose()?;
        // The merged depth decides the packets, which decide the line: so the ratio comes first, and the exposures' own with them.
        let merge = nominal_merge(&parameters, second.as_ref(), readout.hdr)?;
        let hdr_bits = scenario.hdr_bits()?;
        let merged_bits = merge.as_ref().map_or(parameters.adc.bits, HdrMerge::bits_before_companding);
        let merge = merge.map(|merge| merge.companded(hdr_bits));
        let bits = merge.as_ref().map_or(parameters.adc.bits, HdrMerge::bits);
        let packet_time_s = packet_demand_s(&link, size, bits, &readout)
            .map_err(|error| at_key_of_width(error, (array, size), &readout))?;
        let timed = |readout: &ReadoutParams| Schedule::new(array, readout, &parameters.adc, packet_time_s);
        let (schedule, too_short) = match timed(&readout) {
            Ok(schedule) => (schedule, None),
            // The frame that the error names may be too short for the link, which then names a longer one.
            Err(error) => {
                let shortest = Schedule::with_shortest_frame(array, &readout).and_then(|readout| timed(&readout));
                match shortest {
                    Ok(schedule) => (schedule, Some(error)),
                    Err(_) => return Err(error),
                }
            }
        };
        let extractor = scenario.extractor()?;
        ExtractorParams::check_size(size)?;
        let clock_hz = scenario.compute_hz()?;
        if clock_hz.is_none() {
            check_extractor_clk(&extractor, size, &schedule)?;
        }
        let compute_hz = clock_hz.unwrap_or_else(|| schedule.pixel_rate_hz());
        let technology = resolved.technology()?;
        let mosaic = whole.starting_at(window.x_px, window.y_px);
        let black = scenario.black_rows()?;
        let merge = merge.map(|merge| with_exposures(merge, &schedule));
        let bit_error_rate = scenario.bit_error_rate()?;
        let powered = PoweredSensor::new(
            scenario.energy_params()?,
            (&parameters.pixel, &parameters.adc),
            (&schedule, &link),
            scenario.sensor.supply_v,
            (black.rows, bits, merged_bits),
        );
        powered.check_sleep()?;
        let power = SensorPower::new(powered, technology);
        let host = scenario.host_params()?;
        let setup = Self {
            array,
            size,
            mosaic,
            parameters,
            second,
            merge,
            black,
            schedule,
            link,
            bit_error_rate,
            extractor,
            compute_hz,
            host,
            power,
        };
        let passes = setup.check_frame(setup.extractor.features_expected(size));
        if let Some(error) = too_short {
            return Err(with_reason_of(error, passes.err()));
        }
        passes?;
        setup.auto_exposure()?;
        crate::config::idle::check(resolved)?;
        Ok(setup)
    }
}

/// An error on the frame's length, with the reason of another one that asks for a longer frame.
fn with_reason_of(error: Error, longer: Option<Error>) -> Error {
    match (&error, longer) {
        (Error::Config { key, value, .. }, Some(Error::Config { key: of_longer, reason, .. })) if *key == of_longer => {
            Error::key(key, value, reason)
        }
        _ => error,
    }
}

/// An error on the width of pictures, at the key that a user wrote: a window or binning makes them narrower than the array.
fn at_key_of_width(error: Error, (array, size): (Size, Size), readout: &ReadoutParams) -> Error {
    let reason = match &error {
        Error::Config { key, reason, .. } if key == "sensor.width" && size.width_px != array.width_px => reason,
        _ => return error,
    };
    let reason = format!("its pictures are {} pixels wide, and {reason}", size.width_px);
    match readout.window {
        Some(Window { x_px, y_px, width_px, height_px }) => {
            Error::key("sensor.readout.window", format!("[{x_px}, {y_px}, {width_px}, {height_px}]"), reason)
        }
        None => Error::key("sensor.width", array.width_px, reason),
    }
}

/// On the pixel clock the extractor takes a pixel a clock; a frame's octaves must be through before the next one comes.
fn check_extractor_clk(extractor: &ExtractorParams, size: Size, schedule: &Schedule) -> Result<(), Error> {
    let (needed_clk, frame_clk) = (frame_clk(extractor, size), schedule.frame_clk().0);
    if needed_clk <= frame_clk {
        return Ok(());
    }
    let reason =
        format!("its pictures take {needed_clk} clocks of a frame's {frame_clk}; use fewer, or a longer frame");
    Err(Error::key("compute.octaves", extractor.octaves, reason))
}

/// The effects of these names that the parameters have, in physical order.
fn effects_named(parameters: &Parameters, names: &[&str]) -> Vec<Box<dyn Effect>> {
    let mut built = effects::build_all(parameters);
    built.retain(|effect| names.contains(&effect.name()));
    built
}

/// Weighs readings by the exposures of a frame's slots, where there are several.
fn with_exposures(merge: HdrMerge, schedule: &Schedule) -> HdrMerge {
    let exposures = (0..schedule.slots().len()).map(|slot| f64_from_u64(schedule.exposure_clk(slot).0));
    if exposures.len() > 1 { merge.with_sensitivities(&exposures.collect::<Vec<_>>()) } else { merge }
}

/// The pixel at its lower conversion gain. A lateral overflow capacitor adds what it holds to the well; it is reset before the
/// exposure, so the reset level that double sampling takes belongs to another reset.
fn second_reading(parameters: &Parameters) -> Result<Parameters, Error> {
    let pixel = &parameters.pixel;
    let Some(low_uv_per_e) = pixel.low_conversion_gain_uv_per_e else {
        let reason = "dual gain needs sensor.pixel.low_conversion_gain_uv_per_e; use that, or hdr = none";
        return Err(Error::key("sensor.readout.hdr", "dual_gain", reason));
    };
    let pixel_type = if pixel.overflow_capacity_e > 0.0 { PixelType::T5 } else { pixel.pixel_type };
    let second = PixelParams {
        pixel_type,
        conversion_gain_uv_per_e: low_uv_per_e,
        full_well_e: pixel.full_well_e + pixel.overflow_capacity_e,
        low_conversion_gain_uv_per_e: None,
        ..pixel.clone()
    };
    Ok(Parameters { pixel: second, adc: parameters.adc.clone() })
}

/// How readings become one, at the ratios that the configuration names.
fn nominal_merge(first: &Parameters, second: Option<&Parameters>, hdr: Hdr) -> Result<Option<HdrMerge>, Error> {
    let (bits, black_dn) = (first.adc.bits, first.adc.black_level_dn);
    match (hdr, second) {
        (Hdr::MultiExposure { exposures, ratio }, _) => {
            let mut sensitivities = vec![1.0];
            for _ in 1..exposures {
                sensitivities.push(sensitivities[sensitivities.len() - 1] / ratio);
            }
            let key = "sensor.readout.hdr_exposure_ratio";
            let too_deep = |_| {
                // Rounded down, so that what is named does do.
                let most = libm::exp2(f64::from(MERGED_BITS_MAX - bits) / f64::from(exposures - 1));
                let most = (1000.0 * most).floor() / 1000.0;
                let would_do = if most > 1.0 { most.to_string() } else { "fewer sensor.adc.bits".to_owned() };
                let deep = format!("{exposures} exposures merge to codes of more than {MERGED_BITS_MAX} bits");
                Error::key(key, ratio, format!("{deep}; use {would_do}"))
            };
            HdrMerge::new(key, bits, black_dn, &sensitivities).map(Some).map_err(too_deep)
        }
        (Hdr::DualGain, Some(second)) => {
            let gains = [first, second].map(|parameters| parameters.pixel.conversion_gain_uv_per_e);
            let key = "sensor.pixel.low_conversion_gain_uv_per_e";
            let too_deep = |_| {
                let least = gains[0] / f64::from(1_u32 << (MERGED_BITS_MAX - bits));
                let deep = format!("codes at both gains merge to more than {MERGED_BITS_MAX} bits");
                Error::key(key, gains[1], format!("{deep}; use {least} or more"))
            };
            HdrMerge::new(key, bits, black_dn, &gains).map(Some).map_err(too_deep)
        }
        (Hdr::None | Hdr::DualGain, _) => Ok(None),
    }
}
