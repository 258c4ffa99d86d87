//! Colour filters over the pixels. Computes the share of each band that passes to each pixel, from a pattern of letters and their quantum
//! efficiencies.
//!
//! A filter absorbs; the photodiode behind it has one efficiency, the greatest of the pattern. So a filter's transmission in a band
//! is its published quantum efficiency there over that greatest one, and photons of a picture are those behind the filters.

use crate::error::Error;
use crate::num::{greater, index};

/// Bands of a filter: red, green, blue (600-700, 500-600, 400-500 nm) and near infrared (700-1000 nm).
pub const FILTER_BANDS: usize = crate::scene::light::BANDS;

/// Sides of a pattern.
const SIDE_MAX: usize = 4;

/// A pattern of filters that repeats over the array.
#[derive(Clone, Debug, PartialEq)]
pub struct Mosaic {
    /// Rows of letters, all of one length.
    rows: Vec<Vec<char>>,
    /// Letters in alphabetical order, with the transmission of their bands, 0 to 1.
    filters: Vec<(char, [f64; FILTER_BANDS])>,
}

impl Mosaic {
    /// No filters: every band passes whole.
    pub fn mono() -> Self {
        Self { rows: vec![vec!['M']], filters: vec![('M', [1.0; FILTER_BANDS])] }
    }

    /// Reads "mono" with one filter's efficiencies under 'M', or a pattern such as "RGGB" (two rows of two), "RGGB/..." with rows apart by
    /// slashes, up to 4 x 4. Gives the pattern, and the photodiode's efficiency: the greatest of all. Fails on a pattern that is no
    /// rectangle of 1 to 4 letters a side; a letter without efficiencies, or efficiencies without a letter; none above 0.
    pub fn parse(pattern: &str, efficiencies: &[(char, [f64; FILTER_BANDS])]) -> Result<(Self, f64), Error> {
        let refused = |reason: String| Err(Error::key("sensor.pixel.cfa", pattern, reason));
        let rows = rows_of(pattern);
        let width = rows[0].len();
        if rows.len() > SIDE_MAX || width == 0 || width > SIDE_MAX || rows.iter().any(|row| row.len() != width) {
            return refused(
                "no pattern; use mono, RGGB, RCCB, or rows of equal length apart by slashes, up to 4 x 4".to_owned(),
            );
        }
        for &letter in rows.iter().flatten() {
            if !efficiencies.iter().any(|(known, _)| *known == letter) {
                return refused(format!("filter {letter} has no efficiencies; use sensor.pixel.qe_by_filter.{letter}"));
            }
        }
        if let Some((idle, _)) =
            efficiencies.iter().find(|(known, _)| !rows.iter().flatten().any(|letter| letter == known))
        {
            return refused(format!("no pixel has filter {idle}; leave out qe_by_filter.{idle}"));
        }
        let peak = efficiencies.iter().flat_map(|(_, bands)| bands).fold(0.0, |most, &band| greater(most, band));
        let over_peak = |band: f64| if peak > 0.0 { band / peak } else { 1.0 };
        let filters = efficiencies.iter().map(|&(letter, bands)| (letter, bands.map(over_peak))).collect();
        Ok((Self { rows, filters }, peak))
    }

    /// Columns after which the pattern repeats.
    pub fn width_px(&self) -> usize {
        self.rows[0].len()
    }

    /// Rows after which the pattern repeats.
    pub fn height_px(&self) -> usize {
        self.rows.len()
    }

    /// Whether all pixels have the same filter.
    pub fn is_mono(&self) -> bool {
        self.width_px() * self.height_px() == 1
    }

    /// Letters of the filters.
    pub fn letters(&self) -> impl Iterator<Item = char> + '_ {
        self.filters.iter().map(|(letter, _)| *letter)
    }

    /// The filter's letter over a pixel.
    pub fn letter_at(&self, x_px: usize, y_px: usize) -> char {
        self.rows[y_px % self.height_px()][x_px % self.width_px()]
    }

    /// Share of each band that passes to a pixel.
    pub fn transmission_at(&self, x_px: usize, y_px: usize) -> [f64; FILTER_BANDS] {
        self.transmission(self.letter_at(x_px, y_px)).expect("every letter of the pattern has its filter")
    }

    /// Share of each band that passes a filter; none without such a filter.
    pub fn transmission(&self, letter: char) -> Option<[f64; FILTER_BANDS]> {
        self.filters.iter().find(|(known, _)| *known == letter).map(|(_, bands)| *bands)
    }

    /// The same pattern where only some bands pass.
    #[must_use]
    pub(super) fn restricted_to(&self, bands: [bool; FILTER_BANDS]) -> Self {
        let mut mosaic = self.clone();
        for (_, passed) in &mut mosaic.filters {
            for (share, is_kept) in passed.iter_mut().zip(bands) {
                *share = if is_kept { *share } else { 0.0 };
            }
        }
        mosaic
    }

    /// The same pattern where the picture starts at another pixel of the array.
    #[must_use]
    pub fn starting_at(&self, x_px: u32, y_px: u32) -> Self {
        let mut rows = self.rows.clone();
        rows.rotate_left(index(y_px) % self.height_px());
        for row in &mut rows {
            row.rotate_left(index(x_px) % self.width_px());
        }
        Self { rows, filters: self.filters.clone() }
    }
}

/// Rows of letters: at slashes, or in halves and quarters where there are none.
fn rows_of(pattern: &str) -> Vec<Vec<char>> {
    if pattern == "mono" {
        return vec![vec!['M']];
    }
    if pattern.contains('/') {
        return pattern.split('/').map(|row| row.chars().collect()).collect();
    }
    let letters: Vec<char> = pattern.chars().collect();
    let width = match letters.len() {
        4 => 2,
        9 => 3,
        16 => 4,
        other => other.max(1),
    };
    if letters.is_empty() { vec![Vec::new()] } else { letters.chunks(width).map(<[char]>::to_vec).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: (char, [f64; 4]) = ('R', [0.5, 0.1, 0.05, 0.3]);
    const G: (char, [f64; 4]) = ('G', [0.05, 0.6, 0.1, 0.25]);
    const B: (char, [f64; 4]) = ('B', [0.02, 0.1, 0.45, 0.2]);
    const I: (char, [f64; 4]) = ('I', [0.0, 0.0, 0.0, 0.3]);

    #[test]
    fn transmissions_are_efficiencies_over_the_greatest() {
        let (mosaic, peak) = Mosaic::parse("RGGB", &[R, G, B]).unwrap();
        assert_eq!((peak, mosaic.width_px(), mosaic.height_px(), mosaic.is_mono()), (0.6, 2, 2, false));
        for (x, y, (letter, bands)) in [(0, 0, R), (1, 0, G), (0, 1, G), (1, 1, B), (4, 6, R), (7, 3, B)] {
            assert_eq!(mosaic.letter_at(x, y), letter);
            // A quotient times its divisor is off by one rounding each.
            for (share, band) in mosaic.transmission_at(x, y).iter().zip(bands) {
                assert!((share * peak - band).abs() <= 2.0 * f64::EPSILON * band, "{x} {y}");
            }
        }
    }

    #[test]
    fn patterns_of_four_by_four_repeat_and_can_start_anywhere() {
        let (mosaic, _) = Mosaic::parse("BGRG/GIGI/RGBG/GIGI", &[B, G, I, R]).unwrap();
        assert_eq!((mosaic.width_px(), mosaic.height_px()), (4, 4));
        let (same, _) = Mosaic::parse("BGRGGIGIRGBGGIGI", &[B, G, I, R]).unwrap();
        assert_eq!(mosaic, same);
        let moved = mosaic.starting_at(3, 6);
        for y in 0..8 {
            for x in 0..8 {
                assert_eq!(moved.letter_at(x, y), mosaic.letter_at(x + 3, y + 6));
            }
        }
    }

    #[test]
    fn what_is_no_pattern_is_refused_with_an_accepted_value() {
        for (pattern, filters, words) in [
            ("RG", &[R, G][..], ""),
            ("RGG", &[R, G], ""),
            ("RG/B", &[R, G, B], "equal length"),
            ("", &[], "no pattern"),
            ("RGGBR", &[R, G, B], "up to 4 x 4"),
            ("RGGB", &[R, G], "qe_by_filter.B"),
            ("RGGR", &[R, G, B], "leave out qe_by_filter.B"),
        ] {
            match Mosaic::parse(pattern, filters) {
                Ok(_) => assert!(words.is_empty(), "{pattern} passes"),
                Err(error) => assert!(!words.is_empty() && error.to_string().contains(words), "{pattern}: {error}"),
            }
        }
        assert_eq!(Mosaic::parse("mono", &[('M', [0.0; 4])]).unwrap().1, 0.0);
    }
}
