//! The plain linear ramp in f32, a block of columns at a time. Converts microvolts to codes in LSB and clocks, or reports that a sample
//! lies too close to a ramp level for f32 to decide.
//!
//! A count is a straight line of the sample, rounded down. In f32 that line is off by a known part of a code, so only samples that
//! close to a ramp level need the exact count of `LinearKernel`, the slow twin.

use super::params::AdcParams;
use crate::num::{f32_from_u32, f32_nearest, f64_from_i64, low_u16};

/// Columns that are decided together: a block with one sample in doubt goes to the slow twin as a whole.
pub(super) const BLOCK: usize = 32;

/// Above this depth most blocks would hold a sample in doubt.
const BITS_MAX: u32 = 14;

/// Adding and subtracting 1.5 * 2^23 rounds |x| <= 2^22 half-even without a cast; the sum's low bits hold the integer.
const ROUNDER: f32 = 12_582_912.0;

/// Integers below 2^15 in the low bits of a rounded sum. Saying so lets the compiler narrow them to 16 bits in one operation.
const MASK: u32 = 0x7fff;

/// Counter steps and comparator clocks of a block.
pub(super) type BlockWork = [u32; 2];

/// The straight line from samples to counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FastLine {
    codes_per_uv: f32,
    /// Count of the dark level, before rounding to the nearest.
    offset: f32,
    signal_steps: f32,
    reset_steps: f32,
    black_level_dn: f32,
    code_max: f32,
    /// Distance from the nearest count up to which that count is certain.
    certain: f32,
}

impl FastLine {
    /// Prepares checked parameters, with the pedestal at `pedestal_nv`. None for depths that f32 cannot resolve.
    ///
    /// The count of level s (nV, an integer) is ((s + 1/2) 2^b - 1/2) / span rounded down (`LinearKernel::count`), and that less a half
    /// rounded to the nearest. A product and a sum, each of which rounds besides its constant, are off by 4 * 2^-24 of at most 2^b;
    /// leaving the sample unrounded moves it by at most half a nanovolt.
    pub fn new(params: &AdcParams, pedestal_nv: f64) -> Option<Self> {
        let codes = f64::from(1 << params.bits);
        let span_nv = f64_from_i64(params.span_nv());
        let off_codes = 4.0 * codes / 16_777_216.0 + 0.5 * codes / span_nv;
        (params.bits <= BITS_MAX).then(|| Self {
            codes_per_uv: f32_nearest(1000.0 * codes / span_nv),
            offset: f32_nearest(((pedestal_nv + 0.5) * codes - 0.5) / span_nv - 0.5),
            signal_steps: f32_from_u32(params.code_max()),
            reset_steps: f32_from_u32(params.reset_counts_used()),
            black_level_dn: f32_from_u32(params.black_level_dn),
            code_max: f32_from_u32(params.code_max()),
            certain: f32_nearest(0.5 - off_codes),
        })
    }

    /// Codes of one conversion a column. None if a sample is in doubt; the codes are then void.
    #[inline(always)]
    pub fn convert_one(&self, signal_uv: &[f32; BLOCK], codes: &mut [u16; BLOCK]) -> Option<BlockWork> {
        let mut up = [0.0; BLOCK];
        let work = self.counts(signal_uv, self.signal_steps, &mut up);
        for column in 0..BLOCK {
            codes[column] = low_u16(low_bits(up[column]));
        }
        work
    }

    /// Codes of two conversions a column, as `convert_one`.
    #[inline(always)]
    pub fn convert_both(
        &self,
        signal_uv: &[f32; BLOCK],
        reset_uv: &[f32; BLOCK],
        codes: &mut [u16; BLOCK],
    ) -> Option<BlockWork> {
        let (mut up, mut down) = ([0.0; BLOCK], [0.0; BLOCK]);
        let signal_work = self.counts(signal_uv, self.signal_steps, &mut up);
        let reset_work = self.counts(reset_uv, self.reset_steps, &mut down);
        for column in 0..BLOCK {
            // Sums of counts stay far below 2^24, so this is exact.
            let counter = self.black_level_dn - down[column] + up[column];
            codes[column] = low_u16(low_bits(clipped(counter, self.code_max)));
        }
        let ([steps, clocks], [reset_steps, reset_clocks]) = (signal_work?, reset_work?);
        Some([steps + reset_steps, clocks + reset_clocks])
    }

    /// Counts of a ramp of so many steps, and what they took; a NaN counts no ramp level. Beyond both ends a count is certain: the
    /// nearest ramp level is half a code away.
    #[inline(always)]
    fn counts(&self, samples_uv: &[f32; BLOCK], ramp_steps: f32, counts: &mut [f32; BLOCK]) -> Option<BlockWork> {
        let (mut steps, mut open, mut doubts) = (0, 0, 0);
        for column in 0..BLOCK {
            let exact_count = clipped(samples_uv[column] * self.codes_per_uv + self.offset, ramp_steps);
            let shifted = exact_count + ROUNDER;
            let nearest = shifted - ROUNDER;
            doubts |= if (exact_count - nearest).abs() < self.certain { 0 } else { u32::MAX };
            steps += shifted.to_bits() & MASK;
            open += u32::from(nearest < ramp_steps);
            counts[column] = nearest;
        }
        (doubts == 0).then_some([steps, steps + open])
    }
}

/// Clips to 0 ..= `most`; a NaN becomes 0.
#[inline(always)]
fn clipped(value: f32, most: f32) -> f32 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < most { value } else { most }
}

/// A whole number below 2^15 as an integer.
#[inline(always)]
fn low_bits(whole: f32) -> u32 {
    (whole + ROUNDER).to_bits() & MASK
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::linear::LinearKernel;
    use crate::adc::params::tests::paper_adc;
    use crate::adc::ramp::linear_level_nv;
    use crate::adc::{Cds, RowWork, Sample};
    use crate::draw::DrawKey;
    use rand::RngExt;

    const DEPTHS: std::ops::RangeInclusive<u32> = 1..=BITS_MAX;

    fn params(bits: u32, full_scale_uv: f64, cds: Cds) -> AdcParams {
        let black_level_dn = (1 << bits) / 16;
        let reset_counts = ((1 << bits) / 8).max(1);
        AdcParams { bits, full_scale_uv, black_level_dn, reset_counts, cds, ..paper_adc() }
    }

    fn pedestal_nv(params: &AdcParams) -> i64 {
        linear_level_nv(params.bits, params.span_nv(), params.pedestal_lsb())
    }

    /// Samples around every ramp level: up to 2 nV away, across the seam of the doubt, and half a code away.
    fn around_ramp_levels(params: &AdcParams, line: &FastLine) -> Vec<f32> {
        let lsb_nv = f64_from_i64(params.span_nv()) / f64::from(1 << params.bits);
        let seam_nv = (0.5 - f64::from(line.certain)) * lsb_nv;
        let near_nv = [0.0, 1.0, 2.0, 0.5 * seam_nv, 0.98 * seam_nv, 1.02 * seam_nv, 2.0 * seam_nv, 0.5 * lsb_nv];
        let mut samples_uv =
            vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, f32::MAX, f32::MIN, 0.0, -0.0];
        for k in 0..=params.code_max() {
            let ramp_level_nv = f64_from_i64(linear_level_nv(params.bits, params.span_nv(), k) - pedestal_nv(params));
            let sides = near_nv.iter().flat_map(|&near_nv| [ramp_level_nv - near_nv, ramp_level_nv + near_nv]);
            samples_uv.extend(sides.map(|sample_nv| f32_nearest(sample_nv / 1000.0)));
        }
        samples_uv
    }

    /// Blocks of 32 equal samples, so that a certain sample does not hide behind a neighbour in doubt.
    #[test]
    fn a_certain_count_is_the_exact_one_around_every_ramp_level() {
        for (cds, sample) in
            [(Cds::Analog, Sample::Signal), (Cds::Digital, Sample::Signal), (Cds::Digital, Sample::Reset)]
        {
            for bits in DEPTHS {
                let (mut certain, mut doubtful) = (0, 0);
                for full_scale_uv in [100.0, 999.9, 8192.0, 117_455.7, 9.9e6] {
                    let params = params(bits, full_scale_uv, cds);
                    let line = FastLine::new(&params, f64_from_i64(pedestal_nv(&params))).unwrap();
                    let samples_uv = around_ramp_levels(&params, &line);
                    let exact = LinearKernel::new(&params).counts(sample, &samples_uv);
                    let steps = if sample == Sample::Reset { line.reset_steps } else { line.signal_steps };
                    for (&sample_uv, &exact) in samples_uv.iter().zip(&exact) {
                        let mut counts = [0.0; BLOCK];
                        let Some([found, _]) = line.counts(&[sample_uv; BLOCK], steps, &mut counts) else {
                            doubtful += 1;
                            continue;
                        };
                        certain += 1;
                        assert_eq!(found, 32 * exact, "{sample_uv} uV of {params:?}");
                        assert_eq!(counts, [f32_from_u32(exact); BLOCK], "{sample_uv} uV of {params:?}");
                    }
                }
                println!("{cds:?} {sample:?} {bits} bit: {certain} certain, {doubtful} in doubt");
                assert!(certain > 4 << bits && doubtful > 4 << bits, "the seam has two sides");
            }
        }
    }

    /// Codes and work as the exact counts give them.
    fn slowly(params: &AdcParams, signal_uv: &[f32], reset_uv: &[f32]) -> (Vec<u16>, RowWork) {
        let kernel = LinearKernel::new(params);
        let (up, down) = (kernel.counts(Sample::Signal, signal_uv), kernel.counts(Sample::Reset, reset_uv));
        let clocks =
            |counts: &[u32], steps: u32| counts.iter().map(|&count| u64::from((count + 1).min(steps))).sum::<u64>();
        let work = RowWork {
            counter_steps: up.iter().chain(&down).map(|&count| u64::from(count)).sum(),
            comparator_clk: clocks(&up, params.code_max()) + clocks(&down, params.reset_counts_used()),
        };
        let code = |(column, &up): (usize, &u32)| match down.get(column) {
            None => up,
            Some(down) => (up + params.black_level_dn).saturating_sub(*down).min(params.code_max()),
        };
        (up.iter().enumerate().map(code).map(low_u16).collect(), work)
    }

    #[test]
    fn rows_of_every_width_have_the_exact_codes_and_work() {
        let seed = 31;
        let mut stream = DrawKey::root(seed).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * stream.random::<f64>();
        let mut tried = 0;
        for bits in 1..=16 {
            for (case, cds) in [(0, Cds::Analog), (1, Cds::Digital), (2, Cds::None)] {
                let params = params(bits, libm::exp(draw(libm::log(101.0), libm::log(9.9e6))), cds);
                let kernel = LinearKernel::new(&params);
                for width in (0..130).chain([640, 1023]) {
                    let mut row = |least: f64, most: f64| -> Vec<f32> {
                        (0..width).map(|_| f32_nearest(draw(least, most) * params.full_scale_uv)).collect()
                    };
                    let mut signal_uv = row(-0.3, 1.3);
                    let reset_uv = if cds == Cds::Digital { row(-0.1, 0.1) } else { Vec::new() };
                    if width > 100 {
                        signal_uv[case] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][case];
                    }
                    let mut codes = vec![0; width];
                    let work = kernel.convert_linear_row(&signal_uv, &reset_uv, &mut codes);
                    let (expected, expected_work) = slowly(&params, &signal_uv, &reset_uv);
                    assert_eq!(codes, expected, "seed {seed}, width {width}, {params:?}");
                    assert_eq!(work, expected_work, "seed {seed}, width {width}, {params:?}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 16 * 3 * 132);
    }
}
