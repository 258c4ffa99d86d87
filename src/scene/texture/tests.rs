//! Pictures and their look-ups, against sums by definition.

use super::*;
use crate::draw::DrawKey;
use crate::num::low_u32;
use crate::scene::light::BANDS;

fn checker(size: u32) -> Texture {
    let codes: Vec<[u8; 3]> =
        (0..size * size).map(|i| if (i % size + i / size).is_multiple_of(2) { [255; 3] } else { [0; 3] }).collect();
    Texture::from_srgb(size, size, &codes, [Wrap::Repeat; 2])
}

#[test]
fn a_checkerboard_averages_in_light_not_in_code_values() {
    // Half of the texels are 65,535: the mean is 32,767.5, off by at most one rounding of 1/65,535 a level (6 levels).
    let mean = checker(64).mean()[0];
    assert!((mean - 0.5).abs() < 7.0 / ONE, "{mean}");
}

#[test]
fn levels_mix_so_that_the_texels_area_is_the_one_asked_for() {
    let texture = checker(64);
    let mut tried = 0;
    for step in 0..60_u32 {
        let area = 1.0 + 0.37 * f32_from_u32(step * step);
        let (level, share) = texture.level_of(area);
        if level == 6 {
            continue;
        }
        let own = f32_from_u32(1 << (2 * level));
        // Two roundings of 2^-24 of the area and the mix.
        assert!((own * (1.0 + 3.0 * share) / area - 1.0).abs() < 3e-7, "{area}: {level} {share}");
        tried += 1;
    }
    assert!(tried > 50, "{tried}");
    assert_eq!(texture.level_of(f32::MAX), (6, 0.0));
}

#[test]
fn a_row_of_taps_averages_along_its_direction_only() {
    // Columns of black and white: along u the taps meet both, along v one.
    let codes: Vec<[u8; 3]> = (0..64).map(|i| if i % 8 < 4 { [255; 3] } else { [0; 3] }).collect();
    let texture = Texture::from_srgb(8, 8, &codes, [Wrap::Repeat; 2]);
    let over = |step_texels| Footprint { step_texels, taps: 8, ..Footprint::POINT };
    let at = [1.5 / 8.0, 0.5];
    // Eight texels a step apart are every column once: their mean is half of white.
    assert!((texture.over(at, &over([1.0, 0.0]))[0] - 0.5).abs() < 1e-6);
    assert!((texture.over(at, &over([0.0, 1.0]))[0] - 1.0).abs() < 1e-6);
    let moved = Footprint { shift_texels: [4.0, 0.0], ..over([0.0, 1.0]) };
    assert!(texture.over(at, &moved)[0].abs() < 1e-6);
}

#[test]
fn texel_centres_return_the_texel_and_v_runs_downwards() {
    let codes = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    let texture = Texture::from_srgb(2, 2, &codes, [Wrap::Clamp; 2]);
    assert_eq!(texture.colour([0.25, 0.25], 0.0), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(texture.colour([0.75, 0.25], 0.0), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(texture.colour([0.25, 0.75], 0.0), [0.0, 0.0, 1.0, 0.0]);
}

#[test]
fn every_wrap_stays_within_the_picture_for_wild_coordinates() {
    let mut tried = 0;
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let texture = Texture::from_srgb(3, 5, &[[128; 3]; 15], [wrap; 2]);
        let grey = texture.colour([0.5, 0.5], 0.0)[0];
        for u in [-1e9, -7.3, -1.0, -0.0, 0.0, 0.999_999_94, 1.0, 2.5, 1e9, f32::MAX] {
            let colour = texture.colour([u, -u], 1.5);
            assert!((colour[0] - grey).abs() < 1e-4, "{wrap:?} at {u}: {colour:?}");
            tried += 1;
        }
    }
    assert_eq!(tried, 30);
}

/// A picture of random texels.
pub(super) fn noise(seed: u64, [width, height]: [u32; 2], wrap: [Wrap; 2]) -> Texture {
    let key = DrawKey::root(seed);
    let code = |at: u32, band: u64| u8::try_from(key.with(u64::from(at)).with(band).0 & 0xFF).unwrap();
    let codes: Vec<[u8; 3]> = (0..width * height).map(|at| [0, 1, 2].map(|band| code(at, band))).collect();
    Texture::from_srgb(width, height, &codes, wrap)
}

/// A random number of 0..1.
pub(super) fn share(key: DrawKey, field: u64) -> f32 {
    f32_from_u32(low_u32(key.with(field).0 & 0xFF_FFFF)) / 16_777_216.0
}

/// A random footprint, and texture coordinates from -3 to 3.
pub(super) fn question(key: DrawKey) -> ([f32; 2], Footprint) {
    let signed = |field: u64, most: f32| (2.0 * share(key, field) - 1.0) * most;
    let taps = 1 + crate::num::u32_truncated_f32(share(key, 6) * f32_from_u32(TAPS_MAX));
    let footprint = Footprint {
        shift_texels: [signed(2, 3.0), signed(3, 3.0)],
        step_texels: [signed(4, 2.0), signed(5, 2.0)],
        taps,
        area_texels2: 1.0 + 40.0 * share(key, 7) * share(key, 8),
        snap: 0.5 * share(key, 9),
    };
    ([signed(0, 3.0), signed(1, 3.0)], footprint)
}

/// A texel of a level, by definition.
fn texel(level: &MipLevel, wrap: [Wrap; 2], at: [i64; 2]) -> [f64; BANDS] {
    let of_axis = |axis: usize, count: u32| {
        let count = i64::from(count);
        let inside = if wrap[axis] == Wrap::Repeat { at[axis].rem_euclid(count) } else { at[axis].clamp(0, count - 1) };
        usize::try_from(inside).unwrap()
    };
    let (x, y) = (of_axis(0, level.width), of_axis(1, level.height));
    let row = level.rows().nth(y).unwrap();
    std::array::from_fn(|band| f64::from(row[COLOURS * x + band % COLOURS]) / f64::from(ONE))
}

/// One bilinear look-up in a level, by definition.
fn bilinear(level: &MipLevel, wrap: [Wrap; 2], uv: [f64; 2]) -> [f64; BANDS] {
    let counts = [level.width, level.height];
    let coordinate = |axis: usize| {
        let folded = match wrap[axis] {
            Wrap::Repeat => uv[axis].rem_euclid(1.0),
            Wrap::Mirror => 1.0 - (uv[axis].rem_euclid(2.0) - 1.0).abs(),
            Wrap::Clamp => uv[axis].clamp(0.0, 1.0),
        };
        folded * f64::from(counts[axis]) - 0.5
    };
    let [x, y] = [coordinate(0), coordinate(1)];
    let mut sum = [0.0; BANDS];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = |at: f64, step: i64| if step == 0 { 1.0 - (at - at.floor()) } else { at - at.floor() };
        let whole = |at: f64, step: i64| crate::num::i64_truncated(at.floor()) + step;
        let found = texel(level, wrap, [whole(x, dx), whole(y, dy)]);
        for band in 0..BANDS {
            sum[band] += found[band] * weight(x, dx) * weight(y, dy);
        }
    }
    sum
}

/// A footprint's mean, tap by tap.
fn over_by_definition(texture: &Texture, uv: [f32; 2], footprint: &Footprint) -> [f64; BANDS] {
    let (level, share) = texture.level_of(footprint.area_texels2);
    let share = match (f64::from(share), f64::from(footprint.snap)) {
        (share, snap) if share <= snap => 0.0,
        (share, snap) if share >= 1.0 - snap => 1.0,
        (share, _) => share,
    };
    let mut mean = [0.0; BANDS];
    for tap in 0..footprint.taps {
        let along = f64::from(tap) - 0.5 * f64::from(footprint.taps - 1);
        let at = [0, 1].map(|axis| {
            let texels = f64::from(footprint.shift_texels[axis]) + along * f64::from(footprint.step_texels[axis]);
            f64::from(uv[axis]) + texels / f64::from(texture.size()[axis])
        });
        let fine = bilinear(&texture.levels[level], texture.wrap, at);
        let coarse = bilinear(&texture.levels[(level + 1).min(texture.levels.len() - 1)], texture.wrap, at);
        for band in 0..BANDS {
            mean[band] += (fine[band] + (coarse[band] - fine[band]) * share) / f64::from(footprint.taps);
        }
    }
    mean
}

#[test]
fn a_footprints_mean_is_that_of_its_taps_for_every_wrap_and_size() {
    let mut tried = 0;
    let seed = 7;
    for (number, size) in [[64, 48], [5, 7], [1, 1], [1, 9], [33, 2]].into_iter().enumerate() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let texture = noise(seed, size, [wrap, if number % 2 == 0 { wrap } else { Wrap::Repeat }]);
            for case in 0..200 {
                let key = DrawKey::root(seed).with(case).with(crate::num::u64_from(number));
                let (uv, footprint) = question(key);
                let found = texture.over(uv, &footprint);
                let expected = over_by_definition(&texture, uv, &footprint);
                for band in 0..BANDS {
                    // A tap's coordinate, up to 3 + (3 + 3.5 * 2) / size, is off by some six roundings of 2^-24 of at most 14 (a picture of
                    // one texel): 5e-6 of the picture; that of 64 texels, below 4, by 64 * 1.5e-6 = 1e-4 texels. A texel's way changes a
                    // colour by at most 1, in two directions; sums of eight have some twenty roundings of 2^-24.
                    let bound = 2.0 * 1e-4 + 2e-6;
                    let error = (f64::from(found[band]) - expected[band]).abs();
                    assert!(error < bound, "seed {seed}, case {case} of {size:?} {wrap:?}: {error:e}");
                }
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 3_000);
}
