//! Ground truth through its front door: depth, normals, flow and visibility against rays tried one by one in f64, each row at its own time.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

#[path = "truth/kept.rs"]
mod kept;
#[path = "truth/reference.rs"]
mod reference;

use crate::common;

use glam::{DQuat, DVec2, DVec3};
use reference::{RandomPixels, distorted_px, first_hit};
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, index};
use sensel::optics::lens::{Intrinsics, Lens, Mapping, Radtan};
use sensel::optics::truth::{TruthView, Visibility, matches, surfaces};
use sensel::optics::{Aperture, Camera, Pupil, RollOff, Sampling, render};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::scene::{BakeSettings, Illuminant, Scene, box_room, target};
use sensel::units::{Size, Span};

const SIZE: Size = Size { width_px: 160, height_px: 120 };

/// From one frame to the next, and from one row to the next under a rolling shutter.
const FRAME_S: f64 = 1.0 / 30.0;
const ROW_S: f64 = 2e-4;

fn lens() -> Lens {
    let intrinsics = Intrinsics { fx_px: 95.0, fy_px: 96.0, cx_px: 78.3, cy_px: 60.9 };
    Lens { intrinsics, mapping: Mapping::Radtan(Radtan { k1: -0.06, k2: 0.008, p1: 4e-4, p2: -3e-4, k3: 0.0 }) }
}

/// Mounted off the body's axes, so that `body_from_camera` matters.
fn camera(lens: Lens, position_m: DVec3) -> Camera {
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    let mount = Pose::new(DQuat::from_euler(glam::EulerRot::XYZ, 0.1, -0.2, 0.05), position_m);
    Camera::new(lens, SIZE, mount, aperture, 3.0, RollOff::None).unwrap()
}

/// A hand that turns at about 100 degrees a second and walks a metre a second past the furniture.
fn hand(t_s: f64) -> Pose {
    let turn = DQuat::from_rotation_y(2.6 + 1.6 * t_s) * DQuat::from_rotation_x(3.0 + 0.5 * libm::sin(3.0 * t_s));
    Pose::new(turn, DVec3::new(0.3 + 0.8 * t_s, 1.4 - 0.3 * t_s, 0.2 + 0.5 * t_s * t_s))
}

fn rolling(frame: u32) -> Vec<f64> {
    (0..SIZE.height_px).map(|row| f64::from(frame) * FRAME_S + f64::from(row) * ROW_S).collect()
}

fn global(frame: u32) -> Vec<f64> {
    vec![f64::from(frame) * FRAME_S; index(SIZE.height_px)]
}

#[test]
fn depth_range_and_normals_are_those_of_the_nearest_triangle_at_the_time_of_the_row() {
    let scene = box_room::box_room(1);
    let camera = camera(lens(), DVec3::new(0.03, -0.02, 0.05));
    for times_s in [rolling(0), global(3)] {
        let view = TruthView::new(&camera, times_s.clone(), &hand);
        let seen = surfaces(&scene, &view);
        let (depth_m, range_m) = (seen.depth_m(&view), seen.range_m());
        let normals = seen.normals(&scene, &view);
        let materials = seen.materials(&scene);
        let (mut tried, mut worst) = (0, 0.0_f64);
        for (x, y) in RandomPixels::new(21, SIZE).take(1_500) {
            let pose = hand(times_s[y]).then(&camera.body_from_camera);
            let bearing = camera.lens.unproject(DVec2::new(f64_from_usize(x), f64_from_usize(y))).unwrap();
            let hit = first_hit(&scene.mesh, pose.translation_m, pose.direction(bearing)).unwrap();
            // Beside the edge of a face the f32 search may take either neighbour.
            if hit.margin < 1e-5 {
                continue;
            }
            let error = (f64::from(range_m.at(x, y)) / hit.range_m - 1.0).abs();
            worst = worst.max(error);
            // One rounding to f32 (6e-8) of what f64 knows to 1e-13.
            assert!(error < 7e-8, "{x} {y}: {} for {}", range_m.at(x, y), hit.range_m);
            assert!((f64::from(depth_m.at(x, y)) / (hit.range_m * bearing.z) - 1.0).abs() < 7e-8);
            let normal = DVec3::from_array([0, 1, 2].map(|axis| f64::from(normals[axis].at(x, y))));
            assert!((pose.direction(normal) - hit.normal).length() < 2e-7, "{x} {y}: {normal}");
            assert!(normal.dot(bearing) < 0.0, "a normal points at the camera");
            assert_eq!(materials.at(x, y), scene.mesh.material_of[hit.triangle] + 1);
            tried += 1;
        }
        println!("{tried} pixels, worst range {worst:e}");
        assert!(tried > 1_400);
    }
}

#[test]
fn a_wall_is_as_far_along_the_axis_as_each_row_finds_it() {
    // The camera walks at 1 m/s towards a wall 2 m off: every row is nearer than the one above.
    let scene = target::flat(1.0).unwrap();
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    let camera = Camera::new(Lens::pinhole(SIZE, 1.0), SIZE, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap();
    let walk = |t_s: f64| Pose::new(DQuat::IDENTITY, DVec3::new(0.1, 0.0, t_s));
    let view = TruthView::new(&camera, rolling(1), &walk);
    let depth_m = surfaces(&scene, &view).depth_m(&view);
    for (row, t_s) in rolling(1).into_iter().enumerate() {
        // A rounding to f32 of 2 m.
        assert!(depth_m.row(row).iter().all(|&z_m| (f64::from(z_m) - (2.0 - t_s)).abs() < 1.3e-7), "row {row}");
    }
    // A still camera and a wall square to its axis: no flow at all.
    let still = |_: f64| Pose::IDENTITY;
    let (now, next) = (TruthView::new(&camera, rolling(0), &still), TruthView::new(&camera, rolling(1), &still));
    let found = matches(&scene, &now, &surfaces(&scene, &now), &next);
    assert!(found.seen.values().iter().all(|&seen| seen == Visibility::Visible));
    // Roundings of positions up to 160 px in f64.
    assert!(found.dx_px.values().iter().chain(found.dy_px.values()).all(|shift_px| shift_px.abs() < 1e-12));
}

/// Where a point is seen, found without the product's search: the rows of the other picture are gone through one by one for the one
/// that the point crosses while it is exposed, which is then halved. None where it is not crossed exactly once.
fn found_by_scanning(camera: &Camera, times_s: &[f64], point_m: DVec3) -> Option<(DVec2, Pose)> {
    let time_s = |y_px: f64| {
        let row = index(sensel::num::u32_truncated(y_px)).min(times_s.len() - 2);
        times_s[row] + (y_px - f64_from_usize(row)) * (times_s[row + 1] - times_s[row])
    };
    let pose = |y_px: f64| hand(time_s(y_px)).then(&camera.body_from_camera);
    let projected_px = |y_px: f64| distorted_px(&camera.lens, pose(y_px).inverse().point(point_m));
    let beyond = |y_px: f64| projected_px(y_px).map(|position_px| position_px.y - y_px);
    let rows: Vec<f64> = (0..times_s.len()).map(f64_from_usize).collect();
    let crossed: Vec<f64> = rows
        .windows(2)
        .filter(|pair| matches!((beyond(pair[0]), beyond(pair[1])), (Some(a), Some(b)) if a >= 0.0 && b < 0.0))
        .map(|pair| pair[0])
        .collect();
    let [first] = crossed[..] else { return None };
    let (mut low, mut high) = (first, first + 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if beyond(middle)? >= 0.0 { low = middle } else { high = middle }
    }
    Some((projected_px(low)?, pose(low)))
}

#[test]
fn flow_and_visibility_are_those_of_points_projected_and_looked_at_one_by_one() {
    let scene = box_room::box_room(1);
    let here = camera(lens(), DVec3::new(0.03, -0.02, 0.05));
    let beside = camera(lens(), DVec3::new(0.33, -0.02, 0.05));
    let far = camera(lens(), DVec3::new(1.3, 0.5, 0.05));
    // The next frame of a rolling and of a global shutter; a frame later still, where more is hidden; and other cameras.
    let cases = [
        ("next, rolling", rolling(0), rolling(1), &here),
        ("next, global", global(0), global(1), &here),
        ("sixth, rolling", rolling(0), rolling(6), &here),
        ("other camera, rolling", rolling(0), rolling(0), &beside),
        ("far camera, global", global(0), global(0), &far),
    ];
    let (mut hidden, mut outside) = (0, 0);
    for (name, from_s, to_s, other) in cases {
        let (from, to) = (TruthView::new(&here, from_s.clone(), &hand), TruthView::new(other, to_s.clone(), &hand));
        let found = matches(&scene, &from, &surfaces(&scene, &from), &to);
        let (mut tried, mut worst_px) = (0, 0.0_f64);
        for (x, y) in RandomPixels::new(22, SIZE).take(2_000) {
            let pose = hand(from_s[y]).then(&here.body_from_camera);
            let here_px = DVec2::new(f64_from_usize(x), f64_from_usize(y));
            let bearing = pose.direction(here.lens.unproject(here_px).unwrap());
            let hit = first_hit(&scene.mesh, pose.translation_m, bearing).unwrap();
            let point_m = pose.translation_m + bearing * hit.range_m;
            let is_global = to_s[0] == to_s[1];
            let scanned = if is_global {
                let pose = hand(to_s[0]).then(&other.body_from_camera);
                distorted_px(&other.lens, pose.inverse().point(point_m)).map(|position_px| (position_px, pose))
            } else {
                found_by_scanning(other, &to_s, point_m)
            };
            let inside = |position_px: DVec2| {
                let low = position_px.min_element();
                low.min(159.0 - position_px.x).min(119.0 - position_px.y)
            };
            // Within the picture's outermost half pixel the scan has no row on both sides; those pixels are left to the others.
            let Some((position_px, there)) = scanned.filter(|(position_px, _)| inside(*position_px) >= 0.0) else {
                let shift_px = DVec2::new(found.dx_px.at(x, y).into(), found.dy_px.at(x, y).into());
                let beyond = !(shift_px.is_finite() && inside(here_px + shift_px) > 1e-3);
                assert!(beyond, "{name} {x} {y}: {:?} at {shift_px}", found.seen.at(x, y));
                outside += u32::from(found.seen.at(x, y) == Visibility::Outside);
                continue;
            };
            let shift_px = DVec2::new(found.dx_px.at(x, y).into(), found.dy_px.at(x, y).into());
            let error_px = (here_px + shift_px - position_px).length();
            worst_px = worst_px.max(error_px);
            // A rounding to f32 of displacements below 256 px in two axes: 2^-17 px at most in each, 1.1e-5 px together. The
            // unprojection is good to 1e-9 px, the point's range to 1e-13 of it.
            assert!(error_px < 1.2e-5, "{name} {x} {y}: {error_px} px");
            let toward_m = point_m - there.translation_m;
            let met = first_hit(&scene.mesh, there.translation_m, toward_m.normalize()).unwrap();
            let nearer = 1.0 - met.range_m / toward_m.length();
            // What is nearer by up to a few ten-thousandths, or met at its very edge, may count either way.
            if met.margin > 1e-4 && hit.margin > 1e-5 && (nearer.abs() < 1e-6 || nearer > 1e-3) {
                let expected = if nearer > 1e-3 { Visibility::Occluded } else { Visibility::Visible };
                assert_eq!(found.seen.at(x, y), expected, "{name} {x} {y}: nearer by {nearer}");
                hidden += u32::from(expected == Visibility::Occluded);
                tried += 1;
            }
        }
        println!("{name}: {tried} tried, worst {worst_px:e} px");
        // Of the sixth frame about half lies within both pictures.
        assert!(tried > 500, "{name}: {tried}");
    }
    println!("{hidden} hidden, {outside} outside");
    assert!(hidden > 20 && outside > 500, "{hidden} hidden, {outside} outside");
}

#[test]
fn rows_that_the_picture_outruns_are_unsettled_and_what_has_no_bearing_is_nothing() {
    let scene = target::flat(1.0).unwrap();
    let camera = camera(lens(), DVec3::ZERO);
    // Ten turns a second move the picture by 6,000 px/s, and its rows come at 5,000 a second: a point keeps up with the rows.
    let spin = |t_s: f64| Pose::new(DQuat::from_rotation_x(-63.0 * t_s), DVec3::ZERO);
    let slow = |t_s: f64| Pose::new(DQuat::from_rotation_x(-0.63 * t_s), DVec3::ZERO);
    let count = |motion: &(dyn Fn(f64) -> Pose + Sync)| {
        let view = TruthView::new(&camera, rolling(0), motion);
        let later = TruthView::new(&camera, rolling(0).iter().map(|t_s| t_s + 1e-4).collect(), motion);
        let found = matches(&scene, &view, &surfaces(&scene, &view), &later);
        found.seen.values().iter().filter(|&&seen| seen == Visibility::Unsettled).count()
    };
    assert!(count(&spin) > 1_000, "{}", count(&spin));
    assert_eq!(count(&slow), 0);

    // A barrel so strong that its polynomial folds inside the picture: beyond the fold there is no bearing.
    let mut folded = lens();
    folded.mapping = Mapping::Radtan(Radtan { k1: -0.45, ..Radtan::default() });
    let camera = self::camera(folded, DVec3::ZERO);
    let view = TruthView::new(&camera, global(0), &slow);
    let seen = surfaces(&scene, &view);
    let found = matches(&scene, &view, &seen, &view);
    let mut nothing = 0;
    for y in 0..120 {
        for x in 0..160 {
            let has = folded.unproject(DVec2::new(f64_from_usize(x), f64_from_usize(y))).is_some();
            assert_eq!(found.seen.at(x, y) == Visibility::Nothing, !has, "{x} {y}");
            assert!(has == seen.range_m.at(x, y).is_finite() && has == found.dx_px.at(x, y).is_finite());
            nothing += u32::from(!has);
        }
    }
    assert!(nothing > 100 && nothing < 15_000, "{nothing}");
}

#[test]
fn what_is_infinitely_far_turns_with_the_camera_and_does_not_shift() {
    // One small plate in the void: everything else is sky.
    let mut mesh = sensel::scene::mesh::Mesh::default();
    mesh.materials.push(sensel::scene::mesh::Material::plain("plate", [0.5; 3]));
    mesh.append_quad(0, [[-0.2, -0.2, 1.0], [-0.2, 0.2, 1.0], [0.2, 0.2, 1.0], [0.2, -0.2, 1.0]], [1.0; 2]);
    let scene = Scene::new("plate", mesh, [1.0; 4]).unwrap();
    let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
    let camera = Camera::new(Lens::pinhole(SIZE, 1.0), SIZE, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap();
    let step = |t_s: f64| Pose::new(DQuat::IDENTITY, DVec3::new(t_s, 0.0, 0.0));
    let (now, next) = (TruthView::new(&camera, global(0), &step), TruthView::new(&camera, global(3), &step));
    let seen = surfaces(&scene, &now);
    let found = matches(&scene, &now, &seen, &next);
    let focal_px = camera.lens.intrinsics.fx_px;
    let (mut plate, mut sky, mut hidden) = (0, 0, 0);
    for (at, &range_m) in seen.range_m.values().iter().enumerate() {
        let (dx_px, state) = (f64::from(found.dx_px.values()[at]), found.seen.values()[at]);
        if range_m.is_finite() {
            // 0.1 m at 1 m; a rounding of 15 px to f32.
            assert!((dx_px + focal_px * 0.1).abs() < 1e-6, "{dx_px}");
            plate += 1;
        } else {
            assert!(
                dx_px.abs() < 1e-9 && [Visibility::Visible, Visibility::Occluded].contains(&state),
                "{dx_px} {state:?}"
            );
            sky += 1;
            hidden += u32::from(state == Visibility::Occluded);
        }
    }
    // The plate moves by 14.6 px and is 58 px high: that strip of sky is covered.
    assert!(plate > 3_000 && sky > 10_000 && (700..1_000).contains(&hidden), "{plate} {sky} {hidden}");
}

/// Between pixels, in both directions linear; none beyond the centres of the outermost.
fn between(plane: &Plane<f32>, x_px: f64, y_px: f64) -> Option<f64> {
    let (width, height) = (f64_from_usize(plane.width_px() - 1), f64_from_usize(plane.height_px() - 1));
    if !((0.0..width).contains(&x_px) && (0.0..height).contains(&y_px)) {
        return None;
    }
    let (x, y) = (index(sensel::num::u32_truncated(x_px)), index(sensel::num::u32_truncated(y_px)));
    let (fx, fy) = (x_px - x_px.floor(), y_px - y_px.floor());
    let at = |x: usize, y: usize| f64::from(plane.at(x, y));
    let above = at(x, y) * (1.0 - fx) + at(x + 1, y) * fx;
    Some(above * (1.0 - fy) + (at(x, y + 1) * (1.0 - fx) + at(x + 1, y + 1) * fx) * fy)
}

#[test]
fn the_next_frame_warped_by_the_flow_is_this_frame() {
    let scene = box_room::box_room(1);
    let lit = scene.baked_and_lit(&BakeSettings::DRAFT, DVec3::new(0.0, 1.5, 0.0), 300.0, Illuminant::D65).unwrap();
    let camera = camera(lens(), DVec3::new(0.03, -0.02, 0.05));
    let exposed = |times_s: &[f64], seed: u64| {
        let spans: Vec<Span> = times_s.iter().map(|t_s| Span { start_s: t_s - 5e-5, end_s: t_s + 5e-5 }).collect();
        let sampling = Sampling::fixed(64, DrawKey::root(seed));
        render(&lit, &camera, &spans, &hand, sampling).photons
    };
    let later = |frame: u32| -> Vec<f64> { rolling(frame).iter().map(|t_s| t_s + 0.01).collect() };
    let (now, next) = (exposed(&later(0), 1), exposed(&later(1), 2));
    let (view, next_view) = (TruthView::new(&camera, later(0), &hand), TruthView::new(&camera, later(1), &hand));
    let found = matches(lit.scene(), &view, &surfaces(lit.scene(), &view), &next_view);
    // Median difference to this frame, with the flow moved by some pixels.
    let residual = |off_px: [f64; 2]| {
        let mut apart = Vec::new();
        for (y, x) in (0..120).flat_map(|y| (0..160).map(move |x| (y, x))) {
            let x_px = f64_from_usize(x) + f64::from(found.dx_px.at(x, y)) + off_px[0];
            let y_px = f64_from_usize(y) + f64::from(found.dy_px.at(x, y)) + off_px[1];
            let there = between(&next, x_px, y_px).filter(|_| found.seen.at(x, y) == Visibility::Visible);
            apart.extend(there.map(|there| (there / f64::from(now.at(x, y)) - 1.0).abs()));
        }
        (apart.len(), median(&mut apart))
    };
    // Interpolation between pixels is off by up to an eighth of the second difference in each direction.
    let mut softened: Vec<f64> = Vec::new();
    for (y, x) in (1..119).flat_map(|y| (1..159).map(move |x| (y, x))) {
        let at = |x: usize, y: usize| f64::from(now.at(x, y));
        let here = at(x, y);
        let bent = (at(x + 1, y) + at(x - 1, y) - 2.0 * here).abs() + (at(x, y + 1) + at(x, y - 1) - 2.0 * here).abs();
        softened.push(bent / 8.0 / here);
    }
    let softened = median(&mut softened);
    let (count, warped) = residual([0.0; 2]);
    println!("{count} pixels, median difference {warped:.4}, interpolation {softened:.4}");
    assert!(count > 12_000, "{count}");
    // Two renders of 64 samples differ by about 1 % each in textured pixels.
    assert!(warped < softened + 0.02, "{warped} {softened}");
    // A flow that is off by a quarter of a pixel fits worse, whichever way.
    for off_px in [[0.25, 0.0], [-0.25, 0.0], [0.0, 0.25], [0.0, -0.25]] {
        let (_, worse) = residual(off_px);
        println!("{off_px:?}: {worse:.4}");
        assert!(worse > 1.05 * warped, "{off_px:?}: {worse} {warped}");
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
