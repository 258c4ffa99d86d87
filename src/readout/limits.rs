//! Checks the parameters against the demands. Returns the lines of exposure and frame in effect, or an error that names the shortest line
//! or frame that is accepted.

use super::budget::{LineDemand, greatest};
use super::clock::FrameClock;
use super::geometry::Geometry;
use super::params::{
    ExposureSetting, FRAME_CLK_MAX, FrameLength, LENGTH_MAX, LongExposure, ReadoutParams, Trigger, microseconds,
};
use super::slots::{frame_demand, longest_exposure, slots};
use crate::error::Error;
use crate::num::{f64_from_u64, u64_half_even};
use crate::units::{CameraIndex, Clocks};

/// Refuses a line that is shorter than one of its demands, naming the shortest HTS that is accepted.
pub(super) fn check_line(params: &ReadoutParams, demands: &[LineDemand; 4]) -> Result<(), Error> {
    let most = greatest(demands);
    if u64::from(params.hts) >= most.needed_clk {
        return Ok(());
    }
    let reason = if most.needed_clk <= u64::from(LENGTH_MAX) {
        format!("a line must hold {}; use hts = {}", most.words(), most.needed_clk)
    } else {
        // No line is so long: what it must hold has to get shorter.
        let shorter = most.remedy();
        format!("a line must hold {}, more than the longest line of {LENGTH_MAX} clocks; {shorter}", most.words())
    };
    Err(Error::key("sensor.readout.hts", params.hts, reason))
}

/// The (longest) exposure in whole lines.
pub(super) fn exposure_lines(params: &ReadoutParams) -> Result<u64, Error> {
    let least = params.exposure_lines_min;
    match params.exposure {
        ExposureSetting::Lines(lines) if lines < least => {
            let reason = format!("shorter than sensor.readout.exposure_lines_min; use {least}");
            Err(Error::key("sensor.readout.exposure_lines", lines, reason))
        }
        ExposureSetting::Lines(lines) => Ok(lines.into()),
        ExposureSetting::Us(exposure_us) => {
            // One quotient of two products that are exact at a tie: a line's own length in us seldom is.
            let lines = exposure_us * f64_from_u64(params.pixel_rate_hz) / (1e6 * f64::from(params.hts));
            let lines = u64_half_even(lines);
            if exposure_us == 0.0 && least > 0 {
                let shortest_us = lines_us(least.into(), params);
                let reason = format!(
                    "out of range; use {:.3} or more (sensor.readout.exposure_lines_min = {least})",
                    (1e3 * shortest_us).ceil() / 1e3
                );
                return Err(Error::key("sensor.readout.exposure_us", 0.0, reason));
            }
            Ok(lines.max(least.into()))
        }
    }
}

/// VTS in effect.
pub(super) fn frame_lines(exposure_lines: u64, geometry: &Geometry, params: &ReadoutParams) -> Result<u64, Error> {
    let hts = u64::from(params.hts);
    let asked = match params.frame {
        FrameLength::Lines(vts) => u64::from(vts),
        FrameLength::RateHz(rate_hz) => {
            let lines = u64_half_even(f64_from_u64(params.pixel_rate_hz) / (f64_from_u64(hts) * rate_hz));
            if lines > u64::from(LENGTH_MAX) {
                let slowest_hz = f64_from_u64(params.pixel_rate_hz) / f64_from_u64(hts * u64::from(LENGTH_MAX));
                let reason = format!("a frame of {lines} lines is too long; use {slowest_hz} or more");
                return Err(Error::key("sensor.readout.frame_rate_hz", rate_hz, reason));
            }
            lines
        }
    };
    let made = slots(exposure_lines, params);
    let demand = frame_demand(&made, geometry.reads(), params.exposure_fine_clk, params);
    let extends = params.long_exposure == LongExposure::ExtendFrame;
    let frame = if extends { asked.max(demand.exposure) } else { asked };
    if frame < demand.lines() {
        return Err(frame_too_short(asked, demand.rows > frame, exposure_lines, geometry, params));
    }
    if frame > u64::from(LENGTH_MAX) || frame * hts > FRAME_CLK_MAX {
        let most = (FRAME_CLK_MAX / hts).min(LENGTH_MAX.into());
        let reason = format!("a frame of {frame} lines of hts = {hts} clocks is too long; use at most {most} lines");
        let (key, value) = if frame > asked { asked_exposure(params) } else { ("vts", frame.to_string()) };
        return Err(Error::key(&format!("sensor.readout.{key}"), value, reason));
    }
    Ok(frame)
}

/// The shortest frame that holds rows and exposures, said as the parameters say theirs. Fails on an exposure that no frame holds.
pub(super) fn shortest_frame(geometry: &Geometry, params: &ReadoutParams) -> Result<FrameLength, Error> {
    let needed = needed_lines(exposure_lines(params)?, geometry, params);
    Ok(match params.frame {
        FrameLength::RateHz(_) => FrameLength::RateHz(fastest_hz(needed, params)),
        FrameLength::Lines(_) => FrameLength::Lines(u32::try_from(needed).unwrap_or(LENGTH_MAX)),
    })
}

/// Lines that a frame needs. One that grows with its exposure need only hold its rows.
fn needed_lines(exposure_lines: u64, geometry: &Geometry, params: &ReadoutParams) -> u64 {
    let made = slots(exposure_lines, params);
    let demand = frame_demand(&made, geometry.reads(), params.exposure_fine_clk, params);
    if params.long_exposure == LongExposure::ExtendFrame { demand.rows } else { demand.lines() }
}

/// The rate of exactly this number of lines: read again, it rounds to them.
fn fastest_hz(lines: u64, params: &ReadoutParams) -> f64 {
    f64_from_u64(params.pixel_rate_hz) / f64_from_u64(u64::from(params.hts) * lines)
}

/// Says what a frame must hold and how long, or how slow, it must be.
fn frame_too_short(
    frame: u64,
    rows_do_not_fit: bool,
    exposure_lines: u64,
    geometry: &Geometry,
    params: &ReadoutParams,
) -> Error {
    let (rows, exposures) = (geometry.reads(), params.hdr.exposures());
    let needed = needed_lines(exposure_lines, geometry, params);
    if let FrameLength::RateHz(rate_hz) = params.frame {
        let fastest_hz = fastest_hz(needed, params);
        let what = if rows_do_not_fit { "rows" } else { "exposure and its margin" };
        let reason = format!(
            "a frame of {frame} lines is too short for its {what}, which need {needed}; use {fastest_hz} or less"
        );
        return Error::key("sensor.readout.frame_rate_hz", rate_hz, reason);
    }
    if rows_do_not_fit {
        let times = if exposures > 1 { format!(" read {exposures} times") } else { String::new() };
        let reason = format!("a frame of {rows} rows{times} needs at least vts = {needed}");
        return Error::key("sensor.readout.vts", frame, reason);
    }
    let most = longest_exposure(frame, geometry.reads(), params.exposure_fine_clk, params);
    let (key, value) = asked_exposure(params);
    let shorter = match params.exposure {
        // Not even the shortest exposure fits.
        _ if most < u64::from(params.exposure_lines_min) => String::new(),
        ExposureSetting::Lines(_) => format!("at most {most}, "),
        ExposureSetting::Us(_) => format!("at most {:.3} ({most} lines), ", lines_us(most, params)),
    };
    let is_frame = needed <= u64::from(LENGTH_MAX) && needed * u64::from(params.hts) <= FRAME_CLK_MAX;
    let longer = match (is_frame, shorter.is_empty()) {
        (true, _) => format!("{shorter}vts = {needed}, or long_exposure = extend_frame"),
        // No frame is so long.
        (false, false) => shorter.trim_end_matches(", ").to_owned(),
        (false, true) => "a shorter one, or a smaller hts".to_owned(),
    };
    let reason = format!("longer than the frame less its margin; use {longer}");
    Error::key(&format!("sensor.readout.{key}"), value, reason)
}

fn asked_exposure(params: &ReadoutParams) -> (&'static str, String) {
    match params.exposure {
        ExposureSetting::Lines(lines) => ("exposure_lines", lines.to_string()),
        ExposureSetting::Us(exposure_us) => ("exposure_us", exposure_us.to_string()),
    }
}

/// Refuses pulses that come faster than frames, for any camera's clock.
pub(super) fn check_trigger(params: &ReadoutParams, frame_clk: Clocks) -> Result<(), Error> {
    let Trigger::External { period_ns, .. } = params.trigger else { return Ok(()) };
    let cameras = u32::try_from(params.clock_ppb.len()).unwrap_or(u32::MAX).max(1);
    let shortest = |camera| FrameClock::new(params, CameraIndex(camera), frame_clk).shortest_period_ns();
    let shortest_ns = (0..cameras).map(shortest).max().expect("there is at least one camera");
    if period_ns >= shortest_ns {
        return Ok(());
    }
    let reason = format!("a pulse comes before its frame ends; use {}", microseconds(shortest_ns));
    Err(Error::key("sensor.readout.trigger_period_us", microseconds(period_ns), reason))
}

/// Lines in us of the nominal clock.
fn lines_us(lines: u64, params: &ReadoutParams) -> f64 {
    1e6 * f64_from_u64(lines) * f64::from(params.hts) / f64_from_u64(params.pixel_rate_hz)
}
