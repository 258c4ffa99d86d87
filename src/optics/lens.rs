//! Lens mappings: from a bearing in the camera's frame to a place on the picture, and back.
//!
//! The camera looks along +z, x to the right, y down; pixel centres are integers (the top left pixel's centre is (0, 0)).
//! Enters: points of the camera's frame in metres. Leaves: places in pixels, unit bearings. It knows no scene and no pixel
//! values, and clips to no picture.

use glam::{DVec2, DVec3};

use crate::units::Size;

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

impl Radtan {
    /// Upper bound of the tangential terms' pull on the smallest stretch of the mapping, divided by six times the radius.
    fn tangential(&self) -> f64 {
        self.p1.abs() + self.p2.abs()
    }

    /// Lower bounds of the mapping's stretch along the radius and across it, as `a + b s + c s^2` of `s = r^2`.
    ///
    /// The mapping is the gradient of `r^2/2 + k1 r^4/4 + k2 r^6/6 + (p2 x + p1 y) r^2`, so its Jacobian is symmetric. Its
    /// radial part has the eigenvalues `1 + 3 k1 s + 5 k2 s^2` along the radius and `1 + k1 s + k2 s^2` across it; the
    /// tangential part has `4 q.x ± 2 |q| r` with q = (p2, p1), which is never below `-6 |q| r >= -3 |q| (1 + s)`.
    fn stretch_bounds(&self) -> [[f64; 3]; 2] {
        let slack = 3.0 * self.tangential();
        [[1.0 - slack, 3.0 * self.k1 - slack, 5.0 * self.k2], [1.0 - slack, self.k1 - slack, self.k2]]
    }

    /// Whether the mapping is proven one to one on the disc of this squared radius: a gradient whose Jacobian is positive
    /// definite on a convex set belongs to a strictly convex function, and such a gradient takes no value twice.
    fn is_one_to_one_within(&self, radius2: f64) -> bool {
        self.stretch_bounds().into_iter().all(|bound| stays_positive(bound, radius2))
    }

    /// Where an undistorted place in the plane z = 1 lands, with the Jacobian's entries xx, xy (= yx) and yy.
    fn distort(&self, at: DVec2) -> (DVec2, [f64; 3]) {
        let Self { k1, k2, p1, p2 } = *self;
        let (x, y) = (at.x, at.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (k1 + s * k2);
        let growth = 2.0 * (k1 + 2.0 * s * k2); // d(radial)/dx divided by x
        let cross = 2.0 * x * y;
        let place = DVec2::new(
            x * radial + p1 * cross + p2 * (s + 2.0 * x * x),
            y * radial + p1 * (s + 2.0 * y * y) + p2 * cross,
        );
        let jacobian = [
            radial + growth * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            growth * x * y + 2.0 * p1 * x + 2.0 * p2 * y,
            radial + growth * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
        ];
        (place, jacobian)
    }

    /// The undistorted place that lands on `target`: damped Newton inside the proven domain, where the Jacobian is positive
    /// definite and the step is a descent direction of the residual. None if it does not come within 1e-12.
    fn undistort(&self, target: DVec2) -> Option<DVec2> {
        let mut at = DVec2::ZERO;
        let (mut place, mut jacobian) = self.distort(at);
        for _ in 0..NEWTON_STEPS_MAX {
            let residual = target - place;
            let [xx, xy, yy] = jacobian;
            let determinant = xx * yy - xy * xy;
            let step = DVec2::new(yy * residual.x - xy * residual.y, xx * residual.y - xy * residual.x) / determinant;
            if residual.length() <= RESIDUAL_MAX {
                // One more step costs nothing here and squares what error is left.
                return Some(at + step).filter(|at| self.is_one_to_one_within(at.length_squared()));
            }
            (at, place, jacobian) = self.damped(at, step, target, residual.length_squared())?;
        }
        None
    }

    /// Halves a Newton step until it stays in the domain and brings the place closer to its target.
    fn damped(&self, at: DVec2, step: DVec2, target: DVec2, error2: f64) -> Option<(DVec2, DVec2, [f64; 3])> {
        let mut fraction = 1.0;
        for _ in 0..HALVINGS_MAX {
            let next = at + step * fraction;
            if self.is_one_to_one_within(next.length_squared()) {
                let (place, jacobian) = self.distort(next);
                if (target - place).length_squared() < error2 {
                    return Some((next, place, jacobian));
                }
            }
            fraction *= 0.5;
        }
        None
    }
}

/// Residual in the plane z = 1 at which Newton's iteration has converged.
const RESIDUAL_MAX: f64 = 1e-12;
/// Full steps converge in 4 to 6; only targets at the domain's edge need more.
const NEWTON_STEPS_MAX: u32 = 60;
/// 2^-30 of a step is below any useful progress.
const HALVINGS_MAX: u32 = 30;

/// Whether `a + b s + c s^2 > 0` for all s in 0..=`s`. False for NaN.
fn stays_positive([a, b, c]: [f64; 3], s: f64) -> bool {
    let positive_at_end = a > 0.0 && a + s * (b + s * c) > 0.0;
    // Only a valley (c > 0) between 0 and s can dip below zero while both ends are above it.
    let valley_is_inside = c > 0.0 && b < 0.0 && 2.0 * c * s > -b;
    positive_at_end && !(valley_is_inside && b * b >= 4.0 * a * c)
}

/// First s > 0 at which `a + b s + c s^2` is zero; infinite if there is none, 0 if a is not positive.
fn first_zero([a, b, c]: [f64; 3]) -> f64 {
    let discriminant = b * b - 4.0 * a * c;
    if a.is_nan() || a <= 0.0 {
        return 0.0;
    }
    if discriminant < 0.0 || (b >= 0.0 && c >= 0.0) {
        return f64::INFINITY;
    }
    // The form without cancellation for b <= 0; for b > 0 (then c < 0) the other root's.
    let root = discriminant.sqrt();
    if b <= 0.0 { 2.0 * a / (root - b) } else { (-b - root) / (2.0 * c) }
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
        assert!(size.width_px > 0 && size.height_px > 0, "a picture has at least one pixel");
        let (width_px, height_px) = (f64::from(size.width_px), f64::from(size.height_px));
        let focal_px = 0.5 * width_px / libm::tan(0.5 * horizontal_fov_rad);
        Self {
            intrinsics: Intrinsics {
                fx_px: focal_px,
                fy_px: focal_px,
                cx_px: 0.5 * (width_px - 1.0),
                cy_px: 0.5 * (height_px - 1.0),
            },
            distortion: Radtan::default(),
        }
    }

    /// The same lens over a picture whose first pixel lies at a place of this one's, and whose pixels are so many of this one's wide.
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

    /// Where a point in the camera's frame (metres, or any multiple) lands, in pixels; not clipped to a picture.
    ///
    /// None for points at or behind the camera's plane, and beyond [`Lens::radius_max`], where the polynomial folds over
    /// and would show what a real lens never does.
    pub fn project(&self, point_in_camera: DVec3) -> Option<DVec2> {
        let at = self.in_domain(point_in_camera)?;
        let (distorted, _) = self.distortion.distort(at);
        self.to_picture(distorted)
    }

    /// [`Lens::project`] with its derivative by the point, in px per metre.
    pub fn project_with_jacobian(&self, point_in_camera: DVec3) -> Option<(DVec2, ProjectionJacobian)> {
        let at = self.in_domain(point_in_camera)?;
        let (distorted, [xx, xy, yy]) = self.distortion.distort(at);
        let place_px = self.to_picture(distorted)?;
        let per_m = 1.0 / point_in_camera.z;
        let (fx, fy) = (self.intrinsics.fx_px * per_m, self.intrinsics.fy_px * per_m);
        let jacobian =
            [[fx * xx, fx * xy, -fx * (xx * at.x + xy * at.y)], [fy * xy, fy * yy, -fy * (xy * at.x + yy * at.y)]];
        Some((place_px, jacobian))
    }

    /// The unit bearing in the camera's frame that lands on a place of the picture (or outside it). None where no bearing
    /// of the proven domain does.
    pub fn unproject(&self, place_px: DVec2) -> Option<DVec3> {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let target = DVec2::new((place_px.x - cx_px) / fx_px, (place_px.y - cy_px) / fy_px);
        if !target.is_finite() {
            return None;
        }
        let at = self.distortion.undistort(target)?;
        Some(at.extend(1.0).normalize())
    }

    /// Largest tangent of the angle off the axis at which the mapping is proven one to one; infinite if it never folds.
    ///
    /// Without tangential terms this is exactly where the radial polynomial stops growing: the first zero of
    /// `1 + 3 k1 r^2 + 5 k2 r^4`. With them it lies a little inside the true limit (see `Radtan::stretch_bounds`).
    pub fn radius_max(&self) -> f64 {
        let [along, across] = self.distortion.stretch_bounds();
        crate::num::lesser(first_zero(along), first_zero(across)).sqrt()
    }

    /// The point divided by its depth, if it is in front of the camera and where the mapping is one to one.
    fn in_domain(&self, point_in_camera: DVec3) -> Option<DVec2> {
        if point_in_camera.z.is_nan() || point_in_camera.z <= 0.0 {
            return None;
        }
        let at = DVec2::new(point_in_camera.x / point_in_camera.z, point_in_camera.y / point_in_camera.z);
        self.distortion.is_one_to_one_within(at.length_squared()).then_some(at)
    }

    fn to_picture(self, distorted: DVec2) -> Option<DVec2> {
        let Intrinsics { fx_px, fy_px, cx_px, cy_px } = self.intrinsics;
        let place_px = DVec2::new(fx_px * distorted.x + cx_px, fy_px * distorted.y + cy_px);
        place_px.is_finite().then_some(place_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VGA: Size = Size { width_px: 640, height_px: 480 };
    const WIDE_VGA: Size = Size { width_px: 752, height_px: 480 };

    fn lens(intrinsics: [f64; 4], distortion: [f64; 4]) -> Lens {
        let [fx_px, fy_px, cx_px, cy_px] = intrinsics;
        let [k1, k2, p1, p2] = distortion;
        Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, distortion: Radtan { k1, k2, p1, p2 } }
    }

    /// EuRoC MAV (both cameras), TUM RGB-D freiburg3, and two made-up ones: strong pincushion, strong tangential terms.
    fn calibrations() -> Vec<(&'static str, Size, Lens)> {
        let euroc0 = [-0.283_408_11, 0.073_959_07, 0.000_193_59, 1.761_871_14e-5];
        let euroc1 = [-0.283_683_65, 0.074_512_84, -0.000_104_73, -3.555_907e-5];
        vec![
            ("euroc cam0", WIDE_VGA, lens([458.654, 457.296, 367.215, 248.375], euroc0)),
            ("euroc cam1", WIDE_VGA, lens([457.587, 456.134, 379.999, 255.238], euroc1)),
            ("freiburg3", VGA, lens([535.4, 539.2, 320.1, 247.6], [0.0; 4])),
            ("pinhole 90", VGA, Lens::pinhole(VGA, core::f64::consts::FRAC_PI_2)),
            ("pincushion", VGA, lens([420.0, 421.0, 310.0, 250.0], [0.12, 0.05, 0.0, 0.0])),
            ("tangential", VGA, lens([420.0, 421.0, 310.0, 250.0], [-0.05, 0.01, 0.004, -0.006])),
        ]
    }

    #[test]
    fn every_place_of_a_picture_returns_to_itself() {
        for (name, size, lens) in calibrations() {
            let mut tried = 0;
            for y in (0..size.height_px).step_by(7).chain([size.height_px - 1]) {
                for x in (0..size.width_px).step_by(7).chain([size.width_px - 1]) {
                    let place_px = DVec2::new(f64::from(x), f64::from(y));
                    let bearing = lens.unproject(place_px).unwrap_or_else(|| panic!("{name} {place_px}: no bearing"));
                    // Of a normalised vector: three roundings of 2^-53.
                    assert!((bearing.length() - 1.0).abs() < 1e-15);
                    let back_px = lens.project(bearing * 3.0).unwrap();
                    // Newton's last step leaves less than 1e-20; some twenty roundings of values below 1,000 px leave 2e-12.
                    assert!((back_px - place_px).length() < 1e-9, "{name} {place_px} {back_px}");
                    tried += 1;
                }
            }
            assert!(tried > 6_000, "{name}: only {tried} places");
        }
    }

    #[test]
    fn the_jacobian_is_the_slope_of_the_projection() {
        let mut tried = 0;
        for (name, size, lens) in calibrations() {
            for y in (0..size.height_px).step_by(60) {
                for x in (0..size.width_px).step_by(60) {
                    let point_m = lens.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap() * 2.5;
                    let (place_px, jacobian) = lens.project_with_jacobian(point_m).unwrap();
                    assert_eq!(Some(place_px), lens.project(point_m));
                    // Central differences of step h err by h^2 f'''/6 (f''' below 5,000 px/m^3 here: 2e-8 at h = 5e-6) and by
                    // roundings of 1,000 px, 1e-13 * 10 / h = 2e-7.
                    let step_m = 5e-6;
                    for (axis, axis_vector) in DVec3::AXES.into_iter().enumerate() {
                        let ahead_px = lens.project(point_m + axis_vector * step_m).unwrap();
                        let behind_px = lens.project(point_m - axis_vector * step_m).unwrap();
                        let slope = (ahead_px - behind_px) / (2.0 * step_m);
                        let analytic = DVec2::new(jacobian[0][axis], jacobian[1][axis]);
                        assert!((slope - analytic).length() < 1e-6, "{name} {point_m} axis {axis}: {slope} {analytic}");
                        tried += 1;
                    }
                }
            }
        }
        assert!(tried > 1_000, "only {tried} slopes");
    }

    #[test]
    fn points_at_or_behind_the_camera_and_non_numbers_land_nowhere() {
        for (name, _, lens) in calibrations() {
            for point in [
                DVec3::new(0.1, 0.2, 0.0),
                DVec3::new(0.0, 0.0, -0.0),
                DVec3::new(0.0, 0.0, -1.0),
                DVec3::new(0.0, 0.0, f64::NAN),
                DVec3::new(f64::NAN, 0.0, 1.0),
                DVec3::new(1e300, 0.0, 1e-300),
            ] {
                assert_eq!(lens.project(point), None, "{name} {point}");
                assert_eq!(lens.project_with_jacobian(point), None, "{name} {point}");
            }
            assert_eq!(lens.unproject(DVec2::new(f64::NAN, 0.0)), None, "{name}");
        }
    }

    #[test]
    fn a_lens_ends_where_its_polynomial_folds_over() {
        // Barrel alone: 1 + 3 k1 r^2 = 0 at r = 1/sqrt(0.9), where the distorted radius is (2/3) r.
        let barrel = lens([400.0, 400.0, 0.0, 0.0], [-0.3, 0.0, 0.0, 0.0]);
        let limit = 1.0 / 0.9_f64.sqrt();
        assert!((barrel.radius_max() - limit).abs() < 1e-15);
        assert!(barrel.project(DVec3::new(limit * (1.0 - 1e-9), 0.0, 1.0)).is_some());
        assert!(barrel.project(DVec3::new(limit * (1.0 + 1e-9), 0.0, 1.0)).is_none());
        let edge_px = 400.0 * limit * (2.0 / 3.0);
        assert!(barrel.unproject(DVec2::new(edge_px * (1.0 - 1e-9), 0.0)).is_some());
        assert!(barrel.unproject(DVec2::new(edge_px * (1.0 + 1e-9), 0.0)).is_none());

        // It folds and unfolds again: what lies beyond the first fold stays refused though the slope is positive there.
        let valley = lens([400.0, 400.0, 0.0, 0.0], [-0.5, 0.07, 0.0, 0.0]);
        let limit = valley.radius_max();
        assert!((1.0 - 1.5 * limit * limit + 0.35 * limit * limit * limit * limit).abs() < 1e-14);
        let (_, [slope_beyond, _, _]) = valley.distortion.distort(DVec2::new(3.0, 0.0));
        assert!(slope_beyond > 0.0, "the case is to lie beyond the second turn, slope {slope_beyond}");
        assert!(valley.project(DVec3::new(3.0, 0.0, 1.0)).is_none());

        // EuRoC's never folds, a pinhole neither.
        assert_eq!(calibrations()[0].2.radius_max(), f64::INFINITY);
        assert_eq!(calibrations()[3].2.radius_max(), f64::INFINITY);
    }

    #[test]
    fn no_two_bearings_of_the_domain_share_a_place() {
        // The determinant of the mapping changes sign nowhere inside the stated radius, however strong the tangential terms.
        let mut tried = 0;
        for k1 in [-0.4, -0.1, 0.0, 0.2] {
            for k2 in [-0.2, 0.0, 0.05] {
                for p in [0.0, 0.003, 0.03] {
                    let lens = lens([1.0, 1.0, 0.0, 0.0], [k1, k2, p, -0.5 * p]);
                    let radius = crate::num::lesser(lens.radius_max(), 3.0);
                    for step in 0..64_u32 {
                        let (sine, cosine) = libm::sincos(f64::from(step) * (core::f64::consts::TAU / 64.0));
                        for ring in 0..50_u32 {
                            let at = DVec2::new(cosine, sine) * (radius * (f64::from(ring) + 0.5) / 50.0);
                            let (_, [xx, xy, yy]) = lens.distortion.distort(at);
                            assert!(xx > 0.0 && xx * yy - xy * xy > 0.0, "k1 {k1} k2 {k2} p {p} at {at}");
                            let place_px = lens.project(at.extend(1.0)).unwrap();
                            let back = lens.unproject(place_px).unwrap();
                            // At the last ring the mapping stretches by 1 % or more: 1e-15 of rounding grows to 1e-13.
                            assert!((back.truncate() / back.z - at).length() < 1e-11, "k1 {k1} k2 {k2} p {p} at {at}");
                            tried += 1;
                        }
                    }
                }
            }
        }
        assert_eq!(tried, 4 * 3 * 3 * 64 * 50);
    }

    #[test]
    fn a_pinhole_spans_its_field_of_view_between_the_edges() {
        let lens = Lens::pinhole(VGA, core::f64::consts::FRAC_PI_2);
        // tan(pi/4) is 1 within an ulp, so the focal length is 320 within a few.
        assert!((lens.intrinsics.fx_px - 320.0).abs() < 1e-12);
        let left = lens.unproject(DVec2::new(-0.5, 239.5)).unwrap();
        assert!((left.x / left.z + 1.0).abs() < 1e-14 && left.y == 0.0);
    }
}
