//! The feature extractor through its front door: OpenCV's vectors, the literal definition of FAST, and the frame's rules.

// Test data are small numbers, and a test fails by panicking.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss, clippy::unwrap_used)]

use std::collections::BTreeMap;

use sensel::compute::{
    AlwaysReady, AtOnce, Corner, Extractor, ExtractorParams, Feature, PATCH_MARGIN_PX, PairPattern, Pixels, Records,
    blocks, every_corner, extract, fast9, to_8_bits,
};
use sensel::draw::mix;
use sensel::events::{Event, Events};
use sensel::plane::Plane;
use sensel::simd::{Level, limit};
use sensel::units::Size;
use sensel::words::PositionPx;

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
        let positions = (y - 1..=y + 1).flat_map(move |v| (x - 1..=x + 1).map(move |u| (v, u)));
        positions.filter(move |&position| position != (y, x))
    };
    let at = |position: &(usize, usize)| scores.get(position).copied().unwrap_or(0);
    let peak = |&(&(y, x), &score): &(&(usize, usize), &u16)| around(y, x).all(|position| score > at(&position));
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

/// Every cell keeps its best four, and all of them are served.
const MANY: ExtractorParams = ExtractorParams { threshold: 10, per_cell: 4, ..ExtractorParams::USUAL };
/// The same with each feature in the middle of its corner's pixel.
const WHOLE: ExtractorParams = ExtractorParams { subpixel: false, ..MANY };

fn features(codes: &Plane<u16>, bits: u32, params: &ExtractorParams) -> Vec<Feature> {
    extract(codes, bits, params, &mut Events::default()).unwrap()
}

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
    let at_16 = features(&codes, 16, &MANY);
    assert!(at_16.len() > 20, "{} features", at_16.len());
    for bits in 8..16 {
        let shifted = codes.map(|code| code >> (16 - bits));
        assert_eq!(features(&shifted, bits, &MANY), at_16, "{bits} bits");
    }
    // Below 8 bits codes are shifted up: two bits are the four values 0, 64, 128 and 192.
    let two_bits = codes.map(|code| code >> 14);
    assert_eq!(to_8_bits(&two_bits, 2), codes.map(|code| (code >> 14 << 6) as u8));
}

#[test]
fn a_wide_pipeline_finds_the_same_features_in_codes_of_8_bits() {
    let codes = blobs(160, 120);
    let at_8 = features(&codes, 16, &MANY);
    for pipeline_bits in 9..=16 {
        // Shifted words keep every comparison. d > t in 8 bits is 2^s d > 2^s t, and the score is one step of the wider word less.
        let shift = pipeline_bits - 8;
        let wide = ExtractorParams { pipeline_bits, threshold: MANY.threshold << shift, ..MANY };
        let found = features(&codes, 16, &wide);
        assert_eq!(found.len(), at_8.len(), "{pipeline_bits} bits");
        for (wide, narrow) in found.iter().zip(&at_8) {
            assert_eq!((wide.x, wide.y), (narrow.x, narrow.y));
            assert_eq!(wide.score, ((narrow.score + 1) << shift) - 1);
            // Smoothed words keep bits below the narrow ones', so angles and comparisons may differ where those are equal.
            let off = wide.angle.wrapping_sub(narrow.angle).to_bits();
            assert!(off <= 1 || off == 255, "{pipeline_bits} bits");
        }
    }
}

/// The definition again, on words of 16 bits.
#[test]
fn fast9_on_wide_words_is_that_of_the_scaled_picture() {
    for (seed, levels) in [(1, 2), (2, 5), (3, 256)] {
        let narrow = noise(77, 40, levels, seed);
        let wide = narrow.map(|value| u16::from(value) * 257);
        for threshold in [1, 20, 100] {
            let expected: Vec<Corner> = fast9_reference(&narrow, threshold)
                .into_iter()
                .map(|corner| Corner { score: (corner.score + 1) * 257 - 1, ..corner })
                .collect();
            assert_eq!(fast9(&wide, u16::from(threshold) * 257), expected, "seed {seed}, threshold {threshold}");
        }
    }
}

#[test]
fn features_are_the_same_at_every_simd_level() {
    let _turn = crate::common::LEVEL.lock().expect("no test has failed while it held the level");
    let codes = blobs(161, 119);
    for pipeline_bits in [8, 12] {
        let params = ExtractorParams { pipeline_bits, octaves: 2, ..MANY };
        let found = [Level::Baseline, Level::Avx2, Level::Avx512].map(|level| {
            limit(level);
            features(&codes, 16, &params)
        });
        limit(Level::Avx512);
        assert!(found[0] == found[1] && found[1] == found[2] && found[0].len() > 20);
    }
}

#[test]
fn the_full_list_holds_every_corner_and_only_whole_patches_have_descriptors() {
    let codes = blobs(160, 120);
    let corners = fast9(&to_8_bits(&codes, 16), 10);
    let positions: Vec<_> = every_corner(&codes, 16, &WHOLE)
        .unwrap()
        .iter()
        .map(|f| (f.pixel(), f.x.frac().to_bits(), f.y.frac().to_bits(), f.score))
        .collect();
    let expected: Vec<_> = corners.iter().map(|c| ((c.x_px, c.y_px), 0, 0, c.score)).collect();
    assert_eq!(positions, expected);
    let listed = every_corner(&codes, 16, &MANY).unwrap();
    assert_eq!(listed.len(), corners.len());
    let (mut whole, mut cut) = (0, 0);
    for (feature, corner) in listed.iter().zip(&corners) {
        // A fit moves a position by a pixel at most.
        let near = |position_px: f64, px: u32| (position_px - f64::from(px)).abs() <= 1.0;
        assert!(near(feature.x_px(), corner.x_px) && near(feature.y_px(), corner.y_px), "{feature:?} of {corner:?}");
        let inside = has_patch((corner.x_px, corner.y_px), 160, 120);
        assert_eq!(feature.descriptor != [0; 32], inside, "corner at {:?}", feature.pixel());
        whole += u32::from(inside);
        cut += u32::from(!inside);
    }
    assert!(whole > 10 && cut > 5, "{whole} whole patches, {cut} cut ones");
}

fn has_patch((x, y): (u32, u32), width_px: u32, height_px: u32) -> bool {
    let margin = PATCH_MARGIN_PX;
    x >= margin && x + margin < width_px && y >= margin && y + margin < height_px
}

/// The rule of the cells, written again over the full list: of each cell the highest scores, of equal ones the first by rows; cell
/// rows downwards, cells to the right, each list from its highest.
#[test]
fn each_cell_gives_its_best_by_cell_rows() {
    let codes = blobs(330, 250);
    let all = every_corner(&codes, 16, &MANY).unwrap();
    let corners: Vec<_> = every_corner(&codes, 16, &WHOLE).unwrap().iter().map(Feature::pixel).collect();
    for cell_px in [16, 32, 64] {
        for per_cell in 1..=4 {
            let mut cells: BTreeMap<(u32, u32), Vec<Feature>> = BTreeMap::new();
            for (feature, &(x, y)) in all.iter().zip(&corners).filter(|(_, at)| has_patch(**at, 330, 250)) {
                cells.entry((y / cell_px, x / cell_px)).or_default().push(*feature);
            }
            for cell in cells.values_mut() {
                cell.sort_by_key(|feature| std::cmp::Reverse(feature.score));
                cell.truncate(per_cell as usize);
            }
            let expected: Vec<Feature> = cells.into_values().flatten().collect();
            let params = ExtractorParams { cell_px, per_cell, ..MANY };
            assert_eq!(features(&codes, 16, &params), expected, "{per_cell} of {cell_px} px");
            let most = params.features_max(codes.size());
            assert!(expected.len() > 10 && expected.len() as u64 <= most, "{} of {most}", expected.len());
        }
    }
}

#[test]
fn an_upper_octave_is_the_extractor_on_the_halved_picture() {
    let codes = blobs(321, 242);
    let params = ExtractorParams { octaves: 4, ..MANY };
    let all = features(&codes, 16, &params);
    let mut picture = to_8_bits(&codes, 16);
    for octave in 0..3_u8 {
        let alone = features(&picture.map(u16::from), 8, &MANY);
        let mut of_octave: Vec<Feature> = all.iter().filter(|feature| feature.octave == octave).copied().collect();
        // Positions are scaled about the picture's corner, half a pixel before the first centre.
        let scaled = |coordinate: PositionPx| PositionPx::from_bits(((coordinate.to_bits() + 8) << octave) - 8);
        let mut expected: Vec<Feature> = alone
            .iter()
            .map(|feature| Feature { x: scaled(feature.x), y: scaled(feature.y), octave, ..*feature })
            .collect();
        let by_position = |feature: &Feature| (feature.y, feature.x);
        of_octave.sort_by_key(by_position);
        expected.sort_by_key(by_position);
        assert!(of_octave == expected && !expected.is_empty(), "octave {octave}");
        picture = blocks::half_scale(&picture);
    }
    // 40 x 30 pixels: under 33 a side, so it is not built.
    assert!(all.iter().all(|feature| feature.octave < 3));
}

#[test]
fn what_cannot_be_extracted_from_is_refused_in_words() {
    let refusal = |width_px: u32, height_px: u32, code: u16, bits: u32| {
        let codes = Plane::filled(Size { width_px, height_px }, code);
        let errors =
            [extract(&codes, bits, &MANY, &mut Events::default()).err(), every_corner(&codes, bits, &MANY).err()];
        errors.map(|error| error.unwrap().to_string())
    };
    for (width_px, height_px) in [(1, 1), (6, 40), (40, 6), (1, 300), (300, 1), (4097, 7)] {
        for message in refusal(width_px, height_px, 100, 10) {
            assert!(message.contains("7 to 4096 pixels a side"), "{message}");
        }
    }
    for (code, bits, part) in [(256, 8, "use 9 bits"), (65_535, 8, "use 16 bits"), (1, 0, "0 bits"), (1, 17, "17 bits")]
    {
        for message in refusal(40, 40, code, bits) {
            assert!(message.contains(part), "{message}");
        }
    }
    for (width_px, height_px) in [(7, 7), (16, 16), (33, 7), (7, 4096)] {
        let codes = Plane::filled(Size { width_px, height_px }, 100_u16);
        assert_eq!(features(&codes, 10, &MANY), [], "{width_px} x {height_px}");
    }
    assert!(MANY.checked().is_ok());
    for params in [
        ExtractorParams { threshold: 0, ..MANY },
        ExtractorParams { threshold: 256, ..MANY },
        ExtractorParams { pipeline_bits: 17, ..MANY },
        ExtractorParams { octaves: 5, ..MANY },
        ExtractorParams { cell_px: 24, ..MANY },
        ExtractorParams { per_cell: 0, ..MANY },
        ExtractorParams { descriptor_bits: 100, ..MANY },
        ExtractorParams { engines: 0, ..MANY },
        ExtractorParams { fifo_depth: 65, ..MANY },
    ] {
        assert!(params.checked().is_err(), "{params:?}");
    }
}

#[test]
fn a_turned_picture_has_turned_angles_and_nearly_the_same_descriptors() {
    let codes = blobs(240, 240);
    let turned = Plane::from_values(codes.size(), (0..240 * 240).map(|i| codes.at(i / 240, 239 - i % 240)).collect());
    // The new position of (x, y) is (239 - y, x): a quarter turn from +x towards +y, 64 steps.
    for pattern in [PairPattern::Gaussian, PairPattern::Symmetric] {
        let params = ExtractorParams { pattern, subpixel: false, ..MANY };
        let before = every_corner(&codes, 16, &params).unwrap();
        let after = every_corner(&turned, 16, &params).unwrap();
        let mut compared = 0;
        for feature in before.iter().filter(|f| f.descriptor != [0; 32]) {
            let (x, y) = feature.pixel();
            let twin: &Feature = after.iter().find(|f| f.pixel() == (239 - y, x)).expect("FAST turns with the picture");
            // The disc turns onto itself, so the moments are exchanged exactly; only a seam's rounding may move the angle.
            let off = twin.angle.wrapping_sub(feature.angle).to_bits().wrapping_sub(64);
            assert!(off <= 1 || off == 255, "angle {} became {}", feature.angle, twin.angle);
            // Half-way positions round up before and after, and so a few of the 512 points land one pixel apart. The symmetric pattern
            // may besides land in the next of its 32 turns where the angle moved over a seam.
            let seam = pattern == PairPattern::Symmetric
                && off != 0
                && twin.angle.to_bits() % 8 != feature.angle.to_bits() % 8;
            assert!(seam || feature.distance(twin) <= 20, "{} bits differ at ({x}, {y})", feature.distance(twin));
            compared += 1;
        }
        assert!(compared > 50, "{compared} features");
    }
}

#[test]
fn shorter_words_are_the_longer_ones_cut() {
    let codes = blobs(200, 160);
    let whole = features(&codes, 16, &MANY);
    for descriptor_bits in [64, 128, 192] {
        let cut = features(&codes, 16, &ExtractorParams { descriptor_bits, ..MANY });
        let bytes = descriptor_bits as usize / 8;
        for (cut, whole) in cut.iter().zip(&whole) {
            assert!(
                cut.descriptor[..bytes] == whole.descriptor[..bytes] && cut.descriptor[bytes..].iter().all(|&b| b == 0)
            );
        }
    }
    for angle_bits in 3..8 {
        let rounded = features(&codes, 16, &ExtractorParams { angle_bits, ..MANY });
        let step = 256 >> angle_bits;
        for (rounded, whole) in rounded.iter().zip(&whole) {
            let off = i32::from(rounded.angle.wrapping_sub(whole.angle).to_bits().cast_signed());
            assert!(i32::from(rounded.angle.to_bits()) % step == 0 && 2 * off.abs() <= step, "{angle_bits} bits");
        }
    }
}

#[test]
fn the_threshold_follows_its_target_from_frame_to_frame() {
    let codes = blobs(320, 240);
    let corners = |threshold: u16| {
        let listed = every_corner(&codes, 16, &ExtractorParams { threshold, ..WHOLE }).unwrap();
        listed.iter().filter(|feature| has_patch(feature.pixel(), 320, 240)).count() as u64
    };
    let target = corners(60);
    let params = ExtractorParams { target_features: target as u32, threshold: 2, ..MANY };
    let mut extractor = Extractor::new(&params);
    // A run has no warm-up: its first frame's own corners choose where it starts.
    let first = Extractor::new(&params).first_frame(&codes, 16).unwrap();
    assert_eq!(
        (first.counts.corners, corners(first.threshold), corners(first.threshold - 1) > target),
        (target, target, true)
    );
    let mut thresholds = vec![first.threshold];
    let mut show = |codes: &Plane<u16>| {
        let mut last = 0;
        for _ in 0..60 {
            let io = (&mut AtOnce as &mut dyn Pixels, &mut AlwaysReady as &mut dyn Records);
            let frame = extractor.frame(codes, 16, (1, 1), io, &mut Events::default()).unwrap();
            assert_eq!(frame.threshold, *thresholds.last().unwrap());
            last = frame.counts.corners;
            thresholds.push(params.next_threshold(frame.threshold, last));
        }
        (last, *thresholds.last().unwrap())
    };
    let near = |corners: u64| corners >= target - target / 8 && corners <= target + target / 8;
    // It stays there, falls to its least before a blank wall, and rises to the target again.
    assert_eq!(show(&codes), (target, first.threshold));
    assert_eq!(show(&Plane::filled(codes.size(), 7)), (0, 2));
    let (settled, threshold) = show(&codes);
    assert!(near(settled) && threshold > 2, "{settled} of {target}");
    let fixed = ExtractorParams { target_features: 0, ..MANY };
    assert_eq!(fixed.next_threshold(10, 1_000_000), 10);
    let adaptive = ExtractorParams { target_features: 100, threshold: 2, ..MANY };
    assert_eq!(
        [(2, 0), (3, 0), (33, 0), (20, 1000), (250, 1000)].map(|(t, n)| adaptive.next_threshold(t, n)),
        [2, 2, 31, 22, 254]
    );
}

#[test]
fn events_follow_the_pixels_and_the_features() {
    let count = |codes: &Plane<u16>, params: &ExtractorParams| {
        let mut events = Events::default();
        let features = extract(codes, 16, params, &mut events).unwrap().len() as u64;
        (features, events)
    };
    let usual = ExtractorParams { threshold: 10, ..ExtractorParams::USUAL };
    let flat = Plane::filled(Size { width_px: 100, height_px: 80 }, 0);
    let (none, idle) = count(&flat, &usual);
    assert_eq!(none, 0);
    // Six rows of the window and two of scores, read and written; and the ring.
    assert_eq!(idle.count(Event::LineBufferWrite), 9 * 8000);
    assert_eq!(idle.count(Event::LineBufferRead), 8 * 8000);
    assert_eq!(idle.count(Event::ComputeMac), 0);
    let (some, busy) = count(&blobs(100, 80), &ExtractorParams { subpixel: false, ..usual });
    assert!(some > 5);
    // Turned points, two moments of 27 columns or rows, 32 slopes.
    assert_eq!(busy.count(Event::ComputeMac), some * (2048 + 54 + 32));
    let (same, symmetric) =
        count(&blobs(100, 80), &ExtractorParams { subpixel: false, pattern: PairPattern::Symmetric, ..usual });
    assert_eq!((same, symmetric.count(Event::ComputeMac)), (some, some * (54 + 32)));
    let (_, wide) = count(&flat, &ExtractorParams { pipeline_bits: 12, threshold: 160, ..usual });
    assert_eq!(wide.count(Event::LineBufferWrite), 9 * 8000 * 12 / 8);
}
