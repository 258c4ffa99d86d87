//! Chips and ratios of their modes against the model: fitted with all vendors, and with each vendor left out in turn. Figures without a
//! public source take no part in any fit; they are judged apart.

use std::path::Path;

use sensel::config::Resolved;
use sensel::energy::Technology;
use sensel::num::{f64_from_u64, f64_from_usize, u64_half_even};
use sensel::run::{ESTIMATED_LEVEL, SensorSetup};

use super::chips::CHIPS;
use super::fit::{Model, Observations, Prepared, PreparedSlope, at_priors, fit, moved};
use super::slopes::{Change, Mode, SLOPES, Slope};

/// One chip's figures in mW.
pub struct Judged {
    /// The chip's index in the list.
    pub prepared: Prepared,
    /// By constants fitted to all chips.
    pub all_mw: f64,
    /// By constants fitted without the chip's vendor.
    pub unseen_mw: f64,
    /// Likely range of the latter.
    pub range_mw: [f64; 2],
}

/// One ratio.
pub struct JudgedSlope {
    /// What was published.
    pub slope: &'static Slope,
    /// By constants fitted to all vendors.
    pub all: f64,
    /// By constants fitted without its vendor.
    pub unseen: f64,
}

/// What a fit gives.
pub struct Outcome {
    /// Logarithms of the groups' factors over their priors, all chips.
    pub parameters: Vec<f64>,
    /// The chips in the list's order.
    pub chips: Vec<Judged>,
    /// The ratios in the list's order.
    pub slopes: Vec<JudgedSlope>,
}

/// Figures of a column.
pub struct Score {
    /// Median of |model / published - 1|.
    pub median_error: f64,
    /// Chips within a factor of two.
    pub within_two: usize,
    /// Root mean square of the logarithm of model over published.
    pub rms_log: f64,
    /// Chips that were judged.
    pub number: usize,
}

/// A scenario of `scenes/chips`.
pub fn sensor(root: &Path, file: &str, more: &[String]) -> SensorSetup {
    let path = root.join(format!("scenes/chips/{file}.toml"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let resolved =
        Resolved::from_layers(&path.display().to_string(), &text, more).unwrap_or_else(|error| panic!("{error}"));
    SensorSetup::new(&resolved).unwrap_or_else(|error| panic!("{error}"))
}

/// Keys that run a chip slower by a longer vertical blanking: lines, clocks and bias stay.
pub fn blanked(root: &Path, file: &str, fps: f64) -> String {
    let schedule = sensor(root, file, &[]).schedule;
    format!("sensor.readout.vts={}", u64_half_even(f64_from_u64(schedule.vts()) * schedule.fps() / fps))
}

/// Keys that run all of a chip's clocks at a ratio of the file's: lines get longer, and ramps and settling with them.
fn clocked(chip: &SensorSetup, ratio: f64) -> Vec<String> {
    let adc = &chip.parameters.adc;
    let slower = |hz: u64| u64_half_even(f64_from_u64(hz) * ratio);
    vec![
        format!("sensor.readout.pixel_rate_hz={}", slower(chip.schedule.pixel_rate_hz())),
        format!("sensor.adc.clock_hz={}", slower(adc.clock_hz)),
        format!("sensor.adc.settle_reset_us={}", adc.settle_reset_us / ratio),
        format!("sensor.adc.settle_signal_us={}", adc.settle_signal_us / ratio),
    ]
}

fn keys(root: &Path, mode: &Mode) -> Vec<String> {
    let chip = || sensor(root, mode.file, &[]);
    match mode.change {
        Change::None => Vec::new(),
        Change::Blanked(fps) => vec![blanked(root, mode.file, fps)],
        Change::Clocked(fps) => {
            let chip = chip();
            clocked(&chip, fps / chip.schedule.fps())
        }
        Change::Lanes(lanes, fps) => {
            let chip = chip();
            let whole = chip.power.sensor.params.port_lanes.expect("a port of LVDS states its lanes");
            let ratio = f64::from(lanes) / f64::from(whole);
            let vts = f64_from_u64(chip.schedule.vts()) * ratio * chip.schedule.fps() / fps;
            let mut keys = clocked(&chip, ratio);
            keys.push(format!("energy.port_lanes={lanes}"));
            keys.push(format!("sensor.readout.vts={}", u64_half_even(vts)));
            keys
        }
        Change::Halved(fps) => vec!["sensor.readout.binning=2".to_owned(), blanked(root, mode.file, fps)],
    }
}

fn model(root: &Path, mode: &Mode) -> Model {
    let sensor = sensor(root, mode.file, &keys(root, mode));
    let events = sensor.estimated_events(ESTIMATED_LEVEL).unwrap_or_else(|error| panic!("{mode:?}: {error}"));
    Model { power: sensor.power, events }
}

fn prepared(root: &Path) -> Vec<Prepared> {
    let of = |chip: &super::chips::Chip| {
        let model = model(root, &Mode { file: chip.file, change: Change::None });
        Prepared { chip: *chip, model }
    };
    CHIPS.iter().map(of).collect()
}

fn prepared_slopes(root: &Path) -> Vec<PreparedSlope> {
    SLOPES
        .iter()
        .map(|slope| PreparedSlope { slope, modes: [&slope.over, &slope.under].map(|mode| model(root, mode)) })
        .collect()
}

/// Fits and judges all chips.
pub fn judge(root: &Path) -> Outcome {
    let (chips, slopes, base) = (prepared(root), prepared_slopes(root), at_priors());
    let parameters_without = |vendor: Option<&str>| {
        let seen = |of: &str| vendor != Some(of);
        let sourced = chips.iter().filter(|chip| chip.chip.evidence.is_public() && seen(chip.chip.vendor));
        let slopes = slopes.iter().filter(|slope| seen(slope.slope.vendor));
        fit(&base, &Observations { chips: sourced.collect(), slopes: slopes.collect() })
    };
    let parameters = parameters_without(None);
    let fitted = moved(&base, &parameters);
    let mut vendors: Vec<&str> = chips.iter().map(|chip| chip.chip.vendor).collect();
    vendors.extend(slopes.iter().map(|slope| slope.slope.vendor));
    vendors.sort_unstable();
    vendors.dedup();
    let without: Vec<(&str, Technology)> =
        vendors.into_iter().map(|vendor| (vendor, moved(&base, &parameters_without(Some(vendor))))).collect();
    let unseen_by = |vendor: &str| {
        let (_, technology) =
            without.iter().find(|(left_out, _)| *left_out == vendor).expect("every vendor was left out");
        technology
    };
    let of_slope = |prepared: &PreparedSlope| JudgedSlope {
        slope: prepared.slope,
        all: prepared.ratio(&fitted),
        unseen: prepared.ratio(unseen_by(prepared.slope.vendor)),
    };
    let judged_slopes = slopes.iter().map(of_slope).collect();
    let judged = |prepared: Prepared| {
        let all_mw = prepared.model.account(&fitted).power_mw();
        let account = prepared.model.account(unseen_by(prepared.chip.vendor));
        let (range, _) = account.ranges_pj();
        // Picojoules a frame over the frame's seconds, in mW.
        let mw = |pj: f64| 1e-9 * pj / account.run_time_s();
        Judged { all_mw, unseen_mw: account.power_mw(), range_mw: [mw(range.low), mw(range.high)], prepared }
    };
    Outcome { chips: chips.into_iter().map(judged).collect(), slopes: judged_slopes, parameters }
}

impl Outcome {
    /// Chips with a public source, or those without one.
    pub fn chips_with(&self, public: bool) -> impl Iterator<Item = &Judged> {
        self.chips.iter().filter(move |chip| chip.prepared.chip.evidence.is_public() == public)
    }

    /// Figures of the model's column that `of` takes, for chips with a public source or for those without one.
    pub fn score(&self, public: bool, of: impl Fn(&Judged) -> f64) -> Score {
        let ratios: Vec<f64> = self.chips_with(public).map(|chip| of(chip) / chip.prepared.chip.published_mw).collect();
        let mut errors: Vec<f64> = ratios.iter().map(|ratio| (ratio - 1.0).abs()).collect();
        errors.sort_by(f64::total_cmp);
        let middle = errors.len() / 2;
        let squares: f64 = ratios.iter().map(|ratio| libm::log(*ratio) * libm::log(*ratio)).sum();
        Score {
            median_error: 0.5 * (errors[middle] + errors[(errors.len() - 1) / 2]),
            within_two: ratios.iter().filter(|ratio| (0.5..=2.0).contains(*ratio)).count(),
            rms_log: libm::sqrt(squares / f64_from_usize(ratios.len())),
            number: ratios.len(),
        }
    }

    /// Root mean square of the logarithm of model over published of all chips, by the model that has not seen their vendor.
    pub fn rms_of_all(&self) -> f64 {
        let squares = [true, false].map(|public| {
            let score = self.score(public, |chip| chip.unseen_mw);
            f64_from_usize(score.number) * score.rms_log * score.rms_log
        });
        libm::sqrt((squares[0] + squares[1]) / f64_from_usize(self.chips.len()))
    }

    /// Chips whose published figure lies in the likely range of the model that has not seen their vendor.
    pub fn held(&self, public: bool) -> usize {
        let holds = |chip: &&Judged| (chip.range_mw[0]..=chip.range_mw[1]).contains(&chip.prepared.chip.published_mw);
        self.chips_with(public).filter(holds).count()
    }
}
