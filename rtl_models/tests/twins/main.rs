//! The twins against themselves: `tick` against the forms that skip clocks, and against vectors made by hand.
#![allow(clippy::unwrap_used)]

mod blocks;
mod cases;
mod core;
mod vectors;
