//! Hard cases of lenses, roll-off and point spread, against their published formulas in double-double.

use glam::{DVec2, DVec3};
use sensel::num::{f64_from_usize, greater};
use sensel::optics::lens::{DoubleSphere, Eucm, Intrinsics, Kb4, Lens, Mapping, Radtan};
use sensel::optics::{Aperture, Camera, Psf, Pupil, RollOff};
use sensel::pose::Pose;
use sensel::units::Size;

use super::double_double::{Dd, PI, dd, dot, vector};
use super::table::{Case, Chance, Stage};

pub fn run(stage: &mut Stage) {
    wide(stage);
    folding(stage);
    near_the_centre(stage);
    roll_off(stage);
    diffraction(stage);
    defocus(stage);
    kernels(stage);
}

const INTRINSICS: Intrinsics = Intrinsics { fx_px: 310.7, fy_px: 309.2, cx_px: 319.4, cy_px: 241.8 };

fn lens(mapping: Mapping) -> Lens {
    Lens { intrinsics: INTRINSICS, mapping }
}

/// Where a point lands by the published formula.
fn exact_position(mapping: &Mapping, point: DVec3) -> [Dd; 2] {
    let p = vector(point.to_array());
    let [x, y, z] = p;
    let aside2 = x * x + y * y;
    let plane: [Dd; 2] = match mapping {
        Mapping::Pinhole | Mapping::Table(_) => [x / z, y / z],
        Mapping::Radtan(Radtan { k1, k2, p1, p2, k3 }) => {
            let (x, y) = (x / z, y / z);
            let s = x * x + y * y;
            let radial = dd(1.0) + s * (dd(*k1) + s * (dd(*k2) + s * dd(*k3)));
            let cross = dd(2.0) * x * y;
            [
                x * radial + dd(*p1) * cross + dd(*p2) * (s + dd(2.0) * x * x),
                y * radial + dd(*p1) * (s + dd(2.0) * y * y) + dd(*p2) * cross,
            ]
        }
        Mapping::Kb4(kb4) => {
            let aside = aside2.sqrt();
            let angle = Dd::atan2(aside, z);
            let s = angle * angle;
            let series = kb4.coefficients().iter().rev().fold(dd(0.0), |sum, k| sum * s + dd(*k)) * s + dd(1.0);
            if aside.high == 0.0 { [dd(0.0); 2] } else { [x / aside * angle * series, y / aside * angle * series] }
        }
        Mapping::DoubleSphere(DoubleSphere { xi, alpha }) => {
            let z = dd(*xi) * dot(p, p).sqrt() + z;
            let depth = dd(*alpha) * (aside2 + z * z).sqrt() + (dd(1.0) - dd(*alpha)) * z;
            [x / depth, y / depth]
        }
        Mapping::Eucm(Eucm { alpha, beta }) => {
            let depth = dd(*alpha) * (dd(*beta) * aside2 + z * z).sqrt() + (dd(1.0) - dd(*alpha)) * z;
            [x / depth, y / depth]
        }
    };
    let Intrinsics { fx_px, fy_px, cx_px, cy_px } = INTRINSICS;
    [plane[0] * dd(fx_px) + dd(cx_px), plane[1] * dd(fy_px) + dd(cy_px)]
}

/// A projection whose every rounding is one of its bearing's or of its position's: 32 of them, 2^-53 each, of the position and of what a
/// whole bearing (times the Jacobian) moves it. That is backward stability; the limit of a lens, where the Jacobian grows, needs it.
fn check(case: &mut Case, side: usize, lens: &Lens, point: DVec3) {
    let Some((found, jacobian)) = lens.project_with_jacobian(point) else {
        case.hold(side, false, || format!("{point} is not seen by {:?}", lens.mapping));
        return;
    };
    let exact = exact_position(&lens.mapping, point);
    let error = greater(exact[0].miss(found.x), exact[1].miss(found.y));
    let slope = jacobian.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let bound = 32.0 * 0.5 * f64::EPSILON * (found.length() + INTRINSICS.cx_px + slope * point.length());
    case.see(side, error, bound, || format!("{point} by {:?}: {found}", lens.mapping));
}

/// A bearing at an angle off the axis, and the angle of its turn.
fn bearing(angle_rad: f64, chance: &mut Chance) -> DVec3 {
    let (sine, cosine) = libm::sincos(angle_rad);
    let (across, along) = libm::sincos(chance.between(0.0, std::f64::consts::TAU));
    DVec3::new(sine * along, sine * across, cosine) * chance.decade(1e-3, 1e3)
}

/// Up to 180 degrees of field and beyond, to the rim of each model within 1e-12, and past it.
fn wide(stage: &mut Stage) {
    let lenses = [
        Mapping::Kb4(Kb4::new([-0.013, 0.004, -0.003, 0.0005])),
        Mapping::Kb4(Kb4::new([0.0; 4])),
        Mapping::DoubleSphere(DoubleSphere { xi: -0.2, alpha: 0.59 }),
        Mapping::DoubleSphere(DoubleSphere { xi: 0.3, alpha: 0.45 }),
        Mapping::Eucm(Eucm { alpha: 0.62, beta: 1.1 }),
        Mapping::Eucm(Eucm { alpha: 0.4, beta: 0.8 }),
    ]
    .map(lens);
    let name = "KB4, double sphere and EUCM at 180 degrees of field and at their limits";
    let sides = &["before 90 degrees", "around 90", "beyond 90", "1e-2 to 1e-12 inside the limit", "beyond it"];
    let case = stage.case(name, "published formula in double-double", "px", sides);
    let mut chance = Chance::new(701);
    let quarter = std::f64::consts::FRAC_PI_2;
    for lens in &lenses {
        let most_rad = lens.field_angle_max_rad();
        for _ in 0..150 {
            let before = bearing(chance.between(0.0, quarter), &mut chance);
            check(case, 0, lens, before);
            let sign = if chance.below(2) == 0 { -1.0 } else { 1.0 };
            if most_rad > quarter + 0.1 {
                let around = bearing(quarter + sign * chance.decade(1e-15, 1e-2), &mut chance);
                check(case, 1, lens, around);
                let beyond = bearing(chance.between(quarter, most_rad - 1e-2), &mut chance);
                check(case, 2, lens, beyond);
            }
            let near = bearing(most_rad - chance.decade(1e-12, 1e-2), &mut chance);
            check(case, 3, lens, near);
            if most_rad < std::f64::consts::PI - 0.1 {
                let past = bearing(most_rad + chance.decade(1e-12, 0.1), &mut chance);
                case.hold(4, lens.project(past).is_none(), || format!("{past} is seen by {:?}", lens.mapping));
            }
        }
    }
}

/// Radial-tangential lenses end where their polynomial folds over: inside they follow it, beyond they show nothing. Half of them has the
/// tangential terms of a real lens.
fn folding(stage: &mut Stage) {
    let case = stage.case(
        "radial-tangential lens at the end of its monotone range",
        "published formula in double-double",
        "px",
        &["inside", "1e-3 to 1e-12 inside", "beyond", "behind the camera"],
    );
    let mut chance = Chance::new(702);
    for number in 0..400 {
        let tangential = if number % 2 == 0 { 0.0 } else { 1e-3 };
        let radtan = Radtan {
            k1: chance.between(-0.4, -0.1),
            k2: chance.between(-0.05, 0.05),
            p1: tangential * chance.between(-1.0, 1.0),
            p2: tangential * chance.between(-1.0, 1.0),
            k3: chance.between(-0.01, 0.0),
        };
        let (lens, radius_max) = (lens(Mapping::Radtan(radtan)), radtan.radius_max());
        let mut at = |radius: f64| {
            let (y, x) = libm::sincos(chance.between(0.0, std::f64::consts::TAU));
            DVec3::new(radius * x, radius * y, 1.0)
        };
        let inside = at(radius_max * f64::from(number) / 401.0);
        check(case, 0, &lens, inside);
        let gap = libm::pow(10.0, -3.0 - 9.0 * f64::from(number) / 400.0);
        let near = at(radius_max * (1.0 - gap));
        check(case, 1, &lens, near);
        let beyond = at(radius_max * (1.0 + gap));
        case.hold(2, lens.project(beyond).is_none(), || format!("{beyond} by {radtan:?}"));
        for z in [0.0, -1e-300, -1.0] {
            let behind = DVec3::new(inside.x, inside.y, z);
            case.hold(3, lens.project(behind).is_none(), || format!("{behind} by {radtan:?}"));
        }
    }
}

/// Where the position lands by the exact formula is d + r of the position asked for; the bearing is right to d over the lens's slope.
/// Rounding: the position less the principal point rounds by 2^-53 of 320 px, all else by 24 * 2^-53 of the offset.
fn near_the_centre(stage: &mut Stage) {
    let case = stage.case(
        "unprojection from 1e-13 to 10 px off the principal point",
        "published formula of what comes back",
        "px",
        &["under 1e-6 px", "over", "principal point"],
    );
    let mut chance = Chance::new(703);
    let lenses = [
        Mapping::Pinhole,
        Mapping::Radtan(Radtan { k1: -0.28, k2: 0.07, p1: 2e-4, p2: 2e-5, k3: 0.0 }),
        Mapping::Kb4(Kb4::new([-0.013, 0.004, -0.003, 0.0005])),
        Mapping::DoubleSphere(DoubleSphere { xi: -0.2, alpha: 0.59 }),
        Mapping::Eucm(Eucm { alpha: 0.62, beta: 1.1 }),
    ]
    .map(lens);
    let centre = DVec2::new(INTRINSICS.cx_px, INTRINSICS.cy_px);
    for lens in &lenses {
        let axis = lens.unproject(centre);
        case.hold(2, axis == Some(DVec3::Z), || format!("{:?}: {axis:?}", lens.mapping));
        for _ in 0..300 {
            let offset_px = chance.decade(1e-13, 10.0);
            let (y, x) = libm::sincos(chance.between(0.0, std::f64::consts::TAU));
            let position_px = centre + offset_px * DVec2::new(x, y);
            let Some(found) = lens.unproject(position_px) else { continue };
            let exact = exact_position(&lens.mapping, found);
            let error = greater(exact[0].miss(position_px.x), exact[1].miss(position_px.y));
            // Radtan's iteration ends at 1e-12 of the plane and takes one more step, which squares that.
            let bound = 0.5 * f64::EPSILON * (320.0 + 24.0 * offset_px);
            case.see(usize::from(offset_px >= 1e-6), error, bound, || {
                format!("{position_px} by {:?}: {found}", lens.mapping)
            });
        }
    }
}

/// A camera of one pixel far off the axis: its corners' cosines are rounded to f32 (2^-24 relative), which the fourth power takes four
/// times, and three products round: 7 * 2^-24 of the share. The bounds are those of the corners nearest to and farthest from the axis.
fn roll_off(stage: &mut Stage) {
    let sides = &["up to 60 degrees", "60 to 89.99", "beyond 90"];
    let case = stage.case("cos^4 law towards the camera's plane", "fourth power in double-double", "relative", sides);
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    let size = Size { width_px: 1, height_px: 1 };
    let mut chance = Chance::new(704);
    let share_at = |case: &mut Case, lens: Lens| {
        let camera = Camera::new(lens, size, Pose::IDENTITY, aperture, 3.0, RollOff::Cos4).unwrap();
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
        let cosines = corners.map(|(x, y)| lens.unproject(DVec2::new(x, y)).unwrap().z);
        let least = cosines.iter().fold(1.0, |least, &z| sensel::num::lesser(least, z));
        let most = cosines.iter().fold(-1.0, |most, &z| greater(most, z));
        for (found, cosine) in camera.roll_off_bounds().into_iter().zip([least, most]) {
            let exact = if cosine > 0.0 { dd(cosine) * dd(cosine) * dd(cosine) * dd(cosine) } else { dd(0.0) };
            let side = if cosine > 0.5 { 0 } else { 1 + usize::from(cosine <= 0.0) };
            let error = if exact.high == 0.0 { found.abs() } else { exact.miss(found) / exact.high };
            case.see(side, error, 7.0 / 16_777_216.0, || format!("cosine {cosine}: {found}"));
        }
    };
    for _ in 0..400 {
        let offset_px = chance.decade(1.0, 1e6);
        let intrinsics = Intrinsics { fx_px: 100.0, fy_px: 100.0, cx_px: offset_px, cy_px: 3.0 };
        share_at(case, Lens { intrinsics, mapping: Mapping::Pinhole });
        let intrinsics = Intrinsics { cx_px: chance.between(160.0, 300.0), ..intrinsics };
        share_at(case, Lens { intrinsics, mapping: Mapping::Kb4(Kb4::new([0.0; 4])) });
    }
}

/// 2 / pi (acos s - s sqrt(1 - s^2)): both parts are at most pi / 2 and each rounds four times: 8 * 2^-53 * (2 / pi) * (pi / 2),
/// absolute. At the cut-off they cancel, to an error that is as small, and beyond it there is nothing.
fn diffraction(stage: &mut Stage) {
    let case = stage.case(
        "diffraction limit from frequency 0 to the cut-off",
        "closed form in double-double",
        "modulation",
        &["low", "1e-1 to 1e-15 under the cut-off", "cut-off and beyond"],
    );
    let mut chance = Chance::new(705);
    let psf = Psf { diffraction: true, f_number: 4.0, defocus_um: 0.0, aberration_um: 0.0 };
    for _ in 0..1000 {
        let low = chance.decade(1e-12, 0.9);
        let near = 1.0 - chance.decade(1e-15, 0.1);
        for (side, shift) in [(0, low), (1, near)] {
            // At a wavelength of 1/4 um and f/4 the shift is the frequency itself, exactly.
            let found = psf.modulation(shift, 0.25);
            let rest = (dd(1.0) - dd(shift) * dd(shift)).sqrt();
            let exact = dd(2.0) / PI * (Dd::atan2(rest, dd(shift)) - dd(shift) * rest);
            case.see(side, exact.miss(found), 4.0 * f64::EPSILON, || format!("shift {shift}: {found}"));
        }
        let beyond = psf.modulation(1.0 + low, 0.25);
        case.see(2, beyond.abs(), 0.0, || format!("shift {}: {beyond}", 1.0 + low));
    }
    case.see(2, psf.modulation(1.0, 0.25).abs(), 0.0, || "at the cut-off".to_owned());
}

/// J1(x) 2 / x by its series, which double-double carries to x of 40: terms reach e^40 / 40 = 6e15, of 106 bits.
fn disc(x: f64) -> Dd {
    let quarter = dd(0.25) * dd(x) * dd(x);
    let (mut term, mut sum) = (dd(1.0), dd(1.0));
    for k in 1..=120_u32 {
        term = -term * quarter / dd(f64::from(k) * f64::from(k + 1));
        sum = sum + term;
    }
    sum
}

/// A pupil in focus is a sharp lens, and one nearly in focus nearly so: the modulation is even in the defocus, 1 - x^2 / 8. Simpson's rule
/// over a smooth even periodic integrand is exact to rounding: some 200 terms of weight 4/3 and width, of at most 1, sum to 1: their
/// roundings, 2^-53 each of at most 1 in all, and that of the phase (x of 40, four roundings): (200 + 160) * 2^-53 = 4e-14.
fn defocus(stage: &mut Stage) {
    let case = stage.case(
        "defocus from none to 13 cycles of its disc",
        "Bessel series in double-double",
        "modulation",
        &["in focus", "under 1e-3 of phase", "over"],
    );
    let mut chance = Chance::new(706);
    for number in 0..1500 {
        let defocus_um = if number % 10 == 0 { 0.0 } else { chance.decade(1e-9, 12.0) };
        let cycles_per_um = chance.between(0.01, 1.0);
        let psf = Psf { diffraction: false, f_number: 2.0, defocus_um, aberration_um: 0.0 };
        let found = psf.modulation(cycles_per_um, 0.55);
        // The phase as the lens rounds it.
        let phase = std::f64::consts::PI * defocus_um * cycles_per_um;
        let side = if defocus_um == 0.0 { 0 } else { 1 + usize::from(phase > 1e-3) };
        case.see(side, disc(phase).miss(found), 4e-14, || format!("{defocus_um} um at {cycles_per_um}: {found}"));
    }
}

/// A kernel keeps the light: its values sum to 1 within their own roundings, (2 r + 1)^2 of 2^-53 of the sum of their sizes (below 2). A
/// sigma far below a pixel leaves the middle alone: exp(-2 pi^2 s^2 f^2) falls by less than 10 s^2 over the kernel's frequencies, each
/// axis.
fn kernels(stage: &mut Stage) {
    let case = stage.case(
        "kernels of a sigma from 1e-6 to 3 pixels",
        "sum of 1; identity",
        "share",
        &["sum", "middle, under 0.01 px"],
    );
    let mut chance = Chance::new(707);
    for number in 0..60 {
        let sigma_px = if number % 2 == 0 { chance.decade(1e-6, 0.01) } else { chance.between(0.01, 3.0) };
        let psf = Psf { diffraction: false, f_number: 2.0, defocus_um: 0.0, aberration_um: 3.0 * sigma_px };
        let kernel = psf.kernel(0.55, 3.0);
        let radius = kernel.radius();
        let mut sum = dd(0.0);
        for n in 0..(radius + 1) * (radius + 1) {
            let (x, y) = (n % (radius + 1), n / (radius + 1));
            let copies = [1.0, 2.0][usize::from(x > 0)] * [1.0, 2.0][usize::from(y > 0)];
            sum = sum + dd(copies) * dd(kernel.at(x, y));
        }
        let side = f64_from_usize(2 * radius + 1);
        let at = || format!("sigma {sigma_px} px, radius {radius}");
        case.see(0, sum.miss(1.0), side * side * f64::EPSILON, at);
        if sigma_px < 0.01 {
            case.see(1, (kernel.at(0, 0) - 1.0).abs(), 10.0 * sigma_px * sigma_px + side * side * f64::EPSILON, at);
        }
    }
}
