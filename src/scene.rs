//! A moving scene: geometry, materials, light, and the motion of the rig. Computes radiance along rays in photons per second and band, and
//! ground-truth poses and depth. It knows no lens and no pixel, and touches no disk.
//!
//! A `Scene` is geometry with materials in its own light units; a `Bake` is its irradiance; a `LitScene` is both, scaled so that a
//! horizontal plane at a given point has a given illuminance, or taken as lamps and sky state it. Light is baked over diffuse surfaces, and
//! over glossy metals as over mirrors. Glass that the file marks as such is left out.

pub mod animation;
pub mod bake;
pub mod box_room;
#[cfg(feature = "pictures")]
pub mod build;
pub mod bulb;
pub mod bvh;
mod chance;
#[cfg(feature = "gltf")]
mod closed;
pub mod columns;
pub mod cut_out;
pub mod environment;
pub mod file_units;
pub mod flicker;
pub mod generated;
mod geometry;
#[cfg(feature = "gltf")]
pub mod gltf;
#[cfg(feature = "pictures")]
pub mod hall;
mod hashing;
#[cfg(feature = "pictures")]
pub mod images;
pub mod lamps;
pub mod lanes;
pub mod light;
pub mod lit;
mod mapped;
pub mod maps;
pub mod mesh;
pub mod motion;
pub mod nearest;
pub mod object;
#[cfg(feature = "pictures")]
pub mod pattern;
#[cfg(feature = "pictures")]
pub mod photo_box;
mod plane_mirrors;
pub mod samples;
pub mod sky;
#[cfg(feature = "pictures")]
pub mod street;
pub mod surroundings;
pub mod target;
pub mod texture;
pub mod tracer;
mod source;
mod vectors;
pub mod views;

pub use bake::{Bake, BakeCost, BakeSettings};
pub use environment::Environment;
pub use flicker::Flicker;
#[cfg(feature = "pictures")]
pub use images::{ImageSequence, ImageStream};
pub use lamps::fixture::Lamp;
pub use light::Illuminant;
pub use lit::{ExitanceBounds, LitScene};
pub use surroundings::{Panel, Surroundings};

pub use geometry::{MovingScene, Scene, Viewpoint};
pub use source::{PictureBytes, Read};
