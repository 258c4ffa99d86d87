//! Texture look-ups of rays that met one triangle: linear colours, lane by lane equal to those of `Texture::over` in every bit.
//!
//! Picture, level and taps in a row are those of all lanes, so that only the fetching of texels runs lane by lane.

use super::super::lanes::{Floats, LANES, Mask, next_lane};
use super::super::light::{BANDS, Bands, INFRARED};
use super::{Footprint, ONE, TAPS_MAX, TO_WHOLE, Texture, Wrap, between};
use crate::num::f32_from_u32;

/// Rows of taps, by lane: the first, and the way from tap to tap in texture coordinates.
struct TapRows {
    first: [Floats; 2],
    step: [f32; 2],
    taps: u32,
}

impl Texture {
    /// Linear colours of some lanes, averaged over footprints that differ only by how far they are shifted: by `shift_texels`, in place of
    /// the footprint's own shift.
    #[inline(always)]
    pub fn over_alike(
        &self,
        uv: &[Floats; 2],
        shift_texels: &[Floats; 2],
        footprint: &Footprint,
        lanes: Mask,
    ) -> [Bands; LANES] {
        let back = 0.5 * (f32_from_u32(footprint.taps) - 1.0);
        let mut rows = TapRows { first: *uv, step: [0.0; 2], taps: footprint.taps.min(TAPS_MAX) };
        for axis in 0..2 {
            rows.step[axis] = footprint.step_texels[axis] * self.per_size[axis];
            let shifted = uv[axis] + shift_texels[axis] * Floats::splat(self.per_size[axis]);
            rows.first[axis] = shifted - Floats::splat(back * rows.step[axis]);
        }
        let (fine, share) = self.levels_of(footprint);
        let mut sums = self.sums_alike(fine, &rows, lanes);
        if share > 0.0 {
            let coarse = self.sums_alike(fine + 1, &rows, lanes);
            for lane in 0..LANES {
                for band in 0..BANDS {
                    sums[lane][band] += (coarse[lane][band] - sums[lane][band]) * share;
                }
            }
        }
        let scale = 1.0 / (ONE * f32_from_u32(footprint.taps));
        for lane in 0..LANES {
            for band in 0..BANDS {
                sums[lane][band] *= scale;
            }
            sums[lane][INFRARED] = sums[lane][0];
        }
        sums
    }

    /// Sums of one level over the taps of each lane, without the infrared.
    #[inline(always)]
    fn sums_alike(&self, level: usize, rows: &TapRows, lanes: Mask) -> [Bands; LANES] {
        let level = &self.levels[level];
        let stride = level.width + 2;
        let (zero, one, half) = (Floats::splat(0.0), Floats::splat(1.0), Floats::splat(0.5));
        let magic = Floats::splat(TO_WHOLE);
        let mut sums = [[0.0; BANDS]; LANES];
        for tap in 0..rows.taps {
            let number = f32_from_u32(tap);
            let (mut first_texels, mut shares) = ([[0_u32; LANES]; 2], [zero; 2]);
            for axis in 0..2 {
                let at = folded(rows.first[axis] + Floats::splat(rows.step[axis] * number), self.wrap[axis]);
                // Half a texel back to the first one's middle, and one on over the rim.
                let at_texels = at.greater(zero).lesser(one) * Floats::splat(level.size[axis]) + half;
                let base = (at_texels - half) + magic;
                for lane in 0..LANES {
                    first_texels[axis][lane] = base.0[lane].to_bits().wrapping_sub(TO_WHOLE.to_bits());
                }
                shares[axis] = at_texels - (base - magic);
            }
            let mut from = [0; LANES];
            for lane in 0..LANES {
                from[lane] = first_texels[1][lane].wrapping_mul(stride).wrapping_add(first_texels[0][lane]);
            }
            let mut rest = lanes.bits();
            while rest != 0 {
                let lane = next_lane(&mut rest);
                let value = between(&level.texels, from[lane], stride, [shares[0].0[lane], shares[1].0[lane]]);
                for band in 0..BANDS {
                    sums[lane][band] += value[band];
                }
            }
        }
        sums
    }
}

/// Coordinates within the picture that show the texel of any coordinates; those of a clamped one are left as they are.
#[inline(always)]
fn folded(at: Floats, wrap: Wrap) -> Floats {
    let (half, magic) = (Floats::splat(0.5), Floats::splat(TO_WHOLE));
    match wrap {
        Wrap::Repeat => at - ((at - half + magic) - magic),
        Wrap::Mirror => {
            let whole = (at * half - half + magic) - magic;
            let period = at - (whole + whole);
            let turned = Floats::splat(2.0) - period;
            Floats::splat(1.0).below(period).select(turned, period)
        }
        Wrap::Clamp => at,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{noise, question};
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::u64_from;

    #[test]
    fn lanes_have_the_bits_of_single_look_ups() {
        let seed = 4;
        let textures = [
            noise(seed, [64, 48], [Wrap::Repeat; 2]),
            noise(seed, [1, 1], [Wrap::Clamp; 2]),
            noise(seed, [31, 16], [Wrap::Mirror, Wrap::Repeat]),
            noise(seed, [128, 2], [Wrap::Clamp, Wrap::Mirror]),
        ];
        let (mut tried, mut mixed) = (0, 0);
        for case in 0..200_u64 {
            let key = DrawKey::root(seed).with(case);
            let texture = &textures[usize::try_from(case % 4).unwrap()];
            let (_, footprint) = question(key);
            let (mut uv, mut shift) = ([Floats::splat(0.0); 2], [Floats::splat(0.0); 2]);
            let mut single = [[0.0; BANDS]; LANES];
            for lane in 0..LANES {
                let (at, other) = question(key.with(u64_from(lane)));
                for axis in 0..2 {
                    (uv[axis].0[lane], shift[axis].0[lane]) = (at[axis], other.shift_texels[axis]);
                }
                single[lane] = texture.over(at, &Footprint { shift_texels: other.shift_texels, ..footprint });
            }
            mixed += u32::from(texture.levels_of(&footprint).1 > 0.0);
            let bits = |colours: &[Bands; LANES]| colours.map(|colour| colour.map(f32::to_bits));
            let found = texture.over_alike(&uv, &shift, &footprint, Mask([u32::MAX; LANES]));
            assert_eq!(bits(&found), bits(&single), "seed {seed}, case {case}");
            tried += 1;
        }
        assert!(tried == 200 && mixed > 20, "{tried} {mixed}");
    }
}
