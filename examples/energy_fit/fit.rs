//! Fits the constants of the energy model that no source states to published chips: weighted least squares of the logarithm of power with a
//! prior for each constant, by Levenberg and Marquardt.
//!
//! All chips share the constants. A chip counts by one over the root of its vendor's number of chips, so that a vendor with many chips does
//! not decide alone, and residuals beyond 1.5 standard deviations count linearly (Huber). Published ratios of two modes of one chip are
//! observations like totals, with their standard deviation.

use sensel::energy::{Constant, EnergyAccount, SensorPower, Technology};
use sensel::events::Events;

use super::chips::Chip;
use super::slopes::Slope;

/// Constants that are multiplied together, with their sum before any fit: physical estimates, and how far off they may be.
pub struct Group {
    /// Word in the table.
    pub name: &'static str,
    /// Constants of the group.
    pub constants: &'static [Constant],
    /// Estimate of each constant before the fit, in its own unit.
    pub prior: &'static [f64],
    /// Standard deviation of the logarithm of that estimate.
    pub prior_sigma: f64,
}

/// What the fit moves.
pub const GROUPS: &[Group] = &[
    Group {
        name: "column and comparator bias",
        constants: &[Constant::ColumnBias, Constant::ComparatorBias],
        prior: &[4.0, 4.0],
        prior_sigma: 1.0,
    },
    Group {
        name: "comparator charge a clock",
        constants: &[Constant::ComparatorCharge],
        prior: &[100.0],
        prior_sigma: 1.0,
    },
    Group { name: "datapath", constants: &[Constant::DatapathBit], prior: &[30.0], prior_sigma: 1.0 },
    Group {
        name: "overhead",
        constants: &[
            Constant::Pll,
            Constant::Sequencer,
            Constant::References,
            Constant::ChargePump,
            Constant::Regulators,
            Constant::Pads,
            Constant::ClockTree,
        ],
        prior: &[5.0, 6.0, 7.0, 4.0, 3.0, 1.0, 30.0],
        prior_sigma: 1.0,
    },
    Group { name: "LVDS lane", constants: &[Constant::LvdsLane], prior: &[3600.0], prior_sigma: 0.5 },
    Group {
        name: "D-PHY lane",
        constants: &[Constant::PhyLane, Constant::HsLane],
        prior: &[3.5, 4.0],
        prior_sigma: 0.5,
    },
    Group { name: "serialiser", constants: &[Constant::LinkByte], prior: &[40.0], prior_sigma: 0.5 },
    Group { name: "pad", constants: &[Constant::Pad], prior: &[10_000.0], prior_sigma: 0.7 },
    Group { name: "image processor", constants: &[Constant::ImageProcessorBit], prior: &[30.0], prior_sigma: 1.0 },
    Group { name: "analog exponent", constants: &[Constant::AnalogExponent], prior: &[0.35], prior_sigma: 0.5 },
    Group { name: "digital exponent", constants: &[Constant::DigitalExponent], prior: &[0.9], prior_sigma: 0.4 },
    Group { name: "overhead, always on", constants: &[Constant::LowPowerOverhead], prior: &[0.05], prior_sigma: 1.0 },
    Group { name: "bias, always on", constants: &[Constant::LowPowerBias], prior: &[0.2], prior_sigma: 1.0 },
    Group { name: "bias, test chip", constants: &[Constant::ExternalBias], prior: &[0.2], prior_sigma: 1.0 },
];

/// Standard deviation of the logarithm of published over modelled power that the fit assumes: about what vendors left out show.
const SIGMA: f64 = 0.4;
/// The same of a published ratio over the modelled one. What is the chip's own cancels, so that less is left; a quarter is two of these.
const SLOPE_SIGMA: f64 = 0.12;
/// Residual, in standard deviations, from which on it counts linearly.
const HUBER: f64 = 1.5;
/// Step of the numerical derivative, in the logarithm of a constant: the error of the difference, 1e-4 squared, is far below SIGMA.
const STEP: f64 = 1e-4;

/// Everything that the power of a mode is computed from.
pub struct Model {
    /// Its items.
    pub power: SensorPower,
    /// Events of a frame.
    pub events: Events,
}

impl Model {
    /// Power of a frame with constants that stand at the base node.
    pub fn account(&self, base: &Technology) -> EnergyAccount {
        let power = self.power.with_technology(base.scaled_to(self.power.technology.node_nm));
        EnergyAccount::of(&self.events, 1, 1, 1, &power)
    }
}

/// A chip with its model.
pub struct Prepared {
    /// The chip.
    pub chip: Chip,
    /// The mode of its figure.
    pub model: Model,
}

/// A published ratio with the models of both modes.
pub struct PreparedSlope {
    /// The ratio.
    pub slope: &'static Slope,
    /// The mode above the line, and that below it.
    pub modes: [Model; 2],
}

impl PreparedSlope {
    /// The ratio with constants that stand at the base node.
    pub fn ratio(&self, base: &Technology) -> f64 {
        let [over, under] = [0, 1].map(|mode: usize| self.modes[mode].account(base).power_mw());
        over / under
    }
}

/// What a fit is made from.
pub struct Observations<'a> {
    /// Totals of chips.
    pub chips: Vec<&'a Prepared>,
    /// Ratios of two modes.
    pub slopes: Vec<&'a PreparedSlope>,
}

impl Observations<'_> {
    /// Logarithms of model over publication: of the totals, then of the ratios.
    fn residuals(&self, base: &Technology) -> Vec<f64> {
        let of = |chip: &&Prepared| libm::log(chip.model.account(base).power_mw() / chip.chip.published_mw);
        let slope = |slope: &&PreparedSlope| libm::log(slope.ratio(base) / slope.slope.ratio());
        self.chips.iter().map(of).chain(self.slopes.iter().map(slope)).collect()
    }

    /// One over the variance of each residual.
    fn precisions(&self) -> Vec<f64> {
        let of =
            |sigma: f64, vendors: Vec<&str>| weights(&vendors).into_iter().map(move |weight| weight / (sigma * sigma));
        let chips = of(SIGMA, self.chips.iter().map(|chip| chip.chip.vendor).collect());
        chips.chain(of(SLOPE_SIGMA, self.slopes.iter().map(|slope| slope.slope.vendor).collect())).collect()
    }
}

/// The base technology with every group at its prior.
pub fn at_priors() -> Technology {
    let mut base = Technology::by_name("65nm").expect("it comes with the program");
    for group in GROUPS {
        for (&constant, &prior) in group.constants.iter().zip(group.prior) {
            base.set(constant.name(), constant.unit().name(), prior).expect("priors are in range");
        }
    }
    base
}

/// The base technology with each group multiplied by the exponential of its parameter.
pub fn moved(base: &Technology, parameters: &[f64]) -> Technology {
    let groups = GROUPS.iter().zip(parameters);
    groups.fold(base.clone(), |technology, (group, &log)| technology.multiplied(group.constants, libm::exp(log)))
}

/// The parameters that fit these observations best.
pub fn fit(base: &Technology, observations: &Observations<'_>) -> Vec<f64> {
    let precisions = observations.precisions();
    let logs = |parameters: &[f64]| observations.residuals(&moved(base, parameters));
    let mut parameters = vec![0.0; GROUPS.len()];
    let mut residuals = logs(&parameters);
    let mut least = cost(&residuals, &precisions, &parameters);
    let mut damping = 1e-2;
    for _ in 0..40 {
        let slopes: Vec<Vec<f64>> = (0..GROUPS.len())
            .map(|parameter| {
                let mut moved = parameters.clone();
                moved[parameter] += STEP;
                logs(&moved).iter().zip(&residuals).map(|(after, before)| (after - before) / STEP).collect()
            })
            .collect();
        let scale: Vec<f64> = residuals
            .iter()
            .zip(&precisions)
            .map(|(residual, precision)| {
                let sigmas = residual.abs() * libm::sqrt(*precision);
                precision * if sigmas > HUBER { HUBER / sigmas } else { 1.0 }
            })
            .collect();
        let product = |left: &[f64], right: &[f64]| -> f64 {
            left.iter().zip(right).zip(&scale).map(|((left, right), scale)| left * right * scale).sum()
        };
        let mut improved = false;
        for _ in 0..10 {
            let mut matrix: Vec<Vec<f64>> =
                slopes.iter().map(|row| slopes.iter().map(|column| product(row, column)).collect()).collect();
            let mut right: Vec<f64> = slopes.iter().map(|row| -product(row, &residuals)).collect();
            for (parameter, group) in GROUPS.iter().enumerate() {
                let stiffness = 1.0 / (group.prior_sigma * group.prior_sigma);
                matrix[parameter][parameter] = (matrix[parameter][parameter] + stiffness) * (1.0 + damping);
                right[parameter] -= parameters[parameter] * stiffness;
            }
            let step = solved(matrix, right);
            let tried: Vec<f64> = parameters.iter().zip(&step).map(|(at, step)| at + step).collect();
            let found = logs(&tried);
            let now = cost(&found, &precisions, &tried);
            if now < least {
                improved = least - now > 1e-7;
                (parameters, residuals, least, damping) = (tried, found, now, damping / 3.0);
                break;
            }
            damping *= 4.0;
        }
        if !improved {
            break;
        }
    }
    parameters
}

/// One over the root of how often a vendor is named, with mean 1.
fn weights(vendors: &[&str]) -> Vec<f64> {
    let times = |vendor: &str| vendors.iter().filter(|named| **named == vendor).count();
    let raw: Vec<f64> =
        vendors.iter().map(|vendor| 1.0 / libm::sqrt(sensel::num::f64_from_usize(times(vendor)))).collect();
    let mean = raw.iter().sum::<f64>() / sensel::num::f64_from_usize(raw.len());
    raw.iter().map(|weight| weight / mean).collect()
}

fn cost(residuals: &[f64], precisions: &[f64], parameters: &[f64]) -> f64 {
    let of = |(residual, precision): (&f64, &f64)| {
        let sigmas = residual.abs() * libm::sqrt(*precision);
        if sigmas < HUBER { sigmas * sigmas } else { 2.0 * HUBER * sigmas - HUBER * HUBER }
    };
    let data: f64 = residuals.iter().zip(precisions).map(of).sum();
    let prior: f64 =
        parameters.iter().zip(GROUPS).map(|(at, group)| (at / group.prior_sigma) * (at / group.prior_sigma)).sum();
    data + prior
}

/// Solves a symmetric positive definite system by elimination with pivots.
fn solved(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let size = right.len();
    for pivot_row in 0..size {
        let pivot = (pivot_row..size)
            .max_by(|&a, &b| matrix[a][pivot_row].abs().total_cmp(&matrix[b][pivot_row].abs()))
            .expect("rows are left");
        matrix.swap(pivot_row, pivot);
        right.swap(pivot_row, pivot);
        for row in 0..size {
            if row == pivot_row {
                continue;
            }
            let factor = matrix[row][pivot_row] / matrix[pivot_row][pivot_row];
            let above = matrix[pivot_row].clone();
            for (value, above) in matrix[row].iter_mut().zip(&above).skip(pivot_row) {
                *value -= factor * above;
            }
            right[row] -= factor * right[pivot_row];
        }
    }
    (0..size).map(|pivot_row| right[pivot_row] / matrix[pivot_row][pivot_row]).collect()
}
