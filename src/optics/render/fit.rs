//! How light changes within a group of alike triangles. Enters: samples with what is known of them and of all rays of the finer net: what
//! their textures do, where they lie and when. Leaves: how their mean would change with the means of those (a regression estimator:
//! Cochran 1977, 7.1), as far as that is surely more than chance.

#![allow(clippy::needless_range_loop, reason = "rows and columns of a small matrix run in step")]

use crate::num::greater;

/// Numbers that light may be linear in: what its texture does, place and time.
pub const REGRESSORS: usize = 4;

/// Light of a group, as far as it is linear in what is known of the finer net.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fit {
    /// Samples.
    pub count: f64,
    /// Of their light.
    pub sum: f64,
    squares: f64,
    /// Sums of what is known of each.
    pub places: [f64; REGRESSORS],
    products: [[f64; REGRESSORS]; REGRESSORS],
    with_light: [f64; REGRESSORS],
}

impl Fit {
    /// Adds what is known of a ray.
    pub fn add_place(&mut self, place: &[f64; REGRESSORS]) {
        self.count += 1.0;
        for axis in 0..REGRESSORS {
            self.places[axis] += place[axis];
        }
    }

    /// Adds a sample.
    pub fn add(&mut self, place: &[f64; REGRESSORS], light: f64) {
        self.add_place(place);
        self.sum += light;
        self.squares += light * light;
        for axis in 0..REGRESSORS {
            self.with_light[axis] += place[axis] * light;
            for other in 0..REGRESSORS {
                self.products[axis][other] += place[axis] * place[other];
            }
        }
    }

    /// Mean place.
    pub fn places(&self) -> [f64; REGRESSORS] {
        self.places.map(|sum| sum / self.count)
    }

    /// Mean light as it would be about another place.
    pub fn at(&self, places: &[f64; REGRESSORS], slopes: &[f64; REGRESSORS]) -> f64 {
        let own = self.places();
        self.sum / self.count + (0..REGRESSORS).map(|axis| slopes[axis] * (places[axis] - own[axis])).sum::<f64>()
    }

    /// Change of light over what is known, as far as it is surely more than chance, and the sum of squares that is left.
    pub fn slopes(&self) -> ([f64; REGRESSORS], f64) {
        let n = self.count;
        let apart = if n > 0.0 { greater(self.squares - self.sum * self.sum / n, 0.0) } else { 0.0 };
        let used = if n < TINT_FROM {
            0
        } else if n < PLACE_FROM {
            1
        } else {
            REGRESSORS
        };
        let mut slopes = [0.0; REGRESSORS];
        if used == 0 || !(apart > 0.0) {
            return (slopes, apart);
        }
        let mut rows = [[0.0; REGRESSORS + 1]; REGRESSORS];
        for axis in 0..used {
            for other in 0..used {
                rows[axis][other] = self.products[axis][other] - self.places[axis] * self.places[other] / n;
            }
            rows[axis][REGRESSORS] = self.with_light[axis] - self.places[axis] * self.sum / n;
        }
        let (aim, own) = (rows.map(|row| row[REGRESSORS]), rows);
        let mut is_known = [false; REGRESSORS];
        for axis in 0..used {
            // What does not vary, or only with those before, tells nothing more.
            is_known[axis] = rows[axis][axis] > DEPENDENT * own[axis][axis]
                && own[axis][axis] > DEPENDENT * self.products[axis][axis];
            for below in axis + 1..used {
                let times = if is_known[axis] { rows[below][axis] / rows[axis][axis] } else { 0.0 };
                for column in axis..=REGRESSORS {
                    rows[below][column] -= times * rows[axis][column];
                }
            }
        }
        let (mut explained, mut number) = (0.0, 0.0);
        for axis in (0..used).rev().filter(|&axis| is_known[axis]) {
            let known: f64 = (axis + 1..used).map(|other| rows[axis][other] * slopes[other]).sum();
            slopes[axis] = (rows[axis][REGRESSORS] - known) / rows[axis][axis];
            explained += slopes[axis] * aim[axis];
            number += 1.0;
        }
        if !(explained > 0.0) {
            return ([0.0; REGRESSORS], apart);
        }
        // So many slopes explain as many n-ths of what is chance.
        let left = greater(apart - explained, 0.0);
        let sure = greater(1.0 - number * left / ((n - 1.0 - number) * explained), 0.0);
        (slopes.map(|slope| slope * sure), greater(apart - sure * (2.0 - sure) * explained, 0.0))
    }
}

/// Samples of a group from which on its light may follow its texture, and place and time as well.
const TINT_FROM: f64 = 4.0;
const PLACE_FROM: f64 = 12.0;
/// Share of its own variance below which a number only repeats others.
const DEPENDENT: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{DrawKey, normal_quantile};
    use crate::num::{f64_from_usize, low_u32};

    /// Samples whose light is linear in the first and the third number, with chance of some size.
    fn fitted(count: u64, chance: f64, case: u64) -> (Fit, [f64; REGRESSORS], f64) {
        let key = DrawKey::root(52).with(case);
        let mut fit = Fit::default();
        for number in 0..count {
            let draw = |field: u64| normal_quantile(low_u32(key.with(number).with(field).0));
            let place = [100.0 + 10.0 * draw(0), draw(1), draw(2), 0.25];
            fit.add(&place, 7.0 * place[0] - 30.0 * place[2] + chance * draw(3));
        }
        let (slopes, left) = fit.slopes();
        (fit, slopes, left)
    }

    #[test]
    fn what_is_linear_is_found_and_nothing_is_left() {
        let (fit, slopes, left) = fitted(40, 0.0, 1);
        for (slope, expected) in slopes.into_iter().zip([7.0, 0.0, -30.0, 0.0]) {
            // Sums of squares of 100 with a variance of 100: 2^-53 loses two digits, and three dozen operations one more.
            assert!((slope - expected).abs() < 1e-9, "{slope} for {expected}");
        }
        assert!(left < 1e-6, "{left}");
        let elsewhere = [90.0, 0.5, 2.0, 0.25];
        assert!((fit.at(&elsewhere, &slopes) - (7.0 * 90.0 - 60.0)).abs() < 1e-6);
    }

    #[test]
    fn chance_has_hardly_any_slope() {
        let (mut explained, mut tried) = (0.0, 0);
        for case in 0..200 {
            let key = DrawKey::root(53).with(case);
            let mut fit = Fit::default();
            let mut squares = 0.0;
            for number in 0..32_u64 {
                let draw = |field: u64| normal_quantile(low_u32(key.with(number).with(field).0));
                fit.add(&[draw(0), draw(1), draw(2), draw(4)], draw(3));
                squares += draw(3) * draw(3);
            }
            let apart = squares - fit.sum * fit.sum / fit.count;
            explained += 1.0 - fit.slopes().1 / apart;
            tried += 1;
        }
        // Four slopes explain x sigma^2 of what is chance, x a chi squared of four degrees; they are shrunk by 1 - 4 / x and explain then
        // (x^2 - 16) / x where x is beyond 4: 12 / e^2 = 1.62 in the mean, of 31. 200 cases know that to a tenth.
        assert!(explained / f64_from_usize(tried) < 0.08, "{explained} of {tried}");
    }

    #[test]
    fn few_samples_follow_their_texture_alone_and_fewer_nothing() {
        let (_, slopes, _) = fitted(8, 0.1, 3);
        assert!(slopes[0] != 0.0 && slopes[1..].iter().all(|&slope| slope == 0.0), "{slopes:?}");
        assert_eq!(fitted(3, 0.0, 4).1, [0.0; REGRESSORS]);
    }
}
