//! The front's clocked twin gives the extractor's corners and smoothed pixels: of every octave, in the order and clocks of its
//! description, over random and structured pictures of odd sizes, with gaps, stalls and resets; corners are `fast9`'s.

#![allow(clippy::unwrap_used)]

use crate::{cases, front_pictures, front_reference};
use cases::Random;
use front_pictures::{KINDS, committed, made};
use front_reference::{Buffers, Event, Picture, Reference, events_of};
use rtl_models::fx_front::{DRAIN, FRONT_LATENCY, FxFront, FxFrontConfig, FxFrontIn};
use rtl_models::fx_front_rows::{FrontRows, FrontRowsMemory, FrontSink, PixelWord, RowCorner, RowDone};
use sensel::compute::fast9;
use sensel::plane::Plane;
use sensel::units::Size;

fn config_for(picture: &Picture, pix_bits: u32, octaves: u32, harris: bool, spare: u32) -> FxFrontConfig {
    let [width, height] = [picture.width, picture.height].map(|side| u32::try_from(side).unwrap());
    FxFrontConfig { max_width: (width + spare).max(16), pix_bits, octaves, harris, width, height }
}

/// How often pixels and rows wait, one clock in so many; 0: never.
#[derive(Clone, Copy)]
struct Waits {
    pixels: u32,
    rows: u32,
}

/// Plays frames and checks each event's enabled clock; returns the corners seen.
fn play(config: &FxFrontConfig, pictures: &[Picture], thresholds: &[u16], waits: Waits, random: &mut Random) -> usize {
    let mut buffers = Buffers::new(config, 0xFF);
    let mut front = FxFront::new(*config, buffers.memory());
    let (mut enabled, mut corners) = (0_u64, 0);
    let mut late: Vec<(u64, Event)> = Vec::new();
    for (picture, &threshold) in pictures.iter().zip(thresholds) {
        let reference = Reference::new(config, picture, threshold);
        let (start, mut next) = (enabled, 0);
        assert_eq!(reference.slots() + u64::from(DRAIN), config.frame_slots(), "{config:?}");
        while enabled - start < config.frame_slots() {
            let row_ok = waits.rows == 0 || !random.one_in(waits.rows);
            let in_valid = waits.pixels == 0 || !random.one_in(waits.pixels);
            let takes = front.in_ready(row_ok) && in_valid;
            let in_pixel = if in_valid && next < picture.pixels.len() { picture.pixels[next] } else { 0x55 };
            let before = front.enabled_clocks();
            let out = front.tick(&FxFrontIn { rst: false, in_valid, in_pixel, row_ok, threshold });
            next += usize::from(takes);
            let slot = enabled.wrapping_sub(u64::from(FRONT_LATENCY) + start);
            let found = events_of(&out);
            assert!(
                found.is_empty() || front.enabled_clocks() > before,
                "something left in a clock that was not enabled"
            );
            late.extend(found.into_iter().map(|event| (slot, event)));
            enabled = front.enabled_clocks();
        }
        assert_eq!(next, picture.pixels.len());
        for (found, expected) in late.iter().zip(&reference.events) {
            assert_eq!(found, expected, "threshold {threshold}, {config:?}");
        }
        assert_eq!(late.len(), reference.events.len());
        late.clear();
        corners += reference.corners;
    }
    corners
}

#[test]
fn corners_smoothed_pixels_and_row_ends_are_those_of_the_definitions_in_their_clocks() {
    const SEED: u64 = 5101;
    let mut random = Random::new(SEED);
    let (mut corners, mut octaves_built, mut harris_cases) = (0, [0; 4], 0);
    for case in 0..90 {
        let pix_bits = [8, 8, 8, 9, 10, 12, 16][usize::try_from(random.below(7)).unwrap()];
        let octaves = if case % 30 > 27 { 4 } else { random.within(1, 4) };
        let (width, height) = match case % 30 {
            29 => (random.within(264, 270), random.within(264, 267)),
            28 | 14 => (random.within(132, 180), random.within(132, 140)),
            _ if random.one_in(2) => (random.within(7, 90), random.within(7, 60)),
            _ => (random.within(66, 200), random.within(33, 80)),
        };
        let pictures = [case, case + 1].map(|kind| made(&mut random, kind % KINDS, width, height, pix_bits));
        let config = config_for(&pictures[0], pix_bits, octaves, random.one_in(3), random.below(9));
        let most = ((1 << pix_bits) * 100 / 256_u32).max(2);
        let thresholds = [0, 1].map(|_| u16::try_from(random.within(1, most)).unwrap());
        let waits =
            Waits { pixels: [0, 3][usize::from(random.one_in(2))], rows: [0, 2][usize::from(random.one_in(2))] };
        corners += play(&config, &pictures, &thresholds, waits, &mut random);
        let built = (0..octaves).filter(|&octave| config.built(octave)).count();
        octaves_built[built - 1] += 1;
        harris_cases += u32::from(config.harris);
    }
    println!(
        "seed {SEED}: {corners} corners; frames with 1 to 4 octaves: {octaves_built:?}; {harris_cases} with Harris"
    );
    assert!(corners > 10_000 && octaves_built.iter().all(|&count| count > 2) && harris_cases > 10);
}

/// Collects what leaves a row at a time as events.
#[derive(Default)]
struct Collected {
    corners: Vec<RowCorner>,
    events: Vec<(u64, Event)>,
}

impl<T: PixelWord> FrontSink<T> for Collected {
    fn corner(&mut self, corner: &RowCorner) {
        self.corners.push(*corner);
    }

    fn row(&mut self, done: &RowDone<'_, T>) {
        let RowDone { octave, row, is_virtual, frame_end, start, smoothed } = *done;
        let corner = |c: &RowCorner| {
            let (x, y, score, resp, rank) = (c.x, c.y, c.score, c.resp, c.rank);
            (start + u64::from(x) + 4, Event::Corner { octave, x, y, score, resp, rank })
        };
        let pixel = |(x, &pixel): (u32, &T)| {
            let (y, pixel) = (row - 3, pixel.into());
            (start + u64::from(x) + 3, Event::Smoothed { octave, x, y, pixel })
        };
        let mut events: Vec<_> =
            (3..).zip(smoothed).map(pixel).chain(self.corners.drain(..).map(|c| corner(&c))).collect();
        // The sort is stable: in one slot the smoothed pixel comes before the corner.
        events.sort_by_key(|event| event.0);
        self.events.extend(events);
        self.last_slot(octave, row, is_virtual, frame_end);
    }
}

impl Collected {
    fn last_slot(&mut self, octave: u32, row: u32, is_virtual: bool, frame_end: bool) {
        self.events.push((u64::MAX, Event::RowEnd { octave, row, is_virtual, frame_end }));
    }
}

fn rows_equal<T: PixelWord + std::fmt::Debug>(
    config: &FxFrontConfig,
    pictures: &[Picture],
    thresholds: &[u16],
) -> usize {
    let words = FrontRows::<T>::words(config);
    let width = usize::try_from(config.max_width).unwrap();
    let narrow = |value: u16| T::try_from(value).ok().unwrap();
    let (mut pixels, mut differences) = (vec![narrow(0x77); 8 * words], vec![narrow(0x77); 3 * words]);
    let (mut scratch, mut sums) = (vec![narrow(0x77); width], vec![7; width]);
    let memory =
        FrontRowsMemory { pixels: &mut pixels, differences: &mut differences, scratch: &mut scratch, sums: &mut sums };
    let mut front = FrontRows::new(*config, memory);
    let mut corners = 0;
    for (picture, &threshold) in pictures.iter().zip(thresholds) {
        let reference = Reference::new(config, picture, threshold);
        let (mut collected, start) = (Collected::default(), front.slots());
        for row in picture.pixels.chunks(picture.width) {
            let row: Vec<T> = row.iter().map(|&pixel| narrow(pixel)).collect();
            front.row(&row, narrow(threshold), &mut collected);
        }
        assert_eq!(front.slots() - start, config.frame_slots());
        assert_eq!(collected.events.len(), reference.events.len(), "{config:?}");
        for (found, expected) in collected.events.iter().zip(&reference.events) {
            let ends = matches!(expected.1, Event::RowEnd { .. });
            assert!(
                found.1 == expected.1 && (ends || found.0 - start == expected.0),
                "{found:?}, {expected:?}, {config:?}"
            );
        }
        corners += reference.corners;
    }
    corners
}

#[test]
fn a_row_at_a_time_gives_the_same_corners_pixels_and_slots() {
    const SEED: u64 = 5103;
    let mut random = Random::new(SEED);
    let (mut corners, mut narrow) = (0, 0);
    for case in 0..70 {
        let pix_bits = [8, 8, 8, 10, 12, 16][usize::try_from(random.below(6)).unwrap()];
        let (width, height) = (random.within(7, 200), random.within(7, 90));
        let pictures = [case, case + 3].map(|kind| made(&mut random, kind % KINDS, width, height, pix_bits));
        let octaves = random.within(1, 4);
        let config = config_for(&pictures[0], pix_bits, octaves, random.one_in(3), random.below(9));
        let most = ((1 << pix_bits) * 100 / 256_u32).max(2);
        let thresholds = [0, 1].map(|_| u16::try_from(random.within(1, most)).unwrap());
        if pix_bits == 8 {
            corners += rows_equal::<u8>(&config, &pictures, &thresholds);
            narrow += 1;
        }
        corners += rows_equal::<u16>(&config, &pictures, &thresholds);
    }
    println!("seed {SEED}: {corners} corners, {narrow} cases in bytes");
    assert!(corners > 10_000 && narrow > 20);
}

#[test]
fn the_reference_finds_the_corners_of_fast9_in_every_octave() {
    const SEED: u64 = 5102;
    let mut random = Random::new(SEED);
    let mut compared = [0; 3];
    for case in 0..60 {
        let least = if case % 5 == 4 { 132 } else { 7 };
        let (width, height) = (random.within(least, 200), random.within(least, 150));
        let mut picture = made(&mut random, case % KINDS, width, height, 8);
        if case % 10 == 9 {
            let name = ["scene_noisy.png", "plateau.png", "scene_2bit.png"][usize::try_from(case / 10 % 3).unwrap()];
            picture = committed(name, 200, 140, 8);
        }
        let config = config_for(&picture, 8, 3, false, 0);
        // Pictures of half the scale have less contrast.
        let most = if case % 2 == 0 { 100 } else { 20 };
        let threshold = u16::try_from(random.within(1, most)).unwrap();
        let reference = Reference::new(&config, &picture, threshold);
        for octave in 0..3 {
            let Some(picture) = reference.picture(octave) else { break };
            let [width_px, height_px] = [picture.width, picture.height].map(|side| u32::try_from(side).unwrap());
            let bytes = picture.pixels.iter().map(|&pixel| u8::try_from(pixel).unwrap()).collect();
            let plane = Plane::from_values(Size { width_px, height_px }, bytes);
            let expected: Vec<_> = fast9(&plane, u8::try_from(threshold).unwrap())
                .iter()
                .map(|corner| (corner.x_px, corner.y_px, u32::from(corner.score)))
                .collect();
            let corner = |event: &(u64, Event)| match event.1 {
                Event::Corner { octave: found, x, y, score, .. } if usize::try_from(found) == Ok(octave) => {
                    Some((x, y, u32::from(score)))
                }
                _ => None,
            };
            let found: Vec<_> = reference.events.iter().filter_map(corner).collect();
            assert_eq!(found, expected, "case {case}, octave {octave}: {config:?}, threshold {threshold}");
            compared[octave] += found.len();
        }
    }
    println!("seed {SEED}: corners of octaves 0 to 2: {compared:?}");
    assert!(compared[0] > 5000 && compared[1] > 1000 && compared[2] > 20, "{compared:?}");
}
