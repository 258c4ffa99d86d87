//! Differences between two pictures or feature lists: sums of squares, extremes, F1. All sums run in pixel order.

use crate::compute::Feature;
use crate::num::{f64_from_u64, f64_from_usize, greater, lesser, u64_from};
use crate::plane::Plane;

/// Squares of errors over pixels that count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    /// Of errors in units of photon noise.
    pub sum: f64,
    pub pixels: u64,
}

impl Squares {
    /// Those of several pictures together.
    pub fn sum(pictures: impl Iterator<Item = Self>) -> Self {
        pictures.fold(Self::default(), |all, one| Self { sum: all.sum + one.sum, pixels: all.pixels + one.pixels })
    }

    /// Their mean; 0 without a pixel, and where the reference's noise outweighs the error.
    pub fn mean(self) -> f64 {
        if self.pixels == 0 { 0.0 } else { greater(self.sum / f64_from_u64(self.pixels), 0.0) }
    }
}

/// The reference of one picture.
pub struct PictureReference {
    /// Two independent renders of the same photons.
    pub halves: [Plane<f32>; 2],
    /// Their mean.
    pub photons: Plane<f32>,
}

/// What photons mean to a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Judge {
    pub electrons_per_photon: f64,
    /// Photons beyond which a pixel shows no difference.
    pub saturation_photons: f64,
}

impl Judge {
    /// Whether a pixel of the given photons shows differences.
    pub fn counts(&self, photons: f32) -> bool {
        photons > 0.0 && f64::from(photons) < self.saturation_photons
    }

    fn seen(&self, photons: f32) -> f64 {
        lesser(f64::from(photons), self.saturation_photons)
    }

    /// Photon variance in electrons squared; at least one electron's, for below that light has hardly any noise of its own.
    pub fn photon_variance_e2(&self, photons: f32) -> f64 {
        greater(self.electrons_per_photon * f64::from(photons), 1.0)
    }

    /// Squares of a render's errors, free of the reference's own noise: (S - A)(S - B).
    pub fn render_error(&self, rendered: &Plane<f32>, truth: &PictureReference) -> Squares {
        let [first, second] = &truth.halves;
        let mut squares = Squares::default();
        let all = rendered.values().iter().zip(first.values()).zip(second.values()).zip(truth.photons.values());
        for (((&s, &a), &b), &mean) in all.filter(|(_, mean)| self.counts(**mean)) {
            let product = (self.seen(s) - self.seen(a)) * (self.seen(s) - self.seen(b));
            squares.sum +=
                self.electrons_per_photon * self.electrons_per_photon * product / self.photon_variance_e2(mean);
            squares.pixels += 1;
        }
        squares
    }

    /// Squares of the reference's own standard error: half of what its halves differ by.
    pub fn standard_error(&self, truth: &PictureReference) -> Squares {
        let [first, second] = &truth.halves;
        let mut squares = Squares::default();
        let all = first.values().iter().zip(second.values()).zip(truth.photons.values());
        for ((&a, &b), &mean) in all.filter(|(_, mean)| self.counts(**mean)) {
            let half_e = 0.5 * self.electrons_per_photon * (self.seen(a) - self.seen(b));
            squares.sum += half_e * half_e / self.photon_variance_e2(mean);
            squares.pixels += 1;
        }
        squares
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CodeError {
    sum_dn2: u64,
    pixels: u64,
    pub max_dn: u32,
}

impl CodeError {
    pub fn add(&mut self, codes: &Plane<u16>, reference: &Plane<u16>) {
        for (&code, &other) in codes.values().iter().zip(reference.values()) {
            let difference_dn = u32::from(code.abs_diff(other));
            self.sum_dn2 += u64::from(difference_dn) * u64::from(difference_dn);
            self.max_dn = self.max_dn.max(difference_dn);
        }
        self.pixels += u64_from(codes.values().len());
    }

    pub fn rms_dn(self) -> f64 {
        if self.pixels == 0 { 0.0 } else { (f64_from_u64(self.sum_dn2) / f64_from_u64(self.pixels)).sqrt() }
    }
}

/// Features that two pictures have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SharedFeatures {
    /// Pairs of which each is the other's nearest, within a pixel.
    pub matched: usize,
    /// Features of both pictures.
    pub all: usize,
}

impl SharedFeatures {
    /// Adds a picture's.
    pub fn add(&mut self, other: Self) {
        self.matched += other.matched;
        self.all += other.all;
    }

    /// Twice the pairs over all features; 1 where neither has any.
    pub fn f1(self) -> f64 {
        if self.all == 0 { 1.0 } else { 2.0 * f64_from_usize(self.matched) / f64_from_usize(self.all) }
    }
}

/// Matches features by position: of the same octave, within 1 px, each the other's nearest (the first of equally near ones).
pub fn feature_f1(found: &[Feature], reference: &[Feature]) -> SharedFeatures {
    let nearest = |of: &Feature, among: &[Feature]| -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for (at, other) in among.iter().enumerate().filter(|(_, other)| other.octave == of.octave) {
            let (dx, dy) = (of.x_px() - other.x_px(), of.y_px() - other.y_px());
            let distance_px2 = dx * dx + dy * dy;
            if distance_px2 <= 1.0 && best.is_none_or(|(least, _)| distance_px2 < least) {
                best = Some((distance_px2, at));
            }
        }
        best.map(|(_, at)| at)
    };
    let mutual = |(at, feature): &(usize, &Feature)| {
        nearest(feature, reference).is_some_and(|other| nearest(&reference[other], found) == Some(*at))
    };
    SharedFeatures { matched: found.iter().enumerate().filter(mutual).count(), all: found.len() + reference.len() }
}
