//! What a sweep's page says of each figure.

use super::specification::SpecificationJudgement;
use crate::statistics::MeanEstimate;

/// A specification's verdict on a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointVerdict {
    /// Number of the point.
    pub point: usize,
    /// Its factors in words.
    pub name: String,
    /// The specification.
    pub specification: String,
    /// What the runs say.
    pub judgement: SpecificationJudgement,
}

/// The mean of a figure at each level of a factor.
pub struct FactorEffect {
    /// Name of the factor.
    pub factor: String,
    /// Level, its position on an axis where it is a number, and the mean over all its cells.
    pub levels: Vec<(String, Option<f64>, MeanEstimate)>,
    /// Share of the figure's variance that the factor's levels explain by themselves: the first-order Sobol' index, estimated as the
    /// correlation ratio with the bias of equal classes taken away (Saltelli 2008, 4.6).
    pub first_order: Option<f64>,
}

/// The change of a figure from the first level of a factor, between cells that are equal in all else and have equal draws.
pub struct LevelDifference {
    /// Name of the factor.
    pub factor: String,
    /// The first level.
    pub from: String,
    /// The other one.
    pub to: String,
    /// Mean change.
    pub change: MeanEstimate,
    /// Number of independent seeds over paired ones that give the same interval.
    pub saving: Option<f64>,
}

/// One point of a front.
pub struct FrontPoint {
    /// Its factors in words.
    pub name: String,
    /// Both figures.
    pub figures: [MeanEstimate; 2],
    /// Whether no other point is better in both.
    pub is_on_front: bool,
    /// Share of resamples of the replicates in which it is.
    pub share_on_front: f64,
}

/// Everything about one figure.
pub struct FigureReport {
    /// Full name.
    pub figure: String,
    /// By factor.
    pub effects: Vec<FactorEffect>,
    /// By factor and level.
    pub differences: Vec<LevelDifference>,
}
