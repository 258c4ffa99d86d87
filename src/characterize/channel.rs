//! The colour plane that is measured: which pixels of the array count, and the light that reaches all of them.
//!
//! EMVA 1288 release 4.0 measures each colour channel on its own, at the wavelength where it responds best. Light of the filter's best
//! band falls on the whole array, so that neighbours get what their filters pass; the pixels of one position in the pattern are kept, as a
//! camera that reads its four planes apart would have it (the G of RGGB is the one in the rows of R).

use crate::error::Error;
use crate::num::{f32_nearest, index, u32_from};
use crate::optics::Mosaic;
use crate::optics::mosaic::FILTER_BANDS;
use crate::plane::Plane;
use crate::units::Size;

/// Names of a filter's bands.
const BANDS: [&str; FILTER_BANDS] = ["600-700 nm", "500-600 nm", "400-500 nm", "700-1000 nm"];

/// One colour plane of an array.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourPlane {
    /// Letter of its filter; M without colour filters.
    pub letter: char,
    mosaic: Mosaic,
    band: usize,
    /// First pixel of the plane.
    x_px: u32,
    y_px: u32,
}

/// Band of greatest transmission, and that transmission.
fn best_band(bands: &[f64; FILTER_BANDS]) -> (usize, f64) {
    let better = |best: (usize, f64), (band, &share): (usize, &f64)| if share > best.1 { (band, share) } else { best };
    bands.iter().enumerate().fold((0, f64::NEG_INFINITY), better)
}

impl ColourPlane {
    /// The filter that was asked for, else the one that passes most.
    /// Fails on a letter that is no filter's.
    pub fn choose(mosaic: &Mosaic, asked: Option<char>) -> Result<Self, Error> {
        let share = |letter: char| mosaic.transmission(letter).map_or((0, 0.0), |bands| best_band(&bands));
        let letter = match asked {
            Some(letter) if mosaic.letters().any(|known| known == letter) => letter,
            Some(letter) => {
                let known: Vec<String> = mosaic.letters().map(String::from).collect();
                return Err(Error::key(
                    "channel",
                    letter,
                    format!("is not a filter of this sensor; use {}", known.join(", ")),
                ));
            }
            None => mosaic
                .letters()
                .reduce(|best, letter| if share(letter).1 > share(best).1 { letter } else { best })
                .expect("a pattern has at least one filter"),
        };
        let (width, height) = (mosaic.width_px(), mosaic.height_px());
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixel = pixels.clone().find(|&(x, y)| mosaic.letter_at(x, y) == letter);
        let (x, y) = pixel.expect("every filter lies over some pixel of its pattern");
        let band = share(letter).0;
        Ok(Self { letter, mosaic: mosaic.clone(), band, x_px: u32_from(x), y_px: u32_from(y) })
    }

    /// Share of the photons that pass the plane's filter.
    pub fn transmission(&self) -> f64 {
        self.mosaic.transmission(self.letter).expect("the letter was chosen from the pattern")[self.band]
    }

    /// Whether all pixels have one filter.
    pub fn is_whole(&self) -> bool {
        self.mosaic.is_mono()
    }

    /// For a person: letter and band, or that there are no filters.
    pub fn name(&self) -> String {
        if self.is_whole() { "all".to_owned() } else { format!("{}, {}", self.letter, BANDS[self.band]) }
    }

    /// Pixels of the array from one pixel of the plane to the next, across and down.
    pub fn step(&self) -> (u32, u32) {
        (u32_from(self.mosaic.width_px()), u32_from(self.mosaic.height_px()))
    }

    /// The part of the array that holds a plane of that size.
    pub fn array_size(&self, plane: Size) -> Size {
        let (across, down) = self.step();
        Size { width_px: plane.width_px * across, height_px: plane.height_px * down }
    }

    /// The plane of an array.
    pub fn plane_size(&self, array: Size) -> Size {
        let (across, down) = self.step();
        Size { width_px: array.width_px / across, height_px: array.height_px / down }
    }

    /// Row of the array of a row of the plane.
    pub fn array_row(&self, row: u32) -> u32 {
        self.y_px + row * self.step().1
    }

    /// Photons behind the filters of an array under uniform light.
    pub fn light(&self, array: Size, photons: f64) -> Plane<f32> {
        let mut values = Vec::with_capacity(array.pixel_count());
        for y in 0..index(array.height_px) {
            values.extend((0..index(array.width_px)).map(|x| {
                let share = self.mosaic.transmission_at(x % self.mosaic.width_px(), y)[self.band];
                f32_nearest(photons * share)
            }));
        }
        Plane::from_values(array, values)
    }

    /// The codes of the plane out of those of the array.
    pub fn pick(&self, codes: Plane<u16>, plane: Size) -> Plane<u16> {
        if self.is_whole() {
            return codes;
        }
        let (across, first) = (index(self.step().0), index(self.x_px));
        let values = (0..plane.height_px)
            .flat_map(|row| codes.row(index(self.array_row(row))).iter().skip(first).step_by(across).copied())
            .collect();
        Plane::from_values(plane, values)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const R: (char, [f64; 4]) = ('R', [0.5, 0.1, 0.05, 0.3]);
    const G: (char, [f64; 4]) = ('G', [0.05, 0.6, 0.1, 0.25]);
    const B: (char, [f64; 4]) = ('B', [0.02, 0.1, 0.45, 0.2]);

    #[test]
    fn a_plane_holds_the_pixels_of_one_filter_and_neighbours_get_what_theirs_pass() {
        let mosaic = Mosaic::parse("RGGB", &[B, G, R]).unwrap().0;
        let array = Size { width_px: 4, height_px: 4 };
        let plane = Size { width_px: 2, height_px: 2 };
        let codes = Plane::from_values(array, (0..16).collect());
        for (letter, band, picked) in [('R', 0, [0, 2, 8, 10]), ('G', 1, [1, 3, 9, 11]), ('B', 2, [5, 7, 13, 15])] {
            let channel = ColourPlane::choose(&mosaic, Some(letter)).unwrap();
            assert_eq!((channel.array_size(plane), channel.plane_size(array)), (array, plane));
            assert_eq!(channel.pick(codes.clone(), plane).values(), picked);
            let light = channel.light(array, 60.0);
            for (pixel, filter) in [(0, R), (1, G), (4, G), (5, B)] {
                // Photons behind the filter over the peak of 0.6: two roundings of f32.
                let expected = 100.0 * filter.1[band];
                assert!((f64::from(light.values()[pixel]) - expected).abs() < 1e-5, "{letter} {pixel}");
            }
        }
        assert_eq!(ColourPlane::choose(&mosaic, None).unwrap().name(), "G, 500-600 nm");
        assert!(ColourPlane::choose(&mosaic, Some('X')).unwrap_err().to_string().contains("use B, G, R"));
        assert_eq!(ColourPlane::choose(&Mosaic::mono(), None).unwrap().name(), "all");
    }
}
