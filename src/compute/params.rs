//! Parameters of the extractor: checks the values of a config.

use super::patch::RADIUS_PX;
use super::{presmooth, smooth};
use crate::error::Error;
use crate::num::u32_from;
use crate::text::named;
use crate::units::Size;

/// Rows and columns around a corner that its descriptor needs: 13 for the patch and 3 for the smoothing kernel. Corners nearer
/// to an edge leave no feature.
pub const PATCH_MARGIN_PX: u32 = 16;
const _: () = assert!(PATCH_MARGIN_PX as usize == RADIUS_PX + smooth::BORDER_PX);

/// Widest and highest picture: coordinates are 12 bits of pixel and 4 bits of fraction.
pub const SIDE_PX_MAX: u32 = 4096;

/// Least width and height of a picture that has a corner.
pub const SIDE_PX_MIN: u32 = 7;

/// Least width and height of an octave beyond the first: in smaller ones no corner has its whole patch.
pub const OCTAVE_SIDE_PX_MIN: u32 = 2 * PATCH_MARGIN_PX + 1;

/// Features of a frame that a tracker asks for, where no target is set.
const FEATURES_USUAL: u64 = 500;

named! {
    /// Which of a cell's corners count most.
    pub enum Rank {
        /// FAST's score.
        Fast = "fast",
        /// Harris' measure.
        Harris = "harris",
    }
}

named! {
    /// Which pairs a descriptor compares.
    pub enum PairPattern {
        /// 256 pairs of nearly Gaussian positions, turned by the angle.
        Gaussian = "gaussian",
        /// Eight pairs under 32 turns: bytes move round instead.
        Symmetric = "symmetric",
    }
}

named! {
    /// Whether words are smoothed before corners are looked for.
    pub enum Smoothing {
        /// Where codes have so few bits that their steps are corners.
        Auto = "auto",
        /// Never.
        Off = "off",
        /// By the 7x7 binomial kernel, for codes of any depth.
        Binomial = "binomial",
    }
}

/// Codes of this many bits or fewer are smoothed before corners are looked for, by default: measured with one camera in a
/// textured box, where 2 bits do not start without, and 4 bits go wrong from one starting frame of four (docs/tracker_figures.md).
const SMOOTHED_BITS: u32 = 4;

named! {
    /// What happens when a candidate leaves its cell and the queue of the engines is full.
    pub enum Overflow {
        /// Candidates wait in their cells, and finally rows wait.
        Stall = "stall",
        /// The candidate is lost.
        DropNewest = "drop_newest",
        /// The weakest of queue and candidate is lost, the newest among equals.
        DropWeakest = "drop_weakest",
    }
}

/// What the extractor is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExtractorParams {
    /// Least difference to the arc of nine pixels, in DN of the pipeline; a corner's score is at least this. With a target,
    /// the least of all frames. Of smoothed words it is halved (`for_codes`).
    pub threshold: u16,
    /// Corners a frame to which the threshold adapts, from `threshold` upwards; the first frame's own corners decide where it starts. 0:
    /// it stays.
    pub target_features: u32,
    /// Bits of the pipeline's words, 8 to 16.
    pub pipeline_bits: u32,
    /// Whether words are smoothed first.
    pub smoothing: Smoothing,
    /// Octaves, each of half the sides of the one before, 1 to 4.
    pub octaves: u32,
    /// Side of a cell: 16, 32 or 64.
    pub cell_px: u32,
    /// Corners that a cell keeps, 1 to 4.
    pub per_cell: u32,
    /// Which of a cell's corners are kept.
    pub rank: Rank,
    /// Positions to sixteenths of a pixel, by the differences around a corner; else positions are whole pixels of their octave.
    pub subpixel: bool,
    /// Bits of an angle, 3 to 8; its lower bits are 0.
    pub angle_bits: u32,
    /// Bits of a descriptor: 64, 128, 192 or 256; its other bits are 0.
    pub descriptor_bits: u32,
    /// Which pairs a descriptor compares.
    pub pattern: PairPattern,
    /// Descriptor engines in parallel, 1 to 4.
    pub engines: u32,
    /// Candidates that wait for an engine, 1 to 64.
    pub fifo_depth: u32,
    /// What happens to one more.
    pub overflow: Overflow,
}

impl ExtractorParams {
    /// One octave of 8 bits, a threshold that rises where a frame has more than some 500 corners, up to four corners for 16 x 16
    /// pixels, whole descriptors: the defaults of a scenario.
    pub const USUAL: Self = Self {
        threshold: 20,
        target_features: 500,
        pipeline_bits: 8,
        smoothing: Smoothing::Auto,
        octaves: 1,
        cell_px: 16,
        per_cell: 4,
        rank: Rank::Fast,
        subpixel: true,
        angle_bits: 8,
        descriptor_bits: 256,
        pattern: PairPattern::Gaussian,
        engines: 2,
        fifo_depth: 16,
        overflow: Overflow::Stall,
    };

    /// The same, after its ranges are checked. Fails on the first value out of its range.
    pub fn checked(self) -> Result<Self, Error> {
        let most = (1 << self.pipeline_bits.clamp(8, 16)) - 1;
        let ranges = [
            ("compute.pipeline_bits", self.pipeline_bits, 8, 16),
            ("compute.threshold", self.threshold.into(), 1, most),
            ("compute.octaves", self.octaves, 1, 4),
            ("compute.per_cell", self.per_cell, 1, 4),
            ("compute.angle_bits", self.angle_bits, 3, 8),
            ("compute.engines", self.engines, 1, 4),
            ("compute.fifo_depth", self.fifo_depth, 1, 64),
            ("compute.target_features", self.target_features, 0, 1_000_000),
        ];
        for (key, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                let unit = if key == "compute.threshold" { " (DN of the pipeline)" } else { "" };
                return Err(Error::key(key, value, format!("use {least} to {most}{unit}")));
            }
        }
        if ![16, 32, 64].contains(&self.cell_px) {
            return Err(Error::key("compute.cell_px", self.cell_px, "use 16, 32 or 64"));
        }
        if ![64, 128, 192, 256].contains(&self.descriptor_bits) {
            return Err(Error::key("compute.descriptor_bits", self.descriptor_bits, "use 64, 128, 192 or 256"));
        }
        Ok(self)
    }

    /// Whether words of codes of a given width are smoothed before corners are looked for.
    pub fn smooths(&self, code_bits: u32) -> bool {
        match self.smoothing {
            Smoothing::Auto => code_bits <= SMOOTHED_BITS,
            Smoothing::Off => false,
            Smoothing::Binomial => true,
        }
    }

    /// The same for codes of a given width: with the least threshold that makes sense there.
    ///
    /// Smoothing leaves a corner 0.41 of its difference by the median (quartiles 0.33 and 0.47; 4,000 corners of a textured box), so half
    /// the threshold finds as many. What two by two pixels make that noise has moved by one code is no corner, whatever was asked for.
    #[must_use]
    pub fn for_codes(&self, code_bits: u32) -> Self {
        if !self.smooths(code_bits) {
            return *self;
        }
        let step = 1_u32 << self.pipeline_bits.saturating_sub(code_bits);
        let most = (1 << self.pipeline_bits) - 1;
        let least = u32::from(self.threshold / 2).max(presmooth::block_of(step)).clamp(1, most);
        Self { threshold: crate::num::low_u16(least), ..*self }
    }

    /// Whether pictures of this size can be worked on. Fails on a side under 7 pixels, which no corner fits into, or over 4096.
    pub fn check_size(size: Size) -> Result<(), Error> {
        for (key, side_px) in [("sensor.width", size.width_px), ("sensor.height", size.height_px)] {
            if !(SIDE_PX_MIN..=SIDE_PX_MAX).contains(&side_px) {
                let reason = format!("the extractor's window takes {SIDE_PX_MIN} to {SIDE_PX_MAX} pixels a side");
                return Err(Error::key(key, side_px, reason));
            }
        }
        Ok(())
    }

    /// Sizes of the octaves that are built.
    pub fn octave_sizes(&self, size: Size) -> Vec<Size> {
        let mut sizes = vec![size];
        while u32_from(sizes.len()) < self.octaves {
            let next = super::half::half_size(sizes[sizes.len() - 1]);
            if next.width_px.min(next.height_px) < OCTAVE_SIDE_PX_MIN {
                break;
            }
            sizes.push(next);
        }
        sizes
    }

    /// Features of a frame at most: every cell that holds a position with a whole patch is full.
    pub fn features_max(&self, size: Size) -> u64 {
        let cells = |side_px: u32| {
            let (first, last) = (PATCH_MARGIN_PX, side_px.saturating_sub(PATCH_MARGIN_PX + 1));
            if last < first { 0 } else { u64::from(last / self.cell_px - first / self.cell_px + 1) }
        };
        let sizes = self.octave_sizes(size);
        let in_all: u64 = sizes.iter().map(|size| cells(size.width_px) * cells(size.height_px)).sum();
        in_all * u64::from(self.per_cell)
    }

    /// Features of a frame that a link is laid out for: the target, or 500 as trackers ask for. A frame of more is checked when it comes.
    pub fn features_expected(&self, size: Size) -> u64 {
        let wanted = if self.target_features > 0 { self.target_features.into() } else { FEATURES_USUAL };
        self.features_max(size).min(wanted)
    }

    /// Rows of smoothed pixels that are held for patches.
    pub fn ring_rows(&self) -> u32 {
        if self.cell_px == 64 { 128 } else { 64 }
    }

    /// The threshold of the next frame after one with the given number of corners that had their patches.
    ///
    /// Within an eighth of the target it stays; else it moves by an eighth of itself up or by a sixteenth down, at least by one, and
    /// never below where it began.
    pub fn next_threshold(&self, threshold: u16, corners: u64) -> u16 {
        let target = u64::from(self.target_features);
        let most = (1_u32 << self.pipeline_bits) - 2;
        let threshold = u32::from(threshold);
        let next = if target == 0 {
            return crate::num::low_u16(threshold);
        } else if corners > target + target / 8 {
            threshold + (threshold >> 3).max(1)
        } else if corners < target - target / 8 && threshold > u32::from(self.threshold) {
            (threshold - (threshold >> 4).max(1)).max(self.threshold.into())
        } else {
            threshold
        };
        crate::num::low_u16(next.min(most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_threshold_of_smoothed_words_knows_the_step_of_the_codes() {
        let usual = ExtractorParams::USUAL;
        let least = |params: ExtractorParams| [1, 2, 3, 4, 5, 8, 10].map(|bits| params.for_codes(bits).threshold);
        // 1225/4096 of a step of 128, 64 and 32 is 38.3, 19.1 and 9.6, rounded up.
        assert_eq!(least(usual), [39, 20, 10, 10, 20, 20, 20]);
        assert_eq!(least(ExtractorParams { smoothing: Smoothing::Off, ..usual }), [20; 7]);
        assert_eq!(least(ExtractorParams { smoothing: Smoothing::Binomial, ..usual }), [39, 20, 10, 10, 10, 10, 10]);
        let low = ExtractorParams { smoothing: Smoothing::Binomial, threshold: 1, ..usual };
        assert_eq!(least(low), [39, 20, 10, 5, 3, 1, 1]);
        let wide = ExtractorParams { pipeline_bits: 12, threshold: 320, ..usual };
        assert_eq!(least(wide), [613, 307, 160, 160, 320, 320, 320]);
        assert!(least(ExtractorParams { pipeline_bits: 16, threshold: 65_535, ..usual })[0] == 32_767);
    }
}
