//! Look-ups of a whole packet. Enters: texture coordinates and footprints, lane by lane. Leaves: linear colours, equal to those of
//! `Texture::over` in every bit.
//!
//! What all lanes do alike - levels, places, weights - is done side by side; texels are fetched lane by lane, with four bands in one
//! register.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::super::lanes::{Floats, LANES};
use super::super::light::{BANDS, Bands};
use super::{Footprints, ONE, TAPS, TO_WHOLE, Texture, Wrap, between};
use crate::num::{f32_from_u32, index, u32_from, u32_truncated_f32};

/// Look-ups that are ready to be fetched.
pub struct Lookups<'a> {
    textures: &'a [Texture],
    /// Texture of each lane; one that does not exist where there is none.
    texture: &'a [u32; LANES],
    footprints: &'a Footprints,
    uv: [Floats; 2],
    /// The first place of each row of them in texture coordinates, and the way from place to place.
    first: [Floats; 2],
    step: [Floats; 2],
    /// Finer level of each lane, and the weight of the next.
    level: [u32; LANES],
    share: [f32; LANES],
    /// How all lanes' textures go on beyond their edges, but those that are fetched alone.
    wrap: [Wrap; 2],
    /// Lanes that are fetched together, and how many there are.
    together: ([usize; LANES], usize),
    /// Lanes that have another wrap.
    alone: ([usize; LANES], usize),
}

impl<'a> Lookups<'a> {
    /// Chooses levels and rows of places.
    #[inline(always)]
    pub fn of(uv: [Floats; 2], texture: &'a [u32; LANES], textures: &'a [Texture], footprints: &'a Footprints) -> Self {
        let zero = Floats::splat(0.0);
        let (level, share) = levels(footprints);
        let mut all = Self {
            textures,
            texture,
            footprints,
            uv,
            first: [zero; 2],
            step: [zero; 2],
            level,
            share,
            wrap: [Wrap::Repeat; 2],
            together: ([0; LANES], 0),
            alone: ([0; LANES], 0),
        };
        let mut per_size = [zero; 2];
        for lane in 0..LANES {
            let Some(texture) = textures.get(index(texture[lane])) else { continue };
            if all.together.1 == 0 {
                all.wrap = texture.wrap;
            }
            let list = if texture.wrap == all.wrap { &mut all.together } else { &mut all.alone };
            list.0[list.1] = lane;
            list.1 += 1;
            let last = u32_from(texture.levels.len()) - 1;
            if all.level[lane] >= last {
                (all.level[lane], all.share[lane]) = (last, 0.0);
            }
            (per_size[0].0[lane], per_size[1].0[lane]) = (texture.per_size[0], texture.per_size[1]);
        }
        let back = Floats::splat(0.5) * (footprints.taps - Floats::splat(1.0));
        for axis in 0..2 {
            all.step[axis] = footprints.step_texels[axis] * per_size[axis];
            all.first[axis] = uv[axis] + footprints.shift_texels[axis] * per_size[axis] - back * all.step[axis];
        }
        all
    }

    /// Fetches colours of all lanes that have a texture.
    #[inline(always)]
    pub fn run(&self, colours: &mut [Bands; LANES]) {
        let mut sums = [[0.0; BANDS]; LANES];
        let mut list = self.together;
        let mut level = self.level;
        let mut is_coarse = false;
        while list.1 > 0 {
            self.add_taps(&level, &list, is_coarse, &mut sums);
            if is_coarse {
                break;
            }
            is_coarse = true;
            let fine = list;
            list.1 = 0;
            for &lane in &fine.0[..fine.1] {
                if self.share[lane] > 0.0 {
                    list.0[list.1] = lane;
                    list.1 += 1;
                    level[lane] += 1;
                }
            }
        }
        let mut scale = Floats::splat(ONE) * self.footprints.taps;
        for lane in 0..LANES {
            scale.0[lane] = 1.0 / scale.0[lane];
        }
        for &lane in &self.together.0[..self.together.1] {
            for band in 0..BANDS {
                colours[lane][band] = sums[lane][band] * scale.0[lane];
            }
        }
        for &lane in &self.alone.0[..self.alone.1] {
            let uv = [self.uv[0].0[lane], self.uv[1].0[lane]];
            colours[lane] = self.textures[index(self.texture[lane])].over(uv, &self.footprints.lane(lane));
        }
    }

    /// One level's sums over the places of listed lanes; the coarser one's are mixed into the finer one's.
    #[inline(always)]
    fn add_taps(
        &self,
        level: &[u32; LANES],
        list: &([usize; LANES], usize),
        is_coarse: bool,
        sums: &mut [Bands; LANES],
    ) {
        let lanes = &list.0[..list.1];
        let mut size = [Floats::splat(1.0); 2];
        let mut stride = [0; LANES];
        let mut texels: [&[u16]; LANES] = [&[]; LANES];
        for &lane in lanes {
            let level = &self.textures[index(self.texture[lane])].levels[index(level[lane])];
            (size[0].0[lane], size[1].0[lane]) = (level.size[0], level.size[1]);
            stride[lane] = level.width + 2;
            texels[lane] = &level.texels;
        }
        let taps = self.footprints.taps + Floats::splat(TO_WHOLE);
        let places = Places::of(self, &size, &stride, u32_truncated_f32(self.footprints.taps.most()));
        for &lane in lanes {
            let mut sum = [0.0; BANDS];
            let taps = index(taps.0[lane].to_bits().wrapping_sub(TO_WHOLE.to_bits()));
            for tap in 0..taps.min(TAPS) {
                let shares = [places.shares[0][tap].0[lane], places.shares[1][tap].0[lane]];
                let value = between(texels[lane], places.from[tap][lane], stride[lane], shares);
                for band in 0..BANDS {
                    sum[band] += value[band];
                }
            }
            if is_coarse {
                for band in 0..BANDS {
                    sum[band] = sums[lane][band] + (sum[band] - sums[lane][band]) * self.share[lane];
                }
            }
            sums[lane] = sum;
        }
    }
}

/// Levels and the weights of their next, as `Texture::level_of` and `Texture::over` choose them, without regard to the last.
#[inline(always)]
fn levels(footprints: &Footprints) -> ([u32; LANES], [f32; LANES]) {
    let (mut level, mut share) = ([0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let area_texels2 = footprints.area_texels2.0[lane];
        let exponent = ((area_texels2.to_bits() >> 23) & 0xFF).saturating_sub(127);
        let fine = exponent / 2;
        // Four to the power of the level.
        let own = f32::from_bits((2 * fine + 127) << 23);
        let weight = (area_texels2 / own - 1.0) * (1.0 / 3.0);
        let weight = if weight > 0.0 { weight } else { 0.0 };
        let weight = if weight < 1.0 { weight } else { 1.0 };
        let snap = footprints.snap.0[lane];
        let is_fine = weight <= snap;
        let is_next = !is_fine & (weight >= 1.0 - snap);
        level[lane] = fine + u32::from(is_next);
        share[lane] = if is_fine | is_next { 0.0 } else { weight };
    }
    (level, share)
}

/// Places of all look-ups in a level with its rim: the first texel of each square and the weights of the second column and row.
struct Places {
    from: [[u32; LANES]; TAPS],
    shares: [[Floats; TAPS]; 2],
}

impl Places {
    /// Of up to so many taps.
    #[inline(always)]
    fn of(lookups: &Lookups, size: &[Floats; 2], stride: &[u32; LANES], taps: u32) -> Self {
        let zero = Floats::splat(0.0);
        let mut all = Self { from: [[0; LANES]; TAPS], shares: [[zero; TAPS]; 2] };
        for tap in 0..index(taps).min(TAPS) {
            let number = Floats::splat(f32_from_u32(u32_from(tap)));
            let mut places = [[0; LANES]; 2];
            for axis in 0..2 {
                let at = folded(lookups.first[axis] + lookups.step[axis] * number, lookups.wrap[axis]);
                let at = at.greater(zero).lesser(Floats::splat(1.0));
                let place = at * size[axis] + Floats::splat(0.5);
                let base = (place - Floats::splat(0.5)) + Floats::splat(TO_WHOLE);
                for lane in 0..LANES {
                    places[axis][lane] = base.0[lane].to_bits().wrapping_sub(TO_WHOLE.to_bits());
                }
                all.shares[axis][tap] = place - (base - Floats::splat(TO_WHOLE));
            }
            for lane in 0..LANES {
                all.from[tap][lane] = places[1][lane].wrapping_mul(stride[lane]).wrapping_add(places[0][lane]);
            }
        }
        all
    }
}

/// Coordinates within the picture that show what lies at any; those of a clamped one are left as they are.
#[inline(always)]
pub(super) fn folded(at: Floats, wrap: Wrap) -> Floats {
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
mod tests;
