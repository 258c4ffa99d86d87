//! Environment maps against their closed forms: levels, seams, suns, repairs.

use super::*;
use crate::draw::DrawKey;
use crate::num::u64_from;
use crate::scene::chance::pair;

/// Grey with a bright square and a warm half.
fn texels(width: u32) -> Vec<[f32; 3]> {
    let mut texels = Vec::new();
    for row in 0..width / 2 {
        for column in 0..width {
            let bright = row == width / 8 && (column == width / 3 || column == width / 3 + 1);
            let warm = if column < width / 2 { 2.0 } else { 1.0 };
            texels.push(if bright { [20_000.0; 3] } else { [warm, 1.0, 1.0] });
        }
    }
    texels
}

#[test]
fn directions_and_points_of_the_picture_go_back_and_forth() {
    let mut tried = 0;
    for yaw_deg in [0.0, 90.0, -200.0] {
        let environment = Environment::from_texels("e", 64, &texels(64), yaw_deg).unwrap();
        for number in 0..500 {
            let [u, v] = pair(DrawKey::root(5), number);
            let [back_u, back_v] = environment.turned(environment.direction(u, v)).map(f64::from);
            let apart = (back_u - u).abs();
            // f32 directions: 1e-7 over the sine of the polar angle, which is above 0.003 for all but the last of 500.
            let bound = 1e-6 / libm::sin(std::f64::consts::PI * v);
            assert!(
                apart.min(1.0 - apart) < bound && (back_v - v).abs() < bound.max(3e-4),
                "{u} {v}: {back_u} {back_v}"
            );
            tried += 1;
        }
    }
    assert_eq!(tried, 1500);
    let environment = Environment::from_texels("e", 64, &texels(64), 0.0).unwrap();
    // acosf(0) over pi, both of f32.
    assert!(environment.turned([0.0, 0.0, -1.0]).iter().all(|share| (share - 0.5).abs() < 1e-6));
    assert!((environment.turned([1.0, 0.0, 0.0])[0] - 0.75).abs() < 1e-6);
    // Turned to the right by 90 degrees, the middle is found towards +x.
    let turned = Environment::from_texels("e", 64, &texels(64), 90.0).unwrap();
    assert!((turned.turned([1.0, 0.0, 0.0])[0] - 0.5).abs() < 1e-6);
}

#[test]
fn seam_and_poles_are_smooth() {
    let environment = Environment::from_texels("e", 32, &texels(32), 0.0).unwrap();
    let mut tried = 0;
    for v in [0.0005, 0.3, 0.5, 0.9995] {
        for step in 0..200 {
            let at = |shift: f64| {
                let u = f64::from(step) / 200.0 + shift;
                environment.radiance(environment.direction(u - u.floor(), v))[0]
            };
            // The steepest slope is 20,000 over a texel of 1/32: over 1e-4 it is 64; across the warm edge 0.0032.
            assert!((at(0.0) - at(1e-4)).abs() <= 65.0, "{v} {step}");
            tried += 1;
        }
    }
    // At the poles all meridians meet: what is left is the height's 0.0005 of a turn, within the first row.
    let poles = [0.0, 0.25, 0.5, 0.75].map(|u| environment.radiance(environment.direction(u, 1e-6))[0]);
    assert!(poles.iter().all(|pole| (pole - poles[0]).abs() < 0.01), "{poles:?}");
    assert_eq!(tried, 800);
}

/// Irradiance of an upward surface by the soft part along a fine grid, and by distant lights.
fn upward(environment: &Environment) -> [f64; 2] {
    let mut soft = 0.0;
    let (rows, columns) = (200, 400);
    for row in 0..rows {
        for column in 0..columns {
            let [u, v] = [(f64_from_usize(column) + 0.5) / 400.0, (f64_from_usize(row) + 0.5) / 400.0];
            let solid =
                2.0 * std::f64::consts::PI / 400.0 * std::f64::consts::PI / 400.0 * libm::sin(std::f64::consts::PI * v);
            let direction = environment.direction(u, v);
            soft += f64::from(environment.soft_radiance(direction)[1]) * f64::from(direction[1]) * solid;
        }
    }
    let aimed = environment.distant_lights(192).concat();
    let aimed = aimed.iter().map(|light| f64::from(light.normal_irradiance[1] * light.direction[1].max(0.0)));
    [soft, aimed.fold(0.0, |sum, light| sum + light)]
}

#[test]
fn soft_and_aimed_parts_are_together_the_whole_light() {
    let environment = Environment::from_texels("e", 64, &texels(64), 0.0).unwrap();
    let mut whole = 0.0;
    for row in 0..32_usize {
        let solid = environment.map.solid_angle(row);
        for column in 0..64 {
            let up = libm::cos(std::f64::consts::PI * (f64_from_usize(row) + 0.5) / 32.0);
            whole += f64::from(environment.map.texels[row * 64 + column][1]) * up.max(0.0) * solid;
        }
    }
    let [soft, aimed] = upward(&environment);
    // The soft picture is bilinear between texels of 5.6 degrees: its sum is off by the second derivative of the cosine, under 0.2 %
    // of it; the directions lie within two texels of 5.6 degrees, with a spread of the cosine of 2 % at 192 strata: 0.1 %.
    assert!(aimed > soft, "{aimed} {soft}");
    assert!(((soft + aimed) / whole - 1.0).abs() < 0.003, "{soft} {aimed} {whole}");
}

#[test]
fn no_texel_however_bright_makes_a_distant_light_stronger_than_the_others() {
    let environment = Environment::from_texels("e", 64, &texels(64), 0.0).unwrap();
    let lights = environment.distant_lights(96).concat();
    assert_eq!(lights.len(), 96);
    let strengths: Vec<f64> = lights.iter().map(|light| luminance(light.normal_irradiance.map(f64::from))).collect();
    assert!(strengths.iter().all(|strength| (strength / strengths[0] - 1.0).abs() < 1e-5));
    // What random rays hit is below the threshold.
    let mean = environment.map.mean_luminance();
    for number in 0..1000_usize {
        let [u, v] = pair(DrawKey::root(6), u64_from(number));
        let soft = environment.soft_radiance(environment.direction(u, v)).map(f64::from);
        assert!(luminance(soft) <= AIMED_OVER_MEAN * mean * (1.0 + 1e-5));
    }
}

#[test]
fn bad_pictures_are_refused_with_row_and_column_and_harmless_ones_repaired() {
    let good = texels(16);
    let mut tried = 0;
    for (value, word) in [(f32::NAN, "finite"), (f32::INFINITY, "finite")] {
        let mut bad = good.clone();
        bad[16 * 3 + 5][1] = value;
        let error = Environment::from_texels("sky.exr", 16, &bad, 0.0).unwrap_err().to_string();
        assert!(error.contains("row 3, column 5") && error.contains(word) && error.contains("sky.exr"), "{error}");
        tried += 1;
    }
    assert!(Environment::from_texels("e", 16, &good[..64], 0.0).unwrap_err().to_string().contains("twice as wide"));
    assert!(Environment::from_texels("e", 16, &[[0.0; 3]; 128], 0.0).unwrap_err().to_string().contains("black"));
    let mut negative = good;
    negative[7] = [-0.5, 1.0, 1.0];
    let repaired = Environment::from_texels("e", 16, &negative, 0.0).unwrap();
    assert_eq!(repaired.map.texels[7][0].to_bits(), 0.0_f32.to_bits());
    assert_eq!(tried, 2);
}

#[cfg(feature = "exr")]
#[test]
fn an_openexr_picture_becomes_an_environment() {
    use crate::picture::{Channel, to_exr};
    use crate::plane::Plane;
    use crate::units::Size;
    let mut plane = Plane::filled(Size { width_px: 16, height_px: 8 }, 1.0_f32);
    plane.values_mut()[3] = 5.0;
    let of = |names: &[&str]| {
        let channels: Vec<Channel> =
            names.iter().map(|name| Channel { name: (*name).to_owned(), plane: plane.clone() }).collect();
        Environment::from_exr("sky.exr", &to_exr(&channels).unwrap(), 0.0)
    };
    assert_eq!(of(&["R", "G", "B"]).unwrap(), of(&["Y"]).unwrap());
    let error = of(&["Z"]).unwrap_err().to_string();
    assert!(error.contains("it has channels Z") && error.contains("R, G and B"), "{error}");
    assert!(Environment::from_exr("sky.exr", b"no picture", 0.0).is_err());
}
