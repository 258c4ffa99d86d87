//! Boxes against the shares that even samples find of them, and outlines against areas.

use super::*;
use crate::draw::DrawKey;
use crate::optics::render::refine::even;

fn uniform(key: DrawKey, number: u64, least: f64, greatest: f64) -> f64 {
    least + (greatest - least) * key.with(number).uniform()
}

/// The greatest share below 1, stretched over late parts of an exposure, rounds up to its end: beyond the last piece of the motion.
#[test]
fn no_sample_of_a_box_lies_after_the_exposure() {
    const GREATEST: f32 = 1.0 - 1.0 / 16_777_216.0;
    let (mut tried, mut rounded_up) = (0, 0);
    for case in 0..1_000 {
        let key = DrawKey::root(43).with(case);
        let draw = |number: u64, least: f64, greatest: f64| uniform(key, number, least, greatest);
        // Enters the pixel late, and is in it at the end.
        let end = DVec2::new(draw(0, 0.2, 0.8), draw(1, 0.2, 0.8));
        let start = end - DVec2::new(draw(2, 2.0, 8.0), draw(3, -0.2, 0.2));
        let half = DVec2::new(draw(4, 0.01, 0.1), draw(5, 0.01, 0.1));
        let Some(glint) = Glint::within(&Track { start, end, half }, [0, 0], DVec2::ZERO) else { continue };
        let [from, to] = glint.times;
        rounded_up += u32::from(from + GREATEST * (to - from) >= 1.0);
        let [_, _, t] = glint.place([0.5, 0.5, GREATEST]);
        assert!((0.0..1.0).contains(&t), "{case}: {t} of {glint:?}");
        tried += 1;
    }
    assert!(tried > 500 && rounded_up > 50, "{tried} tried, {rounded_up} would have been after the exposure");
}

#[test]
fn even_samples_find_the_share_of_a_box_that_its_own_samples_have_in_the_pixel() {
    const SAMPLES: u32 = 1 << 14;
    let (mut tried, mut moving) = (0, 0);
    for case in 0..1_000 {
        let key = DrawKey::root(41).with(case);
        let draw = |number: u64, least: f64, greatest: f64| uniform(key, number, least, greatest);
        let start = DVec2::new(draw(0, 2.5, 5.5), draw(1, 6.5, 9.5));
        let way = if case.is_multiple_of(3) { DVec2::ZERO } else { DVec2::new(draw(2, -3.0, 3.0), draw(3, -3.0, 3.0)) };
        let half = DVec2::new(draw(4, 0.02, 0.45), draw(5, 0.02, 0.45));
        let Some(glint) = Glint::within(&Track { start, end: start + way, half }, [4, 8], DVec2::ZERO) else {
            continue;
        };
        let [mut found, mut within, mut all] = [0, 0, 0];
        for number in 0..SAMPLES {
            let at = even(key, number);
            found += u32::from(glint.holds(at));
            let own = glint.place(even(key.with(9), number));
            within += u32::from(own[..2].iter().all(|x| (0.0..1.0).contains(x)));
            // What the track passes of the pixel, and not only what the box says.
            let t = f64::from(at[2]);
            let apart = DVec2::new(4.0 + f64::from(at[0]), 8.0 + f64::from(at[1])) - (start + way * t);
            all += u32::from((apart.abs() - half).max_element() < -1e-5);
        }
        let share = |count: u32| f64::from(count) / f64::from(SAMPLES);
        let volume = f64::from(glint.volume());
        // Both counts are of nets in a body with a few faces: their error falls faster than that of random samples, whose
        // four sigmas are 4 sqrt(0.1 * 0.9 / 16384) = 0.0094; half of it is allowed.
        assert!((share(found) - volume * share(within)).abs() < 0.0047, "{case}: {glint:?}");
        assert!(all <= found + 2 && share(found - all.min(found)) < 0.0047, "{case}: {all} in {found}, {glint:?}");
        tried += 1;
        moving += u32::from(way != DVec2::ZERO);
    }
    assert!(tried > 150 && moving > 80, "{tried} {moving}");
}

#[test]
fn boxes_are_joined_only_where_one_is_hardly_greater() {
    let at = |x: f32, width: f32| Glint { edges: [[x, x + width], [0.2, 0.3]], velocity: [0.0; 2], times: [0.0, 1.0] };
    let of = |glints: &[Glint]| joined(&glints.iter().map(|&glint| (7, glint)).collect::<Vec<_>>());
    // Halves of one image in two triangles.
    let both = of(&[at(0.1, 0.1), at(0.19, 0.1)]);
    assert_eq!(both.len(), 1);
    assert!((both[0].volume() - 0.019).abs() < 1e-6 && both[0].holds([0.28, 0.25, 0.5]), "{both:?}");
    assert_eq!(of(&[at(0.1, 0.1), at(0.7, 0.1)]).len(), 2);
    // Two that go apart have a third of their way in common.
    let goes = Glint { velocity: [0.3, 0.0], ..at(0.1, 0.1) };
    assert_eq!(of(&[at(0.1, 0.1), goes]).len(), 2);
}

#[test]
fn a_hull_s_part_within_a_pixel_has_its_own_corners() {
    let turn = |number: u32| 0.7 + f64::from(number) * std::f64::consts::TAU / 12.0;
    // A regular polygon, points within it, and points on its sides' middles, which are no corners of it.
    let mut places = Vec::new();
    for number in 0..12 {
        let [a, b] = [turn(number), turn(number + 1)].map(|angle| DVec2::new(libm::cos(angle), libm::sin(angle)));
        places.extend([a * 0.4, a, (a + b) * 0.499]);
    }
    let rim = hull(&places);
    assert_eq!(rim.len(), 12, "{rim:?}");
    assert!(rim.iter().all(|at| at % 3 == 1), "{rim:?}");
    let outline: Vec<DVec2> = rim.iter().map(|&at| places[at]).collect();
    let area = |outline: &[DVec2]| {
        let side = |at: usize| outline[at].perp_dot(outline[(at + 1) % outline.len()]);
        0.5 * (0..outline.len()).map(side).sum::<f64>()
    };
    let whole = 6.0 * libm::sin(std::f64::consts::TAU / 12.0);
    let mut sum = 0.0;
    for cell in 0..64 {
        let [x, y] = [cell % 8, cell / 8].map(|at| f64::from(at) * 0.25 - 1.0);
        let part = clipped(&outline, DVec2::new(x, y), DVec2::new(x + 0.25, y + 0.25));
        sum += if part.is_empty() { 0.0 } else { area(&part) };
    }
    // 64 parts of some ten roundings each.
    assert!((sum - whole).abs() < 1e-13, "{sum} of {whole}");
    assert!(clipped(&outline, DVec2::new(2.0, 2.0), DVec2::new(3.0, 3.0)).is_empty());
    assert!(hull(&[DVec2::ONE]).len() <= 1 && clipped(&[], DVec2::ZERO, DVec2::ONE).is_empty());
}
