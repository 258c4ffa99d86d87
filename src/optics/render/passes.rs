//! Passes over a whole picture, on all cores where the feature is on. Enters: what a render's samples share. Leaves: even samples of all
//! pixels, or cells of some. Every pixel's result is a function of its own samples, so no order shows.

use super::Sampling;
use super::glints::{Finder, Glint};
use super::halves::Seen;
use super::net::Net;
use super::refine::{Pixel, Rule, STRATA};
use super::rows::{COLUMNS, Pass, ROWS, Rows};
use super::shot::View;
use super::spend::{Estimate, Kind};
use super::strata::Parted;
use super::twins::Twin;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u64_from};
use crate::optics::motion::Timeline;
use crate::pose::Pose;
use crate::scene::lanes::LANES;
use crate::scene::light::{BANDS, Bands};
use crate::scene::tracer::Stack;
use crate::simd::dispatch;
use crate::units::Span;

/// Says that a key is of a pixel's own net.
const OF_NET: u64 = 1 << 41;
/// Says that a key is a twin's.
const OF_TWIN: u64 = 1 << 42;
/// Says that a key shows where boxes are lit.
const OF_BOXES: u64 = 1 << 45;
/// Pixels of a unit of parallel work.
const CHUNK: usize = 64;

/// Everything that the passes of a render share.
pub struct Picture<'a> {
    /// What is seen, by what.
    pub view: View<'a>,
    /// Span of each row.
    pub shutter: &'a [Span],
    /// How it is sampled.
    pub sampling: Sampling,
    /// Motion over the exposure of each group of rows.
    pub timelines: Vec<Timeline>,
    per_lux_s: [f64; BANDS],
    /// Level of the flickering lamps in each stratum of each row's exposure.
    pub lamp_levels: Vec<[f32; STRATA]>,
    /// Parts of some pixels' exposures that have samples of their own, by place in the picture.
    boxes: Vec<(usize, Vec<Glint>)>,
}

/// What parting pixels says of their first batch.
pub struct Partings {
    by_place: Vec<(usize, Parted)>,
    /// Rays that it took.
    pub rays: u64,
}

impl Partings {
    /// Adds what lies in boxes to estimates of the rest.
    pub fn correct(&self, estimates: &mut [Estimate]) {
        for (at, parted) in &self.by_place {
            estimates[*at].photons = parted.photons;
            estimates[*at].variance += parted.variance;
        }
    }
}

/// A pixel with a net of its own.
pub struct Growing {
    /// Place in the picture, row by row.
    pub at: usize,
    /// Its samples.
    pub net: Net,
}

/// Rows of each group; those beyond the last repeat it.
fn rows_of(group: usize, height: usize) -> [usize; ROWS] {
    std::array::from_fn(|row| (group * ROWS + row).min(height - 1))
}

/// Results by number.
pub fn collected<T: Send>(count: usize, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(of).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..count).map(of).collect()
    }
}

/// Work on chunks of a list, by number of the chunk.
pub fn over_chunks<T: Send>(all: &mut [T], length: usize, work: impl Fn(usize, &mut [T]) + Send + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        all.par_chunks_mut(length).enumerate().for_each(|(number, chunk)| work(number, chunk));
    }
    #[cfg(not(feature = "parallel"))]
    {
        all.chunks_mut(length).enumerate().for_each(|(number, chunk)| work(number, chunk));
    }
}

impl<'a> Picture<'a> {
    /// Asks the motion and the lamps once for every row.
    pub fn new(
        view: View<'a>,
        shutter: &'a [Span],
        world_from_body: &(dyn Fn(f64) -> Pose + Sync),
        sampling: Sampling,
    ) -> Self {
        let world_from_camera = |t_s: f64| world_from_body(t_s).then(&view.camera.body_from_camera);
        let groups = shutter.len().div_ceil(ROWS);
        let spans = |group: usize| rows_of(group, shutter.len()).map(|row| shutter[row]);
        let pieces = collected(groups, |group| Timeline::pieces_for(spans(group)[0], &world_from_camera));
        // As many for all, so that rays of many rows may share a packet.
        let pieces = pieces.into_iter().max().unwrap_or(1);
        let timelines = collected(groups, |group| Timeline::of(spans(group), pieces, &world_from_camera));
        let level = |row: usize| std::array::from_fn(|stratum| level(&view, shutter[row], stratum, STRATA));
        let lamp_levels = (0..shutter.len()).map(level).collect();
        let per_lux_s = view.camera.photons_per_lux_s(view.scene.illuminant());
        Self { view, shutter, sampling, timelines, per_lux_s, lamp_levels, boxes: Vec::new() }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        index(self.view.camera.size.width_px)
    }

    /// Photons of each band per lux-equivalent behind the filter of a pixel, over its row's exposure.
    pub fn photons_per_lux(&self, column: usize, row: usize) -> Bands {
        // To the picosecond, so that equal exposures are equal in every bit whenever they begin.
        let length_s = (self.shutter[row].length_s() * 1e12).round_ties_even() * 1e-12;
        let passed = self.view.camera.mosaic.transmission_at(column, row);
        std::array::from_fn(|band| f32_nearest(self.per_lux_s[band] * passed[band] * length_s))
    }

    /// Even samples of every pixel.
    pub fn even(&self, count: u32) -> Vec<Seen> {
        let Sampling { subframes, samples_per_pixel: each, .. } = self.sampling;
        let share = |samples: u32| 1.0 / f32_from_u32(samples).sqrt();
        // A still picture is filtered for itself, and not along the motion.
        let shares = if subframes > 0 { [share(each), 0.0] } else { [share(count); 2] };
        let strata_log2 = count.ilog2().min(super::pattern::SHARED_BITS);
        let pass = Pass { count, shares, subframes, each, strata_log2 };
        let mut seen = vec![Seen::NONE; self.width() * self.shutter.len()];
        over_chunks(&mut seen, self.width() * ROWS, |group, seen| self.even_rows(&pass, group, seen));
        seen
    }

    fn even_rows(&self, pass: &Pass, group: usize, seen: &mut [Seen]) {
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
            lamp_levels: &lamp_levels,
            photons_per_lux: row_of.map(|row| std::array::from_fn(|column| self.photons_per_lux(column, row))),
            first: group * ROWS,
            count: seen.len() / self.width(),
            keys: row_of.map(|row| self.sampling.key.with(u64_from(row))),
            pass,
            seen,
        });
    }

    /// Looks for images of lamps, gives boxes of samples to those that would leave more than `least` of their pixel's photons as
    /// variance for each even sample, and takes their pixels out of the first batch that is `seen`.
    pub fn part(&mut self, count: u32, seen: &mut [Seen], least: f32) -> Partings {
        const EACH: usize = CHUNK / 4;
        let found = Finder { view: self.view, timelines: &self.timelines }.all();
        let of = |chunk: usize| -> Vec<(usize, Vec<Glint>, Parted, u32)> {
            let mut stack = Stack::new();
            let some = &found[chunk * EACH..((chunk + 1) * EACH).min(found.len())];
            let one = |(at, glints): &(usize, Vec<Glint>)| {
                let pixel = self.pixel(*at, OF_BOXES);
                let least = least * seen[*at].photons;
                let (lit, left, rays) = Pixel { glints, ..pixel }.lit_boxes(least, &mut stack);
                let pixel = Pixel { glints: &lit, ..self.pixel(*at, OF_NET | OF_BOXES) };
                let parted = pixel.first_parted(count, seen[*at].nearest_m, left, &mut stack);
                let rays = rays + count + pixel.beside(count);
                (*at, lit, parted, rays)
            };
            some.iter().map(one).collect()
        };
        let parted: Vec<_> = collected(found.len().div_ceil(EACH), of).into_iter().flatten().collect();
        let mut partings = Partings { by_place: Vec::new(), rays: 0 };
        for (at, lit, parted, rays) in parted {
            partings.rays += u64::from(rays);
            if !lit.is_empty() {
                seen[at] = parted.outside;
                partings.by_place.push((at, parted));
                self.boxes.push((at, lit));
            }
        }
        partings
    }

    /// A pixel, whose samples a kind of key names.
    pub fn pixel(&self, at: usize, kind: u64) -> Pixel<'_> {
        let boxes = self.boxes.binary_search_by_key(&at, |(at, _)| *at);
        let (x, y) = (at % self.width(), at / self.width());
        Pixel {
            view: self.view,
            timeline: &self.timelines[y / ROWS],
            lamp_levels: &self.lamp_levels[y],
            photons_per_lux: self.photons_per_lux(x, y),
            at: [x, y],
            glints: boxes.map_or(&[], |number| self.boxes[number].1.as_slice()),
            key: self.sampling.key.with(u64_from(y)).with(u64_from(x) | kind),
        }
    }

    /// Distance of the nearest surface that a pixel or one of the four beside it met.
    fn nearest_m(&self, seen: &[Seen], at: usize) -> f32 {
        let (x, y, width) = (at % self.width(), at / self.width(), self.width());
        let beside = [
            y * width + x.saturating_sub(1),
            y * width + (x + 1).min(width - 1),
            y.saturating_sub(1) * width + x,
            (y + 1).min(self.shutter.len() - 1) * width + x,
        ];
        let mut nearest = seen[at].nearest_m;
        for other in beside {
            nearest = if seen[other].nearest_m < nearest { seen[other].nearest_m } else { nearest };
        }
        nearest
    }

    /// Lets nets grow by a rule.
    pub fn grow(&self, nets: &mut [Growing], seen: &[Seen], rule: &Rule) {
        over_chunks(nets, CHUNK, |_, nets| {
            let mut stack = Stack::new();
            for Growing { at, net } in nets {
                self.pixel(*at, OF_NET).grow(net, self.nearest_m(seen, *at), rule, &mut stack);
            }
        });
    }

    /// What twins of pixels see that have as many samples, and how many that took.
    pub fn twins(
        &self,
        twins: &[Twin],
        estimates: &[Estimate],
        seen: &[Seen],
        first: u32,
        rule: &Rule,
    ) -> (Vec<f32>, u64) {
        const EACH: usize = CHUNK / 4;
        let mut all = vec![(0.0, 0); twins.len()];
        over_chunks(&mut all, EACH, |chunk, some| {
            let mut stack = Stack::new();
            for (number, (photons, samples)) in some.iter_mut().enumerate() {
                let at = twins[chunk * EACH + number].at;
                let mut net_of = |kind: u64, samples: u32| {
                    let rule = Rule { samples, least_gain: None, saturation_photons: f32::INFINITY, ..*rule };
                    let mut net = Net::new(super::spend::hidden(seen, self.width(), at));
                    self.pixel(at, OF_NET | kind).grow(&mut net, self.nearest_m(seen, at), &rule, &mut stack);
                    (net.photons, net.samples + net.extra)
                };
                match estimates[at].kind {
                    Kind::Net => {
                        // A given number has rays beside it, which a twin chooses for itself.
                        let grown = estimates[at].samples - first;
                        let (photons_of_net, rays) =
                            net_of(OF_TWIN, if rule.share.is_some() { rule.samples } else { grown });
                        (*photons, *samples) = (photons_of_net, rays);
                    }
                    Kind::Even => {
                        let pixel = self.pixel(at, OF_TWIN);
                        *photons = pixel.even_mean(first, &mut stack);
                        *samples = first + pixel.beside(first);
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
