//! Look-ups side by side against look-ups one by one.

use super::super::tests::{noise, question};
use super::*;
use crate::draw::DrawKey;
use crate::num::u64_from;

const NONE: u32 = u32::MAX;

#[test]
fn lanes_have_the_bits_of_single_look_ups() {
    let seed = 3;
    let textures = [
        noise(seed, [64, 48], [Wrap::Repeat; 2]),
        noise(seed, [5, 9], [Wrap::Repeat; 2]),
        noise(seed, [1, 1], [Wrap::Clamp; 2]),
        noise(seed, [31, 16], [Wrap::Mirror, Wrap::Repeat]),
        noise(seed, [128, 2], [Wrap::Clamp, Wrap::Mirror]),
    ];
    let (mut tried, mut mixed, mut bare) = (0, 0, 0);
    for case in 0..400_u64 {
        let key = DrawKey::root(seed).with(case);
        let zero = Floats::splat(0.0);
        let mut footprints =
            Footprints { shift_texels: [zero; 2], step_texels: [zero; 2], taps: zero, area_texels2: zero, snap: zero };
        let (mut uv, mut texture) = ([zero; 2], [NONE; LANES]);
        let mut single = [[1.0; BANDS]; LANES];
        for lane in 0..LANES {
            let key = key.with(u64_from(lane));
            // Packets of one picture, of two, and of all.
            let kinds = [1, 2, 6][usize::try_from(case % 3).unwrap()];
            let picture = usize::try_from((case + key.with(99).0 % kinds) % 6).unwrap();
            let (at, footprint) = question(key);
            for axis in 0..2 {
                uv[axis].0[lane] = at[axis];
                footprints.shift_texels[axis].0[lane] = footprint.shift_texels[axis];
                footprints.step_texels[axis].0[lane] = footprint.step_texels[axis];
            }
            footprints.taps.0[lane] = f32_from_u32(footprint.taps);
            footprints.area_texels2.0[lane] = footprint.area_texels2;
            footprints.snap.0[lane] = footprint.snap;
            if let Some(picture_of) = textures.get(picture) {
                texture[lane] = u32_from(picture);
                single[lane] = picture_of.over(at, &footprint);
            }
        }
        let mut found = [[1.0; BANDS]; LANES];
        let lookups = Lookups::of(uv, &texture, &textures, &footprints);
        mixed += u32::from(lookups.alone.1 > 0);
        bare += u32::from(lookups.together.1 < LANES);
        lookups.run(&mut found);
        let bits = |colours: &[Bands; LANES]| colours.map(|colour| colour.map(f32::to_bits));
        assert_eq!(bits(&found), bits(&single), "seed {seed}, case {case}");
        tried += 1;
    }
    assert!(tried == 400 && mixed > 50 && bare > 50, "{tried} {mixed} {bare}");
}
