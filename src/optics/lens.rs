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

/// Rounds of Newton's method before a place counts as outside the mapping; a mild lens needs four.
const INVERSE_ROUNDS_MAX: u32 = 20;

impl Lens {
    /// Place on the picture of a point of the camera's frame; `None` at and behind the camera's plane.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        self.project_with_jacobian(point).map(|(place, _)| place)
    }

    /// Place on the picture and its derivative by the point's coordinates (pixels a unit of length).
    pub fn project_with_jacobian(&self, point: DVec3) -> Option<(DVec2, ProjectionJacobian)> {
        if !point.is_finite() || point.z <= 0.0 {
            return None;
        }
        let inverse_z = 1.0 / point.z;
        let (x, y) = (point.x * inverse_z, point.y * inverse_z);
        let (place, [[xx, xy], [yx, yy]]) = self.distort(x, y);
        let row = |dx: f64, dy: f64| [dx * inverse_z, dy * inverse_z, -(dx * x + dy * y) * inverse_z];
        Some((place, [row(xx, xy), row(yx, yy)]))
    }

    /// Unit bearing of a place on the picture; `None` where the mapping has no inverse.
    pub fn unproject(&self, place_px: DVec2) -> Option<DVec3> {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let (mut x, mut y) = ((place_px.x - cx_px) / fx_px, (place_px.y - cy_px) / fy_px);
        for _ in 0..INVERSE_ROUNDS_MAX {
            let (place, [[xx, xy], [yx, yy]]) = self.distort(x, y);
            let miss = place_px - place;
            let determinant = xx * yy - xy * yx;
            if !(miss.is_finite() && determinant > 0.0) {
                return None;
            }
            x += (yy * miss.x - xy * miss.y) / determinant;
            y += (xx * miss.y - yx * miss.x) / determinant;
            if miss.length_squared() < 1e-18 {
                return Some(DVec3::new(x, y, 1.0).normalize());
            }
        }
        None
    }

    /// Place of a point of the plane z = 1, and its derivative.
    fn distort(&self, x: f64, y: f64) -> (DVec2, [[f64; 2]; 2]) {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let Radtan { k1, k2, p1, p2 } = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * k2);
        let slope = 2.0 * (k1 + 2.0 * k2 * r2);
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        let mixed = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
        let xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x;
        let yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
        let place = DVec2::new(fx_px * xd + cx_px, fy_px * yd + cy_px);
        (place, [[fx_px * xx, fx_px * mixed], [fy_px * mixed, fy_px * yy]])
    }
}
