//! Shadows of moving objects on the static scene: as those of the same shape at rest in the scene, and where they fall in time.

use super::*;

/// A floor of 6 m, and lamps above it: a ball of 2 cm and a panel of 0.4 m, which shine down from 2.4 m.
fn room(shapes: &[&Mesh]) -> LitScene {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material { double_sided: false, ..Material::plain("floor", [0.5; 3]) });
    mesh.append_quad(0, [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]], [1.0; 2]);
    mesh.materials.push(Material { emission: [9.0; 4], double_sided: false, ..Material::plain("panel", [0.0; 3]) });
    let [low, high] = [-0.9, -0.5];
    mesh.append_quad(1, [[low, 2.4, low], [high, 2.4, low], [high, 2.4, high], [low, 2.4, high]], [1.0; 2]);
    mesh.materials.push(Material { emission: [400.0; 4], double_sided: false, ..Material::plain("ball", [0.0; 3]) });
    for corners_m in cube([0.6, 2.38, 0.3], [0.64, 2.42, 0.34], false) {
        mesh.append_quad(2, corners_m, [1.0; 2]);
    }
    for shape in shapes {
        let material = u32::try_from(mesh.materials.len()).unwrap();
        mesh.materials.push(shape.materials[0].clone());
        mesh.append(material, shape.vertices.clone(), &shape.triangles).unwrap();
    }
    let scene = Scene::new("room", mesh, [0.0; 4]).unwrap();
    let bake = scene.bake(&BakeSettings::FINE.direct(), &|_| {});
    scene.lit_absolutely(&bake, DVec3::new(2.0, 0.5, 2.0), Illuminant::D65).unwrap()
}

/// A black bar of 0.4 by 0.3 by 0.2 m, one metre above the floor.
fn bar() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material { double_sided: false, ..Material::plain("bar", [0.0; 3]) });
    for corners_m in cube([-0.2, 1.0, -0.1], [0.2, 1.3, 0.1], false) {
        mesh.append_quad(0, corners_m, [1.0; 2]);
    }
    mesh
}

/// Straight down from 0.9 m, below the bar.
fn down() -> Pose {
    Pose::new(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2), DVec3::new(-0.1, 0.9, -0.1))
}

#[test]
fn an_object_at_rest_shades_as_if_it_belonged_to_the_scene() {
    let sampling = Sampling { reflections: 0, ..Sampling::fixed(256, DrawKey::root(5)) };
    at_rest_as_in_the_scene(&[], down(), sampling, 1_000);
}

#[test]
fn mirrors_show_the_shadows_of_objects() {
    // Upright behind the bar, and seen from before it: the floor and the bar's shadow are seen in it alone.
    let mut mirror = Mesh::default();
    mirror.materials.push(super::mirrors::silver());
    mirror.append_quad(0, [[-1.0, 0.01, -1.0], [1.0, 0.01, -1.0], [1.0, 0.9, -1.0], [-1.0, 0.9, -1.0]], [1.0; 2]);
    let ahead = Pose::new(DQuat::from_rotation_x(std::f64::consts::PI), DVec3::new(0.0, 0.5, -0.5));
    at_rest_as_in_the_scene(&[&mirror], ahead, Sampling::fixed(256, DrawKey::root(5)), 300);
}

/// Sees the floor among shapes with the bar as an object and as a part of the scene, which shades at least so many pixels.
fn at_rest_as_in_the_scene(shapes: &[&Mesh], pose: Pose, sampling: Sampling, shaded_least: usize) {
    let bar = bar();
    let (without, with) = (room(shapes), room(&[shapes, &[&bar]].concat()));
    let still = [object(Scene::new("bar", bar.clone(), SKY).unwrap(), Motion::Still(Pose::IDENTITY), &without)];
    let rows = vec![Span { start_s: 0.0, end_s: 0.01 }; index(SIZE.height_px)];
    let [lit, of_scene, of_object] =
        [(&without).into(), (&with).into(), DynamicScene { fixed: &without, objects: &still }]
            .map(|scene: DynamicScene| render(scene, &camera(), &rows, &|_| pose, sampling).photons);
    let (mut shaded, mut sums) = (0, [0.0; 3]);
    for ((lit, of_scene), of_object) in lit.values().iter().zip(of_scene.values()).zip(of_object.values()) {
        let [lit, of_scene, of_object] = [lit, of_scene, of_object].map(|&photons| f64::from(photons));
        shaded += usize::from(of_scene < 0.8 * lit);
        for (sum, value) in sums.iter_mut().zip([lit, of_scene, (of_object - of_scene).abs()]) {
            *sum += value;
        }
    }
    let [lit, of_scene, error] = sums;
    println!("{shaded} pixels shaded, {} of the light left, mean error {}", of_scene / lit, error / of_scene);
    // The panel's half-shadows are those of the bake there, 8 cm apart, and drawn by 256 rays here: 1 / 16 of a panel's light a pixel.
    assert!(shaded > shaded_least && error < 0.03 * of_scene, "{shaded} {}", error / of_scene);
}

#[test]
fn a_shadow_is_where_its_object_is_at_the_time_of_each_row() {
    // The bar slides at 2 m/s along x, its shadow from the ball faster by the ratio of heights. A render of a still bar, at the middle of a
    // row, has this row in common with the one of the moving bar.
    let without = room(&[]);
    let shape = || Scene::new("bar", bar(), SKY).unwrap();
    let slide = |t_s: f64| Pose::new(DQuat::IDENTITY, DVec3::new(2.0 * t_s - 0.2, 0.0, 0.0));
    let moving = [object(shape(), along(slide), &without)];
    let rows: Vec<Span> = (0..SIZE.height_px)
        .map(|row| f64::from(row) * 2e-3)
        .map(|start_s| Span { start_s, end_s: start_s + 1e-4 })
        .collect();
    let rolling = seen(DynamicScene { fixed: &without, objects: &moving }, &rows, &|_| down(), 64).photons;
    let mut differ = [0.0; 2];
    for row in [10_u32, 32, 54] {
        let at = |t_s: f64| {
            let still = [object(shape(), Motion::Still(slide(t_s)), &without)];
            seen(DynamicScene { fixed: &without, objects: &still }, &rows, &|_| down(), 64).photons
        };
        let middle_s = rows[index(row)].middle_s();
        let [same, other] = [at(middle_s), at(middle_s + 0.02)];
        for x in 0..index(SIZE.width_px) {
            let seen = f64::from(rolling.at(x, index(row)));
            for (sum, photons) in differ.iter_mut().zip([&same, &other]) {
                *sum += (seen - f64::from(photons.at(x, index(row)))).abs();
            }
        }
    }
    println!("{differ:?}");
    assert!(differ[0] < 0.1 * differ[1], "{differ:?}");
}

/// Boards that face up, each by its least and greatest corner and its height, in metres.
fn boards(boards: &[([f32; 2], [f32; 2], f32)], reflectance: f32) -> Scene {
    let mut mesh = Mesh::default();
    mesh.materials.push(Material::plain("board", [reflectance; 3]));
    for &([x0, z0], [x1, z1], y) in boards {
        mesh.append_quad(0, [[x0, y, z1], [x1, y, z1], [x1, y, z0], [x0, y, z0]], [1.0; 2]);
    }
    Scene::new("boards", mesh, SKY).unwrap()
}

/// Lets shapes stand in a scene together.
fn standing(shapes: Vec<Scene>, fixed: &LitScene) -> Vec<MovingObject> {
    let unlit = |shape| UnlitObject::new(("standing", 1), shape, at_rest(), RUN).unwrap();
    UnlitObject::lit(shapes.into_iter().map(unlit).collect(), fixed, RUN)
}

/// Light that leaves the first board's upper side at a point of one of its triangles, in the green band.
fn from_above(object: &MovingObject, triangle: u32, weights: [f32; 2]) -> f64 {
    f64::from(object.lit_at(0.0).exitance_lux(triangle, weights, [0.0, -1.0, 0.0], &Footprint::POINT, 1.0)[1])
}

#[test]
fn objects_hide_the_sky_from_themselves_and_from_each_other() {
    const REFLECTANCE: f32 = 0.5;
    let fixed = nothing();
    let low = ([-0.6; 2], [0.6; 2], 0.0);
    let lid = ([-0.4; 2], [0.4; 2], 0.4);
    let middle = [0.0, 0.5];
    let open = from_above(&standing(vec![boards(&[low], REFLECTANCE)], &fixed)[0], 0, middle);
    let two = standing(vec![boards(&[low], REFLECTANCE), boards(&[lid], REFLECTANCE)], &fixed);
    let one = standing(vec![boards(&[low, lid], REFLECTANCE)], &fixed);
    // View factor of a square from below its middle, as far away as half its edge: 4 / pi times atan(1 / sqrt(2)) / sqrt(2).
    let hidden = 4.0 / std::f64::consts::PI * libm::atan(0.5_f64.sqrt()) * 0.5_f64.sqrt();
    let expected = (1.0 - hidden) / (1.0 - hidden * f64::from(REFLECTANCE));
    for (of, objects) in [("each other", two), ("itself", one)] {
        let found = from_above(&objects[0], 0, middle) / open;
        // The edge of the lid cuts strata of 256 rays: by two of them or so.
        assert!((found / expected - 1.0).abs() < 0.02, "{of}: {found}, expected {expected}");
    }
}

#[test]
fn an_object_is_shaded_by_another_as_by_what_stands() {
    let dark = || boards(&[([-0.5; 2], [0.5; 2], 0.6)], 0.001);
    let (without, with) = (room(&[]), room(&[&bar()]));
    let of_object = standing(vec![dark(), Scene::new("bar", bar(), SKY).unwrap()], &without);
    let [lit, of_scene] = [&without, &with].map(|fixed| standing(vec![dark()], fixed));
    let mut shaded = 0;
    let points = (1..16_u8).flat_map(|u| (1..16 - u).map(move |v| (u, v)));
    for (triangle, (u, v)) in points.flat_map(|point| [(0, point), (1, point)]) {
        let weights = [u, v].map(|at| f32::from(at) / 16.0);
        let [lit, of_scene, of_object] =
            [&lit, &of_scene, &of_object].map(|objects| from_above(&objects[0], triangle, weights));
        // The same rays; the tree of a turned object rounds otherwise.
        assert!((of_object - of_scene).abs() < 0.002 * lit, "{u} {v}: {of_object} for {of_scene}, {lit} without");
        shaded += usize::from(of_scene < 0.8 * lit);
    }
    assert!(shaded > 10, "{shaded}");
}
