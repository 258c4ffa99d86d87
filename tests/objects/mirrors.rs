//! Mirrors among moving objects: fixed ones show objects, and those on objects show the scene and each other.

use super::*;

/// A perfect mirror.
pub fn silver() -> Material {
    Material { metallic: 1.0, roughness: 0.0, ..Material::plain("silver", [1.0; 3]) }
}

/// A mirror of 4 by 3 m, square to z.
fn mirror(z_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.materials.push(silver());
    mesh.append_quad(0, [[-2.0, 1.5, z_m], [2.0, 1.5, z_m], [2.0, -1.5, z_m], [-2.0, -1.5, z_m]], [1.0; 2]);
    mesh
}

/// A scene at rest under the test's sky, with its light.
fn lit(mesh: Mesh) -> LitScene {
    let scene = Scene::new("scene", mesh, SKY).unwrap();
    scene.baked_and_lit(&BakeSettings::DRAFT, DVec3::new(0.0, 0.0, -50.0), 100.0, Illuminant::D65).unwrap()
}

fn reflected(scene: DynamicScene<'_>, rows: &[Span]) -> Exposure {
    render(scene, &camera(), rows, &|_| Pose::IDENTITY, Sampling::fixed(64, DrawKey::root(5)))
}

/// Sum of the differences of two pictures over the sum of the first one's differences from the sky, which no board reaches.
fn differ(a: &Exposure, b: &Exposure) -> f64 {
    let pairs = || a.photons.values().iter().zip(b.photons.values()).map(|(&a, &b)| (f64::from(a), f64::from(b)));
    let sky = pairs().fold(0.0_f64, |most, (a, _)| most.max(a));
    pairs().map(|(a, b)| (a - b).abs()).sum::<f64>() / pairs().map(|(a, _)| sky - a).sum::<f64>()
}

#[test]
fn a_mirror_shows_a_moving_object_as_if_it_moved_behind_it() {
    // Behind the camera, the mirror 3 m before it: the image of z is at 6 - z, and turns the other way about x and y.
    let behind = |t_s: f64| {
        let pose = path(t_s);
        Pose::new(pose.rotation, pose.translation_m - DVec3::new(0.0, 0.0, 3.0))
    };
    let image = |t_s: f64| {
        let Pose { rotation, translation_m } = behind(t_s);
        let [x, y, z] = translation_m.to_array();
        Pose::new(DQuat::from_xyzw(-rotation.x, -rotation.y, rotation.z, rotation.w), DVec3::new(x, y, 6.0 - z))
    };
    let (hall, open) = (lit(mirror(3.0)), nothing());
    let in_mirror = [object(board(), along(behind), &hall)];
    let by_itself = [object(board(), along(image), &open)];
    let seen = reflected(DynamicScene { fixed: &hall, objects: &in_mirror }, &rolling());
    let expected = reflected(DynamicScene { fixed: &open, objects: &by_itself }, &rolling());
    let earlier = rolling()
        .iter()
        .map(|row| Span { start_s: row.start_s + 0.05, end_s: row.end_s + 0.05 })
        .collect::<Vec<Span>>();
    let later = reflected(DynamicScene { fixed: &open, objects: &by_itself }, &earlier);
    let [same, other] = [differ(&expected, &seen), differ(&expected, &later)];
    println!("{same} {other}");
    assert!(same < 0.02 && other > 0.1, "{same} {other}");
}

/// Meshes as one.
fn merged(parts: &[&Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for part in parts {
        for (number, material) in part.materials.iter().enumerate() {
            let number = u32::try_from(number).unwrap();
            let of_material = |&at: &usize| part.material_of[at] == number;
            let triangles: Vec<[u32; 3]> =
                (0..part.triangles.len()).filter(of_material).map(|at| part.triangles[at]).collect();
            all.materials.push(material.clone());
            let last = u32::try_from(all.materials.len() - 1).unwrap();
            all.append(last, part.vertices.clone(), &triangles).unwrap();
        }
    }
    all
}

#[test]
fn what_stands_and_objects_at_rest_are_mirrored_alike() {
    // The board stands upright beside the camera's axis, tilted towards the mirror behind it: it is seen itself and as an image.
    let world_from_board = Pose::new(DQuat::from_rotation_y(0.6), DVec3::new(0.3, -0.1, 1.6));
    let mut board = board().mesh.clone();
    for vertex in &mut board.vertices {
        let at_m = world_from_board.point(DVec3::from_array(vertex.position_m.map(f64::from)));
        vertex.position_m = at_m.to_array().map(f32_nearest);
        vertex.normal =
            world_from_board.direction(DVec3::from_array(vertex.normal.map(f64::from))).to_array().map(f32_nearest);
    }
    let (speck, mirror, board) = (&nothing().scene().mesh.clone(), &mirror(3.0), &board);
    let picture = |standing: &[&Mesh], moving: &[&Mesh]| {
        let fixed = lit(merged(&[&[speck], standing].concat()));
        let still = |mesh: &&Mesh| {
            UnlitObject::new(("part", 1), Scene::new("part", (*mesh).clone(), SKY).unwrap(), at_rest(), RUN).unwrap()
        };
        let objects = UnlitObject::lit(moving.iter().map(still).collect(), &fixed, RUN);
        reflected(DynamicScene { fixed: &fixed, objects: &objects }, &rolling())
    };
    let standing = picture(&[mirror, board], &[]);
    let without = picture(&[mirror], &[]);
    assert!(differ(&standing, &without) > 0.5);
    let divisions: [[&[&Mesh]; 2]; 3] = [[&[mirror], &[board]], [&[board], &[mirror]], [&[], &[mirror, board]]];
    for [standing_parts, moving] in divisions {
        let other = picture(standing_parts, moving);
        let error = differ(&standing, &other);
        println!("{} parts move: {error}", moving.len());
        assert!(error < 0.05, "{error}");
    }
}
