//! Hard cases of the extractor's integers: angles at seams, extreme moments, fits of equal or no values, plateaus.

use sensel::compute::blocks::{Patch, RADIUS_PX, arc_difference, fitted_shift, moments};
use sensel::compute::{Corner, angle_of, fast9};
use sensel::num::{f64_from_i64, index, low_u16, u32_from};
use sensel::plane::Plane;
use sensel::units::Size;

use super::double_double::{Dd, PI, dd};
use super::table::{Chance, Stage};

pub fn run(stage: &mut Stage) {
    angles(stage);
    moments_at_the_widest_word(stage);
    fits(stage);
    arcs(stage);
    plateaus(stage);
}

/// The nearest of 256 steps is within 1/512 of a turn. A constant of the table is off by half of 2^-16 in its slope, so an angle may be
/// given to the next step where it is 2^-17 / 2 pi = 1.3e-6 turns and less beyond the half: that excess is the error.
fn angles(stage: &mut Stage) {
    let sides = &["axes", "octant seams", "beside them", "0 / 0"];
    let case = stage.case("direction of a moment in 1/256 turns", "arctangent in double-double", "turns", sides);
    let mut chance = Chance::new(501);
    let mut check = |side: usize, x: i32, y: i32| {
        let found = f64::from(angle_of(x, y));
        if (x, y) == (0, 0) {
            case.hold(3, found == 0.0, || format!("(0, 0): {found}"));
            return;
        }
        let exact = Dd::atan2(dd(y.into()), dd(x.into())) / (PI * dd(2.0));
        let apart = (dd(found) - exact).f64();
        let error = (apart - apart.round_ties_even()).abs();
        let excess = sensel::num::greater(0.0, error - 1.0 / 512.0);
        case.see(side, excess, 1.3e-6, || format!("({x}, {y}): {found} turns"));
    };
    let sizes = [1, 2, 3, 255, 65_535, 450_685_215, i32::MAX];
    for size in sizes {
        for (x, y) in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
            check(0, x * size, y * size);
        }
        for (x, y) in [(1, 1), (-1, 1), (-1, -1), (1, -1)] {
            check(1, x * size, y * size);
            if size > 3 && size < i32::MAX {
                check(2, x * size, y * (size - 1));
                check(2, x * (size + 1), y * size);
                check(2, x * size, y);
                check(2, x, y * size);
            }
        }
    }
    check(0, i32::MIN, 0);
    check(1, i32::MIN, i32::MIN);
    check(3, 0, 0);
    for _ in 0..5000 {
        let word = |chance: &mut Chance| chance.word().cast_signed() >> chance.below(30);
        check(2, word(&mut chance), word(&mut chance));
    }
}

/// Every sum in 64 bits. The greatest moments are those of a half disc of the widest word.
fn moments_at_the_widest_word(stage: &mut Stage) {
    let sides = &["half discs of 65,535", "all bright or dark", "random"];
    let case = stage.case("first moments of the disc in 32 bits, 16-bit words", "64-bit sums", "units", sides);
    let mut chance = Chance::new(502);
    let side_px = 2 * RADIUS_PX + 1;
    let size = Size { width_px: u32_from(side_px), height_px: u32_from(side_px) };
    let corner = Corner { x_px: u32_from(RADIUS_PX), y_px: u32_from(RADIUS_PX), score: 0 };
    let offset = |coordinate: usize| i64::try_from(coordinate).unwrap() - i64::try_from(RADIUS_PX).unwrap();
    let mut check = |side: usize, at: &mut dyn FnMut(i64, i64) -> u16| {
        let values: Vec<u16> = (0..side_px * side_px).map(|n| at(offset(n % side_px), offset(n / side_px))).collect();
        let (mut x_exact, mut y_exact) = (0_i64, 0_i64);
        for (n, &value) in values.iter().enumerate() {
            let (dx, dy) = (offset(n % side_px), offset(n / side_px));
            if dx * dx + dy * dy <= 169 {
                x_exact += dx * i64::from(value);
                y_exact += dy * i64::from(value);
            }
        }
        let (x, y) = moments(&Patch::around(&Plane::from_values(size, values), &corner));
        let error = (i64::from(x) - x_exact).abs().max((i64::from(y) - y_exact).abs());
        case.see(side, f64_from_i64(error), 0.0, || format!("({x}, {y}) for ({x_exact}, {y_exact})"));
    };
    for (a, b) in [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1), (2, 1), (-1, 3)] {
        check(0, &mut |dx, dy| if a * dx + b * dy > 0 { u16::MAX } else { 0 });
    }
    check(1, &mut |_, _| u16::MAX);
    check(1, &mut |_, _| 0);
    for _ in 0..200 {
        check(2, &mut |_, _| low_u16(chance.word()));
    }
}

/// The centroid of nine values under the weights (1 2 1) both ways, in 128 bits, before it is clipped to within a pixel.
fn exact_centroid(r: &[[i32; 3]; 3]) -> Option<(i128, i128)> {
    let sum = |weight: &dyn Fn(i128, i128) -> i128| -> i128 {
        (0..9)
            .map(|n| {
                let (x, y) = (n % 3 - 1, n / 3 - 1);
                let value = r[usize::try_from(n / 3).unwrap()][usize::try_from(n % 3).unwrap()];
                weight(x, y) * (2 - x * x) * (2 - y * y) * i128::from(value)
            })
            .sum()
    };
    let all = sum(&|_, _| 1);
    // Sixteenths, 2.5 times, half up.
    let shift = |above: i128| (80 * above + all).div_euclid(2 * all);
    (all > 0).then(|| (shift(sum(&|x, _| x)), shift(sum(&|_, y| y))))
}

fn fits(stage: &mut Stage) {
    let sides = &["nothing but zeros", "inside", "beyond a pixel"];
    let case = stage.case("sub-pixel fit of nine scores", "weighted centroid in 128 bits", "1/16 px", sides);
    let mut chance = Chance::new(503);
    let hard: [[[i32; 3]; 3]; 8] = [
        [[0; 3]; 3],
        [[65_535; 3]; 3],
        [[0, 9, 0], [0, 9, 0], [0, 9, 0]],
        [[9, 0, 9], [0, 5, 0], [9, 0, 9]],
        [[0, 9, 0], [5, 5, 5], [0, 9, 0]],
        [[0, 0, 0], [0, 65_535, 0], [0, 0, 0]],
        [[0, 0, 0], [0, 65_535, 65_534], [0, 65_534, 65_533]],
        [[65_535, 0, 0], [0, 65_535, 0], [0, 0, 65_535]],
    ];
    let random = |chance: &mut Chance| {
        let size = 1 + chance.below(65_536);
        [0, 1, 2].map(|y| {
            [0, 1, 2].map(|x| {
                let middle = if (x, y) == (1, 1) { size } else { 0 };
                i32::try_from((chance.below(size) + middle).min(65_535)).unwrap()
            })
        })
    };
    for number in 0..20_000 {
        let r = if number < hard.len() { hard[number] } else { random(&mut chance) };
        let r = match if number < hard.len() { 0 } else { number % 8 } {
            // A corner that ends sharply: one side's three values are nothing, the other's as great as the middle.
            5 => r.map(|[_, middle, _]| [0, middle, r[1][1]]),
            6 => [[r[1][1]; 3], r[1], [0; 3]],
            7 => [[0; 3]; 3],
            _ => r,
        };
        let (x, y) = (fitted_shift(&r).0.to_bits(), fitted_shift(&r).1.to_bits());
        let exact = exact_centroid(&r);
        let (x_free, y_free) = exact.unwrap_or((0, 0));
        let (x_exact, y_exact) = (x_free.clamp(-16, 15), y_free.clamp(-16, 15));
        let side = match exact {
            None => 0,
            Some(free) if free != (x_exact, y_exact) => 2,
            Some(_) => 1,
        };
        case.hold(side, (x.into(), y.into()) == (x_exact, y_exact), || format!("{r:?}: {x}, {y} for {exact:?}"));
    }
}

/// Sixteen arcs of nine, one by one.
fn arcs(stage: &mut Stage) {
    let sides = &["8 bits", "16 bits", "words at their ends"];
    let case = stage.case("arc difference at equal and extreme words", "sixteen arcs one by one", "DN", sides);
    let mut chance = Chance::new(504);
    for number in 0..20_000_u64 {
        let bound = [256, 65_536, 3][usize::try_from(number % 3).unwrap()];
        let word = |chance: &mut Chance| {
            let value = chance.below(bound);
            if bound == 3 {
                [0, 32_768, u16::MAX][usize::try_from(value).unwrap()]
            } else {
                low_u16(sensel::num::low_u32(value))
            }
        };
        let (centre, circle) = (word(&mut chance), [(); 16].map(|()| word(&mut chance)));
        let mut exact = 0_i64;
        for start in 0..16 {
            let arc: Vec<i64> = (0..9).map(|k| i64::from(circle[(start + k) % 16]) - i64::from(centre)).collect();
            let (least, most) = (*arc.iter().min().unwrap(), *arc.iter().max().unwrap());
            exact = exact.max(least).max(-most);
        }
        let found = if bound == 256 {
            let low = |word: u16| u8::try_from(word).unwrap();
            i64::from(arc_difference(circle.map(low), low(centre)))
        } else {
            i64::from(arc_difference(circle, centre))
        };
        let side = usize::try_from(number % 3).unwrap();
        case.see(side, f64_from_i64((found - exact).abs()), 0.0, || {
            format!("{circle:?} about {centre}: {found} for {exact}")
        });
    }
}

/// A corner stands above all eight neighbours; of equal scores side by side none does. A picture of few levels is full of plateaus.
fn plateaus(stage: &mut Stage) {
    let sides = &["corners", "suppressed equals", "flat picture"];
    let case =
        stage.case("non-maximum suppression on plateaus of score", "definition, pixel by pixel", "corners", sides);
    let mut chance = Chance::new(505);
    for number in 0..40_u32 {
        let size = Size { width_px: 40 + number, height_px: 24 };
        let levels: [u8; 3] = [10, 200, 255];
        let values: Vec<u8> = (0..size.pixel_count())
            .map(|_| levels[index(u32_from(usize::try_from(chance.below(3)).unwrap()))])
            .collect();
        let picture = Plane::from_values(size, values);
        let found = fast9(&picture, 5);
        let score = |x: u32, y: u32| {
            let difference = sensel::compute::blocks::arc_difference_at(&picture, x, y);
            if difference > 5 { i32::from(difference) - 1 } else { 0 }
        };
        for y in 3..size.height_px - 3 {
            for x in 3..size.width_px - 3 {
                let own = score(x, y);
                if own == 0 {
                    continue;
                }
                let around = (0..9_u32).filter(|&n| n != 4).map(|n| score(x + n % 3 - 1, y + n / 3 - 1)).max().unwrap();
                let listed = found.iter().any(|corner| (corner.x_px, corner.y_px) == (x, y));
                case.hold(usize::from(own <= around), listed == (own > around), || {
                    format!("({x}, {y}) of picture {number}")
                });
            }
        }
        let flat = Plane::filled(size, levels[usize::try_from(number % 3).unwrap()]);
        case.hold(2, fast9(&flat, 1).is_empty(), || format!("flat picture {number}"));
    }
}
