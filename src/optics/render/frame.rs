//! Runs the steps of a render over a whole picture, on all cores where the feature is on. A pixel's result depends on its own samples
//! only, so the order of work never shows.

use super::allocation::{Estimate, INITIAL_SAMPLES, STRATA, Stage, missed_variance};
use super::first_batch::{FirstBatch, Nearest};
use super::objects::ObjectInView;
use super::pixel::{Pixel, StoppingRule};
use super::pixel_samples::PixelSamples;
use super::replicate::Replicate;
use super::settings::{COLUMNS, ROWS, Sampling};
use super::tile::{Pass, Rows};
use super::view::View;
use crate::draw::sobol::SHARED_BITS;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u64_from};
use crate::optics::motion::Timeline;
use crate::parallel::{collected, over_chunks};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::lanes::LANES;
use crate::scene::light::{BANDS, Bands};
use crate::scene::object::MovingObject;
use crate::scene::tracer::Stack;
use crate::simd::dispatch;
use crate::units::Span;

/// Marks keys of refined pixels.
const OF_REFINED: u64 = 1 << 41;
/// Marks keys of replicates.
const OF_REPLICATE: u64 = 1 << 42;
/// Marks keys of second replicates.
const OF_SECOND_REPLICATE: u64 = 1 << 46;
/// Pixels of a unit of parallel work.
const CHUNK: usize = 64;

/// Everything that the steps of a render share.
pub struct FrameRender<'a> {
    /// Scene and camera.
    pub view: View<'a>,
    /// Span of each row.
    pub shutter: &'a [Span],
    /// Sampling options.
    pub sampling: Sampling,
    /// Motion over the exposure of each group of rows.
    pub timelines: Vec<Timeline>,
    /// What moves beside the camera.
    pub objects: Vec<ObjectInView>,
    /// What is not rendered; none: all is.
    pub kept: Option<Kept<'a>>,
    per_lux_s: [f64; BANDS],
    /// Level of the flickering lamps in each stratum of each row's exposure.
    pub lamp_levels: Vec<[f32; STRATA]>,
}

/// A picture of which some tiles are kept.
pub struct Kept<'a> {
    /// Which tiles of each group of rows are rendered anew.
    pub tiles: Vec<Vec<bool>>,
    /// Photons of the others.
    pub photons: &'a Plane<f32>,
}

/// A pixel that is refined.
pub struct Refined {
    /// Place in the picture, row by row.
    pub at: usize,
    /// Its samples.
    pub pixel_samples: PixelSamples,
}

impl Refined {
    /// Without samples yet.
    pub fn at(at: usize) -> Self {
        Self { at, pixel_samples: PixelSamples::new(0.0) }
    }
}

/// Rows of each group; those beyond the last repeat it.
fn rows_of(group: usize, height: usize) -> [usize; ROWS] {
    std::array::from_fn(|row| (group * ROWS + row).min(height - 1))
}

impl<'a> FrameRender<'a> {
    /// Evaluates the motion and the lamps once for every row.
    pub fn new(
        view: View<'a>,
        objects: &[MovingObject],
        shutter: &'a [Span],
        world_from_body: &(dyn Fn(f64) -> Pose + Sync),
        sampling: Sampling,
    ) -> Self {
        let world_from_camera = |t_s: f64| world_from_body(t_s).then(&view.camera.body_from_camera);
        let groups = shutter.len().div_ceil(ROWS);
        let spans = collected(groups, |group| rows_of(group, shutter.len()).map(|row| shutter[row]));
        let pieces_of = |group: usize| {
            let beside = objects.iter().map(|object| {
                let pose = |t_s: f64| object.world_from_object(t_s).inverse().then(&world_from_camera(t_s));
                Timeline::pieces_for(spans[group][0], &pose)
            });
            beside.fold(Timeline::pieces_for(spans[group][0], &world_from_camera), u32::max)
        };
        // As many for all, so that rays of many rows may share a packet.
        let pieces = collected(groups, pieces_of).into_iter().max().unwrap_or(1);
        let mut timelines = collected(groups, |group| Timeline::of(spans[group], pieces, &world_from_camera));
        let mut objects: Vec<ObjectInView> =
            objects.iter().map(|object| ObjectInView::new(object, &spans, pieces, &world_from_camera)).collect();
        for group in 0..groups {
            let beside = objects.iter_mut().map(|object| &mut object.timelines[group]);
            let mut all: Vec<&mut Timeline> = beside.chain([&mut timelines[group]]).collect();
            if all.iter().any(|timeline| !timeline.is_still) {
                all.iter_mut().for_each(|timeline| timeline.cut_alike(pieces));
            }
        }
        let level = |row: usize| std::array::from_fn(|stratum| level(&view, shutter[row], stratum, STRATA));
        let lamp_levels = (0..shutter.len()).map(level).collect();
        let per_lux_s = view.camera.photons_per_lux_s(view.scene.illuminant());
        Self { view, shutter, sampling, timelines, objects, kept: None, per_lux_s, lamp_levels }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        index(self.view.camera.size.width_px)
    }

    /// Whether a pixel is rendered.
    pub fn is_rendered(&self, at: usize) -> bool {
        let (x, y) = (at % self.width(), at / self.width());
        self.kept.as_ref().is_none_or(|kept| kept.tiles[y / ROWS][x / COLUMNS])
    }

    /// Photons of each band per lux-equivalent behind the filter of a pixel, over its row's exposure.
    pub fn photons_per_lux(&self, column: usize, row: usize) -> Bands {
        // To the picosecond, so that equal exposures are equal in every bit whenever they begin.
        let length_s = (self.shutter[row].length_s() * 1e12).round_ties_even() * 1e-12;
        let passed = self.view.camera.mosaic.transmission_at(column, row);
        std::array::from_fn(|band| f32_nearest(self.per_lux_s[band] * passed[band] * length_s))
    }

    /// The first batch of every pixel.
    pub fn first_batch(&self, count: u32) -> Vec<FirstBatch> {
        let Sampling { subframes, samples_per_pixel: each, .. } = self.sampling;
        let share = |samples: u32| 1.0 / f32_from_u32(samples).sqrt();
        // A still picture is filtered for itself, and not along the motion.
        let shares = if subframes > 0 { [share(each), 0.0] } else { [share(count); 2] };
        let strata_log2 = count.ilog2().min(SHARED_BITS);
        let pass = Pass { count, shares, subframes, each, strata_log2 };
        let mut seen = vec![FirstBatch::NONE; self.width() * self.shutter.len()];
        over_chunks(&mut seen, self.width() * ROWS, |group, seen| self.first_batch_rows(&pass, group, seen));
        if let Some(kept) = &self.kept {
            let photons = kept.photons.values().iter().enumerate().filter(|(at, _)| !self.is_rendered(*at));
            photons.for_each(|(at, photons)| seen[at].photons = *photons);
        }
        seen
    }

    fn first_batch_rows(&self, pass: &Pass, group: usize, seen: &mut [FirstBatch]) {
        let row_of = rows_of(group, self.shutter.len());
        let strata = if pass.subframes > 0 { index(pass.subframes) } else { 1 << pass.strata_log2 };
        let levels = |stratum: usize| {
            let of_row = row_of.map(|row| level(&self.view, self.shutter[row], stratum, strata));
            std::array::from_fn(|lane| of_row[lane / COLUMNS])
        };
        let lamp_levels: Vec<[f32; LANES]> = (0..strata).map(levels).collect();
        dispatch(Rows {
            view: self.view,
            timeline: &self.timelines[group],
            objects: &self.objects,
            lamp_levels: &lamp_levels,
            photons_per_lux: row_of.map(|row| std::array::from_fn(|column| self.photons_per_lux(column, row))),
            first: group * ROWS,
            count: seen.len() / self.width(),
            keys: row_of.map(|row| self.sampling.key.with(u64_from(row))),
            pass,
            tiles: self.kept.as_ref().map(|kept| kept.tiles[group].as_slice()),
            seen,
        });
    }

    /// A pixel whose samples are named by `kind`, a mark of keys.
    pub fn pixel(&self, at: usize, kind: u64) -> Pixel<'_> {
        let (x, y) = (at % self.width(), at / self.width());
        Pixel {
            view: self.view,
            timeline: &self.timelines[y / ROWS],
            objects: &self.objects,
            lamp_levels: &self.lamp_levels[y],
            photons_per_lux: self.photons_per_lux(x, y),
            at: [x, y],
            key: self.sampling.key.with(u64_from(y)).with(u64_from(x) | kind),
        }
    }

    /// The nearest surface that a pixel or one of the four beside it met.
    fn nearest(&self, seen: &[FirstBatch], at: usize) -> Nearest {
        let (x, y, width) = (at % self.width(), at / self.width(), self.width());
        let beside = [
            y * width + x.saturating_sub(1),
            y * width + (x + 1).min(width - 1),
            y.saturating_sub(1) * width + x,
            (y + 1).min(self.shutter.len() - 1) * width + x,
        ];
        beside.into_iter().fold(seen[at].nearest, |nearest, other| nearest.or(seen[other].nearest))
    }

    /// Refines pixels until a rule has enough.
    pub fn refine(&self, refined: &mut [Refined], seen: &[FirstBatch], rule: &StoppingRule) {
        over_chunks(refined, CHUNK, |_, refined| {
            let mut stack = Stack::new();
            for Refined { at, pixel_samples } in refined {
                if pixel_samples.samples == 0 {
                    pixel_samples.missed_variance = missed_variance(seen, self.width(), *at);
                } else if pixel_samples.samples >= rule.samples || rule.is_enough(pixel_samples) {
                    continue;
                }
                self.pixel(*at, OF_REFINED).refine(pixel_samples, self.nearest(seen, *at), rule, &mut stack);
            }
        });
    }

    /// Photons of replicates, and the rays that they took: one replicate of as many samples for a refined pixel, two finer ones for a
    /// pixel of the first batch.
    pub fn replicates(
        &self,
        replicates: &[Replicate],
        estimates: &[Estimate],
        seen: &[FirstBatch],
        first_batch: u32,
        rule: &StoppingRule,
    ) -> (Vec<[f32; 2]>, u64) {
        const EACH: usize = CHUNK / 4;
        let mut all = vec![([0.0; 2], 0); replicates.len()];
        over_chunks(&mut all, EACH, |chunk, some| {
            let mut stack = Stack::new();
            for (number, (photons, samples)) in some.iter_mut().enumerate() {
                let at = replicates[chunk * EACH + number].at;
                let mut replicate_of = |kind: u64, samples: u32| {
                    let rule = StoppingRule { samples, least_gain: None, saturation_photons: f32::INFINITY, ..*rule };
                    let mut pixel_samples = PixelSamples::new(missed_variance(seen, self.width(), at));
                    self.pixel(at, OF_REFINED | kind).refine(
                        &mut pixel_samples,
                        self.nearest(seen, at),
                        &rule,
                        &mut stack,
                    );
                    (pixel_samples.photons, pixel_samples.samples)
                };
                match estimates[at].stage {
                    Stage::Refined => {
                        // A given number has rays beside it, which a replicate chooses for itself.
                        let grown = estimates[at].samples - first_batch;
                        let samples_of_replicate = if rule.share.is_some() { rule.samples } else { grown };
                        let (photons_of_replicate, rays) = replicate_of(OF_REPLICATE, samples_of_replicate);
                        (*photons, *samples) = ([photons_of_replicate; 2], rays);
                    }
                    Stage::First => {
                        let [(a, rays), (b, more)] =
                            [OF_REPLICATE, OF_SECOND_REPLICATE].map(|kind| replicate_of(kind, INITIAL_SAMPLES));
                        (*photons, *samples) = ([a, b], rays + more);
                    }
                }
            }
        });
        let samples = all.iter().map(|(_, samples)| u64::from(*samples)).sum();
        (all.into_iter().map(|(photons, _)| photons).collect(), samples)
    }
}

/// Level of the flickering lamps over a stratum of a row's exposure.
fn level(view: &View, span: Span, stratum: usize, strata: usize) -> f32 {
    let share = |edge: usize| f64::from(u32_from(edge)) / f64::from(u32_from(strata));
    let at_s = |edge: usize| span.start_s + span.length_s() * share(edge);
    view.scene.lamp_level(Span { start_s: at_s(stratum), end_s: at_s(stratum + 1) })
}
