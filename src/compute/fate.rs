//! What becomes of one pixel: the stage at which the extractor loses it, or the feature that it gives.

use serde::Serialize;

use super::cells::{CellLists, CornerCandidate};
use super::fast::{BORDER_PX, arc_difference_at};
use super::params::ExtractorParams;
use super::sequence::{candidates, octaves};
use super::word::Word;
use super::{Extracted, Extractor, words};
use crate::error::Error;
use crate::events::Events;
use crate::num::{index, low_u16};
use crate::plane::Plane;

/// A pixel of an octave and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PixelFate {
    /// Half-scale octave, 0 is full size.
    pub octave: u8,
    /// Its column in the octave.
    pub x_px: u32,
    /// Its row in the octave.
    pub y_px: u32,
    /// Its arc difference, in DN of the pipeline; 0 within three pixels of the edge.
    pub arc_difference: u16,
    /// What became of it.
    #[serde(flatten)]
    pub fate: Fate,
}

/// Stages in their order (docs/extractor.md, "What happened to my corner").
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "fate", rename_all = "snake_case")]
pub enum Fate {
    /// The octave is not built, or an odd last column or row that it leaves out.
    NotInOctave,
    /// It is within three pixels of the edge.
    AtEdge,
    /// Its arc difference is not above the threshold.
    BelowThreshold,
    /// A neighbour's arc difference is no smaller.
    Suppressed {
        /// That neighbour's column.
        by_x_px: u32,
        /// That neighbour's row.
        by_y_px: u32,
        /// The neighbour's arc difference.
        by_arc_difference: u16,
    },
    /// Its patch does not lie in the picture.
    WithoutPatch,
    /// Its cell keeps others.
    Unselected {
        /// Its value under the criterion of the selection.
        rank: u16,
        /// The least one that its cell keeps.
        least_rank: u16,
    },
    /// The queue was full, or its rows were overwritten before an engine had loaded them.
    Lost {
        /// Candidates of the whole picture for which the queue was full.
        #[serde(rename = "dropped")]
        dropped_in_picture: u64,
        /// Candidates of the whole picture whose rows were overwritten.
        #[serde(rename = "late")]
        late_in_picture: u64,
    },
    /// A feature left.
    Feature {
        /// Which one, from 0.
        number: usize,
    },
}

/// What becomes of a pixel (column, row) of a picture of codes of `bits` bits in each octave, and the threshold. The picture is the first
/// of a run, at the threshold that its own corners ask for; all its pixels are there, and records are taken at once. Fails on a pixel that
/// is none of the picture's, and as `Extractor::frame` does.
pub fn fates(
    codes: &Plane<u16>,
    bits: u32,
    params: &ExtractorParams,
    (x_px, y_px): (u32, u32),
) -> Result<(u16, Vec<PixelFate>), Error> {
    let size = codes.size();
    if x_px >= size.width_px || y_px >= size.height_px {
        let (x_last, y_last) = (size.width_px.saturating_sub(1), size.height_px.saturating_sub(1));
        return Err(Error::Run(format!("({x_px}, {y_px}) is no pixel of it; use 0,0 to {x_last},{y_last}")));
    }
    let (extracted, mut fates) = extracted_fates(codes, bits, params, [(x_px, y_px)].into_iter())?;
    Ok((extracted.threshold, fates.remove(0)))
}

/// Extracts once, and gives what becomes of some pixels.
fn extracted_fates(
    codes: &Plane<u16>,
    bits: u32,
    params: &ExtractorParams,
    pixels: impl Iterator<Item = (u32, u32)>,
) -> Result<(Extracted, Vec<Vec<PixelFate>>), Error> {
    // Without the fit, positions tell from which pixels the features are.
    let whole = ExtractorParams { subpixel: false, ..*params };
    let extracted = Extractor::new(&whole).first_frame(codes, bits)?;
    let (params, events) = (&whole.for_codes(bits), &mut Events::default());
    let fates = if params.pipeline_bits == 8 {
        let octaves = octaves(words::<u8>(codes, bits, params, events), params);
        pixels.map(|pixel| in_octaves(&octaves, params, &extracted, pixel)).collect()
    } else {
        let octaves = octaves(words::<u16>(codes, bits, params, events), params);
        pixels.map(|pixel| in_octaves(&octaves, params, &extracted, pixel)).collect()
    };
    Ok((extracted, fates))
}

fn in_octaves<W: Word>(
    octaves: &[Plane<W>],
    params: &ExtractorParams,
    extracted: &Extracted,
    (x_px, y_px): (u32, u32),
) -> Vec<PixelFate> {
    let at = |octave: u8| {
        let (x_px, y_px) = (x_px >> octave, y_px >> octave);
        let inside = |picture: &&Plane<W>| x_px < picture.size().width_px && y_px < picture.size().height_px;
        let outside = PixelFate { octave, x_px, y_px, arc_difference: 0, fate: Fate::NotInOctave };
        let picture = octaves.get(usize::from(octave)).filter(inside);
        picture.map_or(outside, |picture| in_octave(picture, octave, params, extracted, (x_px, y_px)))
    };
    (0..).take(index(params.octaves)).map(at).collect()
}

fn in_octave<W: Word>(
    picture: &Plane<W>,
    octave: u8,
    params: &ExtractorParams,
    extracted: &Extracted,
    (x_px, y_px): (u32, u32),
) -> PixelFate {
    let arc_difference = |x_px: u32, y_px: u32| low_u16(arc_difference_at(picture, x_px, y_px).number());
    let own = arc_difference(x_px, y_px);
    let mut greatest = (0, (x_px, y_px));
    for y in y_px.saturating_sub(1)..=(y_px + 1).min(picture.size().height_px - 1) {
        for x in x_px.saturating_sub(1)..=(x_px + 1).min(picture.size().width_px - 1) {
            if (x, y) != (x_px, y_px) {
                greatest = greatest.max((arc_difference(x, y), (x, y)));
            }
        }
    }
    let is_inner = |position_px: u32, side_px: u32| {
        index(position_px) >= BORDER_PX && index(position_px) + BORDER_PX < index(side_px)
    };
    let fate = if !is_inner(x_px, picture.size().width_px) || !is_inner(y_px, picture.size().height_px) {
        Fate::AtEdge
    } else if own <= extracted.threshold {
        Fate::BelowThreshold
    } else if greatest.0 >= own {
        let (by_arc_difference, (by_x_px, by_y_px)) = greatest;
        Fate::Suppressed { by_x_px, by_y_px, by_arc_difference }
    } else {
        of_corner(picture, octave, params, extracted, (x_px, y_px))
    };
    PixelFate { octave, x_px, y_px, arc_difference: own, fate }
}

fn of_corner<W: Word>(
    picture: &Plane<W>,
    octave: u8,
    params: &ExtractorParams,
    extracted: &Extracted,
    (x_px, y_px): (u32, u32),
) -> Fate {
    let (_, candidates) = candidates(picture, octave, extracted.threshold, params);
    let is_own = |candidate: &CornerCandidate| (candidate.corner.x_px, candidate.corner.y_px) == (x_px, y_px);
    let Some(own) = candidates.iter().find(|candidate| is_own(candidate)) else { return Fate::WithoutPatch };
    let lists = CellLists::of(&candidates, picture.size(), params.cell_px, index(params.per_cell));
    let kept = lists.list(index(y_px / params.cell_px), index(x_px / params.cell_px));
    if !kept.iter().any(is_own) {
        let least_rank = kept.last().expect("a full cell is not empty").rank;
        return Fate::Unselected { rank: own.rank, least_rank };
    }
    // In sixteenths of the full picture's pixels.
    let sixteenths = |position_px: u32| (((position_px << 4) + 8) << octave) - 8;
    let left = extracted.features.iter().position(|feature| {
        let [x, y] = [feature.x, feature.y].map(|coordinate| u32::from(coordinate.to_bits()));
        (feature.octave, x, y) == (octave, sixteenths(x_px), sixteenths(y_px))
    });
    let counts = &extracted.counts;
    let lost = Fate::Lost { dropped_in_picture: counts.dropped, late_in_picture: counts.late };
    left.map_or(lost, |number| Fate::Feature { number })
}

#[cfg(test)]
mod tests {
    use super::super::params::{Overflow, Rank};
    use super::super::test_pictures::noise;
    use super::*;

    /// Every pixel of a picture has a fate, and as many have each as the extractor counts.
    #[test]
    fn fates_of_all_pixels_are_what_the_extractor_counts() {
        let usual = ExtractorParams { target_features: 0, octaves: 2, per_cell: 1, ..ExtractorParams::USUAL };
        let cases = [
            ("usual", 8, usual),
            ("longer words", 12, ExtractorParams { pipeline_bits: 10, rank: Rank::Harris, ..usual }),
            ("full queue", 8, ExtractorParams { overflow: Overflow::DropWeakest, fifo_depth: 1, engines: 1, ..usual }),
            ("adapted", 8, ExtractorParams { target_features: 40, ..usual }),
            ("few bits", 3, ExtractorParams { threshold: 4, ..usual }),
        ];
        for (name, bits, params) in cases {
            let codes = noise(75, 67, 200, 5).map(|value| u16::from(value) << 8 >> (16 - bits));
            let extracted = Extractor::new(&params).first_frame(&codes, bits).unwrap();
            let pixels = || (0..67).flat_map(|y| (0..75).map(move |x| (x, y)));
            let (without_fit, all) = extracted_fates(&codes, bits, &params, pixels()).unwrap();
            assert_eq!((without_fit.threshold, without_fit.counts), (extracted.threshold, extracted.counts), "{name}");
            assert_eq!(
                fates(&codes, bits, &params, (40, 30)).unwrap(),
                (extracted.threshold, all[30 * 75 + 40].clone())
            );
            let mut counted = [0; 7];
            let mut features = Vec::new();
            for ((x, y), fates) in pixels().zip(&all) {
                assert_eq!(fates.len(), 2);
                // Four pixels share one of an upper octave.
                let is_first = |fate: &&PixelFate| x % (1 << fate.octave) == 0 && y % (1 << fate.octave) == 0;
                for fate in fates.iter().filter(is_first) {
                    counted[match fate.fate {
                        Fate::NotInOctave => continue,
                        Fate::AtEdge => 0,
                        Fate::BelowThreshold => 1,
                        Fate::Suppressed { .. } => 2,
                        Fate::WithoutPatch => 3,
                        Fate::Unselected { .. } => 4,
                        Fate::Lost { dropped_in_picture, late_in_picture } => {
                            let lost = (extracted.counts.dropped, extracted.counts.late);
                            assert_eq!((dropped_in_picture, late_in_picture), lost, "{name}");
                            5
                        }
                        Fate::Feature { number } => {
                            let feature = &extracted.features[number];
                            assert_eq!((feature.octave, feature.score), (fate.octave, fate.arc_difference - 1));
                            features.push(number);
                            6
                        }
                    }] += 1;
                }
            }
            features.sort_unstable();
            assert!(features.into_iter().eq(0..extracted.features.len()), "{name}");
            let counts = &extracted.counts;
            assert_eq!(counted[3..5], [counts.without_patch, counts.unselected], "{name}");
            assert_eq!(counted[5], counts.dropped + counts.late, "{name}");
            assert!([1, 2, 3, 4, 6].iter().all(|&fate| counted[fate] > 0), "{name}: {counted:?}");
            assert_eq!(counted[5] > 0, name == "full queue", "{name}: {counted:?}");
            assert_eq!(counted[0], 75 * 67 - 69 * 61 + 37 * 33 - 31 * 27, "{name}");
            assert_eq!(counted.iter().sum::<u64>(), 75 * 67 + 37 * 33, "{name}");
        }
    }
}
