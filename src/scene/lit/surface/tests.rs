//! Light of packets against light of single hits.

use super::*;
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, low_u32, u32_from, u64_from};
use crate::scene::box_room::box_room;
use crate::scene::flicker::{Flicker, Waveform};
use crate::scene::light::Illuminant;
use crate::scene::texture::Footprint;

#[test]
fn lanes_have_the_bits_of_single_hits() {
    let seed = 5;
    let (mut tried, mut backs, mut parts) = (0, 0, 0);
    let mut steady = box_room(1).evenly_lit(300.0, Illuminant::D65);
    for (number, light) in steady.irradiance_lux.iter_mut().enumerate() {
        *light = light.map(|band| band + f32_from_u32(u32_from(number % 97)));
    }
    // Every third triangle has its samples at the corners.
    let scene = std::sync::Arc::get_mut(&mut steady.scene).unwrap();
    for shade in scene.layout.triangles.iter_mut().step_by(3) {
        (shade.grid_steps, shade.samples) = (0, [5, 60, 17]);
    }
    let number = |vertex: usize| f32_from_u32(u32_from(vertex % 89)) / 89.0;
    let vertices = scene.mesh.vertices.len();
    scene.mesh.colours = (0..vertices).map(|at| [number(at), number(3 * at), number(7 * at), 1.0]).collect();
    let flicker = Flicker { waveform: Waveform::Sine, frequency_hz: 100.0, modulation: 0.5, phase_deg: 0.0 };
    let flickering = box_room(1).evenly_lit(300.0, Illuminant::D65).all_flickering(flicker);
    for (number, scene) in [steady, flickering].iter().enumerate() {
        let triangles = u32_from(scene.scene().mesh.triangles.len());
        for case in 0..300_u64 {
            let key = DrawKey::root(seed).with(case).with(u64_from(number));
            let zero = Floats::splat(0.0);
            let triangle = low_u32(case) * 7 % triangles;
            let (mut u, mut v) = (Floats::splat(0.3), Floats::splat(0.4));
            let (mut direction, mut lamp_levels, mut lanes) = ([zero; 3], [0.0; LANES], Mask([0; LANES]));
            for lane in 0..LANES {
                let share =
                    |field: u64| f32_from_u32(low_u32(key.with(u64_from(lane)).with(field).0) >> 8) / 16_777_216.0;
                // All lanes, most, or a few.
                let is_in = share(9) < [1.1, 0.7, 0.2][usize::try_from(case % 3).unwrap()];
                lanes.0[lane] = if is_in { u32::MAX } else { 0 };
                // Up to both rims, and beyond them by a rounding.
                let on_rim = if share(6) < 0.1 { 1.0 } else { share(0) };
                let up = if share(7) < 0.5 { 1.0 - on_rim } else { (1.0 - on_rim) * share(1) };
                // Every other packet lies within a cell or two.
                let narrow = if case % 2 == 0 { 1e-3 } else { 1.0 };
                if is_in {
                    u.0[lane] = 0.3 + (on_rim - 0.3) * narrow - 1e-7;
                    v.0[lane] = 0.4 + (up - 0.4) * narrow + 1e-7;
                }
                for axis in 0..3 {
                    // Every other pair of packets comes from one side.
                    let away = if case % 4 < 2 { 0.0 } else { share(2 + u64_from(axis)) - 0.5 };
                    let towards = low_u32(key.with(u64_from(axis)).0 >> 40) % 2;
                    direction[axis].0[lane] = away + if towards == 0 { 0.25 } else { -0.25 };
                }
                lamp_levels[lane] = share(5);
            }
            let footprint = Footprint { step_texels: [1.0; 2], ..Footprint::POINT };
            let face = scene.face(triangle);
            let colours = scene.texture_of(face).map_or([[1.0; BANDS]; LANES], |texture| {
                texture.over_alike(&face.uv(u, v), &[zero; 2], &footprint, lanes)
            });
            let rays = OnTriangle {
                triangle,
                lanes,
                u,
                v,
                direction: &direction,
                lamp_levels: &lamp_levels,
                added: None,
                emission: None,
            };
            let found = by_lane(&scene.exitance_lux_alike(&rays, &by_band(&colours)));
            for lane in (0..LANES).filter(|&lane| lanes.0[lane] != 0) {
                let along = [0, 1, 2].map(|axis| direction[axis].0[lane]);
                let at = [u.0[lane], v.0[lane]];
                backs += u32::from(dot3(splat3(face.normal()), direction).0[lane] > 0.0);
                let single = scene.exitance_lux(triangle, at, along, &footprint, lamp_levels[lane]);
                assert_eq!(found[lane].map(f32::to_bits), single.map(f32::to_bits), "seed {seed}, case {case}");
                tried += 1;
            }
            parts += u32::from(lanes.0.contains(&0));
        }
    }
    assert!(tried > 5_000 && backs > 500 && parts > 300, "{tried} {backs} {parts}");
}
