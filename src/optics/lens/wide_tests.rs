//! Tests of the mappings of wide lenses with random parameters, over their whole domain.

use glam::{DVec2, DVec3};

use super::*;
use crate::draw::DrawKey;

/// Seed of the random lenses.
const SEED: u64 = 4;
/// Lenses of each model.
const LENSES: u64 = 40;

/// A number of 0..1 that is a function of a key and a number.
fn random(key: DrawKey, number: u64) -> f64 {
    key.with(number).uniform()
}

fn between(key: DrawKey, number: u64, least: f64, most: f64) -> f64 {
    least + (most - least) * random(key, number)
}

fn mapping(model: u64, key: DrawKey) -> Mapping {
    match model {
        0 => {
            let [k1, k2, k3, k4] = [0.05, 0.02, 0.005, 0.001_f64].map(|k| k * between(key, k.to_bits(), -1.0, 1.0));
            Mapping::Kb4(Kb4::new([k1, k2, k3, k4]))
        }
        1 => Mapping::DoubleSphere(DoubleSphere { xi: between(key, 1, -0.5, 0.5), alpha: between(key, 2, 0.0, 1.0) }),
        2 => Mapping::Eucm(Eucm { alpha: between(key, 1, 0.0, 1.0), beta: between(key, 2, 0.3, 3.0) }),
        _ => {
            let mut points = vec![(0.0, 0.0)];
            for knot in 0..12 {
                let (angle_rad, radius) = points[points.len() - 1];
                points.push((
                    angle_rad + between(key, 2 * knot, 0.05, 0.2),
                    radius + between(key, 2 * knot + 1, 0.03, 0.3),
                ));
            }
            Mapping::Table(RadiusTable::new(&points).unwrap())
        }
    }
}

/// Random lenses of every wide model.
fn lenses() -> Vec<Lens> {
    println!("seed {SEED}");
    let intrinsics = Intrinsics { fx_px: 191.0, fy_px: 187.0, cx_px: 254.9, cy_px: 250.1 };
    let of = |model, number| Lens { intrinsics, mapping: mapping(model, DrawKey::root(SEED).with(model).with(number)) };
    (0..4)
        .flat_map(|model| (0..LENSES).map(move |number| (model, number)))
        .map(|(model, number)| of(model, number))
        .collect()
}

fn bearing(angle_rad: f64, turn_rad: f64) -> DVec3 {
    let ((s, c), (y, x)) = (libm::sincos(angle_rad), libm::sincos(turn_rad));
    DVec3::new(s * x, s * y, c)
}

/// Angles over a lens' domain, its rim to a part in a billion included, with turns around the axis.
fn bearings(lens: &Lens) -> Vec<(f64, DVec3)> {
    let most = lens.field_angle_max_rad();
    let shares = (0..40_u32).map(|step| f64::from(step) / 40.0).chain([0.999, 0.999_999, 1.0 - 1e-9]);
    shares.zip(0_u32..).map(|(share, n)| (share, bearing(most * share, 2.4 * f64::from(n)))).collect()
}

#[test]
fn positions_and_bearings_return_to_themselves_up_to_the_rim() {
    let (mut tried, mut behind) = (0, 0);
    for lens in lenses() {
        for (share, bearing) in bearings(&lens) {
            let Some(position_px) = lens.project(bearing * 2.0) else {
                panic!("{lens:?} refuses {share} of its field")
            };
            let back =
                lens.unproject(position_px).unwrap_or_else(|| panic!("{lens:?}: no bearing at {position_px}, {share}"));
            let again_px = lens
                .project(back)
                .unwrap_or_else(|| panic!("{lens:?}: {share} of the field returns outside it from {position_px}"));
            // Some thirty roundings of 2^-53, of the position and of the bearing; where positions run to infinity the mapping stretches the
            // latter by up to the square of the position over the focal length.
            let size_px = 1.0 + position_px.length();
            let most_px = 1e-14 * size_px * (1.0 + size_px / 187.0);
            assert!((again_px - position_px).length() < most_px, "{lens:?} {share}: {position_px} {again_px}");
            // A bearing is as well known as the position allows: on a rim where the slope vanishes, or where positions run to infinity,
            // less.
            if share < 0.99 {
                assert!((back - bearing).length() < 1e-9, "{lens:?} {share}: {bearing} {back}");
            }
            behind += u32::from(bearing.z < 0.0);
            tried += 1;
        }
    }
    assert_eq!(tried, 4 * 40 * 43);
    assert!(behind > 1000, "only {behind} bearings lay behind the camera's plane");
}

#[test]
fn a_round_trip_of_a_picture_keeps_its_positions_to_a_billionth_of_a_pixel() {
    let (mut tried, mut dark) = (0, 0);
    for lens in lenses() {
        for y in (0..512_u32).step_by(37) {
            for x in (0..512_u32).step_by(31) {
                let position_px = DVec2::new(x.into(), y.into());
                let Some(bearing) = lens.unproject(position_px) else {
                    dark += 1;
                    continue;
                };
                assert!((bearing.length() - 1.0).abs() < 1e-15);
                let back_px = lens.project(bearing * 3.0).unwrap();
                assert!((back_px - position_px).length() < 1e-9, "{lens:?} {position_px} {back_px}");
                tried += 1;
            }
        }
    }
    assert!(tried > 20_000 && dark > 100, "{tried} positions, {dark} outside");
}

#[test]
fn jacobians_both_ways_are_the_slopes() {
    let mut tried = 0;
    for lens in lenses() {
        for (_, bearing) in bearings(&lens).into_iter().filter(|(share, _)| *share < 0.9) {
            let point_m = bearing * 2.5;
            let (position_px, jacobian) = lens.project_with_jacobian(point_m).unwrap();
            assert_eq!(Some(position_px), lens.project(point_m));
            let scale = jacobian.iter().flatten().fold(100.0_f64, |most, entry| most.max(entry.abs()));
            let step_m = 1e-6;
            for (axis, axis_vector) in DVec3::AXES.into_iter().enumerate() {
                let ahead_px = lens.project(point_m + axis_vector * step_m).unwrap();
                let behind_px = lens.project(point_m - axis_vector * step_m).unwrap();
                let slope = (ahead_px - behind_px) / (2.0 * step_m);
                let analytic = DVec2::new(jacobian[0][axis], jacobian[1][axis]);
                // A position of 1,000 px rounds to 1e-13 px, over the step 1e-7; a table's second derivative jumps at its knots by
                // up to 1e2 of the scale, so a step across one errs by half of that times the step.
                assert!((slope - analytic).length() < 1e-4 * scale, "{lens:?} {point_m} {axis}: {slope} {analytic}");
                tried += 1;
            }
            let (back, by_position) = lens.unproject_with_jacobian(position_px).unwrap();
            let by_position =
                [0, 1].map(|axis| DVec3::new(by_position[0][axis], by_position[1][axis], by_position[2][axis]));
            // J U = 1 and no change along the bearing: roundings of the scale times the inverse's own size.
            let jacobian = lens.project_with_jacobian(back).unwrap().1.map(DVec3::from_array);
            for (row, column, expected) in [(0, 0, 1.0), (0, 1, 0.0), (1, 0, 0.0), (1, 1, 1.0)] {
                assert!((jacobian[row].dot(by_position[column]) - expected).abs() < 1e-9, "{lens:?} {point_m}");
            }
            assert!(by_position.iter().all(|column| column.dot(back).abs() < 1e-9 * column.length()));
            tried += 1;
        }
    }
    assert!(tried > 4 * 40 * 36 * 4 - 1, "{tried}");
}

#[test]
fn beyond_the_domain_there_is_nothing() {
    for lens in lenses() {
        let most = lens.field_angle_max_rad();
        if most < core::f64::consts::PI - 1e-6 {
            assert_eq!(lens.project(bearing(most + 1e-7, 1.0)), None, "{lens:?}");
        }
        for point in [DVec3::ZERO, DVec3::NAN, DVec3::new(0.0, 0.0, -1.0), DVec3::new(f64::INFINITY, 0.0, 1.0)] {
            assert_eq!(lens.project(point), None, "{lens:?} {point}");
            assert_eq!(lens.project_with_jacobian(point), None, "{lens:?} {point}");
        }
        assert_eq!(lens.unproject(DVec2::new(f64::NAN, 0.0)), None);
        // The axis itself: the principal point, and a Jacobian without a quotient of zeros.
        let (position_px, jacobian) = lens.project_with_jacobian(DVec3::Z).unwrap();
        assert_eq!(position_px, DVec2::new(254.9, 250.1));
        assert!((0.5 * (jacobian[0][0] + jacobian[1][1]) / lens.focal_px() - 1.0).abs() < 1e-14);
        assert_eq!(lens.unproject(position_px), Some(DVec3::Z));
    }
}

#[test]
fn models_give_the_values_of_their_published_formulas() {
    let one = Intrinsics { fx_px: 1.0, fy_px: 1.0, cx_px: 0.0, cy_px: 0.0 };
    let project = |mapping, x, y, z| Lens { intrinsics: one, mapping }.project(DVec3::new(x, y, z)).unwrap();
    // OpenCV's fisheye with TUM-VI's coefficients at 45 and at 100 degrees, by fifty digits of Python's decimal arithmetic.
    let kb4 = Mapping::Kb4(Kb4::new([
        0.003_482_389_402_249_343_4,
        0.000_715_034_845_216_225_7,
        -0.002_053_236_141_870_620_2,
        0.000_202_936_735_918_111_82,
    ]));
    // Four roundings of numbers up to 2.
    for (angle_rad, radius) in [
        (core::f64::consts::FRAC_PI_4, 0.786_943_548_137_426_352_98),
        (100.0_f64.to_radians(), 1.704_627_537_078_283_271_96),
    ] {
        let at = bearing(angle_rad, 0.0) * 7.0;
        assert!((project(kb4, at.x, at.y, at.z) - DVec2::new(radius, 0.0)).length() < 2e-15, "{angle_rad}");
    }
    // The double sphere at (3, 4, -1): |p| = sqrt(26), and so on as the paper's equations 40 to 43 say.
    let spheres = Mapping::DoubleSphere(DoubleSphere { xi: -0.25, alpha: 0.5 });
    let expected = DVec2::new(1.864_293_082_101_575_808_6, 2.485_724_109_468_767_744_8);
    // The denominator is a difference, 1.6 of 5: roundings threefold.
    assert!((project(spheres, 3.0, 4.0, -1.0) - expected).length() < 5e-15);
    // EUCM at (3, 4, -1) with alpha 0.6, beta 4: d = sqrt(4 * 25 + 1), the denominator 0.6 d - 0.4.
    let eucm = Mapping::Eucm(Eucm { alpha: 0.6, beta: 4.0 });
    let expected = DVec2::new(0.532_866_743_591_646_477_5, 0.710_488_991_455_528_636_7);
    assert!((project(eucm, 3.0, 4.0, -1.0) - expected).length() < 1e-15);
}

#[test]
fn a_table_of_a_known_lens_stands_for_it() {
    // A stereographic lens, 2 tan(a/2), every 5 degrees. The cubic's slopes are means of neighbouring stretches, off by the third
    // derivative (below 2) times the stretch squared over 6, and the radius by that times a quarter of the stretch: 6e-5.
    let points: Vec<(f64, f64)> = (0..=20_u32)
        .map(|step| f64::from(5 * step).to_radians())
        .map(|angle_rad| (angle_rad, 2.0 * libm::tan(0.5 * angle_rad)))
        .collect();
    let intrinsics = Intrinsics { fx_px: 1.0, fy_px: 1.0, cx_px: 0.0, cy_px: 0.0 };
    let lens = Lens { intrinsics, mapping: Mapping::Table(RadiusTable::new(&points).unwrap()) };
    let mut tried = 0;
    for step in 0..990_u32 {
        let angle_rad = (0.1 * f64::from(step)).to_radians();
        let radius = lens.project(bearing(angle_rad, 0.7)).unwrap().length();
        // The last stretch has a one-sided slope: ten times the error.
        let most = if step < 900 { 1e-4 } else { 1e-3 };
        assert!((radius - 2.0 * libm::tan(0.5 * angle_rad)).abs() < most, "{step}: {radius}");
        tried += 1;
    }
    assert_eq!(tried, 990);
}

#[test]
fn parts_and_bins_of_a_picture_see_the_same_bearings() {
    let mut tried = 0;
    for lens in lenses() {
        let part = lens.of_part(DVec2::new(100.5, 60.5), 2.0);
        for position_px in [DVec2::new(20.0, 40.0), DVec2::new(70.25, 90.5), DVec2::new(77.2, 94.8)] {
            let (Some(own), Some(whole)) =
                (part.unproject(position_px), lens.unproject(position_px * 2.0 + DVec2::new(100.5, 60.5)))
            else {
                continue;
            };
            // A few roundings of positions of some hundred pixels over the focal length.
            assert!((own - whole).length() < 1e-11, "{lens:?} {position_px}");
            tried += 1;
        }
    }
    assert!(tried > 400, "{tried}");
}
