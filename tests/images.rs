//! Pictures from elsewhere through their front doors: the photons that they give, and what is refused.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

#[path = "images/refusals.rs"]
mod refusals;
#[path = "images/room.rs"]
mod room;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec2;
use sensel::draw::DrawKey;
use sensel::error::Error;
use sensel::num::{f32_nearest, f64_from_usize, u32_from};
use sensel::optics::lens::{Lens, Mapping, Radtan};
use sensel::optics::{Aperture, Camera, Pupil, RollOff, Sampling, render, resample};
use sensel::picture::{Channel, to_exr};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::scene::images::{Blend, ImageStream, PictureBytes, PictureCamera, StreamParams, pinhole};
use sensel::scene::{Illuminant, target};
use sensel::units::{Size, Span};

/// Files in memory.
#[derive(Clone, Default)]
pub(crate) struct Files(pub BTreeMap<String, Vec<u8>>);

impl PictureBytes for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let found = self.0.get(name).cloned();
        found.ok_or_else(|| Error::Content { file: name.to_owned(), reason: "is not there".to_owned() })
    }
}

pub(crate) const FOV_RAD: f64 = 1.2;

pub(crate) fn size(width_px: u32, height_px: u32) -> Size {
    Size { width_px, height_px }
}

pub(crate) fn camera_with(lens: Lens, size: Size) -> Camera {
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    Camera::new(lens, size, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap()
}

fn camera(size: Size, fov_rad: f64) -> Camera {
    camera_with(Lens::pinhole(size, fov_rad), size)
}

/// A grey OpenEXR picture of a value at each pixel.
fn grey(size: Size, value: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let mut plane = Plane::filled(size, 0.0_f32);
    for y in 0..plane.height_px() {
        for x in 0..plane.width_px() {
            plane.row_mut(y)[x] = f32_nearest(value(x, y));
        }
    }
    to_exr(&[Channel { name: "Y".to_owned(), plane }]).unwrap()
}

/// A stream of these pictures at these times, white at 10 lux of D65.
pub(crate) fn stream(pictures: Vec<Vec<u8>>, times_s: &[f64], camera: PictureCamera, blend: Blend) -> ImageStream {
    let names: Vec<String> = (0..pictures.len()).map(|number| format!("{number:05}")).collect();
    let files = Files(names.iter().cloned().zip(pictures).collect());
    let params = StreamParams {
        files: names,
        depth_files: None,
        depth_per_m: 1000.0,
        times_s: times_s.to_vec(),
        camera,
        transfer: None,
        blend,
        illuminant: Illuminant::D65,
        white_lux: WHITE_LUX,
    };
    let run = Span { start_s: times_s[0], end_s: times_s[times_s.len() - 1] + 1e-9 };
    ImageStream::new(params, run, Arc::new(files), &|_| {}).unwrap()
}

pub(crate) const WHITE_LUX: f64 = 10.0;

/// One picture for all time.
fn still(picture: Vec<u8>, size: Size, fov_rad: f64) -> ImageStream {
    stream(vec![picture], &[0.0], pinhole(size, fov_rad, [0.0; 4]), Blend::Nearest)
}

fn global(rows: u32) -> Vec<Span> {
    vec![Span { start_s: 0.0, end_s: 0.01 }; sensel::num::index(rows)]
}

fn white_png(size: Size) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::GrayImage::from_pixel(size.width_px, size.height_px, image::Luma([255]));
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Photons of a pixel that looks at white for 10 ms.
fn white_photons(camera: &Camera) -> f64 {
    camera.photons_per_lux_s(Illuminant::D65).iter().sum::<f64>() * WHITE_LUX * 0.01
}

#[test]
fn a_white_picture_is_the_white_target_at_any_resolution_and_through_any_lens() {
    let sensor = size(45, 31);
    let mut distorted = Lens::pinhole(sensor, FOV_RAD);
    distorted.mapping = Mapping::Radtan(Radtan { k1: -0.1, p1: 0.01, ..Radtan::default() });
    let mut tried = 0;
    for lens in [Lens::pinhole(sensor, FOV_RAD), distorted] {
        let camera = camera_with(lens, sensor);
        let flat = target::flat(1.0).unwrap().evenly_lit(WHITE_LUX, Illuminant::D65);
        let sampling = Sampling::fixed(4, DrawKey::root(1));
        let expected = render(&flat, &camera, &global(31), &|_| Pose::IDENTITY, sampling).photons;
        for source in [size(7, 5), size(45, 31), size(64, 48), size(400, 300)] {
            let seen = resample(&still(white_png(source), source, 1.6), &camera, &global(31)).unwrap();
            assert!(!seen.render_variance_ratio.is_finite() && seen.rays == 0);
            for (seen, expected) in seen.photons.values().iter().zip(expected.values()) {
                // Some ten roundings of f32 (6e-8 each) in the render, one in the mean over the picture.
                assert!((seen / expected - 1.0).abs() < 1e-6, "{source:?}: {seen} {expected}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 2 * 4 * 45 * 31);
}

#[test]
fn whole_factors_average_their_pixels_and_any_factor_keeps_the_sum() {
    let value = |x: usize, y: usize| f64_from_usize((x * 7 + y * 13 + x * y) % 11);
    let sensor = size(24, 16);
    let camera = camera(sensor, FOV_RAD);
    let of_white = white_photons(&camera);
    let fine = size(96, 64);
    let seen = resample(&still(grey(fine, value), fine, FOV_RAD), &camera, &global(16)).unwrap().photons;
    for y in 0..16 {
        for x in 0..24 {
            let sum: f64 = (0..16).map(|n| value(4 * x + n % 4, 4 * y + n / 4)).sum();
            // Corners are f32 bearings: 6e-8 rad times 70 px of focal length on four edges of 4 px, of values up to 10 in a mean near 5.
            let error = f64::from(seen.at(x, y)) / of_white - sum / 16.0;
            assert!(error.abs() < 10.0 * 4.0 * (6e-8 * 70.0 * 2.0) / 4.0, "{x} {y}: {error:e}");
        }
    }
    let mut tried = 0;
    for source in [size(25, 17), size(37, 23), size(96, 64), size(101, 67), size(240, 160)] {
        // Square pixels of one field of view across: the rows are as many as fit, and what lies above and below is seen as well or black.
        let focal_px = 0.5 * f64::from(source.width_px) / libm::tan(0.5 * FOV_RAD);
        let scale = f64::from(source.width_px) / 24.0;
        let mut source_camera = pinhole(source, FOV_RAD, [0.0; 4]);
        // The axis where the sensor's is: rows of the picture from the sensor's upper edge on.
        source_camera.cy_px = 0.5 * 16.0 * scale - 0.5;
        assert!((source_camera.fx_px - focal_px).abs() < 1e-9);
        let stream = stream(vec![grey(source, value)], &[0.0], source_camera, Blend::Nearest);
        let seen = resample(&stream, &camera, &global(16)).unwrap().photons;
        let got: f64 = seen.values().iter().map(|&photons| f64::from(photons)).sum::<f64>() / of_white * scale * scale;
        let mut sum = 0.0;
        for y in 0..sensel::num::index(source.height_px) {
            let row_share = (16.0 * scale - f64_from_usize(y)).clamp(0.0, 1.0);
            sum += row_share * (0..sensel::num::index(source.width_px)).map(|x| value(x, y)).sum::<f64>();
        }
        // Only the outer edge's corners can err: 6e-8 rad of bearings are 4e-6 of the width, and each photon number has 6e-8.
        assert!((got / sum - 1.0).abs() < 1e-5, "{source:?}: {got} {sum}");
        tried += 1;
    }
    assert_eq!(tried, 5);
}

#[test]
fn a_ramp_stays_a_ramp_across_the_seam_between_averaging_and_interpolation() {
    let sensor = size(40, 30);
    let camera = camera(sensor, 0.8);
    let of_white = white_photons(&camera);
    let (mut tried, mut coarser, mut finer) = (0, 0, 0);
    for width in [14, 30, 57, 60, 61, 62, 63, 64, 66, 90, 130, 250] {
        let source = size(width, width * 3 / 4);
        let seen = resample(&still(grey(source, |x, y| f64_from_usize(3 * x + y)), source, 1.2), &camera, &global(30));
        let seen = seen.unwrap().photons;
        let source_lens = Lens::pinhole(source, 1.2);
        let pixel_px = source_lens.intrinsics.fx_px / camera.lens.intrinsics.fx_px;
        if pixel_px < 1.0 {
            coarser += 1
        } else {
            finer += 1
        }
        for y in 0..30_u32 {
            for x in 0..40_u32 {
                let bearing = camera.lens.unproject(DVec2::new(x.into(), y.into())).unwrap();
                let at = source_lens.project(bearing).unwrap();
                let got = f64::from(seen.at(sensel::num::index(x), sensel::num::index(y))) / of_white;
                // A picture of squares is off the ramp by the squares' own steps, which cancel over whole squares: a footprint of w squares
                // (at least one) keeps at most 1/4 step, (fraction)(1 - fraction)/2 at either end over w, in x and in y.
                let staircase = 0.25 / pixel_px.max(1.0) * 4.0;
                // On whole numbers of squares, one included, the mean is exact but for f32: 6e-8 of values up to 1,000.
                let bound = if pixel_px <= 1.0 { 2e-4 } else { staircase };
                assert!((got - (3.0 * at.x + at.y)).abs() < bound, "{width}: {x} {y} {got} {at}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 12 * 1200);
    assert!(coarser >= 4 && finer >= 4, "{coarser} {finer}");
}

#[test]
fn each_row_integrates_a_step_in_brightness_over_its_own_span() {
    let sensor = size(24, 16);
    let camera = camera(sensor, FOV_RAD);
    let per_s = white_photons(&camera) / 0.01;
    let source = size(48, 32);
    let pictures: Vec<_> = [1.0, 1.0, 5.0, 5.0].iter().map(|&value| grey(source, |_, _| value)).collect();
    let mut tried = 0;
    for blend in [Blend::Linear, Blend::Nearest] {
        let stream = stream(pictures.clone(), &[0.0, 0.010, 0.020, 0.030], pinhole(source, 1.3, [0.0; 4]), blend);
        // Rows of 7 ms that start 1.5 ms apart: before the step, over it, after it.
        let shutter: Vec<Span> = (0..16)
            .map(|row| Span { start_s: 0.0015 * f64::from(row), end_s: 0.0015 * f64::from(row) + 0.0070 })
            .collect();
        let seen = resample(&stream, &camera, &shutter).unwrap().photons;
        let integral = |t_s: f64| match blend {
            Blend::Linear => {
                let rise_s = (t_s - 0.010).clamp(0.0, 0.010);
                t_s + 4.0 * (0.5 * rise_s * rise_s / 0.010 + (t_s - 0.020).max(0.0))
            }
            Blend::Nearest => t_s + 4.0 * (t_s - 0.015).max(0.0),
        };
        for (row, span) in shutter.iter().enumerate() {
            let expected = per_s * (integral(span.end_s) - integral(span.start_s));
            for &photons in seen.row(row) {
                // One rounding of f32, and some of f64.
                assert!((f64::from(photons) / expected - 1.0).abs() < 1e-7, "{blend:?} row {row}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 2 * 16 * 24);
}

#[test]
fn what_lies_outside_the_pictures_is_black_and_stated() {
    let sensor = size(40, 30);
    let camera = camera(sensor, 1.2);
    let source = size(80, 60);
    let narrow = still(white_png(source), source, 0.8);
    let share = sensel::optics::resample::outside_share(&narrow, &camera);
    // A pinhole of the same shape sees the square of the ratio of the tangents; corners are f32.
    let ratio = libm::tan(0.4) / libm::tan(0.6);
    let expected = 1.0 - ratio * ratio;
    assert!((share - expected).abs() < 1e-6, "{share} {expected}");
    let seen = resample(&narrow, &camera, &global(30)).unwrap().photons;
    let of_white = white_photons(&camera);
    let mean = seen.values().iter().map(|&photons| f64::from(photons)).sum::<f64>() / 1200.0 / of_white;
    assert!((mean - (1.0 - expected)).abs() < 1e-6 && seen.at(0, 0) == 0.0, "{mean}");
    let wide = still(white_png(source), source, 1.3);
    assert_eq!(sensel::optics::resample::outside_share(&wide, &camera), 0.0);
}

#[test]
fn bands_and_codes_become_the_light_that_they_stand_for() {
    let source = size(48, 32);
    let sensor = size(24, 16);
    let infrared = camera(sensor, FOV_RAD).with_infrared(1.0);
    let per_lux_s = infrared.photons_per_lux_s(Illuminant::D65);
    let channel = |name: &str, value: f32| Channel { name: name.to_owned(), plane: Plane::filled(source, value) };
    let mut tried = 0;
    for (nir, expected) in [(None, 0.25), (Some(("N", 2.0)), 2.0), (Some(("NIR", 0.0)), 0.0)] {
        let mut channels = vec![channel("R", 0.25), channel("G", 0.5), channel("B", 4.0), channel("A", 1.0)];
        channels.extend(nir.map(|(name, value)| channel(name, value)));
        let seen = resample(&still(to_exr(&channels).unwrap(), source, 1.3), &infrared, &global(16)).unwrap();
        let bands = [0.25, 0.5, 4.0, expected];
        let photons: f64 = (0..4).map(|band| bands[band] * per_lux_s[band] * WHITE_LUX * 0.01).sum();
        assert!((f64::from(seen.photons.at(3, 3)) / photons - 1.0).abs() < 1e-7, "{nir:?}");
        tried += 1;
    }
    assert_eq!(tried, 3);
    // IEC 61966-2-1: code 188 of 255 is 0.502886 of white; 16 bits stand between.
    for (bytes, expected) in [(grey_png_8(source, 188), 0.502_886_5), (grey_png_16(source, 188 * 257), 0.502_886_5)] {
        let seen = resample(&still(bytes, source, 1.3), &camera(sensor, FOV_RAD), &global(16)).unwrap().photons;
        let value = f64::from(seen.at(5, 5)) / white_photons(&camera(sensor, FOV_RAD));
        // The constant has seven digits.
        assert!((value - expected).abs() < 1e-6, "{value}");
    }
}

fn png_of(picture: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

pub(crate) fn grey_png_8(size: Size, code: u8) -> Vec<u8> {
    png_of(&image::GrayImage::from_pixel(size.width_px, size.height_px, image::Luma([code])).into())
}

pub(crate) fn grey_png_16(size: Size, code: u16) -> Vec<u8> {
    let picture = image::ImageBuffer::from_pixel(size.width_px, size.height_px, image::Luma([code]));
    png_of(&image::DynamicImage::ImageLuma16(picture))
}

#[test]
fn threads_and_the_number_of_pictures_held_change_no_bit() {
    let source = size(90, 61);
    let value = |seed: usize| move |x: usize, y: usize| f64_from_usize((x * 31 + y * 17 + seed) % 23);
    let times_s: Vec<f64> = (0..12).map(|number| 0.001 * f64::from(number)).collect();
    let pictures: Vec<_> = (0..12).map(|seed| grey(source, value(seed))).collect();
    let made = || stream(pictures.clone(), &times_s, pinhole(source, FOV_RAD, [-0.1, 0.01, 0.0, 0.002]), Blend::Linear);
    let camera = camera(size(32, 24), FOV_RAD);
    let shutter: Vec<Span> =
        (0..24).map(|row| Span { start_s: 1e-4 * f64::from(row), end_s: 1e-4 * f64::from(row) + 0.008 }).collect();
    let first = resample(&made(), &camera, &shutter).unwrap().photons;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let other = one.install(|| resample(&made(), &camera, &shutter).unwrap().photons);
    assert_eq!(first, other);
    let again = made();
    assert_eq!(resample(&again, &camera, &shutter).unwrap().photons, first);
    assert_eq!(resample(&again, &camera, &shutter).unwrap().photons, first, "from the cache");
    let held = again.pictures_at_once() * sensel::num::index(u32_from(source.pixel_count())) * 4 * 4;
    assert!(held <= sensel::scene::images::CACHE_BYTES, "{held}");
}

#[test]
fn depth_comes_from_the_picture_nearest_in_time_and_is_never_mixed() {
    let source = size(48, 32);
    let picture = |near_m: f32, far_m: f32| {
        let mut depth = Plane::filled(source, far_m);
        (0..32).for_each(|y| depth.row_mut(y)[..20].fill(near_m));
        let light = Channel { name: "Y".to_owned(), plane: Plane::filled(source, 0.5) };
        to_exr(&[light, Channel { name: "Z".to_owned(), plane: depth }]).unwrap()
    };
    let pictures = vec![picture(1.0, 3.0), picture(2.0, 0.0)];
    let stream = stream(pictures, &[0.0, 0.1], pinhole(source, FOV_RAD, [0.0; 4]), Blend::Nearest);
    let camera = camera(size(24, 16), FOV_RAD);
    let mut tried = 0;
    for (t_s, near_m, far_m) in [(0.04, 1.0, 3.0), (0.06, 2.0, f32::INFINITY)] {
        let depth = sensel::optics::resample::depth(&stream, &camera, t_s).unwrap().unwrap();
        for x in 0..24 {
            assert_eq!(depth.at(x, 7), if x < 10 { near_m } else { far_m }, "{x} at {t_s} s");
            tried += 1;
        }
    }
    assert_eq!(tried, 48);
}
