//! Photometric targets: evenly lit scenes in which every edge is geometry.
//!
//! "flat" is the inside of a cube around the origin. All others are boards that stand `distance_m` before a still rig at the
//! origin, which looks along the world's +z with y down; the board's middle is on the axis. Around the board is a wall of the mean
//! reflectance. Light them with `Scene::evenly_lit`: its illuminance is that on the target's plane.

mod board;
mod params;

use super::geometry::Scene;
use crate::error::Error;

pub use board::Board;
pub use params::{TargetRequest, cube, flat};

/// The names.
pub const NAMES: [&str; 6] = ["flat", "blank_wall", "slanted_edge", "grey_wedge", "checkerboard", "point_sources"];

/// Makes the target of a name. Fails on a name that is not among `NAMES`, a value out of range, a key that this target does not read.
pub fn named(name: &str, request: &TargetRequest) -> Result<Scene, Error> {
    match name {
        "flat" => {
            request.only(name, &[])?;
            flat(request.reflectance)
        }
        "blank_wall" => board::blank_wall(request),
        "slanted_edge" => board::slanted_edge(request),
        "grey_wedge" => board::grey_wedge(request),
        "checkerboard" => board::checkerboard(request),
        "point_sources" => board::point_sources(request),
        _ => Err(Error::key("scene.target", name, format!("not known; use one of {}", NAMES.join(", ")))),
    }
}
