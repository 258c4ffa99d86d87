//! Chance as a function: a draw is named by (seed, effect, camera, frame, exposure slot, row, column).
//!
//! The key of a row is built by mixing, never by adding constants, so that neighbours share no state. Column c owns one
//! 32-bit uniform of its row for each draw, and every distribution is the exact quantile of that uniform.
//!
//! Computes 32-bit uniforms, standard normals and Poisson counts from a key and, for Poisson draws, from means in electrons. `sobol` has
//! scrambled Sobol' points from their numbers and seeds.

mod exact;
mod key;
mod normal;
mod poisson;
pub mod sobol;
mod uniform;

pub use exact::{normal_quantile, poisson_quantile};
pub use normal::normals;
pub use poisson::{poisson, poisson_of_one_mean};
pub use uniform::{fill_uniforms, uniform_at};

pub use key::{DrawKey, EffectNumber, RowId, mix};
