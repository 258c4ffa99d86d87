//! Accuracy against cost: measures error and time of every rung and knob, the Pareto front of their combinations, and the cheapest
//! setting that meets an accuracy or a time goal.
//!
//! Errors are functions of the configuration alone: all loops end by counts, never by a clock. Times are processor time (all threads) and
//! wall time, the least of repetitions that take turns over the settings, so that a busy minute does not fall on one of them. The
//! definitions of the figures stand in `report::ladder_record` and docs/ladder.md.
//!
//! Render and effects part company at the photons: a combination's error is the root of the sum of the two squares, its time the sum
//! of its stages'. Codes, features and energy of every row on the front are measured as such.

mod choice;
mod clocks;
mod curve;
mod errors;
mod front;
mod knobs;
mod margin;
mod measure;
mod pictures;
mod poses;
mod reference;
mod rows;
mod search;
mod study;
mod verilog;

pub use choice::{ChosenSetting, Goal, PILOT_FRAMES, choose};
pub use clocks::{MeasuredCost, StudyClocks};
pub use errors::{SharedFeatures, feature_f1};
pub use knobs::{EffectsKnob, RayBudget, Setting};
pub use measure::{LadderBench, LadderOptions, study_key};
pub use rows::ladder;
pub use study::{HeldOut, SettingVerdict, judge};
