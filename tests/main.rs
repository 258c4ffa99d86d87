//! All integration tests in one program, so that the library is linked once: `cargo test --test all [MODULE::]`.
//! `memory` stands apart, because it counts what the whole process allocates.

#![allow(missing_docs)]

mod chance;
mod common;

mod adc;
mod characterize;
mod chips;
mod command_line;
mod compute;
mod determinism;
mod effects;
mod emva;
mod energy;
mod estimation;
mod extractor;
mod facts;
mod few_bits;
mod front;
mod gait;
mod gltf;
mod hard_cases;
mod images;
mod imu;
mod judges;
mod ladder;
mod lenses;
mod lie;
mod light;
mod link;
mod motion;
mod pipeline;
mod pixel;
mod plan;
mod presets;
mod quality;
mod rays;
mod recordings;
mod report;
mod rigs;
mod rtl;
mod sampling;
mod scenes;
mod statistics;
mod sweeps;
mod tidy;
mod timing;
mod tracker;
mod truth;
mod twins;
mod waves;
