//! All integration tests in one program, so that the library is linked once: `cargo test --test all [MODULE::]`.
//! `memory` stands apart, because it counts what the whole process allocates.

#![allow(missing_docs)]
#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

mod chance;
mod common;

// Shared by several modules below.
#[path = "../rtl_models/tests/twins/cases.rs"]
#[allow(dead_code)]
mod cases;
#[path = "rtl/csi2_cases.rs"]
#[allow(dead_code)]
mod csi2_cases;
#[path = "rtl/extractor_forms.rs"]
#[allow(dead_code)]
mod extractor_forms;
#[path = "rtl/extractor_play.rs"]
#[allow(dead_code)]
mod extractor_play;
#[path = "rtl/front_pictures.rs"]
#[allow(dead_code)]
mod front_pictures;
#[path = "rtl/front_reference.rs"]
#[allow(dead_code)]
mod front_reference;

mod adc;
mod answers;
mod characterize;
mod chips;
mod command_line;
mod compare_coverage;
mod compute;
mod determinism;
mod effects;
mod emva;
mod energy;
mod estimation;
mod extractor;
mod facts;
mod few_bits;
mod fit;
mod front;
mod gait;
mod gates;
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
mod objects;
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
mod scene_verb;
mod scenes;
mod statistics;
mod sweeps;
mod tidy;
mod timing;
mod tracker;
mod truth;
mod tutorial;
mod twins;
mod waves;
