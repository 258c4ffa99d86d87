//! Which pixels a sample is seen by. Enters: samples, and how their points move. Leaves: for each pixel, sums over the samples whose points
//! go through it.
//!
//! A point goes through pixel j for a time K_j, and a patch about it has then the area A_j there. Samples of all pixels meet it as often as
//! its way within the picture has time and area, sum K A, so each counts in pixel j by K_j A_j / sum K A: the balance heuristic of Veach
//! and Guibas (1995) over all pixels that might have taken it. That is right where points keep their light and nothing that goes
//! otherwise hides them. Where points of one pixel go different ways, `shared` has it and those about it sampled by themselves.

use super::sums::{Sum, greater, lesser};
use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u32_truncated_f32};
use crate::scene::light::{BANDS, Bands};
use crate::units::Span;

/// One sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where it was taken, in pixels.
    pub at_px: [f32; 2],
    /// And when: share of its row's exposure.
    pub t: f32,
    /// How its point moves in the picture, in pixels an exposure; 0 where only the pixel that it was taken in may have it.
    pub velocity_px: [f32; 2],
    /// By how much that changes over an exposure.
    pub bend_px: [f32; 2],
    /// By what share the area of a patch about it grows over an exposure.
    pub swell: f32,
    /// What it stands for, in pixels times exposures, over what samples do in the mean.
    pub area: f32,
    /// Distance of the point in metres.
    pub distance_m: f32,
    /// Whether it is of the second half of its net.
    pub is_second: bool,
    /// Its light.
    pub lux: Bands,
}

/// Rows whose sums are wanted.
pub struct Rows<'a> {
    /// Pixels of a row.
    pub width: usize,
    /// The first of them.
    pub first: usize,
    /// What is known of all ways.
    pub ways: &'a Ways,
    /// Photons of each pixel in each band for a lux, row by row.
    pub photons_per_lux: &'a [Bands],
}

/// What all points' ways have in common.
pub struct Ways {
    /// When each row of the picture opens and closes, in exposures after the first one opened.
    openings: Vec<[f32; 2]>,
    /// How much later a row opens than the one above it, in exposures, in the mean.
    pub later: f32,
    /// Straight legs that a way has.
    pub legs: u32,
}

/// A straight part of a point's way.
#[derive(Clone, Copy)]
struct Leg {
    /// Where it would be at the sample's instant.
    at_px: [f32; 2],
    velocity_px: [f32; 2],
    /// When it begins and ends, in exposures from that instant on.
    from: f32,
    to: f32,
}

/// Motion below this many pixels an exposure is none: places of f32 are good to a 200th of it in a picture of 1,024 columns.
const LEAST_PX: f32 = 1.0 / 64.0;

impl Ways {
    /// Of rows that are all exposed for as long.
    pub fn new(shutter: &[Span], legs: u32) -> Self {
        let (first, last) = (shutter[0], shutter[shutter.len() - 1]);
        let exposures = |at_s: f64| f32_nearest((at_s - first.start_s) / first.length_s());
        let openings = shutter.iter().map(|span| [span.start_s, span.end_s].map(exposures)).collect();
        let steps = f32_from_u32(u32_from(shutter.len().max(2) - 1));
        Self { openings, later: exposures(last.start_s) / steps, legs }
    }
}

/// Exposures, from a sample's instant on, in which a point at a place is between two others.
#[inline(always)]
fn between(place: f32, speed: f32, least: f32, most: f32) -> [f32; 2] {
    if speed.abs() < LEAST_PX {
        return [f32::MIN, f32::MAX];
    }
    let per_px = 1.0 / speed;
    let (a, b) = ((least - place) * per_px, (most - place) * per_px);
    if a < b { [a, b] } else { [b, a] }
}

#[inline(always)]
fn photons(sample: &Sample, per_lux: &Bands) -> f32 {
    let mut photons = 0.0;
    for band in 0..BANDS {
        photons += sample.lux[band] * per_lux[band];
    }
    photons
}

impl Rows<'_> {
    /// Adds samples to the sums of all pixels that their points go through.
    pub fn add(&self, samples: &[Sample], sums: &mut [Sum]) {
        let end = self.first + sums.len() / self.width;
        let [above, below] = [self.first, end].map(|row| f32_from_u32(u32_from(row)));
        for sample in samples {
            let (y, speed) = (sample.at_px[1], sample.velocity_px[1]);
            let own = index(u32_truncated_f32(y));
            // A point that goes after the rows of a rolling shutter is seen for longer than one of them is open.
            let longer = if speed.abs() < LEAST_PX { 1.0 } else { 1.0 / (1.0 - speed * self.ways.later) };
            let reach = (speed.abs() + 0.5 * sample.bend_px[1].abs() * longer) * longer + 1.0;
            if y + reach < above || y - reach > below {
                continue;
            }
            let (opens, step) = (-sample.t * longer, longer / f32_from_u32(self.ways.legs));
            let leg = |number: u32| {
                let (from, to) = (opens + step * f32_from_u32(number), opens + step * f32_from_u32(number + 1));
                let (mut at_px, mut velocity_px) = (sample.at_px, sample.velocity_px);
                for axis in 0..2 {
                    // The chord of x + v s + b s^2 / 2 from one end to the other.
                    at_px[axis] -= 0.5 * sample.bend_px[axis] * from * to;
                    velocity_px[axis] += 0.5 * sample.bend_px[axis] * (from + to);
                }
                Leg { at_px, velocity_px, from, to }
            };
            let way: f32 = (0..self.ways.legs).map(|number| self.within(&leg(number))).sum();
            let amid = 1.0 + sample.swell * (0.5 - sample.t) * longer;
            let weight = sample.area / greater(way * amid, f32::EPSILON);
            for number in 0..self.ways.legs {
                self.add_leg(sample, own, weight, &leg(number), sums);
            }
        }
    }

    /// How long a leg lies within the picture.
    #[inline(always)]
    fn within(&self, leg: &Leg) -> f32 {
        let [columns, rows] = [self.width, self.ways.openings.len()].map(|size| f32_from_u32(u32_from(size)));
        let [left, right] = between(leg.at_px[0], leg.velocity_px[0], 0.0, columns);
        let [above, below] = between(leg.at_px[1], leg.velocity_px[1], 0.0, rows);
        greater(lesser(leg.to, lesser(right, below)) - greater(leg.from, greater(left, above)), 0.0)
    }

    /// Adds a sample to the pixels on a leg of its point's way.
    #[inline(always)]
    fn add_leg(&self, sample: &Sample, own: usize, weight: f32, leg: &Leg, sums: &mut [Sum]) {
        let (y, speed) = (leg.at_px[1], leg.velocity_px[1]);
        let is_level = speed.abs() < LEAST_PX;
        let (a, b) = (y + speed * leg.from, y + speed * leg.to);
        let row = |place: f32| index(u32_truncated_f32(greater(place, 0.0)));
        let (from, to) = if is_level {
            (row(0.5 * (a + b)), row(0.5 * (a + b)) + 1)
        } else {
            // A row more on either side: the point and the row's beginning go in steps.
            (row(lesser(a, b) - 1.0), row(greater(a, b) + 2.0))
        };
        let (from, to) = (from.max(self.first), to.min(self.first + sums.len() / self.width));
        let [begins, _] = self.ways.openings[own];
        for row in from..to {
            let [opened, closed] = self.ways.openings[row].map(|at| at - begins - sample.t);
            let edge = f32_from_u32(u32_from(row));
            let [enters, leaves] = if is_level { [f32::MIN, f32::MAX] } else { between(y, speed, edge, edge + 1.0) };
            let (enters, leaves) = (greater(enters, opened), lesser(leaves, closed));
            // Beyond the ends of all legs a row may still be open, by its rounding.
            let (enters, leaves) = (greater(enters, leg.from), lesser(leaves, leg.to));
            if leaves > enters {
                let from = (row - self.first) * self.width;
                let sums = &mut sums[from..from + self.width];
                self.add_to_row(sample, weight, leg, [enters, leaves], &self.photons_per_lux[from..], sums);
            }
        }
    }

    /// Adds a sample to the pixels of a row that its point goes through meanwhile.
    #[inline(always)]
    fn add_to_row(
        &self,
        sample: &Sample,
        weight: f32,
        leg: &Leg,
        [enters, leaves]: [f32; 2],
        photons_per_lux: &[Bands],
        sums: &mut [Sum],
    ) {
        let (x, speed) = (leg.at_px[0], leg.velocity_px[0]);
        let mut add = |column: usize, weight: f32, at: f32| {
            let velocity_px = [0, 1].map(|axis| sample.velocity_px[axis] + sample.bend_px[axis] * at);
            let weight = weight * (1.0 + sample.swell * at);
            let photons = photons(sample, &photons_per_lux[column]);
            sums[column].add(weight, photons, velocity_px, sample.is_second, sample.distance_m);
        };
        let width = f32_from_u32(u32_from(self.width));
        let (a, b) = (x + speed * enters, x + speed * leaves);
        if speed.abs() < LEAST_PX {
            let middle = 0.5 * (a + b);
            if middle >= 0.0 && middle < width {
                add(index(u32_truncated_f32(middle)), (leaves - enters) * weight, 0.5 * (enters + leaves));
            }
            return;
        }
        let (from, to) = (greater(lesser(a, b), 0.0), lesser(greater(a, b), width));
        let (per_px, weight_per_px) = (1.0 / speed, weight / speed.abs());
        let mut column = u32_truncated_f32(from);
        let mut place = from;
        while place < to {
            let next = lesser(f32_from_u32(column + 1), to);
            add(index(column), (next - place) * weight_per_px, (0.5 * (place + next) - x) * per_px);
            (place, column) = (next, column + 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;

    const WIDTH: usize = 24;
    const HEIGHT: usize = 20;

    /// Rows that are exposed for 10 ms, each so much later than the one above it.
    fn shutter(row_s: f64) -> Vec<Span> {
        let row = |row: u32| {
            let start_s = row_s * f64::from(row);
            Span { start_s, end_s: start_s + 0.01 }
        };
        (0..u32_from(HEIGHT)).map(row).collect()
    }

    fn sums(samples: &[Sample], shutter: &[Span], legs: u32) -> Vec<Sum> {
        let mut sums = vec![Sum::NONE; WIDTH * HEIGHT];
        let photons_per_lux = vec![[1.0, 0.0, 0.0, 0.0]; WIDTH * HEIGHT];
        let ways = Ways::new(shutter, legs);
        Rows { width: WIDTH, first: 0, ways: &ways, photons_per_lux: &photons_per_lux }.add(samples, &mut sums);
        sums
    }

    fn uniform(key: DrawKey) -> f32 {
        f32_nearest(key.uniform())
    }

    /// A sample anywhere, of a point that goes anywhere.
    fn any(key: DrawKey, speed_px: f32) -> Sample {
        let of = |number: u64| uniform(key.with(number));
        Sample {
            at_px: [of(1) * f32_from_u32(u32_from(WIDTH)), of(2) * f32_from_u32(u32_from(HEIGHT))],
            t: of(3),
            velocity_px: [speed_px * (2.0 * of(4) - 1.0), speed_px * (2.0 * of(5) - 1.0)],
            bend_px: [0.5 * speed_px * (2.0 * of(10) - 1.0), 0.5 * speed_px * (2.0 * of(11) - 1.0)],
            swell: 0.2 * (of(12) - 0.5),
            area: 0.5 + of(6),
            distance_m: 1.0 + of(7),
            is_second: of(8) < 0.5,
            lux: [of(9), 0.0, 0.0, 0.0],
        }
    }

    #[test]
    fn a_sample_deals_its_area_to_the_pixels_on_its_way_and_to_no_other() {
        let mut most = 0;
        for number in 0..2_000 {
            let speed_px = [0.0, 0.3, 5.0, 40.0][usize::try_from(number % 4).unwrap()];
            let sample = any(DrawKey::root(5).with(number), speed_px);
            let (sums, mut all, mut met) = (sums(&[sample], &shutter(0.0), 32), 0.0, 0);
            for (at, sum) in sums.iter().enumerate() {
                let weight = sum.weight();
                all += weight;
                met += usize::from(weight > 0.0);
                let [x, y] = [at % WIDTH, at / WIDTH].map(|place| f32_from_u32(u32_from(place)));
                // The way within the picture, in steps of 1 / 200 exposure: where none goes through, no weight is.
                let goes_through = (0..=200).any(|step| {
                    let after = f32_from_u32(step) / 200.0 - sample.t;
                    let of = |axis: usize| {
                        let (speed, bend) = (sample.velocity_px[axis], sample.bend_px[axis]);
                        sample.at_px[axis] + speed * after + 0.5 * bend * after * after
                    };
                    let [px, py] = [of(0), of(1)];
                    px > x - 0.11 && px < x + 1.11 && py > y - 0.11 && py < y + 1.11
                });
                assert!(weight == 0.0 || goes_through, "{sample:?} at {x} {y}");
            }
            // Places up to 24 are good to 1e-6, over motion of 1 / 64 px. What leaves the picture has grown otherwise than the whole way.
            let bound = 1e-3 + sample.swell.abs();
            assert!((all / sample.area - 1.0).abs() < bound, "{all} of {sample:?}");
            most = most.max(met);
        }
        assert!(most > 20, "{most}: nothing goes far");
    }

    #[test]
    fn a_row_that_opens_later_sees_a_point_as_long_as_it_is_open() {
        // Down a column by 12 px an exposure, past rows that open 1/40 of it one after the other: a row is passed in 1/12, unless it is
        // closed then.
        let sample = Sample {
            at_px: [4.5, 6.25],
            t: 0.5,
            velocity_px: [0.0, 12.0],
            bend_px: [0.0; 2],
            swell: 0.0,
            area: 1.0,
            distance_m: 2.0,
            is_second: false,
            lux: [1.0, 0.0, 0.0, 0.0],
        };
        let seen = sums(&[sample], &shutter(0.01 / 40.0), 1);
        let mut tried = 0;
        for row in 0..HEIGHT {
            // From the sample's instant on, in exposures of row 6: when the point is in the row, and when that is open.
            let place = f64::from(u32_from(row));
            let [enters, leaves] = [place, place + 1.0].map(|edge| (edge - 6.25) / 12.0);
            let opened = (place - 6.0) / 40.0 - 0.5;
            let stays = crate::num::lesser(leaves, opened + 1.0) - crate::num::greater(enters, opened);
            let expected = crate::num::greater(stays, 0.0);
            let found = f64::from(seen[row * WIDTH + 4].weight());
            // It is seen for 1 / (1 - 12 / 40) exposures in all, from t / (1 - 12 / 40) before its instant on: 8.6 px above the picture's
            // rim of 6.25 px, so less than that by (8.57 - 6.25) / 12.
            let expected = expected / (1.0 / 0.7 - (12.0 * 0.5 / 0.7 - 6.25) / 12.0);
            assert!((found - expected).abs() < 1e-5, "row {row}: {found} for {expected}");
            tried += usize::from(expected > 0.0);
        }
        assert!(tried > 10, "{tried}");
    }

    #[test]
    fn what_leaves_the_picture_counts_by_the_way_within() {
        // A quarter of an exposure before it leaves, and half after it came.
        let sample =
            Sample { at_px: [22.0, 10.5], t: 0.5, velocity_px: [8.0, 0.0], swell: 0.0, ..any(DrawKey::root(6), 0.0) };
        let seen = sums(&[sample], &shutter(0.0), 1);
        let weight = |column: usize| seen[10 * WIDTH + column].weight() / sample.area;
        let expected = |column: usize| if column >= 18 { 1.0 / 6.0 } else { 0.0 };
        assert!((0..WIDTH).all(|column| (weight(column) - expected(column)).abs() < 1e-6));
    }

    #[test]
    fn even_samples_of_a_moving_stripe_have_its_ramp() {
        // Columns below 12.25 at the exposure's middle are lit; all goes 6 px to the right. A grid of points amid the exposure, each at
        // an instant of its own (a lattice of the golden ratio).
        let speed = 6.0;
        let mut samples = Vec::new();
        for row in 0..200 {
            for column in 0..420 {
                let t = (f64::from(column) * 0.618_033_988_75 + f64::from(row) * 0.381_966).fract();
                let [x, y] = [column, row].map(|step: u32| (f64::from(step) + 0.5) / 10.0);
                let place = f32_nearest(x - 9.0 + speed * (t - 0.5));
                if (0.0..24.0).contains(&place) {
                    let at_px = [place, f32_nearest(y)];
                    let lux = [if x - 9.0 < 12.25 { 1.0 } else { 0.0 }, 0.0, 0.0, 0.0];
                    let (area, is_second, distance_m) = (0.01, row % 2 == 1, 1.0);
                    let (velocity_px, bend_px, swell) = ([f32_nearest(speed), 0.0], [0.0; 2], 0.0);
                    samples.push(Sample {
                        at_px,
                        t: f32_nearest(t),
                        velocity_px,
                        swell,
                        bend_px,
                        area,
                        distance_m,
                        is_second,
                        lux,
                    });
                }
            }
        }
        let seen = sums(&samples, &shutter(0.0), 1);
        let mut worst = 0.0_f64;
        for (column, sum) in seen[9 * WIDTH..10 * WIDTH].iter().enumerate() {
            // Share of its time and area for which the edge is right of it.
            let lit = |t: f64| (12.25 + speed * (t - 0.5) - f64::from(u32_from(column))).clamp(0.0, 1.0);
            let expected = (0..1_000).map(|step: u32| lit((f64::from(step) + 0.5) / 1e3)).sum::<f64>() / 1e3;
            let found = f64::from(sum.seen().unwrap().photons);
            worst = crate::num::greater(worst, (found - expected).abs());
        }
        // Ten columns of points a pixel, one of which the edge parts from the next, over a ramp of seven pixels.
        assert!(worst < 0.1 / 7.0, "{worst}");
    }

    #[test]
    fn halves_and_spread_tell_what_their_samples_do() {
        let still = |at: u64, light: f32| Sample {
            at_px: [3.5, 3.5],
            velocity_px: [0.0; 2],
            bend_px: [0.0; 2],
            swell: 0.0,
            area: 1.0,
            is_second: at >= 2,
            lux: [light, 0.0, 0.0, 0.0],
            ..any(DrawKey::root(7).with(at), 0.0)
        };
        let lights = [1.0, 3.0, 5.0, 11.0];
        let samples: Vec<Sample> = (0..4).zip(lights).map(|(at, light)| still(at, light)).collect();
        let told = sums(&samples, &shutter(0.0), 1)[3 * WIDTH + 3].seen().unwrap();
        // Mean 5; halves of 2 and 8; squares 156 / 4 - 25.
        assert_eq!((told.photons, told.taken, told.spread, told.shared), (5.0, 9.0, 14.0, Some(4.0)));
        assert!(
            sums(&samples[..2], &shutter(0.0), 1)[3 * WIDTH + 3].seen().is_none(),
            "one half says nothing of its error"
        );
    }
}
