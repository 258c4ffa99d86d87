//! Images of lamps that are a thousandth of a pixel, against the solid angle that optics gives them.

use super::*;
use crate::scene::mesh::Vertex;

const LUX: f64 = 100.0;
/// Radiance of the lamps, over that of a white surface under `LUX`.
const BRIGHT: f32 = 2e5;
/// What a white metal reflects straight back.
const REFLECTED: f64 = 1.0;

/// A lamp's square in the plane of some depth, and what else is in the scene, before black.
fn with_lamp(middle_m: DVec3, side_m: f64, more: &dyn Fn(&mut Mesh, u32)) -> LitScene {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material::plain("black", [0.0; 3]));
    mesh.materials.push(Material { emission: [BRIGHT; BANDS], ..Material::plain("lamp", [0.0; 3]) });
    mesh.materials.push(Material { metallic: 1.0, roughness: 0.0, ..Material::plain("chrome", [1.0; 3]) });
    let wall = |z: f32| [[-90.0, -90.0, z], [90.0, -90.0, z], [90.0, 90.0, z], [-90.0, 90.0, z]];
    mesh.append_quad(0, wall(9.0), [1.0, 1.0]);
    let half = 0.5 * side_m;
    let corner = |x: f64, y: f64| [middle_m.x + x * half, middle_m.y + y * half, middle_m.z].map(f32_nearest);
    mesh.append_quad(1, [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], [1.0, 1.0]);
    more(&mut mesh, 2);
    Scene::new("lamp", mesh, [0.0; 4]).unwrap().evenly_lit(LUX, Illuminant::D65)
}

/// A ball of 96 by 48 facets with the normals of a sphere.
fn ball(mesh: &mut Mesh, material: u32, middle_m: DVec3, radius_m: f64) {
    const ROUND: u32 = 96;
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for row in 0..=ROUND / 2 {
        for column in 0..=ROUND {
            let [polar, around] = [row, column].map(|step| f64::from(step) * std::f64::consts::TAU / f64::from(ROUND));
            let normal = DVec3::new(
                libm::sin(polar) * libm::cos(around),
                libm::cos(polar),
                libm::sin(polar) * libm::sin(around),
            );
            let position_m = (middle_m + normal * radius_m).to_array().map(f32_nearest);
            vertices.push(Vertex { position_m, normal: normal.to_array().map(f32_nearest), uv: [0.0; 2] });
            if row > 0 && column > 0 {
                let at = row * (ROUND + 1) + column;
                triangles.push([at, at - 1, at - ROUND - 1]);
                triangles.push([at - 1, at - ROUND - 2, at - ROUND - 1]);
            }
        }
    }
    mesh.append(material, vertices, &triangles).unwrap();
}

#[test]
fn an_image_of_a_lamp_a_thousandth_of_a_pixel_wide_is_as_bright_as_its_solid_angle() {
    let camera = camera(Pupil::ThinLens, RollOff::None);
    let white = {
        let scene = target::flat(0.8).unwrap().evenly_lit(LUX, Illuminant::D65);
        let seen = render(&scene, &camera, &global(0.01), &|_| Pose::IDENTITY, sampling(1, DrawKey::root(1)));
        f64::from(seen.photons.at(10, 10)) / 0.8
    };
    let px_rad = libm::tan(0.6) / 22.5;
    let none = |_: &mut Mesh, _: u32| {};
    let plane = |mesh: &mut Mesh, chrome: u32| {
        let corners_m = [[-2.0, -2.0, 3.0], [2.0, -2.0, 3.0], [2.0, 2.0, 3.0], [-2.0, 2.0, 3.0]];
        mesh.append_quad(chrome, corners_m, [1.0, 1.0]);
    };
    let (ball_m, radius_m) = (DVec3::new(0.13, -0.06, 1.2), 0.2);
    let sphere = |mesh: &mut Mesh, chrome: u32| ball(mesh, chrome, ball_m, radius_m);
    // Behind the camera, on the line from the ball's middle through the eye.
    let behind_m = -ball_m / ball_m.z;
    let of_ball = |side_m: f64| {
        let cos = ball_m.z / ball_m.length();
        let (eye_m, lamp_m) = (ball_m.length() - radius_m, (ball_m - behind_m).length() - radius_m);
        let image_m = lamp_m * 0.5 * radius_m / (lamp_m + 0.5 * radius_m);
        let seen = side_m * image_m / lamp_m / (eye_m + image_m);
        // The square stands askew to the line, and pixels off the axis are cos^3 of those on it.
        REFLECTED * seen * seen * cos / (px_rad * px_rad * cos * cos * cos)
    };
    let square = |seen_rad: f64| seen_rad * seen_rad / (px_rad * px_rad);
    let lamp_m = DVec3::new(0.171, 0.333, 2.0);
    let cases: [(&str, LitScene, f64, f64); 5] = [
        ("itself", with_lamp(lamp_m, 0.002, &none), square(0.001), 0.0),
        ("itself, passing by", with_lamp(lamp_m, 0.002, &none), square(0.001), 8.0),
        ("in a plane mirror", with_lamp(DVec3::new(0.5, -0.8, -1.0), 0.007, &plane), REFLECTED * square(0.001), 0.0),
        ("in a ball", with_lamp(behind_m, 0.02, &sphere), of_ball(0.02), 0.0),
        ("in a ball, passing by", with_lamp(behind_m, 0.02, &sphere), of_ball(0.02), 2.0),
    ];
    let mut tried = 0;
    for (name, scene, area, goes_m_per_s) in cases {
        // Over the exposure's two ends the same, so that the image is on the ball's axis amid.
        let moved = |t_s: f64| Pose::new(DQuat::IDENTITY, DVec3::new(goes_m_per_s * (t_s - 0.005), 0.0, 0.0));
        let expected = white * std::f64::consts::PI * f64::from(BRIGHT) * area;
        assert!(area < 2e-3 && expected > 100.0, "{name}: {area} {expected}");
        for sampling in [
            sampling(64, DrawKey::root(3)),
            Sampling { samples_max: 1_024, tolerance: 0.05, ..sampling(4, DrawKey::root(3)) },
        ] {
            let mut sum = 0.0;
            for seed in 0..4 {
                let sampling = Sampling { key: DrawKey::root(seed), ..sampling };
                let seen = render(&scene, &camera, &global(0.01), &moved, sampling);
                let all: f64 = seen.photons.values().iter().map(|&value| f64::from(value)).sum();
                // Even samples meet such an image once in 15 frames of 64 a pixel, and are then worth sixteen times as much.
                assert!((all / expected - 1.0).abs() < 0.2, "{name}: {all} for {expected}");
                sum += 0.25 * all;
            }
            // Nets of 64 in a box that the image fills to a half and more leave 2 % each; the ball's facets lie 0.05 % below its
            // sphere, and its image is small to 1 %.
            assert!((sum / expected - 1.0).abs() < 0.03, "{name}: {sum} for {expected}");
            tried += 1;
        }
    }
    assert_eq!(tried, 10);
}
