//! Steps at outlines, whose means are known. Enters: samples of one pixel and many more rays. Leaves: the mean as it is when what each
//! triangle shows counts by its share of pixel and exposure.
//!
//! Light takes a walk through the whole scene and all its shading to know. Which of the few triangles within a pixel's beam lies in front
//! takes neither, so it is asked for sixteen times as many rays: the finer net of which the samples are the first points. Samples of each
//! triangle then count by its share of the finer net, and no longer by how many of them there happen to be (stratification after the
//! fact, in two phases: Cochran 1977, 5A.9 and 12.2). Triangles that no sample met are strata of their own: some of the finer net's
//! rays to them are traced for their light. Samples are sorted by the same question as all rays, so what the question does not
//! know (holes, mirrors) costs gain and biases nothing. The list has to be of all triangles: one made of those that samples met gives what
//! was missed to whatever lies behind, which was measured to be a bias of four times the variance.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::refine::Places;
use super::shot::{Pixels, bilinear};
use crate::num::{f64_from_usize, index, u32_from};
use crate::optics::motion::Timeline;
use crate::scene::Scene;
use crate::scene::lanes::{Floats, LANES, Vectors, dot3, splat3, sub3};
use crate::scene::tracer::{MISS, Packet, Stack, along_beam};
use crate::simd::{Kernel, dispatch};

/// Rays of a packet.
pub struct Beam {
    /// Where they begin, in metres.
    origin_m: Vectors,
    /// Where they go.
    direction: Vectors,
}

/// The rays of a packet of samples, without what they meet.
pub struct Ways<'a> {
    /// How the camera moves.
    pub timeline: &'a Timeline,
    /// The pixel, in every lane.
    pub pixels: &'a Pixels,
    /// Where and when the samples lie.
    pub places: &'a Places,
}

impl Kernel for Ways<'_> {
    type Output = Beam;

    #[inline(always)]
    fn run(self) -> Beam {
        let bearing = bilinear(&self.pixels.corners, self.places.place[0], self.places.place[1]);
        let pose = self.places.motion(self.timeline).at(self.places.share);
        Beam { origin_m: pose.place_m(), direction: pose.turned(bearing) }
    }
}

/// Triangles that are listed, at most.
pub const LISTED_MAX: usize = 1_024;
/// Says that a ray meets first what no sample did.
const UNMET: u16 = u16::MAX;
/// Groups of alike triangles, at most.
const GROUPS_MAX: usize = 6;
/// Triangles part into two groups if that explains at least this share of what samples still differ by.
const EXPLAINED_LEAST: f64 = 0.05;

/// What a pixel's samples say.
#[derive(Clone, Copy, Debug)]
pub struct Told {
    /// Mean photons.
    pub mean: f64,
    /// Variance of samples about the means that they are told apart by.
    pub spread: f64,
    /// Means of the first and of the second half.
    pub halves: [f64; 2],
}

/// Samples of one kind.
#[derive(Clone, Copy, Debug, Default)]
struct Kind {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Kind {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn with(self, other: Self) -> Self {
        Self { count: self.count + other.count, sum: self.sum + other.sum, squares: self.squares + other.squares }
    }

    fn without(self, other: Self) -> Self {
        Self { count: self.count - other.count, sum: self.sum - other.sum, squares: self.squares - other.squares }
    }

    fn mean(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }

    /// Sum of squares about the mean.
    fn apart(&self) -> f64 {
        if self.count > 0.0 { self.squares - self.sum * self.sum / self.count } else { 0.0 }
    }
}

/// Triangles within a pixel's beam, and which of them rays meet first.
#[derive(Default)]
pub struct Outlines {
    triangles: Vec<u32>,
    corners_m: Vec<[[f32; 3]; 3]>,
    /// Of each ray, the number of the first listed triangle; beyond the last where it meets none.
    front: Vec<u16>,
}

impl Outlines {
    /// Lists the triangles that the rays of a pixel may meet. False if there are none to tell apart, or too many.
    pub fn list(&mut self, scene: &Scene, beam: &Beam, stack: &mut Stack) -> bool {
        self.corners_m.clear();
        self.front.clear();
        let (t_min, t_max) = (Floats::splat(0.0), Floats::splat(f32::MAX));
        let packet = Packet { origin_m: beam.origin_m, direction: beam.direction, t_min, t_max };
        let are_all = along_beam(&scene.bvh, &packet, LISTED_MAX, stack, &mut self.triangles);
        // In an order that no tree has a say in.
        self.triangles.sort_unstable();
        self.corners_m.extend(self.triangles.iter().map(|&triangle| scene.mesh.corners_m(index(triangle))));
        are_all && !self.triangles.is_empty()
    }

    /// Asks for some more rays of a packet.
    pub fn ask(&mut self, rays: &Beam, lanes: usize) {
        let none = self.corners_m.len();
        let first = dispatch(Front { corners_m: &self.corners_m, rays });
        self.front.extend(first[..lanes].iter().map(|&number| {
            let number = if number == MISS { none } else { index(number) };
            u16::try_from(number).expect("fewer triangles are listed")
        }));
    }

    /// Numbers of up to as many rays as a packet has that meet first what none of the first `count` does.
    pub fn unmet(&mut self, count: usize) -> Option<([u32; LANES], usize)> {
        let mut is_met = vec![false; self.corners_m.len() + 1];
        for &front in &self.front[..count] {
            is_met[usize::from(front)] = true;
        }
        let all = self.front.iter().filter(|&&front| !is_met[usize::from(front)]).count();
        let (mut numbers, mut lanes, mut place) = ([0; LANES], 0, 0);
        for (number, front) in self.front.iter_mut().enumerate() {
            if is_met[usize::from(*front)] {
                continue;
            }
            *front = UNMET;
            // As even among them as it goes.
            if lanes < LANES && place * LANES >= lanes * all {
                numbers[lanes] = u32_from(number);
                lanes += 1;
            }
            place += 1;
        }
        (lanes > 0).then_some((numbers, lanes))
    }

    /// What samples say whose photons are given, with the mean of those rays that were traced for a gap, if any were.
    pub fn told(&self, photons: &dyn Fn(usize) -> f64, count: usize, gap: Option<f64>) -> Told {
        let none = self.corners_m.len();
        let mut kinds = vec![Kind::default(); none + 1];
        let base = photons(0);
        for sample in 0..count {
            kinds[usize::from(self.front[sample])].add(photons(sample) - base);
        }
        let group_of = groups(&kinds);
        let mut shares = [0.0; GROUPS_MAX];
        let (mut of_gap, each) = (0.0, 1.0 / f64_from_usize(self.front.len()));
        for &front in &self.front {
            if front == UNMET {
                of_gap += each;
            } else {
                shares[group_of[usize::from(front)]] += each;
            }
        }
        let sums = |from: usize, to: usize| {
            let mut groups = [Kind::default(); GROUPS_MAX];
            for sample in from..to {
                groups[group_of[usize::from(self.front[sample])]].add(photons(sample) - base);
            }
            groups
        };
        let all = sums(0, count);
        let whole = all.iter().fold(Kind::default(), |sum, kind| sum.with(*kind)).mean().unwrap_or(0.0);
        let mean = |groups: &[Kind; GROUPS_MAX]| {
            let mut mean = base + of_gap * gap.map_or(whole, |photons| photons - base);
            for (number, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                // What only the other half met counts as there.
                mean += share * groups[number].mean().or(all[number].mean()).unwrap_or(whole);
            }
            mean
        };
        let halves = [mean(&sums(0, count / 2)), mean(&sums(count / 2, count))];
        let apart: f64 = all.iter().map(Kind::apart).sum();
        let spread = if apart > 0.0 { apart / f64_from_usize(count) } else { 0.0 };
        Told { mean: mean(&all), spread, halves }
    }
}

/// What samples say by themselves.
pub fn plain(photons: &dyn Fn(usize) -> f64, count: usize) -> Told {
    let mean = |from: usize, to: usize| (from..to).map(photons).sum::<f64>() / f64_from_usize(to - from);
    let all = mean(0, count);
    let square = |sample: usize| (photons(sample) - all) * (photons(sample) - all);
    let spread = (0..count).map(square).sum::<f64>() / f64_from_usize(count);
    // The lone sample of an odd batch is both of its halves.
    let half = (count / 2).max(1);
    Told { mean: all, spread, halves: [mean(0, half), mean(count - half, count)] }
}

/// Group of each kind: neighbours by their means stay together unless telling them apart explains enough.
fn groups(kinds: &[Kind]) -> Vec<usize> {
    let mut group_of = vec![0; kinds.len()];
    let mut order: Vec<(f64, usize)> = Vec::new();
    for (number, kind) in kinds.iter().enumerate() {
        order.extend(kind.mean().map(|mean| (mean, number)));
    }
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let order: Vec<usize> = order.into_iter().map(|(_, number)| number).collect();
    let met = order.len();
    let joined = |range: &[usize]| range.iter().fold(Kind::default(), |sum, &number| sum.with(kinds[number]));
    let mut left = joined(&order).apart();
    // Ends of the groups along the order.
    let mut ends = [met; GROUPS_MAX];
    let mut count = 1;
    while count < GROUPS_MAX {
        let (mut most, mut at) = (0.0, (0, 0));
        for group in 0..count {
            let from = if group == 0 { 0 } else { ends[group - 1] };
            let whole = joined(&order[from..ends[group]]);
            let mut before = Kind::default();
            for cut in from + 1..ends[group] {
                before = before.with(kinds[order[cut - 1]]);
                let gain = whole.apart() - before.apart() - whole.without(before).apart();
                if gain > most {
                    (most, at) = (gain, (group, cut));
                }
            }
        }
        if !(most > 0.0 && most >= EXPLAINED_LEAST * left) {
            break;
        }
        left -= most;
        ends.copy_within(at.0..GROUPS_MAX - 1, at.0 + 1);
        ends[at.0] = at.1;
        count += 1;
    }
    let mut group = 0;
    for (place, &number) in order.iter().enumerate() {
        while place >= ends[group] {
            group += 1;
        }
        group_of[number] = group;
    }
    group_of
}

/// Which of some triangles each ray of a packet meets first, `MISS` for none.
struct Front<'a> {
    corners_m: &'a [[[f32; 3]; 3]],
    rays: &'a Beam,
}

impl Kernel for Front<'_> {
    type Output = [u32; LANES];

    #[inline(always)]
    fn run(self) -> [u32; LANES] {
        let Beam { origin_m, direction } = self.rays;
        // One over the distance, so that a plane's grows evenly across a picture.
        let (zero, mut nearest) = (Floats::splat(0.0), Floats::splat(0.0));
        let mut first = [MISS; LANES];
        for (number, corners) in self.corners_m.iter().enumerate() {
            let from = corners.map(|corner| sub3(splat3(corner), *origin_m));
            let mut sides = [zero; 3];
            for corner in 0..3 {
                let along = sub(corners[(corner + 1) % 3], corners[corner]);
                sides[corner] = dot3(cross3(from[corner], splat3(along)), *direction);
            }
            let [a, b, c] = sides;
            let inside = zero.at_most(a.lesser(b).lesser(c)) | a.greater(b).greater(c).at_most(zero);
            let normal = splat3(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])));
            let (slope, height) = (dot3(normal, *direction), dot3(normal, from[0]));
            let mut near = zero;
            for lane in 0..LANES {
                near.0[lane] = slope.0[lane] / height.0[lane];
            }
            let nearer = inside & nearest.below(near);
            nearest = nearer.select(near, nearest);
            first = nearer.select_u32([u32_from(number); LANES], first);
        }
        first
    }
}

#[inline(always)]
fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn cross3(a: Vectors, b: Vectors) -> Vectors {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
