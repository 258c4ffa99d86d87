//! High dynamic range from several readings of a pixel, the most sensitive first. Merges their codes into one linear code per pixel, deeper
//! than the readings, and optionally compands it to fewer bits.
//!
//! A reading is a separate exposure (multi-exposure) or the same charge at another conversion gain (dual gain, lateral overflow).
//! Each is scaled by its sensitivity to the units of the most sensitive one; where a reading comes near its end, the next takes
//! over in a linear blend, so that the picture has no step (as published for companding and DOL sensors; Darmont,
//! "High Dynamic Range Imaging", SPIE Press, 2012, on merging). Companding is piecewise linear with slopes that halve: half of the
//! output's codes keep the linear code's own step, and every octave above them shares the other half alike, as the PWL output of
//! automotive sensors does. Integers only: this runs on the sensor.

use crate::error::Error;

/// Bits of fraction of a reading's scale.
const SCALE_BITS: u32 = 12;

/// Bits of fraction of the blend.
const BLEND_BITS: u32 = 8;

/// Greatest depth of the code that leaves: the widest RAW kind.
pub const MERGED_BITS_MAX: u32 = 16;

/// Greatest depth of a merged code before companding, as of automotive sensors.
const LINEAR_BITS_MAX: u32 = 24;

/// How readings become one code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HdrMerge {
    /// Depth of the merged code before companding.
    linear_bits: u32,
    /// Depth of the code that leaves; less than the merged one's where it is companded.
    bits: u32,
    black_level_dn: i64,
    /// Code at which the next reading begins to count, and at which it alone counts.
    blend_dn: [i64; 2],
    /// Units of the most sensitive reading in a unit of each, in 1/4096; the first is 4096.
    scales: Vec<i64>,
}

impl HdrMerge {
    /// For readings of `bits` with their sensitivities, falling, relative to the first; companded to 16 bits where it needs more. Fails
    /// on sensitivities so far apart that the merged code does not fit 24 bits; names the greatest ratio that is accepted.
    pub fn new(key: &str, bits: u32, black_level_dn: u32, sensitivities: &[f64]) -> Result<Self, Error> {
        assert!((1..=16).contains(&bits) && !sensitivities.is_empty(), "readings have 1 to 16 bits");
        let code_max = (1_i64 << bits) - 1;
        let scales = scales(sensitivities);
        let black = i64::from(black_level_dn);
        let last = scales[scales.len() - 1];
        let most = black + (((code_max - black) * last) >> SCALE_BITS);
        let merged_bits = (1..=63).find(|&bits| most < 1 << bits).expect("a scaled code fits 63 bits");
        if merged_bits > LINEAR_BITS_MAX {
            let ratio = f64::from(1_u32 << (LINEAR_BITS_MAX - bits));
            let reason = format!(
                "merged codes would need {merged_bits} bits of {LINEAR_BITS_MAX}; use sensitivities up to {ratio} apart"
            );
            return Err(Error::key(key, sensitivities[0] / sensitivities[sensitivities.len() - 1], reason));
        }
        let blend_dn = [code_max - code_max / 4, code_max - code_max / 16 - 1];
        let bits = merged_bits.min(MERGED_BITS_MAX);
        Ok(Self { linear_bits: merged_bits, bits, black_level_dn: black, blend_dn, scales })
    }

    /// Depth of the merged code before companding.
    pub fn bits_before_companding(&self) -> u32 {
        self.linear_bits
    }

    /// The same merging, companded to a number of bits; unchanged where the merged code fits them.
    #[must_use]
    pub fn companded(&self, bits: u32) -> Self {
        assert!((8..=MERGED_BITS_MAX).contains(&bits), "a companded code has 8 to 16 bits");
        Self { bits: bits.min(self.linear_bits), ..self.clone() }
    }

    /// The same merging, at the same depth, for other sensitivities: exposures that registers have changed.
    #[must_use]
    pub fn with_sensitivities(&self, sensitivities: &[f64]) -> Self {
        Self { scales: scales(sensitivities), ..self.clone() }
    }

    /// Depth of the code that leaves.
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// How many readings a pixel has.
    pub fn readings(&self) -> usize {
        self.scales.len()
    }

    /// Merges one row. Panics if there are not as many readings as sensitivities, or of other lengths.
    pub fn merge_row(&self, readings: &[&[u16]], merged: &mut [u16]) {
        assert!(readings.len() == self.scales.len(), "every reading has its scale");
        assert!(readings.iter().all(|reading| reading.len() == merged.len()), "a pixel has one code a reading");
        for (column, merged) in merged.iter_mut().enumerate() {
            *merged = self.merge(|reading| readings[reading][column]);
        }
    }

    fn merge(&self, code: impl Fn(usize) -> u16) -> u16 {
        let [start_dn, end_dn] = self.blend_dn;
        let last = self.scales.len() - 1;
        let mut value = self.scaled(code(last), last);
        for reading in (0..last).rev() {
            let code = code(reading);
            let beyond = (i64::from(code) - start_dn).clamp(0, (end_dn - start_dn).max(1));
            let weight = (beyond << BLEND_BITS) / (end_dn - start_dn).max(1);
            let own = self.scaled(code, reading);
            value = (own * ((1 << BLEND_BITS) - weight) + value * weight + (1 << (BLEND_BITS - 1))) >> BLEND_BITS;
        }
        let most = (1_i64 << self.linear_bits) - 1;
        u16::try_from(self.compand(value.clamp(0, most))).expect("merged codes have at most 16 bits")
    }

    fn compand(&self, linear: i64) -> i64 {
        let half = 1_i64 << (self.bits - 1);
        if self.bits == self.linear_bits || linear < half {
            return linear;
        }
        let octaves = i64::from(self.linear_bits - self.bits + 1);
        let share = half / octaves;
        let octave = i64::from((linear / half).ilog2());
        half + octave * share + ((linear - (half << octave)) * share) / (half << octave)
    }

    /// A code in units of the most sensitive reading, above the same black level, halves up.
    fn scaled(&self, code: u16, reading: usize) -> i64 {
        let above = i64::from(code) - self.black_level_dn;
        self.black_level_dn + ((above * self.scales[reading] + (1 << (SCALE_BITS - 1))) >> SCALE_BITS)
    }
}

/// Units of the most sensitive reading in a unit of each. Panics unless the most sensitive stands first.
fn scales(sensitivities: &[f64]) -> Vec<i64> {
    let one = f64::from(1_u32 << SCALE_BITS);
    let scale = |share: &f64| crate::num::i64_half_even(sensitivities[0] / share * one);
    let scales: Vec<i64> = sensitivities.iter().map(scale).collect();
    assert!(scales.is_sorted(), "the most sensitive reading comes first");
    scales
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes_of(light: f64, sensitivities: &[f64]) -> Vec<u16> {
        let code = |share: &f64| u16::try_from(crate::num::i64_half_even((64.0 + light * share).min(1023.0))).unwrap();
        sensitivities.iter().map(code).collect()
    }

    /// A reading is off by half its LSB, which is half its scale merged, and half a merged LSB from rounding.
    #[test]
    fn merged_codes_are_linear_over_the_whole_range_and_never_fall() {
        for sensitivities in [&[1.0, 1.0 / 16.0][..], &[1.0, 0.25, 1.0 / 16.0], &[1.0, 1.0 / 7.3], &[1.0]] {
            let merge = HdrMerge::new("sensor.readout.hdr_exposure_ratio", 10, 64, sensitivities).unwrap();
            let widest = 1.0 / sensitivities[sensitivities.len() - 1];
            let (mut before, mut tried) = (0, 0);
            for step in 0..20_000 {
                let light = f64::from(step) * 0.9 * 959.0 * widest / 20_000.0;
                let codes = codes_of(light, sensitivities);
                let readings: Vec<&[u16]> = codes.iter().map(std::slice::from_ref).collect();
                let mut merged = [0];
                merge.merge_row(&readings, &mut merged);
                assert!(
                    (f64::from(merged[0]) - 64.0 - light).abs() <= 0.5 * widest + 1.0,
                    "{light}: {merged:?} of {codes:?}"
                );
                // Between two readings the coarser one may round down by half its step.
                assert!(f64::from(merged[0]) + widest >= f64::from(before), "{light}: {merged:?} after {before}");
                before = merged[0];
                tried += 1;
            }
            assert_eq!(tried, 20_000);
        }
    }

    #[test]
    fn depth_grows_with_the_ratio_and_is_companded_beyond_sixteen_bits() {
        let bits =
            |depth, ratio: f64| HdrMerge::new("sensor.readout.hdr_exposure_ratio", depth, 64, &[1.0, 1.0 / ratio]);
        assert_eq!(bits(10, 16.0).unwrap().bits(), 14);
        assert_eq!(bits(10, 1.0).unwrap().bits(), 10);
        assert_eq!(bits(12, 16.0).unwrap().bits(), 16);
        assert_eq!(bits(12, 64.0).unwrap().bits(), 16);
        let message = bits(12, 16_384.0).unwrap_err().to_string();
        assert!(message.contains("26 bits") && message.contains("up to 4096 apart"), "{message}");
    }

    #[test]
    fn a_companded_code_never_falls_and_loses_no_more_than_its_slope() {
        let mut tried = 0;
        for (ratio, bits) in [(16.0, 10), (16.0, 12), (64.0, 10), (2.0, 8)] {
            let linear = HdrMerge::new("sensor.readout.hdr_exposure_ratio", 10, 64, &[1.0, 1.0 / ratio]).unwrap();
            let merge = linear.companded(bits);
            assert_eq!(merge.bits(), bits);
            let (most, half) = ((1_i64 << linear.bits()) - 1, 1_i64 << (bits - 1));
            let octaves = i64::from(linear.bits() - bits + 1);
            let mut before = -1;
            for code in 0..=most {
                let companded = merge.compand(code);
                assert!(companded >= before && companded < 2 * half, "{code}: {companded} after {before}");
                assert!(code >= half || companded == code, "{code}: {companded}");
                // An octave of half << k codes is told in half / octaves steps.
                assert!(companded - before <= 1, "{code}: {companded} after {before}");
                before = companded;
                tried += 1;
            }
            assert!(before >= 2 * half - 1 - octaves, "the last code is {before} of {}", 2 * half);
        }
        assert_eq!(tried, 16_384 + 16_384 + 65_536 + 2048);
    }

    #[test]
    fn black_stays_black_and_white_stays_white() {
        let merge = HdrMerge::new("sensor.readout.hdr_exposure_ratio", 10, 64, &[1.0, 1.0 / 16.0]).unwrap();
        let mut merged = [0; 4];
        merge.merge_row(&[&[64, 1023, 0, 1023], &[64, 1023, 64, 64]], &mut merged);
        assert_eq!(merged, [64, 64 + 959 * 16, 0, 64]);
    }
}
