//! Counted events times a technology's constants. Enters: events, run time and a technology. Leaves: energy by block,
//! its likely range, and which constants decided it. Inside, energies are integer attojoules, so sums are exact in any
//! order.

mod account;
mod technology;
mod uncertainty;

pub use account::{Contribution, EnergyAccount, RunLength};
pub use technology::{EventEnergy, StaticPower, Technology};
pub use uncertainty::Range;
