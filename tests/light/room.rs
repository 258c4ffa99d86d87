//! Small scenes and a camera for tests of light.

use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::optics::lens::Lens;
use sensel::optics::{Aperture, Camera, Exposure, Pupil, RollOff, Sampling, render};
use sensel::pose::Pose;
use sensel::scene::light::BANDS;
use sensel::scene::mesh::{Material, Mesh};
use sensel::scene::target::cube;
use sensel::scene::{LitScene, Scene};
use sensel::units::{Size, Span};

/// f/2 on pixels of 3 um, even over the picture.
pub fn camera(size: Size, fov_rad: f64, transmission: f64, pupil: Pupil) -> Camera {
    let aperture = Aperture { f_number: 2.0, transmission, pupil };
    Camera::new(Lens::pinhole(size, fov_rad), size, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap()
}

/// 10 ms for every row.
pub fn global(exposure_s: f64) -> impl Fn(usize) -> Vec<Span> {
    move |rows| vec![Span { start_s: 0.0, end_s: exposure_s }; rows]
}

pub fn seen(scene: &LitScene, camera: &Camera, pose: Pose, samples_per_pixel: u32) -> Exposure {
    let shutter = global(0.01)(usize::try_from(camera.size.height_px).unwrap());
    let sampling = Sampling::fixed(samples_per_pixel, DrawKey::root(1));
    render(scene, camera, &shutter, &|_| pose, sampling)
}

pub fn mean(exposure: &Exposure) -> f64 {
    let values = exposure.photons.values();
    values.iter().map(|&value| f64::from(value)).sum::<f64>() / f64::from(u32::try_from(values.len()).unwrap())
}

/// A camera (x right, y down, z forward) in a world with y up: turned about the vertical, then down.
pub fn looking(at_m: DVec3, turn: f64, down: f64) -> Pose {
    let level = DQuat::from_rotation_x(std::f64::consts::PI);
    Pose::new(DQuat::from_rotation_y(turn) * level * DQuat::from_rotation_x(-down), at_m)
}

/// A closed room of 3 by 2 by 2.5 m, all of one albedo and one radiance; with three boxes in it, one on top of another.
pub fn furnished(albedo: f32, radiance: f32, furniture: bool) -> Scene {
    let mut mesh = Mesh::default();
    let emission = [radiance; BANDS];
    mesh.materials.push(Material { emission, double_sided: false, ..Material::plain("wall", [albedo; 3]) });
    for corners_m in cube([-1.5, 0.0, -1.25], [1.5, 2.0, 1.25], true) {
        mesh.append_quad(0, corners_m, [1.0, 1.0]);
    }
    let boxes = [
        [[-1.4, 0.0, -1.2], [-0.7, 0.6, -0.5]],
        [[0.6, 0.0, 0.5], [1.4, 0.75, 1.2]],
        [[0.8, 0.75, 0.6], [1.1, 1.0, 0.9]],
    ];
    for [least_m, greatest_m] in boxes.into_iter().filter(|_| furniture) {
        for (face, corners_m) in cube(least_m, greatest_m, false).into_iter().enumerate() {
            if face != 2 {
                mesh.append_quad(0, corners_m, [1.0, 1.0]);
            }
        }
    }
    Scene::new("furnace", mesh, [0.0; BANDS]).unwrap()
}

/// A square of 2 m, looking up.
pub fn plate(middle_m: [f32; 3], material: Material) -> Scene {
    let mut mesh = Mesh::default();
    mesh.materials.push(material);
    let [x, y, z] = middle_m;
    let corners_m = [[x - 1.0, y, z + 1.0], [x + 1.0, y, z + 1.0], [x + 1.0, y, z - 1.0], [x - 1.0, y, z - 1.0]];
    mesh.append_quad(0, corners_m, [1.0, 1.0]);
    Scene::new("plate", mesh, [0.0; BANDS]).unwrap()
}
