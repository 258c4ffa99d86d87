//! Lens mappings: from a bearing in the camera's frame to a place on the picture, and back.
//!
//! The camera looks along +z, x to the right, y down; pixel centres are integers (the top left pixel's centre is (0, 0)).

use glam::{DVec2, DVec3};

/// Focal lengths and principal point in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Horizontal focal length.
    pub fx_px: f64,
    /// Vertical focal length.
    pub fy_px: f64,
    /// Column of the principal point.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
}

/// Radial-tangential (Brown-Conrady) distortion as OpenCV and Kalibr define it; all zero is a pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Radtan {
    /// Radial, r^2.
    pub k1: f64,
    /// Radial, r^4.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
}

/// The mapping of one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal lengths and principal point.
    pub intrinsics: Intrinsics,
    /// Distortion.
    pub distortion: Radtan,
}

/// Rows of d(place)/d(point).
pub type ProjectionJacobian = [[f64; 3]; 2];
