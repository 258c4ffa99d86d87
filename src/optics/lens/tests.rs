//! Tests of the lens mappings, each over its whole domain.

use super::*;

const VGA: Size = Size { width_px: 640, height_px: 480 };
const WIDE_VGA: Size = Size { width_px: 752, height_px: 480 };

fn radtan([k1, k2, p1, p2]: [f64; 4]) -> Radtan {
    Radtan { k1, k2, p1, p2, k3: 0.0 }
}

fn lens(intrinsics: [f64; 4], distortion: [f64; 4]) -> Lens {
    let [fx_px, fy_px, cx_px, cy_px] = intrinsics;
    let radtan = radtan(distortion);
    Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, mapping: Mapping::Radtan(radtan) }
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
fn every_position_in_a_picture_returns_to_itself() {
    for (name, size, lens) in calibrations() {
        let mut tried = 0;
        for y in (0..size.height_px).step_by(7).chain([size.height_px - 1]) {
            for x in (0..size.width_px).step_by(7).chain([size.width_px - 1]) {
                let position_px = DVec2::new(f64::from(x), f64::from(y));
                let bearing = lens.unproject(position_px).unwrap_or_else(|| panic!("{name} {position_px}: no bearing"));
                // Of a normalised vector: three roundings of 2^-53.
                assert!((bearing.length() - 1.0).abs() < 1e-15);
                let back_px = lens.project(bearing * 3.0).unwrap();
                // Newton's last step leaves less than 1e-20; some twenty roundings of values below 1,000 px leave 2e-12.
                assert!((back_px - position_px).length() < 1e-9, "{name} {position_px} {back_px}");
                tried += 1;
            }
        }
        assert!(tried > 6_000, "{name}: only {tried} positions");
    }
}

#[test]
fn the_jacobian_is_the_slope_of_the_projection() {
    let mut tried = 0;
    for (name, size, lens) in calibrations() {
        for y in (0..size.height_px).step_by(60) {
            for x in (0..size.width_px).step_by(60) {
                let point_m = lens.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap() * 2.5;
                let (position_px, jacobian) = lens.project_with_jacobian(point_m).unwrap();
                assert_eq!(Some(position_px), lens.project(point_m));
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
    let fold = radtan([-0.3, 0.0, 0.0, 0.0]);
    let barrel = lens([400.0, 400.0, 0.0, 0.0], [-0.3, 0.0, 0.0, 0.0]);
    let limit = 1.0 / 0.9_f64.sqrt();
    assert!((fold.radius_max() - limit).abs() < 1e-15);
    // The angle's tangent is within a few roundings of the radius.
    assert!((libm::tan(barrel.field_angle_max_rad()) - limit).abs() < 1e-14);
    assert!(barrel.project(DVec3::new(limit * (1.0 - 1e-9), 0.0, 1.0)).is_some());
    assert!(barrel.project(DVec3::new(limit * (1.0 + 1e-9), 0.0, 1.0)).is_none());
    let edge_px = 400.0 * limit * (2.0 / 3.0);
    assert!(barrel.unproject(DVec2::new(edge_px * (1.0 - 1e-9), 0.0)).is_some());
    assert!(barrel.unproject(DVec2::new(edge_px * (1.0 + 1e-9), 0.0)).is_none());

    // It folds and unfolds again: angles beyond the first fold stay refused, although the slope is positive there.
    let valley = radtan([-0.5, 0.07, 0.0, 0.0]);
    let limit = valley.radius_max();
    assert!((1.0 - 1.5 * limit * limit + 0.35 * limit * limit * limit * limit).abs() < 1e-14);
    let (_, [slope_beyond, _, _]) = valley.distort(DVec2::new(3.0, 0.0));
    assert!(slope_beyond > 0.0, "the case is to lie beyond the second turn, slope {slope_beyond}");
    let valley = lens([400.0, 400.0, 0.0, 0.0], [-0.5, 0.07, 0.0, 0.0]);
    assert!(valley.project(DVec3::new(3.0, 0.0, 1.0)).is_none());

    // The third radial term alone: 1 + 7 k3 r^6 = 0; and a valley that it lifts out of reach.
    let sixth = Radtan { k3: -0.01, ..Radtan::default() };
    let limit = libm::cbrt(1.0 / 0.07).sqrt();
    assert!((sixth.radius_max() - limit).abs() < 1e-14, "{}", sixth.radius_max());
    let lifted = Radtan { k1: -0.3, k2: 0.0, k3: 0.05, ..Radtan::default() };
    assert_eq!(lifted.radius_max(), f64::INFINITY);

    // EuRoC's never folds, a pinhole neither.
    assert_eq!(calibrations()[0].2.field_angle_max_rad(), core::f64::consts::FRAC_PI_2);
    assert_eq!(calibrations()[3].2.field_angle_max_rad(), core::f64::consts::FRAC_PI_2);
}

#[test]
fn no_two_bearings_of_the_domain_share_a_position() {
    // The determinant of the mapping changes sign nowhere inside the stated radius, however strong the tangential terms.
    let mut tried = 0;
    for k1 in [-0.4, -0.1, 0.0, 0.2] {
        for k2 in [-0.2, 0.0, 0.05] {
            for p in [0.0, 0.003, 0.03] {
                let lens = lens([1.0, 1.0, 0.0, 0.0], [k1, k2, p, -0.5 * p]);
                let bent = radtan([k1, k2, p, -0.5 * p]);
                let radius = crate::num::lesser(bent.radius_max(), 3.0);
                for step in 0..64_u32 {
                    let (sine, cosine) = libm::sincos(f64::from(step) * (core::f64::consts::TAU / 64.0));
                    for ring in 0..50_u32 {
                        let at = DVec2::new(cosine, sine) * (radius * (f64::from(ring) + 0.5) / 50.0);
                        let (_, [xx, xy, yy]) = bent.distort(at);
                        assert!(xx > 0.0 && xx * yy - xy * xy > 0.0, "k1 {k1} k2 {k2} p {p} at {at}");
                        let position_px = lens.project(at.extend(1.0)).unwrap();
                        let back = lens.unproject(position_px).unwrap();
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
