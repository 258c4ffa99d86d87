//! The clocked form: runs a frame through the hardware's twin, `rtl_models::extractor_rows`, which skips clocks in which nothing changes.
//! Its features equal those of the functional form.

use rtl_models::extractor_core::front_config;
use rtl_models::extractor_rows::{ExtractorHost, ExtractorRows, row_corners};
use rtl_models::fx_back::{self, CellList, Engine, FxBackConfig, FxBackMemory, FxSettings, Policy, QueuedCorner};
use rtl_models::fx_front_rows::{FrontRows, FrontRowsMemory, PixelWord, RowCorner};

use super::back::Records;
use super::feature::{Extracted, ExtractorCounts, Feature};
use super::params::{ExtractorParams, Overflow, PairPattern, Rank};
use super::rows::Pixels;
use crate::error::Error;
use crate::num::{index, low_u16};
use crate::plane::Plane;
use crate::rtl_simulator::{FrameRequest, FrameResult, RtlSimulator};
use crate::simd::{Kernel, dispatch};
use crate::units::Size;

/// Columns for which hardware is built at least.
const WIDTH_MIN: u32 = 16;

impl ExtractorParams {
    /// The hardware that these parameters are.
    pub fn hardware(&self, size: Size) -> FxBackConfig {
        FxBackConfig {
            max_width: size.width_px.max(WIDTH_MIN),
            pix_bits: self.pipeline_bits,
            octaves: self.octaves,
            harris: self.rank == Rank::Harris,
            cell_log2: self.cell_px.ilog2(),
            per_cell: self.per_cell,
            ring_log2: self.ring_rows().ilog2(),
            engines: self.engines,
            fifo_depth: self.fifo_depth,
            desc_bits: self.descriptor_bits,
            symmetric: self.pattern == PairPattern::Symmetric,
            subpixel: self.subpixel,
            width: size.width_px,
            height: size.height_px,
        }
    }
}

fn settings(params: &ExtractorParams) -> Result<FxSettings, Error> {
    let target = u16::try_from(params.target_features).map_err(|_| {
        let reason = format!("the clocked extractor's register has 16 bits; use at most {}", u16::MAX);
        Error::key("compute.target_features", params.target_features, reason)
    })?;
    let policy = match params.overflow {
        Overflow::Stall => Policy::Stall,
        Overflow::DropNewest => Policy::DropNewest,
        Overflow::DropWeakest => Policy::DropWeakest,
    };
    Ok(FxSettings { threshold: params.threshold, policy, target, angle_bits: params.angle_bits })
}

/// The world around the twin, and what left it.
struct FrameHost<'a> {
    pixels: &'a mut dyn Pixels,
    records: &'a mut dyn Records,
    features: Vec<Feature>,
    out_clk: Vec<u64>,
}

impl FrameHost<'_> {
    fn extracted(self, given: &FrameResult, threshold: u16) -> Extracted {
        let found = &given.counts;
        let counts = ExtractorCounts {
            corners: found.corners.wrapping_sub(found.without_patch).into(),
            without_patch: found.without_patch.into(),
            unselected: found.unselected.into(),
            dropped: found.dropped.into(),
            late: found.late.into(),
            stalled_clk: found.stalled.into(),
            not_ready_clk: given.not_ready_clk,
        };
        Extracted { features: self.features, out_clk: self.out_clk, counts, threshold, end_clk: given.end_clk }
    }
}

impl ExtractorHost for FrameHost<'_> {
    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64 {
        self.pixels.offered_run(first, end, y, clk)
    }

    fn taken(&mut self, clk: u64) -> u64 {
        self.records.taken(clk)
    }

    fn leaves(&mut self, record: &fx_back::Record, clk: u64) {
        let fx_back::Record { x_q4, y_q4, score, angle, octave, descriptor, .. } = *record;
        self.features.push(Feature { x: x_q4, y: y_q4, score, angle, octave, descriptor });
        self.out_clk.push(clk);
    }
}

/// A frame through the twin, compiled for the machine's instruction set.
struct WholeFrame<'k, 'm, 'a, T> {
    core: &'k mut ExtractorRows<'m, T>,
    pixels: &'k [T],
    around: &'k mut FrameHost<'a>,
}

impl<T: PixelWord> Kernel for WholeFrame<'_, '_, '_, T> {
    type Output = u64;

    #[inline(always)]
    fn run(self) -> u64 {
        self.core.frame(self.pixels, self.around)
    }
}

/// What a frame gives at a threshold, and the threshold of the next. Fails on a target that the register does not hold.
pub(super) fn frame<T: PixelWord>(
    params: &ExtractorParams,
    threshold: u16,
    picture: &Plane<T>,
    (pixels, records): (&mut dyn Pixels, &mut dyn Records),
) -> Result<(Extracted, u16), Error> {
    let (config, settings) = (params.hardware(picture.size()), settings(params)?);
    let front = front_config(&config);
    let (words, width) = (FrontRows::<T>::words(&front), index(config.max_width));
    let (mut kept, mut differences) = (vec![T::default(); 8 * words], vec![T::default(); 3 * words]);
    let (mut scratch, mut sums) = (vec![T::default(); width], vec![0; width]);
    let memory =
        FrontRowsMemory { pixels: &mut kept, differences: &mut differences, scratch: &mut scratch, sums: &mut sums };
    let (mut lists, mut ring) = (vec![CellList::default(); config.lists()], vec![0; config.ring_pixels()]);
    let mut queue = vec![QueuedCorner::default(); index(config.fifo_depth)];
    let mut engines = vec![Engine::default(); index(config.engines)];
    let back = FxBackMemory { lists: &mut lists, ring: &mut ring, queue: &mut queue, engines: &mut engines };
    let mut corners = vec![RowCorner::default(); row_corners(config.max_width)];
    let mut core = ExtractorRows::new(config, settings, threshold, (memory, back, &mut corners));
    let mut around = FrameHost { pixels, records, features: Vec::new(), out_clk: Vec::new() };
    let end_clk = dispatch(WholeFrame { core: &mut core, pixels: picture.values(), around: &mut around });
    let not_ready_clk = core.not_ready();
    core.finish(&mut around);
    let given = FrameResult { counts: *core.counts(), not_ready_clk, threshold: core.threshold(), end_clk };
    Ok((around.extracted(&given, threshold), given.threshold))
}

/// The same from the Verilog.
pub(super) fn frame_in<T: super::word::Word>(
    simulator: &dyn RtlSimulator,
    params: &ExtractorParams,
    threshold: u16,
    picture: &Plane<T>,
    (pixels, records): (&mut dyn Pixels, &mut dyn Records),
) -> Result<(Extracted, u16), Error> {
    let (hardware, settings) = (params.hardware(picture.size()), settings(params)?);
    let words = picture.map(|word| low_u16(word.into()));
    let mut around = FrameHost { pixels, records, features: Vec::new(), out_clk: Vec::new() };
    let given =
        simulator.frame(&FrameRequest { hardware, settings, threshold, pixels: words.values() }, &mut around)?;
    Ok((around.extracted(&given, threshold), given.threshold))
}
