//! Chips against the model: fitted with all vendors, and with each vendor left out in turn. Figures without a public source take no part in
//! any fit; they are judged apart.

use std::path::Path;

use sensel::config::Resolved;
use sensel::energy::{EnergyAccount, Technology};
use sensel::num::f64_from_usize;
use sensel::run::{ESTIMATED_LEVEL, SensorSetup};

use super::chips::CHIPS;
use super::fit::{Prepared, at_priors, fit, moved};

/// One chip's figures in mW.
pub struct Judged {
    /// The chip's place in the list.
    pub prepared: Prepared,
    /// By constants fitted to all chips.
    pub all_mw: f64,
    /// By constants fitted without the chip's vendor.
    pub unseen_mw: f64,
    /// Likely range of the latter.
    pub range_mw: [f64; 2],
}

/// What a fit gives.
pub struct Outcome {
    /// Logarithms of the groups' factors over their priors, all chips.
    pub parameters: Vec<f64>,
    /// The chips in the list's order.
    pub chips: Vec<Judged>,
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

fn prepared(root: &Path) -> Vec<Prepared> {
    let of = |chip: &super::chips::Chip| {
        let sensor = sensor(root, chip.file, &[]);
        let events = sensor.estimated_events(ESTIMATED_LEVEL).unwrap_or_else(|error| panic!("{}: {error}", chip.file));
        Prepared { chip: *chip, power: sensor.power, events }
    };
    CHIPS.iter().map(of).collect()
}

/// Fits and judges all chips.
pub fn judge(root: &Path) -> Outcome {
    let (chips, base) = (prepared(root), at_priors());
    let sourced: Vec<&Prepared> = chips.iter().filter(|chip| chip.chip.evidence.is_public()).collect();
    let parameters = fit(&base, &sourced);
    let mut vendors: Vec<&str> = chips.iter().map(|chip| chip.chip.vendor).collect();
    vendors.dedup();
    let mut without: Vec<(&str, Technology)> = Vec::new();
    for vendor in vendors {
        let others: Vec<&Prepared> = sourced.iter().copied().filter(|chip| chip.chip.vendor != vendor).collect();
        without.push((vendor, moved(&base, &fit(&base, &others))));
    }
    let judged = |prepared: Prepared| {
        let all_mw = prepared.power_mw(&base, &parameters);
        let (_, unseen) =
            without.iter().find(|(vendor, _)| *vendor == prepared.chip.vendor).expect("every vendor was left out");
        let power = prepared.power.with_technology(unseen.scaled_to(prepared.power.technology.node_nm));
        let account = EnergyAccount::of(&prepared.events, 1, 1, 1, &power);
        let (range, _) = account.ranges_pj();
        // Picojoules a frame over the frame's seconds, in mW.
        let mw = |pj: f64| 1e-9 * pj / account.run_time_s();
        Judged { all_mw, unseen_mw: account.power_mw(), range_mw: [mw(range.low), mw(range.high)], prepared }
    };
    Outcome { chips: chips.into_iter().map(judged).collect(), parameters }
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
