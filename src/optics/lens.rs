//! Lens mappings: from a bearing in the camera's frame to a position in the picture, and back.
//!
//! The camera looks along +z, x to the right, y down; pixel centres are integers (the top left pixel's centre is (0, 0)).
//! Converts points of the camera's frame in metres to positions in pixels, and positions to unit bearings. Knows no scene and no pixel
//! values, and does not clip to the picture.
//!
//! A mapping takes a bearing to a point of a plane whose unit is the focal length; intrinsics take that to pixels. Each mapping is
//! one to one on a cone around the axis, [`Lens::field_angle_max_rad`] wide on every side, and is refused beyond it.

mod double_sphere;
mod eucm;
mod kb4;
mod projection;
mod radial;
mod radtan;
mod table;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wide_tests;

pub use double_sphere::DoubleSphere;
pub use eucm::Eucm;
pub use kb4::Kb4;
pub use radtan::Radtan;
pub use table::{RadiusTable, TABLE_POINTS_MAX};

use glam::{DVec2, DVec3};

use crate::units::Size;
use projection::Projected;
pub use projection::{BearingJacobian, ProjectionJacobian};

/// Focal lengths and principal point in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Pixels of a unit of the mapping's plane, horizontally: the focal length, except as [`Lens::focal_px`] says.
    pub fx_px: f64,
    /// The same vertically.
    pub fy_px: f64,
    /// Column of the principal point.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
}

/// How bearings meet the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a measured table stays inside, so that a lens is a plain value")]
pub enum Mapping {
    /// The tangent of the angle.
    Pinhole,
    /// A pinhole with radial-tangential distortion.
    Radtan(Radtan),
    /// A polynomial of the angle.
    Kb4(Kb4),
    /// Two spheres and a pinhole.
    DoubleSphere(DoubleSphere),
    /// An ellipsoid and a pinhole.
    Eucm(Eucm),
    /// A measured radius for each angle.
    Table(RadiusTable),
}

/// The mapping of one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal lengths and principal point.
    pub intrinsics: Intrinsics,
    /// How bearings meet the plane.
    pub mapping: Mapping,
}

impl Mapping {
    /// Whether it takes a plane to a picture without an image circle: a pinhole, with or without distortion. The others reach wide angles.
    pub fn is_flat(&self) -> bool {
        match self {
            Self::Pinhole | Self::Radtan(_) => true,
            Self::Kb4(_) | Self::DoubleSphere(_) | Self::Eucm(_) | Self::Table(_) => false,
        }
    }

    /// Where a point meets the plane, with its derivative; none outside the domain.
    fn project(&self, point: DVec3, scale: [f64; 2]) -> Option<Projected> {
        match self {
            Self::Pinhole => Radtan::default().project(point, scale),
            Self::Radtan(radtan) => radtan.project(point, scale),
            Self::Kb4(kb4) => radial::project(kb4, point, scale),
            Self::DoubleSphere(spheres) => spheres.project(point, scale),
            Self::Eucm(eucm) => eucm.project(point, scale),
            Self::Table(table) => radial::project(table, point, scale),
        }
    }

    /// [`Mapping::project`] without the derivative, to the same bits.
    fn project_point(&self, point: DVec3) -> Option<DVec2> {
        match self {
            Self::Pinhole => Radtan::default().project_point(point),
            Self::Radtan(radtan) => radtan.project_point(point),
            Self::Kb4(_) | Self::DoubleSphere(_) | Self::Eucm(_) | Self::Table(_) => {
                self.project(point, [1.0; 2]).map(|(projected, _)| projected)
            }
        }
    }

    /// The unit bearing that meets the plane at a point; none where no bearing of the domain does.
    fn unproject(&self, point: DVec2) -> Option<DVec3> {
        match self {
            Self::Pinhole => Radtan::default().unproject(point),
            Self::Radtan(radtan) => radtan.unproject(point),
            Self::Kb4(kb4) => radial::unproject(kb4, point),
            Self::DoubleSphere(spheres) => spheres.unproject(point),
            Self::Eucm(eucm) => eucm.unproject(point),
            Self::Table(table) => radial::unproject(table, point),
        }
    }

    /// Half the opening of the cone on which the mapping is defined and one to one.
    fn field_angle_max_rad(&self) -> f64 {
        match self {
            Self::Pinhole => core::f64::consts::FRAC_PI_2,
            Self::Radtan(radtan) => libm::atan(radtan.radius_max()),
            Self::Kb4(kb4) => radial::Radial::angle_max_rad(kb4),
            Self::DoubleSphere(spheres) => spheres.angle_max_rad(),
            Self::Eucm(eucm) => eucm.angle_max_rad(),
            Self::Table(table) => radial::Radial::angle_max_rad(table),
        }
    }

    /// Length in the plane of a radian at the axis.
    fn axial_slope(&self) -> f64 {
        match self {
            Self::Pinhole | Self::Radtan(_) | Self::Kb4(_) | Self::Eucm(_) => 1.0,
            Self::DoubleSphere(spheres) => spheres.axial_slope(),
            Self::Table(table) => table.axial_slope(),
        }
    }
}

impl Lens {
    /// A lens without distortion whose picture spans `horizontal_fov_rad` from the left edge of the first column to the
    /// right edge of the last, with square pixels and the principal point in the picture's middle.
    ///
    /// # Panics
    /// If the field of view is not between 0 and pi, or the size is empty.
    pub fn pinhole(size: Size, horizontal_fov_rad: f64) -> Self {
        assert!(
            horizontal_fov_rad > 0.0 && horizontal_fov_rad < core::f64::consts::PI,
            "a pinhole's field of view lies between 0 and pi"
        );
        let intrinsics = centred(size, 0.5 * f64::from(size.width_px) / libm::tan(0.5 * horizontal_fov_rad));
        Self { intrinsics, mapping: Mapping::Pinhole }
    }

    /// A lens of any mapping whose picture spans `horizontal_fov_rad` across the row of the principal point, which lies in the
    /// picture's middle; none where the mapping does not reach that far.
    ///
    /// # Panics
    /// If the size is empty.
    pub fn spanning(size: Size, mapping: Mapping, horizontal_fov_rad: f64) -> Option<Self> {
        let (sine, cosine) = libm::sincos(0.5 * horizontal_fov_rad);
        let (edge, _) = mapping.project(DVec3::new(sine, 0.0, cosine), [1.0; 2])?;
        let lens = Self { intrinsics: centred(size, 0.5 * f64::from(size.width_px) / edge.x), mapping };
        (edge.x > 0.0 && edge.x.is_finite()).then_some(lens)
    }

    /// The same lens over a picture whose first pixel lies at a position in this one's, and whose pixels are `step_px` of this one's wide.
    #[must_use]
    pub fn of_part(&self, first_px: DVec2, step_px: f64) -> Self {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let intrinsics = Intrinsics {
            fx_px: fx_px / step_px,
            fy_px: fy_px / step_px,
            cx_px: (cx_px - first_px.x) / step_px,
            cy_px: (cy_px - first_px.y) / step_px,
        };
        Self { intrinsics, ..*self }
    }

    /// The same lens with a picture this many times as large around the principal point.
    #[must_use]
    pub fn magnified(&self, factor: f64) -> Self {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        Self { intrinsics: Intrinsics { fx_px: fx_px * factor, fy_px: fy_px * factor, cx_px, cy_px }, ..*self }
    }

    /// Pixels of a radian at the axis, mean of both directions.
    pub fn focal_px(&self) -> f64 {
        0.5 * (self.intrinsics.fx_px + self.intrinsics.fy_px) * self.mapping.axial_slope()
    }

    /// Greatest angle off the axis at which the mapping is defined and proven one to one; bearings at this angle and beyond land nowhere.
    pub fn field_angle_max_rad(&self) -> f64 {
        self.mapping.field_angle_max_rad()
    }

    /// Where a point in the camera's frame (metres, or any multiple) lands, in pixels; not clipped to a picture.
    ///
    /// None for points outside the mapping's domain: for pinhole and radtan at or behind the camera's plane, for all beyond the angle
    /// where the mapping folds over and would show what a real lens never does.
    pub fn project(&self, point_in_camera: DVec3) -> Option<DVec2> {
        self.to_picture(self.mapping.project_point(point_in_camera)?)
    }

    /// [`Lens::project`] with its derivative by the point, in px per metre.
    pub fn project_with_jacobian(&self, point_in_camera: DVec3) -> Option<(DVec2, ProjectionJacobian)> {
        let (point, jacobian) =
            self.mapping.project(point_in_camera, [self.intrinsics.fx_px, self.intrinsics.fy_px])?;
        Some((self.to_picture(point)?, jacobian))
    }

    /// The unit bearing in the camera's frame that lands on a position in the picture (or outside it). None where no bearing
    /// of the domain does.
    pub fn unproject(&self, position_px: DVec2) -> Option<DVec3> {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let point = DVec2::new((position_px.x - cx_px) / fx_px, (position_px.y - cy_px) / fy_px);
        if !point.is_finite() {
            return None;
        }
        self.mapping.unproject(point)
    }

    /// [`Lens::unproject`] with its derivative by the position, per px. None also on the rim where the mapping folds and a bearing has no
    /// finite derivative.
    ///
    /// A projection does not change along its ray, so its Jacobian J at the unit bearing maps the plane across the bearing to the
    /// picture, and the pseudo-inverse J'(J J')^-1 is the inverse of that map.
    pub fn unproject_with_jacobian(&self, position_px: DVec2) -> Option<(DVec3, BearingJacobian)> {
        let bearing = self.unproject(position_px)?;
        let (_, [a, b]) = self.project_with_jacobian(bearing)?;
        let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
        let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
        let determinant = aa * bb - ab * ab;
        let (by_x, by_y) = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant);
        let jacobian = [[by_x.x, by_y.x], [by_x.y, by_y.y], [by_x.z, by_y.z]];
        (by_x.is_finite() && by_y.is_finite()).then_some((bearing, jacobian))
    }

    /// Solid angle that a square pixel's unit of area takes at a bearing, in sr/px^2; none outside the domain.
    pub fn solid_angle_per_px2(&self, bearing: DVec3) -> Option<f64> {
        let (_, [a, b]) = self.project_with_jacobian(bearing.normalize())?;
        Some(1.0 / DVec3::from_array(a).cross(DVec3::from_array(b)).length())
    }

    fn to_picture(self, point: DVec2) -> Option<DVec2> {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let position_px = DVec2::new(fx_px * point.x + cx_px, fy_px * point.y + cy_px);
        position_px.is_finite().then_some(position_px)
    }
}

/// Square pixels, and the principal point in the picture's middle.
fn centred(size: Size, focal_px: f64) -> Intrinsics {
    assert!(size.width_px > 0 && size.height_px > 0, "a picture has at least one pixel");
    let (width_px, height_px) = (f64::from(size.width_px), f64::from(size.height_px));
    Intrinsics { fx_px: focal_px, fy_px: focal_px, cx_px: 0.5 * (width_px - 1.0), cy_px: 0.5 * (height_px - 1.0) }
}
