//! Repeatability and matching score of the features of two pictures with a known view between them.

use sensel::num::{f64_from_usize, lesser};
use sensel::units::Size;

use super::MARGIN_PX;
use super::views::View;

/// Distance within which a feature is the same one.
const NEAR_PX: f64 = 3.0;

/// Positions with descriptors of 256 bits.
pub type Features = Vec<([f64; 2], [u64; 4])>;

/// Of one view.
#[derive(Clone, Copy, Debug)]
pub struct Score {
    /// Features of the first picture that both pictures show.
    pub features: f64,
    /// Share of features that are found again within three pixels.
    pub repeatability: f64,
    /// Share of features whose mutually nearest descriptor is at the right position.
    pub matching: f64,
}

impl Score {
    pub fn mean(scores: &[Self]) -> Option<Self> {
        let mean = |of: fn(&Self) -> f64| scores.iter().map(of).sum::<f64>() / f64_from_usize(scores.len());
        (!scores.is_empty()).then(|| Self {
            features: mean(|score| score.features),
            repeatability: mean(|score| score.repeatability),
            matching: mean(|score| score.matching),
        })
    }

    pub fn text(&self) -> String {
        format!("{:.1} / {:.1}", 100.0 * self.repeatability, 100.0 * self.matching)
    }
}

/// Positions from the middle of a picture.
fn from_middle([x, y]: [f64; 2], size: Size) -> [f64; 2] {
    [x - 0.5 * (f64::from(size.width_px) - 1.0), y - 0.5 * (f64::from(size.height_px) - 1.0)]
}

fn is_inside([x, y]: [f64; 2], size: Size) -> bool {
    let inside = |position: f64, side_px: u32| position.abs() <= 0.5 * (f64::from(side_px) - 1.0) - MARGIN_PX;
    inside(x, size.width_px) && inside(y, size.height_px)
}

/// Features beyond the margin.
pub fn inside(features: &Features, size: Size) -> usize {
    features.iter().filter(|(position, _)| is_inside(from_middle(*position, size), size)).count()
}

/// The share of the features that both pictures show, which is the lesser number of the two.
pub fn score(before: &Features, after: &Features, view: &View, size: Size) -> Score {
    // Where features of the first picture are in the second; and those of the second, if the first shows them.
    let mapped = before.iter().filter_map(|(position, descriptor)| {
        let position = from_middle(*position, size);
        let there = view.map(position);
        (is_inside(position, size) && is_inside(there, size)).then_some((there, *descriptor))
    });
    let mapped: Features = mapped.collect();
    let shown = after.iter().filter_map(|(position, descriptor)| {
        let position = from_middle(*position, size);
        (is_inside(position, size) && is_inside(view.unmapped(position), size)).then_some((position, *descriptor))
    });
    let shown: Features = shown.collect();
    let most = lesser(f64_from_usize(mapped.len()), f64_from_usize(shown.len()));
    if most == 0.0 {
        return Score { features: 0.0, repeatability: 0.0, matching: 0.0 };
    }
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    let found = mutual(&mapped, &shown, |a, b| apart(&a.0, &b.0));
    let found = found.filter(|&(i, j)| apart(&mapped[i].0, &shown[j].0) <= NEAR_PX * NEAR_PX).count();
    let differ = |a: &[u64; 4], b: &[u64; 4]| a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
    let matched = mutual(&mapped, &shown, |a, b| f64::from(differ(&a.1, &b.1)));
    let matched = matched.filter(|&(i, j)| apart(&mapped[i].0, &shown[j].0) <= NEAR_PX * NEAR_PX).count();
    Score {
        features: f64_from_usize(mapped.len()),
        repeatability: f64_from_usize(found) / most,
        matching: f64_from_usize(matched) / most,
    }
}

/// Pairs that are each other's nearest; the first one where several are.
fn mutual<'a, T>(
    left: &'a [T],
    right: &'a [T],
    apart: impl Fn(&T, &T) -> f64 + Copy + 'a,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let nearest = move |one: &T, others: &[T]| {
        let distances = others.iter().map(|other| apart(one, other)).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, _)| number)
    };
    let back: Vec<Option<usize>> = right.iter().map(|one| nearest(one, left)).collect();
    left.iter().enumerate().filter_map(move |(i, one)| {
        let j = nearest(one, right)?;
        (back[j] == Some(i)).then_some((i, j))
    })
}
