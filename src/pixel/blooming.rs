//! Blooming. Moves charge beyond the full well to neighbours, so that each pixel of the array holds at most the full well.
//!
//! Model: of the charge beyond the full well a share spills into the four neighbours, a quarter of it each; the rest goes to the
//! anti-blooming drain, and so does what would leave the array. A neighbour that is full passes on what it receives in the same way
//! (Janesick, "Scientific Charge-Coupled Devices", on blooming and anti-blooming, without the preferred direction of a CCD's channels).
//!
//! All pixels spill at once, sweep after sweep, and the four inflows are added in pairs: so the result depends on no order, is equal
//! to the last bit when the picture is mirrored or turned, and needs no threads. What is still over after `SWEEPS_MAX` sweeps
//! goes to the drain.

use super::dark_rates::DarkRates;
use super::full_well::well_excess;
use super::params::PixelParams;
use crate::draw::EffectNumber;
use crate::effect::{ArrayPass, Domain, Effect, Identity, Omission, RowPass};
use crate::facts::{DieSpread, Facts};
use crate::num::{f32_nearest, f64_from_usize, lesser};
use crate::plane::Plane;
use crate::simd::kernel;

/// Excess below this is no longer followed, in electrons: under the least read noise of any sensor.
const LEAST_E: f32 = 1.0 / 64.0;

/// Sweeps at most. With a share s, s^256 of the first excess is left: 2e-12 at 0.9, 8 % at 0.99, all of it in the middle of a wide
/// field at 1, where nothing drains.
const SWEEPS_MAX: usize = 256;

/// Charge that spills over.
pub struct Blooming {
    capacity_e: f64,
    share: f64,
    rates: DarkRates,
    prnu: f64,
    dsnu_e: f64,
}

impl Blooming {
    /// `None` where the drain takes all.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        (params.blooming > 0.0).then(|| Box::new(Self::new(params)) as Box<dyn Effect>)
    }

    fn new(params: &PixelParams) -> Self {
        Self {
            capacity_e: params.full_well_e,
            share: params.blooming,
            rates: DarkRates::of(params),
            prnu: params.prnu,
            dsnu_e: params.dsnu_e,
        }
    }

    /// Bound of what any pixel of the frame is over the well, where that is rare.
    fn rare_excess(&self, frame_e_max: f64, [exposure_s, storage_s]: [f64; 2], dies: DieSpread) -> Option<Omission> {
        let mean_e = frame_e_max + self.rates.most_e(exposure_s, storage_s, dies);
        let pattern_e = self.prnu * frame_e_max;
        well_excess(mean_e, pattern_e * pattern_e + self.dsnu_e * self.dsnu_e, self.capacity_e)
    }
}

/// The most that a pixel's charge can grow with a charge that all pixels gain: 1 where none can be over the well, else the spills
/// of spills, 1 + s + s^2 + ... The other pixels together receive no more than that of a change in one pixel.
pub fn spill_slope_max(params: &PixelParams, frame_e_max: f64, times_s: [f64; 2], dies: DieSpread) -> f64 {
    if params.blooming == 0.0 || Blooming::new(params).rare_excess(frame_e_max, times_s, dies).is_some() {
        return 1.0;
    }
    all_spills(params.blooming)
}

fn all_spills(share: f64) -> f64 {
    let sweeps = f64_from_usize(SWEEPS_MAX) + 1.0;
    if share < 1.0 { lesser(1.0 / (1.0 - share), sweeps) } else { sweeps }
}

impl Effect for Blooming {
    fn identity(&self) -> Identity {
        Identity { name: "blooming", number: EffectNumber(113), domain: Domain::ArrayElectrons }
    }

    fn spills(&self) -> bool {
        true
    }

    /// Where no pixel of the frame is over the well but by chance, by the Chernoff bound of `FullWell`: the excess of the pixel and
    /// what may reach it of others. Else any pixel may be filled to the well by bright neighbours, and it stays.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let excess = self.rare_excess(facts.frame_e_max, [facts.exposure_s, facts.storage_s_max], facts.dies)?;
        let slope = all_spills(self.share);
        Some(Omission { bias_e: slope * excess.bias_e, variance_e2: slope * slope * excess.variance_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("{:.0} e- at most in the frame, full well {} e-", facts.frame_e_max, self.capacity_e)
    }

    fn apply(&self, _row: &mut RowPass<'_>) {
        unreachable!("blooming acts on the array")
    }

    fn apply_to_array(&self, array: &mut ArrayPass<'_>) {
        spill(array.charge_e, f32_nearest(self.capacity_e), f32_nearest(self.share));
    }
}

/// Spills until no pixel is over by `LEAST_E`, and clips the rest.
fn spill(charge_e: &mut Plane<f32>, well_e: f32, share: f32) {
    let (width, height) = (charge_e.width_px(), charge_e.height_px());
    // A border of empty pixels removes all checks for edges.
    let stride = width + 2;
    let mut excess_e = Vec::new();
    let (mut first, mut last) = (height, 0);
    for y in 0..height {
        let most_e = greatest_of_row(charge_e.row(y));
        if most_e > well_e {
            excess_e.resize(stride * (height + 2), 0.0_f32);
            let inside = &mut excess_e[(y + 1) * stride + 1..][..width];
            clip(charge_e.row_mut(y), inside, well_e);
            (first, last) = (first.min(y), y);
        }
    }
    if excess_e.is_empty() {
        return;
    }
    let mut spilt_e = vec![0.0_f32; excess_e.len()];
    for _ in 0..SWEEPS_MAX {
        (first, last) = (first.saturating_sub(1), (last + 1).min(height - 1));
        let mut most_e = 0.0_f32;
        for y in first..=last {
            let [above, own, below] = [y, y + 1, y + 2].map(|row| &excess_e[row * stride..][..stride]);
            let spilt_e = &mut spilt_e[(y + 1) * stride + 1..][..width];
            let row_e = charge_e.row_mut(y);
            let found_e = spill_row(row_e, spilt_e, [above, own, below], well_e, 0.25 * share);
            most_e = if found_e > most_e { found_e } else { most_e };
        }
        std::mem::swap(&mut excess_e, &mut spilt_e);
        if most_e < LEAST_E {
            return;
        }
    }
}

kernel! {
    /// The greatest value.
    fn greatest_of_row<'a>(values: &'a [f32]) -> f32 {
        greatest(values)
    }
}

/// Sixteen lanes, so that the loop is vectorised; the greatest value depends on no order.
#[inline(always)]
fn greatest(values: &[f32]) -> f32 {
    let mut lanes = [0.0_f32; 16];
    let (chunks, rest) = values.as_chunks::<16>();
    for chunk in chunks {
        for lane in 0..16 {
            lanes[lane] = if chunk[lane] > lanes[lane] { chunk[lane] } else { lanes[lane] };
        }
    }
    let both = lanes.iter().chain(rest);
    both.fold(0.0, |most, &value| if value > most { value } else { most })
}

kernel! {
    /// Moves what is over the well into `excess_e`.
    fn clip<'a>(charge_e: &'a mut [f32], excess_e: &'a mut [f32], well_e: f32) {
        for (charge_e, excess_e) in charge_e.iter_mut().zip(excess_e) {
            let over_e = *charge_e - well_e;
            *excess_e = if over_e > 0.0 { over_e } else { 0.0 };
            *charge_e = if over_e > 0.0 { well_e } else { *charge_e };
        }
    }
}

kernel! {
    /// One row receives from the excess of the rows above, its own and below; what is over the well is theirs in the next sweep. Rows of
    /// excess are framed by one pixel.
    fn spill_row<'a>(row_e: &'a mut [f32], spilt_e: &'a mut [f32], excess_e: [&'a [f32]; 3], well_e: f32, quarter: f32) -> f32 {
        let width = row_e.len();
        let [above, own, below] = excess_e;
        let spilt_e = &mut spilt_e[..width];
        let (left, right) = (&own[..width], &own[2..][..width]);
        let (above, below) = (&above[1..][..width], &below[1..][..width]);
        for x in 0..width {
            let inflow_e = quarter * ((left[x] + right[x]) + (above[x] + below[x]));
            let charge_e = row_e[x] + inflow_e;
            let over_e = charge_e - well_e;
            spilt_e[x] = if over_e > 0.0 { over_e } else { 0.0 };
            row_e[x] = if over_e > 0.0 { well_e } else { charge_e };
        }
        greatest(spilt_e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{DrawKey, fill_uniforms};
    use crate::num::{f32_from_u32, u32_from};
    use crate::units::Size;

    const WELL_E: f32 = 1000.0;

    fn plane(width_px: u32, height_px: u32, value: impl Fn(u32, u32) -> f32) -> Plane<f32> {
        let size = Size { width_px, height_px };
        let positions = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
        Plane::from_values(size, positions.map(|(x, y)| value(x, y)).collect())
    }

    /// A night scene: dim pixels and lamps far beyond the well.
    fn lamps(width_px: u32, height_px: u32, seed: u64) -> Plane<f32> {
        let mut uniforms = vec![0; crate::num::index(width_px * height_px)];
        fill_uniforms(DrawKey::root(seed), &mut uniforms);
        plane(width_px, height_px, |x, y| {
            let chance = uniforms[crate::num::index(y * width_px + x)];
            if chance.is_multiple_of(50) { f32_from_u32(chance % 40_000) } else { f32_from_u32(chance % 900) }
        })
    }

    fn spilt(mut charge_e: Plane<f32>, share: f32) -> Plane<f32> {
        spill(&mut charge_e, WELL_E, share);
        charge_e
    }

    fn total(plane: &Plane<f32>) -> f64 {
        plane.values().iter().map(|&value| f64::from(value)).sum()
    }

    #[test]
    fn a_lamp_gives_each_neighbour_a_quarter_of_the_share() {
        let lamp = |at: f32| plane(5, 5, move |x, y| if (x, y) == (2, 2) { at } else { 10.0 });
        let found = spilt(lamp(1400.0), 0.5);
        let expected = plane(5, 5, |x, y| match x.abs_diff(2) + y.abs_diff(2) {
            0 => WELL_E,
            1 => 60.0,
            _ => 10.0,
        });
        assert_eq!(found, expected);
        assert_eq!(spilt(lamp(WELL_E), 0.5), lamp(WELL_E), "exactly full spills nothing");
        assert_eq!(spilt(lamp(1001.0), 0.5).at(2, 1), 10.125);
    }

    /// Every addition rounds to 2^-24 of at most 1000 e-, twice a sweep and pixel; what is below a 64th is no longer followed.
    #[test]
    fn without_a_drain_no_charge_is_lost_inside_the_array() {
        let before = plane(61, 61, |x, y| if (x, y) == (30, 30) { 60_000.0 } else { 1.0 });
        let after = spilt(before.clone(), 1.0);
        let full = after.values().iter().filter(|&&value| value == WELL_E).count();
        println!("{full} full pixels, {} and {}", total(&before), total(&after));
        assert!((40..61).contains(&full), "{full} full pixels hold some 60,000 e-");
        let rounding_e = 1000.0 / 16_777_216.0 * 256.0 * 2.0 * 200.0;
        assert!((total(&before) - total(&after)).abs() < rounding_e + 100.0 / 64.0);
    }

    /// The same model pixel by pixel in f64, to the end, with all that leaves counted.
    fn reference(before: &Plane<f32>, share: f64) -> (Vec<f64>, f64) {
        let (width, height) = (before.width_px(), before.height_px());
        let mut charge_e: Vec<f64> = before.values().iter().map(|&value| f64::from(value)).collect();
        let mut gone_e = 0.0;
        for _ in 0..2000 {
            let mut inflow_e = vec![0.0; charge_e.len()];
            for y in 0..height {
                for x in 0..width {
                    let over_e = charge_e[y * width + x] - f64::from(WELL_E);
                    if over_e <= 0.0 {
                        continue;
                    }
                    charge_e[y * width + x] = f64::from(WELL_E);
                    gone_e += over_e * (1.0 - share);
                    let to = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
                    for (x, y) in to {
                        if x < width && y < height {
                            inflow_e[y * width + x] += 0.25 * share * over_e;
                        } else {
                            gone_e += 0.25 * share * over_e;
                        }
                    }
                }
            }
            charge_e.iter_mut().zip(inflow_e).for_each(|(charge_e, inflow_e)| *charge_e += inflow_e);
        }
        (charge_e, gone_e)
    }

    /// Excess that is no longer followed is below a 64th of an electron per pixel, and could have reached a pixel 1 / (1 - share) times.
    #[test]
    fn many_lamps_spill_as_the_slow_reference_says_and_nothing_is_unaccounted_for() {
        for (case, share) in [(1, 0.1), (2, 0.6), (3, 0.9)] {
            let before = lamps(40, 31, case);
            let after = spilt(before.clone(), f32_nearest(share));
            let (expected_e, gone_e) = reference(&before, f64::from(f32_nearest(share)));
            let slack_e = 1.0 / 64.0 / (1.0 - share) + 0.01;
            for (found, expected) in after.values().iter().zip(&expected_e) {
                assert!((f64::from(*found) - expected).abs() < slack_e, "share {share}: {found} for {expected}");
            }
            let sum_e = total(&after) + gone_e;
            assert!((sum_e / total(&before) - 1.0).abs() < 1e-6, "share {share}: {sum_e} of {}", total(&before));
        }
    }

    #[test]
    fn mirrored_and_turned_pictures_spill_alike_to_the_last_bit() {
        let before = lamps(33, 20, 9);
        let after = spilt(before.clone(), 0.7);
        let at = |plane: &Plane<f32>, x: u32, y: u32| plane.at(crate::num::index(x), crate::num::index(y));
        let mirrored = |from: &Plane<f32>| plane(33, 20, |x, y| at(from, 32 - x, 19 - y));
        let turned = |from: &Plane<f32>| plane(20, 33, |x, y| at(from, y, x));
        assert_eq!(spilt(mirrored(&before), 0.7), mirrored(&after));
        assert_eq!(spilt(turned(&before), 0.7), turned(&after));
        assert_eq!(u32_from(after.values().len()), 660);
    }
}
