//! What a sensor's work costs: counted events and bias over time, times the constants of a technology; energy by block and by rail with its
//! likely range, and the host's beside it. Inside, energies are integer attojoules, so sums are exact in any order.

mod account;
pub mod constant;
mod converter;
mod host;
mod item;
mod model;
mod params;
mod technology;
mod uncertainty;

pub use account::{Contribution, EnergyAccount};
pub use constant::Constant;
pub use host::{HostEnergy, HostParams};
pub use item::{Amount, Item, PoweredSensor, Rail};
pub use model::SensorPower;
pub use params::{Architecture, EnergyParams, Periphery, Port};
pub use technology::{ConstantValue, Scaling, Technology};
pub use uncertainty::{DISCREPANCY, Range};
