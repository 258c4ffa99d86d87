//! Pictures for the front: noise of few and many levels, checkerboards, plateaus, edges, and committed photographs of scenes. In DN
//! of any depth.

use std::path::Path;

use super::cases::Random;
use super::front_reference::Picture;

/// Kinds of made pictures.
pub const KINDS: u32 = 8;

/// A picture of one of the kinds.
pub fn made(random: &mut Random, kind: u32, width: u32, height: u32, pix_bits: u32) -> Picture {
    let top = (1_u32 << pix_bits) - 1;
    let (cell, tilt) = (random.within(2, 9), random.within(1, 5));
    let blobs: [[u32; 4]; 12] = std::array::from_fn(|_| {
        [random.below(width), random.below(height), random.within(1, 9), random.below(top + 1)]
    });
    let mut value = |x: u32, y: u32| match kind % KINDS {
        0 => random.below(top + 1),
        1 => random.below(2) * top,
        2 => random.below(4) * (top / 3),
        3 => (x / cell + y / cell) % 2 * top,
        4 => (x / cell + y / cell) % 2 * (top / 2) + random.below(top / 8),
        5 => (x * tilt + y) * 3 % (top + 1),
        6 => blobs.iter().rev().find(|b| x.abs_diff(b[0]) < b[2] && y.abs_diff(b[1]) < b[2]).map_or(top / 2, |b| b[3]),
        _ => {
            let blob = blobs.iter().find(|b| x.abs_diff(b[0]) + y.abs_diff(b[1]) < 2 * b[2]).map_or(top / 3, |b| b[3]);
            (blob + random.below(top / 16 + 1)).min(top)
        }
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| u16::try_from(value(x, y)).unwrap()).collect();
    Picture { width: usize::try_from(width).unwrap(), height: usize::try_from(height).unwrap(), pixels }
}

/// A part of a committed picture, its 8 bits brought to `pix_bits`.
pub fn committed(name: &str, width: u32, height: u32, pix_bits: u32) -> Picture {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors/fast").join(name);
    let grey = image::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_luma8();
    let (width, height) = (width.min(grey.width()), height.min(grey.height()));
    let pixel = |x, y| {
        let value = u32::from(grey.get_pixel(x, y).0[0]);
        u16::try_from((value << (pix_bits - 8)) | (value >> (16 - pix_bits))).unwrap()
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
    Picture { width: usize::try_from(width).unwrap(), height: usize::try_from(height).unwrap(), pixels }
}
