//! Lenses from their keys to photons: what each key does to a rendered picture.

#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::num::index;
use sensel::optics::lens::{Kb4, Lens, Mapping};
use sensel::optics::{
    Aperture, Camera, ImagePath, Mosaic, Psf, Pupil, RollOff, Sampling, Shading, expose, photon_bounds, render,
};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::scene::mesh::{Material, Mesh};
use sensel::scene::{Illuminant, LitScene, Scene, target};
use sensel::units::{Size, Span};

const SIZE: Size = Size { width_px: 96, height_px: 72 };
const SHARP: Psf = Psf { diffraction: false, f_number: 2.0, defocus_um: 0.0, aberration_um: 0.0 };
const IDEAL: ImagePath =
    ImagePath { magnification: [1.0; 4], psf: SHARP, optical_crosstalk: 0.0, electrical_crosstalk: [0.0; 4] };

fn aperture() -> Aperture {
    Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens }
}

fn camera(lens: Lens, roll_off: RollOff) -> Camera {
    Camera::new(lens, SIZE, Pose::IDENTITY, aperture(), 3.0, roll_off).unwrap()
}

fn fisheye() -> Lens {
    let kb4 = Kb4::new([0.003_482_389_4, 0.000_715_034_8, -0.002_053_236_1, 0.000_202_936_7]);
    Lens::spanning(SIZE, Mapping::Kb4(kb4), 190.0_f64.to_radians()).unwrap()
}

fn seen(scene: &LitScene, camera: &Camera, samples_per_pixel: u32) -> Plane<f32> {
    let shutter = vec![Span { start_s: 0.0, end_s: 0.01 }; 72];
    let sampling = Sampling::fixed(samples_per_pixel, DrawKey::root(1));
    expose(scene, camera, &shutter, &|_| Pose::IDENTITY, sampling).photons
}

/// A wall before the camera, black to the left of a line and white to its right: the line leaves the vertical by one pixel in `rows`.
fn edge(x_m: f32, slope: f32) -> LitScene {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material::plain("black", [0.2; 3]));
    mesh.materials.push(Material::plain("white", [0.8; 3]));
    let (top, bottom) = (x_m + 2.0 * slope, x_m - 2.0 * slope);
    mesh.append_quad(0, [[-9.0, -2.0, 1.0], [bottom, -2.0, 1.0], [top, 2.0, 1.0], [-9.0, 2.0, 1.0]], [1.0, 1.0]);
    mesh.append_quad(1, [[bottom, -2.0, 1.0], [9.0, -2.0, 1.0], [9.0, 2.0, 1.0], [top, 2.0, 1.0]], [1.0, 1.0]);
    Scene::new("edge", mesh, [0.0; 4]).unwrap().evenly_lit(1000.0, Illuminant::E)
}

#[test]
fn a_fisheye_of_190_degrees_sees_what_is_behind_it() {
    let scene = target::flat(0.5).unwrap().evenly_lit(100.0, Illuminant::D65);
    let even = camera(fisheye(), RollOff::None);
    let photons = seen(&scene, &even, 4);
    let axis = photons.at(48, 36);
    assert!(axis > 0.0);
    // Even light from everywhere: the same sum of equal samples in each pixel, whatever it looks at.
    assert!(photons.values().iter().all(|&value| (value / axis - 1.0).abs() < 1e-5));
    let behind = fisheye().unproject(DVec2::new(0.0, 36.0)).unwrap();
    assert!(behind.z < -0.05, "{behind}");

    // With an image circle of 95 degrees the corners, which look at 130, are black, and no number is lost.
    let shading = Shading::of(RollOff::SolidAngle, &fisheye()).vignetted(80.0_f64.to_radians(), 95.0_f64.to_radians());
    let circled = camera(fisheye(), RollOff::None).with_shading(shading);
    let photons = seen(&scene, &circled, 4);
    let (mut black, mut lit) = (0, 0);
    for y in 0..72_u32 {
        for x in 0..96_u32 {
            let bearing = fisheye().unproject(DVec2::new(x.into(), y.into())).unwrap();
            let angle_rad = libm::acos(bearing.z);
            let share = f64::from(photons.at(index(x), index(y)) / axis);
            if angle_rad > 97.0_f64.to_radians() {
                assert_eq!(share, 0.0, "{x} {y}");
                black += 1;
            } else if angle_rad < 78.0_f64.to_radians() && angle_rad > 0.1 {
                // The solid angle of a pixel: sin(a) / (r r'), by a difference of radii here. Over a pixel (2 degrees) the share
                // is not even; its second derivative (below 1) times 1/24 of the pixel's angle squared is 5e-5; four samples err
                // by a part of its slope times the pixel: 0.5 %.
                let radius = |angle_rad: f64| {
                    let (sine, cosine) = libm::sincos(angle_rad);
                    fisheye().project(DVec3::new(sine, 0.0, cosine)).unwrap().x - 47.5
                };
                let slope = |angle_rad: f64| (radius(angle_rad + 1e-4) - radius(angle_rad - 1e-4)) / 2e-4;
                let focal = fisheye().focal_px();
                let expected = focal * focal * libm::sin(angle_rad) / (radius(angle_rad) * slope(angle_rad));
                assert!((share / expected - 1.0).abs() < 0.01, "{x} {y}: {share} {expected}");
                lit += 1;
            }
        }
    }
    assert!(black > 300 && lit > 3000, "{black} {lit}");
    let [least, most] = photon_bounds(&scene, &circled, 0.01);
    assert!(photons.values().iter().all(|&value| f64::from(value) >= least && f64::from(value) <= most * (1.0 + 1e-6)));
}

/// Column of the edge: where the bright side begins, were each row a step. Kernels that are even keep it.
fn edge_px(photons: &Plane<f32>) -> f64 {
    let mean = |columns: std::ops::Range<usize>| {
        let count = f64::from(u32::try_from(columns.len() * 40).unwrap());
        let rows = 16..56;
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| f64::from(photons.at(x, y))).sum::<f64>()
            / count
    };
    let (dark, bright) = (mean(20..40), mean(76..90));
    90.0 - 70.0 * (mean(20..90) - dark) / (bright - dark)
}

#[test]
fn bands_part_at_an_edge_by_the_stated_lateral_aberration() {
    let lens = Lens::pinhole(SIZE, 1.2);
    // 14 px right of the middle.
    let scene = edge(14.0 / 70.2, 0.0);
    let of_band = |band: usize, lateral: [f64; 4]| {
        let mut passed = [0.0; 4];
        passed[band] = 1.0;
        let (mosaic, _) = Mosaic::parse("mono", &[('M', passed)]).unwrap();
        let path = ImagePath { magnification: lateral, ..IDEAL };
        let camera = camera(lens, RollOff::None).with_mosaic(mosaic).with_image_path(&path).unwrap();
        edge_px(&seen(&scene, &camera, 256))
    };
    let lateral = [1.02, 1.0, 0.99, 1.02];
    let green_px = of_band(1, lateral);
    let aside_px = green_px - 48.0;
    assert!((aside_px - 14.0 * lens.focal_px() / 70.2).abs() < 0.05, "{green_px}");
    for (band, factor) in [(0, 0.02), (2, -0.01)] {
        // 256 samples locate an edge within a pixel to 1/256 at worst, over 40 rows with their own patterns to a sixth of that.
        let shift_px = of_band(band, lateral) - green_px;
        assert!((shift_px - factor * aside_px).abs() < 0.003, "band {band}: {shift_px} for {}", factor * aside_px);
        assert!((of_band(band, [1.0; 4]) - green_px).abs() < 0.003, "without aberration band {band} stays");
    }
}

/// Modulation of a slanted edge at a frequency: the transform of the derivative of its profile, binned at an eighth of a pixel
/// across the edge as ISO 12233 has it.
fn modulation(photons: &Plane<f32>, edge_at: &dyn Fn(usize) -> f64, cycles_per_px: f64) -> f64 {
    let (mut sums, mut counts) = (vec![0.0; 400], vec![0.0; 400]);
    for y in 16..56 {
        for x in 0..96_u32 {
            let across = f64::from(x) - edge_at(y);
            let bin = (across * 8.0 + 200.0).floor();
            if (0.0..400.0).contains(&bin) {
                let bin = usize::try_from(sensel::num::i64_truncated(bin)).unwrap();
                sums[bin] += f64::from(photons.at(usize::try_from(x).unwrap(), y));
                counts[bin] += 1.0;
            }
        }
    }
    let profile: Vec<f64> = sums.iter().zip(&counts).map(|(sum, count): (&f64, &f64)| sum / count).collect();
    let (mut re, mut im, mut all) = (0.0, 0.0, 0.0);
    for (bin, pair) in (0_u32..).zip(profile.windows(2)) {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * cycles_per_px * f64::from(bin) / 8.0);
        (re, im, all) = (re + (pair[1] - pair[0]) * cosine, im + (pair[1] - pair[0]) * sine, all + pair[1] - pair[0]);
    }
    libm::hypot(re, im) / all
}

#[test]
fn a_slanted_edge_has_the_modulation_of_lens_times_pixel() {
    let lens = Lens::pinhole(SIZE, 1.2);
    // Ten rows to a pixel: 40 rows pass four whole pixels, so the bins are filled alike.
    let scene = edge(0.02, 0.1);
    let edge_at = |y: usize| {
        let row_m = (35.5 - f64::from(u32::try_from(y).unwrap())) / lens.focal_px();
        // Rows count downwards, as the camera's y does; the wall's slope is in that frame.
        47.5 + lens.focal_px() * (0.02 - 0.1 * row_m)
    };
    let green = Mosaic::parse("mono", &[('M', [0.0, 1.0, 0.0, 0.0])]).unwrap().0;
    let of = |psf: Psf| {
        let camera = camera(lens, RollOff::None).with_mosaic(green.clone());
        seen(&scene, &camera.with_image_path(&ImagePath { psf, ..IDEAL }).unwrap(), 256)
    };
    let sharp = of(SHARP);
    let mut tried = 0;
    for psf in [
        Psf { diffraction: true, f_number: 2.0, ..SHARP },
        Psf { diffraction: true, f_number: 5.6, ..SHARP },
        Psf { diffraction: true, f_number: 2.8, defocus_um: 4.0, aberration_um: 0.5 },
    ] {
        let blurred = of(psf);
        for cycles_per_px in [0.05, 0.1, 0.2, 0.3, 0.4] {
            let (own, whole) =
                (modulation(&sharp, &edge_at, cycles_per_px), modulation(&blurred, &edge_at, cycles_per_px));
            // The slant of 1 in 10 stretches frequencies across the edge by 0.5 %; 256 samples per pixel leave 0.5 % of noise
            // beside an edge of 1.
            let pixel = libm::sin(std::f64::consts::PI * cycles_per_px) / (std::f64::consts::PI * cycles_per_px);
            let bins =
                libm::sin(std::f64::consts::PI * cycles_per_px / 8.0) / (std::f64::consts::PI * cycles_per_px / 8.0);
            assert!((own - pixel * bins).abs() < 0.01, "pixel at {cycles_per_px}: {own} {}", pixel * bins);
            let expected = psf.modulation(cycles_per_px / 3.0, 0.55) * pixel * bins;
            println!("{psf:?} at {cycles_per_px}: {whole:.4}, expected {expected:.4}");
            assert!((whole - expected).abs() < 0.01, "{psf:?} at {cycles_per_px}: {whole} {expected}");
            tried += 1;
        }
    }
    assert_eq!(tried, 15);
}

#[test]
fn an_ideal_path_keeps_the_bits_of_the_render() {
    let scene = edge(0.02, 0.1);
    let camera = camera(Lens::pinhole(SIZE, 1.2), RollOff::Cos4).with_image_path(&IDEAL).unwrap();
    let shutter = vec![Span { start_s: 0.0, end_s: 0.01 }; 72];
    let sampling = Sampling::fixed(4, DrawKey::root(1));
    let rendered = render(&scene, &camera, &shutter, &|_| Pose::IDENTITY, sampling);
    let exposed = expose(&scene, &camera, &shutter, &|_| Pose::IDENTITY, sampling);
    assert_eq!((rendered.photons, rendered.rays), (exposed.photons, exposed.rays));
    assert_eq!(rendered.render_variance_ratio.to_bits(), exposed.render_variance_ratio.to_bits());
}

#[test]
fn a_mosaic_under_a_blurring_lens_keeps_its_colours_and_its_light() {
    let filters = [('R', [0.5, 0.1, 0.05, 0.3]), ('G', [0.05, 0.6, 0.1, 0.25]), ('B', [0.02, 0.1, 0.45, 0.2])];
    let (mosaic, _) = Mosaic::parse("RGGB", &filters).unwrap();
    let scene = target::flat(0.5).unwrap().evenly_lit(100.0, Illuminant::D65);
    let plain = camera(Lens::pinhole(SIZE, 1.2), RollOff::None).with_mosaic(mosaic);
    let psf = Psf { diffraction: true, f_number: 4.0, defocus_um: 5.0, aberration_um: 0.5 };
    let path = ImagePath { magnification: [1.002, 1.0, 0.999, 1.003], psf, ..IDEAL };
    let blurred = plain.clone().with_image_path(&path).unwrap();
    let (before, after) = (seen(&scene, &plain, 4), seen(&scene, &blurred, 4));
    // Even light stays even under any kernel: a few roundings of f32.
    for (before, after) in before.values().iter().zip(after.values()) {
        assert!((after / before - 1.0).abs() < 1e-6, "{before} {after}");
    }
    // Crosstalk moves light from the bright filters to the dark ones, and loses none of it over the pattern.
    let path = ImagePath { optical_crosstalk: 0.1, electrical_crosstalk: [0.05, 0.05, 0.05, 0.2], ..path };
    let shared = seen(&scene, &plain.clone().with_image_path(&path).unwrap(), 4);
    let mean = |plane: &Plane<f32>, x: usize, y: usize| f64::from(plane.at(20 + x, 20 + y));
    let of = |plane: &Plane<f32>| [mean(plane, 0, 0), mean(plane, 1, 0), mean(plane, 0, 1), mean(plane, 1, 1)];
    let (whole, moved) = (of(&after), of(&shared));
    assert!((moved.iter().sum::<f64>() / whole.iter().sum::<f64>() - 1.0).abs() < 1e-6);
    assert!(moved[1] < whole[1] && moved[0] + moved[3] > whole[0] + whole[3], "{whole:?} {moved:?}");
}

fn lens_of(text: &str) -> Result<Lens, String> {
    let resolved = Resolved::from_layers("test.toml", text, &[]).map_err(|error| error.to_string())?;
    let sensor = sensel::run::SensorSetup::new(&resolved).map_err(|error| error.to_string());
    resolved.scenario.lens().map_err(|error| error.to_string()).and_then(|lens| sensor.map(|_| lens))
}

#[test]
fn presets_and_keys_make_the_lenses_that_they_say() {
    for (name, half_deg) in [("kb4_120", 60.0), ("kb4_190", 95.0), ("double_sphere_195", 97.5), ("pinhole_90", 45.0)] {
        let lens = lens_of(&format!("[optics]\npreset = \"{name}\"\n")).unwrap();
        let edge = lens.unproject(DVec2::new(-0.5, lens.intrinsics.cy_px)).unwrap();
        assert!((libm::acos(edge.z).to_degrees() - half_deg).abs() < 1e-9, "{name}: {edge}");
    }
    let given = "preset = \"kb4_190\"\nfx_px = 190.978\nfy_px = 190.973\ncx_px = 254.932\n";
    let lens = lens_of(&format!("[optics]\n{given}")).unwrap();
    assert_eq!((lens.intrinsics.fx_px, lens.intrinsics.cx_px, lens.intrinsics.cy_px), (190.978, 254.932, 239.5));
    let eucm = lens_of("[optics]\nmodel = \"eucm\"\nalpha = 0.6\nbeta = 1.1\nhorizontal_fov_deg = 150.0\n").unwrap();
    assert!(matches!(eucm.mapping, Mapping::Eucm(_)));
    let table = "[optics]\nmodel = \"table\"\ntable = [[30.0, 0.5], [60.0, 0.9], [80.0, 1.0]]\nroll_off = \"table\"\n\
                 roll_off_table = [[0.0, 1.0], [80.0, 0.4]]\n";
    let lens = lens_of(table).unwrap();
    let at = lens.project(DVec3::new(libm::sin(30.0_f64.to_radians()), 0.0, libm::cos(30.0_f64.to_radians()))).unwrap();
    // 0.5 mm in pixels of the default sensor.
    assert!((at.x - lens.intrinsics.cx_px - 0.5 * lens.intrinsics.fx_px).abs() < 1e-9);
}

#[test]
fn keys_that_contradict_are_refused_with_what_would_do() {
    let mut tried = 0;
    for (text, words) in [
        ("k1 = -0.1", "optics.model = radtan or kb4"),
        ("model = \"kb4\"\np1 = 0.1", "optics.model = radtan"),
        ("model = \"radtan\"\nk1 = -3.0", "nearer to 0"),
        ("model = \"kb4\"\nhorizontal_fov_deg = 360.0", "ends below 360.000 degrees"),
        ("model = \"kb4\"\nk1 = -0.1\nhorizontal_fov_deg = 220.0", "ends below 209.215 degrees"),
        ("horizontal_fov_deg = 180.0", "1 to 170"),
        ("horizontal_fov_deg = 90.0\nfx_px = 100.0\nfy_px = 100.0", "this, or fx_px and fy_px"),
        ("fx_px = 100.0", "optics.fy_px"),
        ("cx_px = 1000.0", "-0.5 to 639.5"),
        ("model = \"double_sphere\"\nxi = 1.5", "-0.999 to 0.999"),
        ("model = \"table\"", "1 to 64 points"),
        ("model = \"table\"\ntable = [[10.0, 1.0], [20.0, 0.5]]", "both rise"),
        ("table = [[10.0, 1.0]]", "optics.model = table"),
        ("roll_off_table = [[0.0, 1.0]]", "optics.roll_off = \"table\""),
    ] {
        let error = lens_of(&format!("[optics]\n{text}\n")).unwrap_err();
        assert!(error.contains(words) && error.contains("optics."), "{text}: {error}");
        tried += 1;
    }
    assert_eq!(tried, 14);
    let fitted = |text: &str| {
        let resolved = Resolved::from_layers("test.toml", &format!("[optics]\n{text}\n"), &[]).unwrap();
        let lens = resolved.scenario.lens().unwrap();
        let (aperture, roll_off) = resolved.scenario.aperture().unwrap();
        let size = resolved.scenario.size().unwrap();
        let camera = Camera::new(lens, size, Pose::IDENTITY, aperture, 3.0, roll_off).unwrap();
        resolved.scenario.fitted(camera).map_err(|error| error.to_string())
    };
    for (text, words) in [
        ("preset = \"kb4_190\"\nroll_off = \"cos4\"", "solid_angle or table"),
        ("vignetting_deg = [40.0, 30.0]", "two rising angles"),
        ("lateral_ca = [1.0]", "[red, blue]"),
        ("lateral_ca = [100.0, 0.0]", "-50 to 50"),
        ("defocus_um = -1.0", "0 to 1000"),
        ("roll_off = \"table\"\nroll_off_table = [[0.0, 1.0]]", "two or more points"),
    ] {
        let error = fitted(text).unwrap_err();
        assert!(error.contains(words), "{text}: {error}");
    }
    assert!(fitted("preset = \"kb4_190\"").is_ok());
    assert!(fitted("diffraction = true\ndefocus_um = 3.0\nlateral_ca = [1.0, -1.0]").is_ok());
}
