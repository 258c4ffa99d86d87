//! Samples that many pixels share, along the ways of their points: against finer renders where something hides, mirrors or outruns
//! what is behind it, and where they must not be shared.

use super::*;
use crate::scene::flicker::{Flicker, Waveform};

/// Panels in the planes of some depths: material, rectangle in metres, depth.
fn panels(materials: Vec<Material>, panels: &[(u32, [f32; 4], f32)]) -> LitScene {
    let mut mesh = Mesh { materials, ..Mesh::default() };
    for &(material, [left, top, right, bottom], z) in panels {
        mesh.append_quad(
            material,
            [[left, top, z], [right, top, z], [right, bottom, z], [left, bottom, z]],
            [1.0, 1.0],
        );
    }
    Scene::new("panels", mesh, [0.0; 4]).unwrap().evenly_lit(100.0, Illuminant::D65)
}

/// Mean square over pixels of the error that all renders have in common, and of what they differ by, over the square of the brightest.
fn bias2_and_variance(
    scene: &LitScene,
    speed_m_per_s: DVec3,
    turn_rad_per_s: f64,
    samples: u32,
    row_s: f64,
) -> (f64, f64) {
    const SEEDS: u32 = 12;
    let camera = camera(Pupil::ThinLens, RollOff::None);
    let shutter: Vec<Span> = (0..31)
        .map(|row| {
            let start_s = row_s * f64::from(row);
            Span { start_s, end_s: start_s + 0.01 }
        })
        .collect();
    let moved = |t_s: f64| {
        let t_s = t_s - 0.005 - 15.0 * row_s;
        // Turns that end 40 % slower, or faster, than they are amid.
        let turn_rad = turn_rad_per_s * (t_s + 40.0 * t_s * t_s);
        Pose::new(DQuat::from_rotation_y(turn_rad), speed_m_per_s * t_s)
    };
    let of = |samples: u32, seed: u64| Sampling { outlines: false, ..sampling(samples, DrawKey::root(seed)) };
    let truth = render(scene, &camera, &shutter, &moved, of(4_096, 99)).photons;
    let white = f64::from(truth.values().iter().fold(0.0_f32, |most, &value| if value > most { value } else { most }));
    let (mut sums, mut squares) = (vec![0.0; truth.values().len()], 0.0);
    for seed in 1..=SEEDS {
        let view = View { scene, camera: &camera, reflections: BOUNCES_MAX, follows_gloss: true };
        let picture = Picture::new(view, &shutter, &moved, of(samples, seed.into()));
        assert!(picture.rides().is_some(), "{speed_m_per_s} m/s, {turn_rad_per_s} rad/s");
        let (seen, _) = picture.first(samples);
        for ((sum, seen), &truth) in sums.iter_mut().zip(seen).zip(truth.values()) {
            let error = f64::from(seen.photons - truth) / white;
            *sum += error;
            squares += error * error;
        }
    }
    // Of n errors, the products of two different ones are n (n - 1) of the n^2 in the square of their sum.
    let (n, pixels) = (f64::from(SEEDS), 45.0 * 31.0);
    let of_sums = sums.iter().map(|sum: &f64| sum * sum).sum::<f64>();
    let bias2 = (of_sums - squares) / (n * (n - 1.0)) / pixels;
    (bias2, squares / n / pixels - bias2)
}

/// Whether what all renders have in common is within its uncertainty. The error lies in some hundred of the 1,395 pixels, those at
/// edges, so the mean product of two of twelve renders is known to sqrt(2 / 100) / 12 = 1.2 % of the variance, of which four are
/// allowed. Ways of points may be off by 1 / 16 px where a turn bends them, which an edge of such a pixel turns into 1 / 16 of its
/// contrast: (1 / 16)^2 100 / 1,395 / 3 in the mean of all instants. (Pixels of mixed points that shared them had 1.2e-3, by any number
/// of samples.)
fn is_right(bias2: f64, variance: f64) -> bool {
    bias2 < 0.05 * variance + 1e-4
}

#[test]
fn shared_samples_are_right_where_what_is_near_outruns_what_is_far() {
    let colours = || vec![Material::plain("white", [0.8; 3]), Material::plain("black", [0.05; 3])];
    let stripes = |z: f32, width_m: f32, at: std::ops::Range<i32>| -> Vec<(u32, [f32; 4], f32)> {
        let stripe = |number: i32| {
            let left = width_m * crate::num::f32_nearest(f64::from(number));
            (u32::from(number.rem_euclid(2) == 1), [left, -9.0, left + width_m, 9.0], z)
        };
        at.map(stripe).collect()
    };
    let mut tried = 0;
    for (speed, turn, row_s, near_m) in [
        // A wall at 4 m, before which posts stand at 1 m: they go 10 px while it goes 2.5.
        (DVec3::new(30.0, 0.0, 0.0), 0.0, 0.0, 1.0),
        (DVec3::new(20.0, 12.0, 0.0), 0.0, 1e-4, 1.0),
        (DVec3::new(0.0, 0.0, 60.0), 0.0, 0.0, 1.0),
        (DVec3::ZERO, 6.0, 0.0, 1.0),
        (DVec3::new(-3.0, 0.0, 10.0), 5.0, 1e-4, 1.0),
        // The posts stand still in the picture, and the wall goes behind them.
        (DVec3::new(8.0, 0.0, 0.0), -8.0, 0.0, 1.0),
        // They go 40 px, so that blocks that followed them and the wall would fold.
        (DVec3::new(36.0, 0.0, 0.0), 0.0, 0.0, 0.3),
    ] {
        let mut all = stripes(4.0, 0.37, -20..20);
        let post = |[left, top, right, bottom]: [f32; 4]| [left * near_m, top, right * near_m, bottom];
        all.extend([(0, post([-0.6, -9.0, -0.5, 0.3]), near_m), (1, post([0.21, -0.2, 0.31, 9.0]), near_m)]);
        let scene = panels(colours(), &all);
        for samples in [2, 4, 16] {
            let (bias2, variance) = bias2_and_variance(&scene, speed, turn, samples, row_s);
            assert!(
                is_right(bias2, variance),
                "{speed} m/s, {turn} rad/s, {near_m} m, {samples}: {bias2} of {variance}"
            );
            tried += 1;
        }
    }
    assert_eq!(tried, 21);
}

#[test]
fn shared_samples_are_right_in_mirrors() {
    let materials = vec![
        Material::plain("white", [0.8; 3]),
        Material::plain("black", [0.05; 3]),
        Material { metallic: 1.0, roughness: 0.0, ..Material::plain("chrome", [1.0; 3]) },
    ];
    // A mirror at 2 m shows stripes 3 m behind the camera.
    let mut all: Vec<(u32, [f32; 4], f32)> = (-20..20_i16)
        .map(|number| {
            let left = 0.45 * f32::from(number);
            (u32::from(number.rem_euclid(2) == 1), [left, -9.0, left + 0.45, 9.0], -3.0)
        })
        .collect();
    all.push((2, [-1.0, -5.0, 0.7, 5.0], 2.0));
    all.push((0, [-9.0, -9.0, 9.0, 9.0], 5.0));
    let scene = panels(materials, &all);
    for samples in [2, 4, 16] {
        let (bias2, variance) = bias2_and_variance(&scene, DVec3::new(30.0, 0.0, 0.0), 0.0, samples, 0.0);
        assert!(is_right(bias2, variance), "{samples}: {bias2} of {variance}");
    }
}

#[test]
fn samples_are_shared_only_where_the_camera_moves_and_light_stays() {
    let camera = camera(Pupil::ThinLens, RollOff::None);
    let flickering =
        Flicker { waveform: Waveform::RectifiedSine, frequency_hz: 100.0, modulation: 0.8, phase_deg: 0.0 };
    let even = || panels(vec![Material::plain("white", [0.8; 3])], &[(0, [-9.0, -9.0, 9.0, 9.0], 4.0)]);
    let rides = |scene: &LitScene, exposure_s: f64, speed_m_per_s: f64| {
        let view = View { scene, camera: &camera, reflections: 2, follows_gloss: true };
        let moved = |t_s: f64| Pose::new(DQuat::IDENTITY, DVec3::new(speed_m_per_s * t_s, 0.0, 0.0));
        Picture::new(view, &global(exposure_s), &moved, sampling(4, DrawKey::root(1))).rides().is_some()
    };
    // At 4 m the picture goes 0.08 px for a metre a second, in the mean.
    assert!(rides(&even(), 0.01, 15.0) && !rides(&even(), 0.01, 10.0));
    assert!(!rides(&even(), 0.01, 0.0) && !rides(&even(), 0.0, 15.0));
    assert!(!rides(&even().all_flickering(flickering), 0.01, 15.0));
}
