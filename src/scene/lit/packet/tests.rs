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
    let (mut tried, mut missed, mut backs, mut ones) = (0, 0, 0, [0; 2]);
    let mut steady = box_room(1).evenly_lit(300.0, Illuminant::D65);
    for (number, light) in steady.irradiance_lux.iter_mut().enumerate() {
        *light = light.map(|band| band + f32_from_u32(u32_from(number % 97)));
    }
    // Every third triangle has its samples at the corners.
    for shade in steady.scene.layout.triangles.iter_mut().step_by(3) {
        (shade.grid_steps, shade.samples) = (0, [5, 60, 17]);
    }
    let flicker = Flicker { waveform: Waveform::Sine, frequency_hz: 100.0, modulation: 0.5, phase_deg: 0.0 };
    let flickering = box_room(1).evenly_lit(300.0, Illuminant::D65).all_flickering(flicker);
    for (number, scene) in [steady, flickering].iter().enumerate() {
        let triangles = u32_from(scene.scene().mesh.triangles.len());
        for case in 0..300_u64 {
            let key = DrawKey::root(seed).with(case).with(u64_from(number));
            let zero = Floats::splat(0.0);
            let one = Floats::splat(1.0);
            let footprints =
                Footprints { shift_texels: [zero; 2], step_texels: [one; 2], taps: one, area_texels2: one, snap: zero };
            let mut hits = Hits { t: one, triangle: [MISS; LANES], u: zero, v: zero };
            let (mut direction, mut levels) = ([zero; 3], [0.0; LANES]);
            for lane in 0..LANES {
                let share =
                    |field: u64| f32_from_u32(low_u32(key.with(u64_from(lane)).with(field).0) >> 8) / 16_777_216.0;
                // Packets of few and of many triangles, with rays that miss.
                let kinds = [1, 3, 40][usize::try_from(case % 3).unwrap()];
                let pick = low_u32(key.with(u64_from(lane)).with(9).0 % (kinds + 1));
                let triangle = (low_u32(case) * 7 + pick) % triangles;
                let triangle = if kinds > 1 { triangle } else { low_u32(case) * 7 % triangles };
                hits.triangle[lane] = if pick == 0 && kinds > 1 { MISS } else { triangle };
                // Up to both rims, and beyond them by a rounding.
                let u = if share(6) < 0.1 { 1.0 } else { share(0) };
                let v = if share(7) < 0.5 { 1.0 - u } else { (1.0 - u) * share(1) };
                // Every other packet of one triangle lies within a cell or two.
                let narrow = if kinds == 1 && case % 2 == 0 { 1e-3 } else { 1.0 };
                let (u, v) = (0.3 + (u - 0.3) * narrow, 0.4 + (v - 0.4) * narrow);
                (hits.u.0[lane], hits.v.0[lane]) = (u - 1e-7, v + 1e-7);
                for axis in 0..3 {
                    let away = if kinds == 1 && case % 4 < 2 { 0.0 } else { share(2 + u64_from(axis)) - 0.5 };
                    let towards = low_u32(key.with(u64_from(axis)).0 >> 40) % 2;
                    direction[axis].0[lane] = away + if towards == 0 { 0.25 } else { -0.25 };
                }
                levels[lane] = share(5);
            }
            let met = scene.met(&hits);
            let found = scene.exitances_lux(&hits, &met, &direction, Some(&footprints), &levels);
            let one = scene.one_met(&hits).map(|triangle| {
                let face = scene.face(triangle);
                let uv = face.uv(hits.u, hits.v);
                let of_one = Footprint { step_texels: [1.0; 2], ..Footprint::POINT };
                let colours = scene
                    .texture_of(face)
                    .map_or([[1.0; BANDS]; LANES], |texture| texture.over_alike(&uv, &[zero; 2], &of_one));
                by_lane(&scene.exitances_of_one(&hits, &direction, &by_band(&colours), &levels))
            });
            if let Some(one) = one {
                assert_eq!(one.map(|lux| lux.map(f32::to_bits)), found.map(|lux| lux.map(f32::to_bits)), "case {case}");
                ones[usize::from(case % 2 == 0)] += 1;
            }
            for lane in 0..LANES {
                let along = [0, 1, 2].map(|axis| direction[axis].0[lane]);
                let at = [hits.u.0[lane], hits.v.0[lane]];
                let footprint = Footprint { step_texels: [1.0; 2], ..Footprint::POINT };
                let single = if hits.triangle[lane] == MISS {
                    missed += 1;
                    [0.0; BANDS]
                } else {
                    backs += u32::from(dot3(met.normal(), direction).0[lane] > 0.0);
                    scene.exitance_lux(hits.triangle[lane], at, along, &footprint, levels[lane])
                };
                assert_eq!(found[lane].map(f32::to_bits), single.map(f32::to_bits), "seed {seed}, case {case}");
                tried += 1;
            }
        }
    }
    assert!(tried == 9_600 && missed > 500 && backs > 500, "{tried} {missed} {backs}");
    assert!(ones.iter().all(|&ones| ones > 80), "{ones:?}");
}
