//! From photons to pose, bit by bit: a machine-perception image sensor, end to end.
//!
//! One frame of a generated room, from its photons to the packets that leave the sensor:
//!
//! ```
//! use sensel::config::Resolved;
//! use sensel::run::{NoClock, NoFiles, NoProgress, Session, Setup};
//!
//! let scenario = r#"
//!     [scene]
//!     generator = "box"
//!     illuminance_lux = 1000.0
//!     [motion]
//!     offset_m = [0.0, 1.5, 0.3]
//!     [sensor]
//!     width = 160
//!     height = 120
//! "#;
//! let resolved = Resolved::from_layers("example", scenario, &["sensor.adc.bits=12".to_owned()])?;
//! let mut session = Session::new(Setup::new(resolved, &NoFiles, &NoProgress)?)?;
//! let frame = session.step(&NoClock)?;
//! let camera = &frame.cameras[0];
//! assert_eq!(camera.codes.width_px(), 160);
//! let received = sensel::link::decode(&camera.packets);
//! assert_eq!(received.frames[0].picture.as_ref(), Some(&camera.codes));
//! # Ok::<(), sensel::error::Error>(())
//! ```
//!
//! The modules stand in the order in which light becomes a pose; a stage uses only the ones before it.

pub mod num;
pub mod words;
pub mod units;
pub mod plane;
pub mod text;
pub mod pose;
pub mod so3;
pub mod error;
#[cfg(feature = "exr")]
pub mod picture;
pub mod parallel;
pub mod simd;
pub mod draw;
#[cfg(feature = "cli")]
pub mod statistics;
pub mod events;
pub mod facts;
pub mod fidelity;
pub mod rtl_simulator;
pub mod effect;

pub mod scene;
pub mod optics;
pub mod pixel;
pub mod adc;
pub mod readout;
pub mod compute;
pub mod link;
pub mod energy;
pub mod tracker;
pub mod report;

pub mod effects;
pub mod config;
pub mod run;
pub mod ladder;
pub mod waves;
pub mod characterize;
#[cfg(feature = "cli")]
pub mod sweep;
#[cfg(feature = "cli")]
pub mod files;
