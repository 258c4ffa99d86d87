//! The feature extractor through its front door: OpenCV's vectors, the literal definition of FAST, and the frame's rules.

// Test data are small numbers, and a test fails by panicking.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss, clippy::unwrap_used)]

use std::collections::BTreeMap;

use sensel::compute::{
    Corner, ExtractorParams, Feature, Overflow, PATCH_MARGIN_PX, every_corner, extract, fast9, to_8_bits,
};
use sensel::draw::mix;
use sensel::events::{Event, Events};
use sensel::plane::Plane;
use sensel::simd::{Level, limit};
use sensel::units::Size;

/// The circle of radius 3, clockwise from straight below.
const CIRCLE: [(i32, i32); 16] = [
    (0, 3),
    (1, 3),
    (2, 2),
    (3, 1),
    (3, 0),
    (3, -1),
    (2, -2),
    (1, -3),
    (0, -3),
    (-1, -3),
    (-2, -2),
    (-3, -1),
    (-3, 0),
    (-3, 1),
    (-2, 2),
    (-1, 3),
];

/// The definition, word for word: the largest threshold from `threshold` on at which nine neighbours in a row pass.
fn score_reference(picture: &Plane<u8>, x: usize, y: usize, threshold: u8) -> Option<u16> {
    let value = |dx: i32, dy: i32| {
        i32::from(picture.at(x.checked_add_signed(dx as isize).unwrap(), y.checked_add_signed(dy as isize).unwrap()))
    };
    let centre = value(0, 0);
    let passes = |t: i32| {
        let nine = |test: &dyn Fn(i32) -> bool| {
            (0..16).any(|start| (start..start + 9).all(|k| test(value(CIRCLE[k % 16].0, CIRCLE[k % 16].1))))
        };
        nine(&|v| v > centre + t) || nine(&|v| v < centre - t)
    };
    (i32::from(threshold)..=255).take_while(|&t| passes(t)).last().map(|t| u16::try_from(t).unwrap())
}

/// The slow twin of `fast9`.
fn fast9_reference(picture: &Plane<u8>, threshold: u8) -> Vec<Corner> {
    let (width, height) = (picture.width_px(), picture.height_px());
    let mut scores = BTreeMap::new();
    for y in 3..height.saturating_sub(3).max(3) {
        for x in 3..width.saturating_sub(3).max(3) {
            if let Some(score) = score_reference(picture, x, y, threshold) {
                scores.insert((y, x), score);
            }
        }
    }
    let around = |y: usize, x: usize| {
        let places = (y - 1..=y + 1).flat_map(move |v| (x - 1..=x + 1).map(move |u| (v, u)));
        places.filter(move |&place| place != (y, x))
    };
    let at = |place: &(usize, usize)| scores.get(place).copied().unwrap_or(0);
    let peak = |&(&(y, x), &score): &(&(usize, usize), &u16)| around(y, x).all(|place| score > at(&place));
    let corner = |(&(y, x), &score): (&(usize, usize), &u16)| Corner { x_px: x as u32, y_px: y as u32, score };
    scores.iter().filter(peak).map(corner).collect()
}

fn picture(width_px: u32, height_px: u32, value: impl Fn(u32, u32) -> u8) -> Plane<u8> {
    let values = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
    Plane::from_values(Size { width_px, height_px }, values)
}

fn noise(width_px: u32, height_px: u32, levels: u32, seed: u64) -> Plane<u8> {
    picture(width_px, height_px, |x, y| {
        let draw = mix(mix(mix(seed) ^ u64::from(y)) ^ u64::from(x)) % u64::from(levels);
        (draw as u32 * (255 / (levels - 1))) as u8
    })
}

#[test]
fn fast9_is_its_definition_on_noise_plateaus_checkerboards_and_few_levels() {
    let mut pictures = vec![
        ("checkerboard", picture(53, 41, |x, y| if (x / 5 + y / 5) % 2 == 0 { 255 } else { 0 })),
        ("plateaus", picture(71, 33, |x, y| if x % 20 < 2 && y % 16 < 2 { 200 } else { 90 })),
        ("flat", picture(33, 33, |_, _| 128)),
        ("bars", picture(90, 30, |x, y| ((x * 7 + y * y) % 256) as u8)),
    ];
    for (seed, (width, height)) in
        (1..).zip([(7, 7), (8, 7), (69, 20), (70, 19), (71, 9), (134, 11), (135, 12), (33, 40)])
    {
        for (name, levels) in [("noise of 2 levels", 2), ("noise of 4 levels", 4), ("noise of 256 levels", 256)] {
            pictures.push((name, noise(width, height, levels, seed)));
        }
    }
    let (mut cases, mut corners) = (0, 0);
    for (name, picture) in &pictures {
        for threshold in [0, 1, 2, 7, 20, 50, 63, 64, 100, 254, 255] {
            let found = fast9(picture, threshold);
            let size = picture.size();
            assert_eq!(found, fast9_reference(picture, threshold), "{name}, {size:?}, threshold {threshold}");
            cases += 1;
            corners += found.len();
        }
    }
    assert!(cases == 28 * 11 && corners > 1000, "{cases} cases with {corners} corners");
}

#[test]
fn fast9_finds_the_corners_of_opencv_with_their_scores() {
    let table = include_str!("vectors/fast/corners.csv");
    let mut expected: BTreeMap<(&str, u8), Vec<Corner>> = BTreeMap::new();
    for line in table.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let corner = Corner {
            x_px: fields[2].parse().unwrap(),
            y_px: fields[3].parse().unwrap(),
            score: fields[4].parse().unwrap(),
        };
        expected.entry((fields[0], fields[1].parse().unwrap())).or_default().push(corner);
    }
    let mut corners = 0;
    for (name, bytes) in VECTORS {
        let decoded = image::load_from_memory(bytes).unwrap().into_luma8();
        let size = Size { width_px: decoded.width(), height_px: decoded.height() };
        let picture = Plane::from_values(size, decoded.into_raw());
        for threshold in [1, 5, 20, 40, 100] {
            let found = fast9(&picture, threshold);
            let answer = expected.remove(&(*name, threshold)).unwrap_or_default();
            assert_eq!(found, answer, "{name} at threshold {threshold}");
            corners += found.len();
        }
    }
    assert!(expected.is_empty(), "pictures that were not tried: {:?}", expected.keys());
    assert!(corners > 1000, "{corners} corners");
}

macro_rules! vectors {
    ($($name:literal),*) => { &[$(($name, include_bytes!(concat!("vectors/fast/", $name, ".png")))),*] };
}
const VECTORS: &[(&str, &[u8])] = vectors![
    "scene_clean",
    "scene_noisy",
    "scene_2bit",
    "noise_256",
    "noise_4",
    "noise_2",
    "checkerboard",
    "plateau",
    "smallest",
    "narrow"
];

const LIST_ALL: ExtractorParams = ExtractorParams { threshold: 10, top_k: None, cell_px: 32, subpixel: true };

/// Soft blobs of many directions on a grid, with 16-bit codes.
fn blobs(width_px: u32, height_px: u32) -> Plane<u16> {
    picture(width_px, height_px, |x, y| {
        let (cell, step) = (mix(u64::from(x / 24 + 100 * (y / 24))), 24);
        let (dx, dy) = ((x % step) as i32 - 8 - (cell % 8) as i32, (y % step) as i32 - 8 - (cell / 8 % 8) as i32);
        let inside = dx * dx + dy * dy < 12 || (dx > 0 && dy > 0 && dx < 6 && dy < 4);
        let noise = (mix(u64::from(x) << 20 | u64::from(y)) % 5) as u8;
        60 + noise + if inside { 100 } else { 0 }
    })
    .map(|value| u16::from(value) << 8)
}

#[test]
fn features_are_the_same_at_every_depth_that_holds_the_8_bits() {
    let codes = blobs(160, 120);
    let at_16 = extract(&codes, 16, &LIST_ALL, &mut Events::default());
    assert!(at_16.len() > 20, "{} features", at_16.len());
    for bits in 8..16 {
        let shifted = codes.map(|code| code >> (16 - bits));
        assert_eq!(extract(&shifted, bits, &LIST_ALL, &mut Events::default()), at_16, "{bits} bits");
    }
    // Below 8 bits codes are shifted up: two bits are the four values 0, 64, 128 and 192.
    let two_bits = codes.map(|code| code >> 14);
    assert_eq!(to_8_bits(&two_bits, 2), codes.map(|code| (code >> 14 << 6) as u8));
}

#[test]
fn features_are_the_same_at_every_simd_level() {
    let codes = blobs(161, 119);
    let features = [Level::Baseline, Level::Avx2, Level::Avx512].map(|level| {
        limit(level);
        extract(&codes, 16, &LIST_ALL, &mut Events::default())
    });
    limit(Level::Avx512);
    assert!(features[0] == features[1] && features[1] == features[2]);
}

#[test]
fn the_full_list_holds_every_corner_and_only_whole_patches_have_descriptors() {
    let codes = blobs(160, 120);
    let corners = fast9(&to_8_bits(&codes, 16), LIST_ALL.threshold);
    let features = extract(&codes, 16, &LIST_ALL, &mut Events::default());
    let places: Vec<_> = features.iter().map(|f| (f.pixel(), f.score)).collect();
    let expected: Vec<_> = corners.iter().map(|c| ((c.x_px, c.y_px), c.score)).collect();
    assert_eq!(places, expected);
    let (mut whole, mut cut) = (0, 0);
    for feature in &features {
        let (x, y) = feature.pixel();
        let margin = PATCH_MARGIN_PX;
        let inside = x >= margin && x + margin < 160 && y >= margin && y + margin < 120;
        assert_eq!(feature.descriptor != [0; 32], inside, "corner at ({x}, {y})");
        whole += u32::from(inside);
        cut += u32::from(!inside);
    }
    assert!(whole > 10 && cut > 5, "{whole} whole patches, {cut} cut ones");
}

#[test]
fn the_choice_is_capped_ordered_by_rows_and_spread_over_the_picture() {
    let codes = blobs(320, 240);
    let all = extract(&codes, 16, &LIST_ALL, &mut Events::default());
    for top_k in [1, 10, 40, 100_000] {
        let params = ExtractorParams { top_k: Some(top_k), ..LIST_ALL };
        let chosen = extract(&codes, 16, &params, &mut Events::default());
        assert!(chosen.len() <= top_k as usize && !chosen.is_empty());
        assert!(chosen.is_sorted_by_key(|f| (f.pixel().1, f.pixel().0)));
        assert!(chosen.iter().all(|f| all.contains(f) && f.descriptor != [0; 32]));
        let cells: std::collections::BTreeSet<_> =
            chosen.iter().map(|f| (f.pixel().0 / 32, f.pixel().1 / 32)).collect();
        // Every cell has corners, so as many cells are taken as the choice has room for.
        assert!(cells.len() >= chosen.len().min(40), "{top_k}: {} cells of {}", cells.len(), chosen.len());
    }
}

#[test]
fn pictures_too_small_for_a_corner_have_none_and_impossible_ones_are_refused() {
    for (width_px, height_px) in [(1, 1), (6, 40), (40, 6), (7, 7), (16, 16), (33, 7)] {
        let codes = Plane::filled(Size { width_px, height_px }, 100_u16);
        assert_eq!(extract(&codes, 10, &LIST_ALL, &mut Events::default()), [], "{width_px} x {height_px}");
    }
    assert!(ExtractorParams::check_size(Size { width_px: 4096, height_px: 1 }).is_ok());
    assert!(ExtractorParams::check_size(Size { width_px: 4097, height_px: 1 }).is_err());
    assert!(LIST_ALL.checked().is_ok());
    for params in [
        ExtractorParams { threshold: 0, ..LIST_ALL },
        ExtractorParams { top_k: Some(0), ..LIST_ALL },
        ExtractorParams { cell_px: 0, ..LIST_ALL },
    ] {
        assert!(params.checked().is_err(), "{params:?}");
    }
}

#[test]
fn a_turned_picture_has_turned_angles_and_nearly_the_same_descriptors() {
    let codes = blobs(240, 240);
    let turned = Plane::from_values(codes.size(), (0..240 * 240).map(|i| codes.at(i / 240, 239 - i % 240)).collect());
    // The new place of (x, y) is (239 - y, x): a quarter turn from +x towards +y, 64 steps.
    let before = extract(&codes, 16, &LIST_ALL, &mut Events::default());
    let after = extract(&turned, 16, &LIST_ALL, &mut Events::default());
    let mut compared = 0;
    for feature in before.iter().filter(|f| f.descriptor != [0; 32]) {
        let (x, y) = feature.pixel();
        let twin: &Feature = after.iter().find(|f| f.pixel() == (239 - y, x)).expect("FAST turns with the picture");
        // The disc turns onto itself, so the moments are exchanged exactly; only a seam's rounding may move the angle.
        let off = twin.angle.wrapping_sub(feature.angle).wrapping_sub(64);
        assert!(off <= 1 || off == 255, "angle {} became {}", feature.angle, twin.angle);
        // Half-way places round up before and after, and so a few of the 512 points land one pixel apart.
        assert!(feature.distance(twin) <= 20, "{} bits differ at ({x}, {y})", feature.distance(twin));
        compared += 1;
    }
    assert!(compared > 50, "{compared} features");
}

#[test]
fn events_follow_the_pixels_and_the_features() {
    let count = |codes: &Plane<u16>, params: &ExtractorParams| {
        let mut events = Events::default();
        let features = extract(codes, 16, params, &mut events).len() as u64;
        (features, events)
    };
    let flat = Plane::filled(Size { width_px: 100, height_px: 80 }, 0);
    let (none, idle) = count(&flat, &LIST_ALL);
    assert_eq!(none, 0);
    assert_eq!(idle.count(Event::LineBufferWrite), 3 * 8000);
    assert_eq!(idle.count(Event::LineBufferRead), 8 * 8000);
    assert_eq!(idle.count(Event::ComputeMac), 0);
    let (some, busy) = count(&blobs(100, 80), &ExtractorParams { top_k: Some(5), subpixel: false, ..LIST_ALL });
    assert_eq!(some, 5);
    // Disc of 709 pixels, 512 points of the pattern.
    assert_eq!(busy.count(Event::LineBufferRead), 8 * 8000 + 5 * (709 + 512));
    assert_eq!(busy.count(Event::ComputeMac), 5 * (709 + 31 + 5 + 2048));
}
