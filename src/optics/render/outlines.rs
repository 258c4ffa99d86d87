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

use super::fit::{Fit, REGRESSORS};
use super::refine::Places;
use super::shot::{Pixels, bilinear};
use crate::num::{f64_from_usize, index, u32_from, u32_truncated};
use crate::optics::motion::Timeline;
use crate::scene::lanes::{Floats, LANES, Vectors, dot3, splat3, sub3};
use crate::scene::tracer::{Hits, MISS, Packet, Stack, along_beam};
use crate::scene::{LitScene, Scene};
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
const LISTED_MAX: usize = 8_192;
/// Says that a ray meets first what no sample did.
const UNMET: u16 = u16::MAX;
/// Says that a ray lies where the pixel has other samples.
const TAKEN: u16 = u16::MAX - 1;
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
    /// Where in the pixel and when each lies.
    places: Vec<[f32; 3]>,
    /// How far each goes, and the weights of its triangle's second and third corner.
    met: Vec<[f32; 3]>,
    /// What textures do at samples, and at the first rays of the finer net.
    tints: [Vec<f32>; 2],
}

impl Outlines {
    /// Lists the triangles that the rays of a pixel may meet up to a distance. False if there are none to tell apart, or too many.
    pub fn list(&mut self, scene: &Scene, beam: &Beam, far_m: f32, stack: &mut Stack) -> bool {
        self.corners_m.clear();
        self.front.clear();
        self.places.clear();
        self.met.clear();
        self.tints.iter_mut().for_each(Vec::clear);
        let far_m = if far_m < f32::MAX { far_m } else { f32::MAX };
        let (t_min, t_max) = (Floats::splat(0.0), Floats::splat(far_m));
        let packet = Packet { origin_m: beam.origin_m, direction: beam.direction, t_min, t_max };
        let are_all = along_beam(&scene.bvh, &packet, LISTED_MAX, stack, &mut self.triangles);
        // In an order that no tree has a say in.
        self.triangles.sort_unstable();
        self.corners_m.extend(self.triangles.iter().map(|&triangle| scene.mesh.corners_m(index(triangle))));
        are_all && !self.triangles.is_empty()
    }

    /// Asks for some more rays of a packet, at places of which some are taken.
    pub fn ask(&mut self, rays: &Beam, at: &[[f32; 3]], is_taken: &dyn Fn([f32; 3]) -> bool) {
        let lanes = at.len();
        self.places.extend_from_slice(at);
        let none = self.corners_m.len();
        let (first, met) = dispatch(Front { corners_m: &self.corners_m, rays });
        self.met.extend((0..lanes).map(|lane| met.map(|numbers| numbers.0[lane])));
        self.front.extend(first.iter().zip(at).map(|(&number, &at)| {
            let number = if number == MISS { none } else { index(number) };
            if is_taken(at) { TAKEN } else { u16::try_from(number).expect("fewer triangles are listed") }
        }));
    }

    /// What some rays met, by what was asked.
    pub fn hits(&self, from: usize, lanes: usize) -> Hits {
        let zero = Floats::splat(0.0);
        let mut hits = Hits { t: Floats::splat(f32::MAX), triangle: [MISS; LANES], u: zero, v: zero };
        for lane in 0..LANES {
            // Lanes without a ray repeat the last, so that those of one triangle stay together.
            let ray = from + lane.min(lanes - 1);
            if let Some(&triangle) = self.triangles.get(usize::from(self.front[ray])) {
                hits.triangle[lane] = triangle;
                [hits.t.0[lane], hits.u.0[lane], hits.v.0[lane]] = self.met[ray];
            }
        }
        hits
    }

    /// Whether any of the triangles that samples or others met has a texture.
    pub fn has_texture(&self, scene: &LitScene) -> bool {
        let is_textured = |front: &u16| {
            self.triangles
                .get(usize::from(*front))
                .is_some_and(|&triangle| scene.texture_of(scene.face(triangle)).is_some())
        };
        self.front.iter().any(is_textured)
    }

    /// Keeps what textures do to some more samples, or rays of the finer net.
    pub fn tint(&mut self, tints: &[f32], is_fine: bool) {
        self.tints[usize::from(is_fine)].extend_from_slice(tints);
    }

    /// Tint, place and time of a ray; no tint where none is known.
    fn place(&self, ray: usize, is_fine: bool) -> [f64; REGRESSORS] {
        let [x, y, t] = self.places[ray].map(f64::from);
        let tint = self.tints[usize::from(is_fine)].get(ray).map_or(0.0, |&tint| f64::from(tint));
        [tint, x - 0.5, y - 0.5, t - 0.5]
    }

    /// Numbers of up to as many rays as a packet has that meet first what none of the first `count` does: each triangle by its share, the
    /// last one by chance, which `offset` of 0..1 decides (systematic sampling: Cochran 1977, 8.1).
    pub fn unmet(&mut self, count: usize, offset: f64) -> Option<([u32; LANES], usize)> {
        let mut is_met = vec![false; self.corners_m.len() + 1];
        for &front in self.front[..count].iter().filter(|&&front| front != TAKEN) {
            is_met[usize::from(front)] = true;
        }
        let is_known = |front: u16| front == TAKEN || is_met[usize::from(front)];
        let (mut numbers, mut unmet) = ([0; LANES], Vec::new());
        for (number, front) in self.front.iter_mut().enumerate().filter(|(_, front)| !is_known(**front)) {
            unmet.push((*front, u32_from(number)));
            *front = UNMET;
        }
        // Those of one triangle stay together, so that each has its share of the few.
        unmet.sort_unstable();
        let (all, lanes) = (f64_from_usize(unmet.len()), unmet.len().min(LANES));
        let step = all / f64_from_usize(lanes);
        for lane in 0..lanes {
            let place = index(u32_truncated((f64_from_usize(lane) + offset) * step));
            numbers[lane] = unmet[place.min(unmet.len() - 1)].1;
        }
        (lanes > 0).then_some((numbers, lanes))
    }

    /// What is known of each group's rays, and the shares of the gap, of what is taken and of each ray.
    fn shares(&self, group_of: &[usize]) -> (Vec<Fit>, [f64; 3]) {
        let mut finer = vec![Fit::default(); GROUPS_MAX];
        let mut tinted = vec![Kind::default(); GROUPS_MAX];
        let (mut of_gap, mut of_taken, each) = (0.0, 0.0, 1.0 / f64_from_usize(self.front.len()));
        for (ray, &front) in self.front.iter().enumerate() {
            if front == UNMET || front == TAKEN {
                *if front == UNMET { &mut of_gap } else { &mut of_taken } += each;
                continue;
            }
            let group = group_of[usize::from(front)];
            finer[group].add_place(&self.place(ray, true));
            if let Some(&tint) = self.tints[1].get(ray) {
                tinted[group].add(f64::from(tint));
            }
        }
        for (finer, tinted) in finer.iter_mut().zip(&tinted) {
            // The mean of those that are known stands for all.
            finer.places[0] = tinted.mean().unwrap_or(0.0) * finer.count;
        }
        (finer, [of_gap, of_taken, each])
    }

    /// What samples say whose photons are given, with the mean of those rays that were traced for a gap, if any were.
    pub fn told(&self, lights: &[f32], gap: Option<f64>) -> Told {
        let (photons, count) = (|sample: usize| f64::from(lights[sample]), lights.len());
        let none = self.corners_m.len();
        let mut kinds = vec![Kind::default(); none + 1];
        let base = photons(0);
        let is_own = |sample: &usize| self.front[*sample] != TAKEN;
        for sample in (0..count).filter(is_own) {
            kinds[usize::from(self.front[sample])].add(photons(sample) - base);
        }
        let group_of = groups(&kinds);
        let (finer, [of_gap, of_taken, each]) = self.shares(&group_of);
        let sums = |from: usize, to: usize| {
            let mut groups = vec![Fit::default(); GROUPS_MAX];
            for sample in (from..to).filter(is_own) {
                groups[group_of[usize::from(self.front[sample])]]
                    .add(&self.place(sample, false), photons(sample) - base);
            }
            groups
        };
        let all = sums(0, count);
        let counted = all.iter().map(|fit| fit.count).sum::<f64>();
        let whole = if counted > 0.0 { all.iter().map(|fit| fit.sum).sum::<f64>() / counted } else { 0.0 };
        let fits: Vec<([f64; REGRESSORS], f64)> = all.iter().map(Fit::slopes).collect();
        let mean = |groups: &[Fit]| {
            // What is taken is dark here.
            let mut mean = base * (1.0 - of_taken) + of_gap * gap.map_or(whole, |photons| photons - base);
            for (number, finer) in finer.iter().enumerate().filter(|(_, finer)| finer.count > 0.0) {
                // What only the other half met counts as there.
                let group = if groups[number].count > 0.0 { &groups[number] } else { &all[number] };
                let light = if group.count > 0.0 { group.at(&finer.places(), &fits[number].0) } else { whole };
                mean += finer.count * each * light;
            }
            mean
        };
        let halves = [mean(&sums(0, count / 2)), mean(&sums(count / 2, count))];
        let spread: f64 = fits.iter().map(|fit| fit.1).sum::<f64>() / f64_from_usize(count);
        Told { mean: mean(&all), spread, halves }
    }
}

/// What samples say by themselves.
pub fn plain(lights: &[f32]) -> Told {
    let (photons, count) = (|sample: usize| f64::from(lights[sample]), lights.len());
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

/// Which of some triangles each ray of a packet meets first, `MISS` for none, how far away, and at which weights of the second and third
/// corner.
struct Front<'a> {
    corners_m: &'a [[[f32; 3]; 3]],
    rays: &'a Beam,
}

impl Kernel for Front<'_> {
    type Output = ([u32; LANES], [Floats; 3]);

    #[inline(always)]
    fn run(self) -> ([u32; LANES], [Floats; 3]) {
        let Beam { origin_m, direction } = self.rays;
        // One over the distance, so that a plane's grows evenly across a picture.
        let (zero, mut nearest) = (Floats::splat(0.0), Floats::splat(0.0));
        let mut first = [MISS; LANES];
        let mut weights = [zero; 3];
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
            for corner in 0..3 {
                weights[corner] = nearer.select(sides[corner], weights[corner]);
            }
        }
        let [c, a, b] = weights;
        let (sum, mut met) = (a + b + c, [nearest, b, c]);
        for lane in 0..LANES {
            met[0].0[lane] = 1.0 / nearest.0[lane];
            met[1].0[lane] = b.0[lane] / sum.0[lane];
            met[2].0[lane] = c.0[lane] / sum.0[lane];
        }
        (first, met)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_unmet_triangle_has_its_share_of_the_rays_that_are_traced() {
        // Four samples met the first triangle. Of the finer net's 60 more rays it has 20; of the gap's 40 the others have 20, 10, 9 and 1.
        let shares = [(1, 20), (2, 10), (3, 9), (4, 1)];
        // Every 2.5th ray, rounded up, meets the first of them: whoever takes sixteen in the order of the rays takes it alone.
        let mut of_gap = [0_u16; 40];
        (0..16_usize).for_each(|lane| of_gap[(5 * lane).div_ceil(2)] = 1);
        let mut others = shares.iter().flat_map(|&(front, count)| vec![front; count]).skip(16);
        of_gap.iter_mut().filter(|front| **front == 0).for_each(|front| *front = others.next().unwrap());
        let front: Vec<u16> = [0; 24].into_iter().chain(of_gap).collect();
        let (mut traced, mut tried) = ([0_u32; 5], 0);
        for step in 0..100_u8 {
            let mut outlines =
                Outlines { front: front.clone(), corners_m: vec![[[0.0; 3]; 3]; 5], ..Outlines::default() };
            let (numbers, lanes) = outlines.unmet(4, (f64::from(step) + 0.5) / 100.0).unwrap();
            assert_eq!(lanes, LANES);
            let mut own = [0_u32; 5];
            numbers.iter().for_each(|&number| own[usize::from(front[index(number)])] += 1);
            for (triangle, count) in shares {
                // 16 of 40, to one ray.
                let share = 0.4 * f64_from_usize(count);
                assert!((f64::from(own[usize::from(triangle)]) - share).abs() < 1.0, "{step}: {own:?}");
            }
            assert!(outlines.front[24..].iter().all(|&front| front == UNMET) && own[0] == 0);
            own.iter().zip(&mut traced).for_each(|(own, sum)| *sum += own);
            tried += 1;
        }
        assert_eq!(tried, 100);
        // Chance makes the shares exact in the mean: 100 even offsets know them to a ray of each hundred.
        for (triangle, count) in shares {
            let mean = f64::from(traced[usize::from(triangle)]) / 100.0;
            assert!((mean - 0.4 * f64_from_usize(count)).abs() < 0.011, "{triangle}: {mean}");
        }
    }

    #[test]
    fn a_gap_of_few_rays_is_traced_whole_and_none_is_none() {
        let outlines = |front: Vec<u16>| Outlines { front, corners_m: vec![[[0.0; 3]; 3]; 3], ..Outlines::default() };
        let (numbers, lanes) = outlines(vec![0, 0, 2, 1, 0, TAKEN]).unmet(2, 0.999_999_999_999).unwrap();
        assert_eq!((lanes, numbers[0], numbers[1]), (2, 3, 2));
        assert!(outlines(vec![0, 0, 0, TAKEN]).unmet(2, 0.5).is_none());
    }
}
