//! Images of lamps that are smaller than a pixel. Enters: mirrors and lamps of a scene, a camera's motion. Leaves: for each pixel the
//! boxes of place and time that hold such images.
//!
//! Even samples meet a lamp in a chrome tap once in a thousand or a million, and each is then worth as much: the noise of a whole picture.
//! Where such images lie is known without a ray. So the part of a pixel's exposure that may hold one has samples of its own, which
//! count by its volume, and the pixel's even samples count where they lie outside: strata whose sum has no bias wherever they are cut.

use glam::{DMat3, DVec2, DVec3};

use super::passes::collected;
use super::rows::{COLUMNS, ROWS};
use super::shear::bounded;
use super::shot::View;
use crate::num::{f32_nearest, f64_from_usize, index, u32_truncated};
use crate::optics::motion::Timeline;
use crate::scene::glints::{Lamp, Mirror, Weights, beyond};

/// A part of a pixel's exposure: a box that moves evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glint {
    /// Least and greatest place at the exposure's start, in shares of the pixel's width and height.
    edges: [[f32; 2]; 2],
    /// How far it moves over the exposure.
    velocity: [f32; 2],
    /// When it is within the pixel, in shares of the exposure.
    times: [f32; 2],
}

impl Glint {
    /// Share of the pixel's exposure.
    pub fn volume(&self) -> f32 {
        let [[left, right], [top, bottom]] = self.edges;
        (right - left) * (bottom - top) * (self.times[1] - self.times[0])
    }

    /// Whether a sample lies in it.
    pub fn holds(&self, [x, y, t]: [f32; 3]) -> bool {
        let is_in = |axis: usize, place: f32| {
            let at = place - self.velocity[axis] * t;
            at >= self.edges[axis][0] && at < self.edges[axis][1]
        };
        t >= self.times[0] && t < self.times[1] && is_in(0, x) && is_in(1, y)
    }

    /// Three even numbers' place in it.
    pub fn place(&self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        let t = bounded(self.times[0] + c * (self.times[1] - self.times[0]));
        let at = |axis: usize, share: f32| {
            let [least, greatest] = self.edges[axis];
            least + share * (greatest - least) + self.velocity[axis] * t
        };
        [at(0, a), at(1, b), t]
    }

    /// The part of a track's box within a pixel; none where there is none, or where it is so great that even samples serve.
    fn within(track: &Track, [x, y]: [usize; 2], shift: DVec2) -> Option<Self> {
        let corner = DVec2::new(f64_from_usize(x), f64_from_usize(y));
        if !(track.half.min_element() < HALF_MAX_PX) {
            return None;
        }
        let start = track.start + shift - corner;
        let velocity = track.end - track.start;
        let mut times = [0.0, 1.0];
        let mut edges = [[0.0; 2]; 2];
        for axis in 0..2 {
            let (at, speed, half) = (start[axis], velocity[axis], track.half[axis]);
            // What is never within the pixel is cut off.
            let (mut least, mut greatest) = (at - half, at + half);
            let (lowest, highest) = if speed > 0.0 { (-speed, 1.0) } else { (0.0, 1.0 - speed) };
            least = crate::num::greater(least, lowest);
            greatest = crate::num::lesser(greatest, highest);
            if !(greatest > least) {
                return None;
            }
            edges[axis] = [least, greatest];
            if speed != 0.0 {
                // From when its leading edge enters until its trailing edge leaves.
                let (enters, leaves) = if speed > 0.0 {
                    (-greatest / speed, (1.0 - least) / speed)
                } else {
                    ((1.0 - least) / speed, -greatest / speed)
                };
                times = [crate::num::greater(times[0], enters), crate::num::lesser(times[1], leaves)];
            }
        }
        let [edges_x, edges_y] = edges.map(|pair| pair.map(f32_nearest));
        let glint = Self {
            edges: [edges_x, edges_y],
            velocity: [velocity.x, velocity.y].map(f32_nearest),
            times: times.map(f32_nearest),
        };
        (times[1] > times[0] && glint.volume() > 0.0 && glint.volume() < VOLUME_MAX).then_some(glint)
    }

    /// Whether one that holds both has hardly more room than they have.
    fn is_nearly(&self, other: &Self) -> bool {
        self.joined(other).volume() <= JOINED_MAX * (self.volume() + other.volume())
    }

    fn edges_at(&self, axis: usize, t: f32) -> [f32; 2] {
        self.edges[axis].map(|edge| edge + self.velocity[axis] * t)
    }

    /// One that holds both.
    fn joined(&self, other: &Self) -> Self {
        let mut all = *self;
        for axis in 0..2 {
            let velocity = 0.5 * (self.velocity[axis] + other.velocity[axis]);
            all.velocity[axis] = velocity;
            all.edges[axis] = [f32::MAX, f32::MIN];
            for (glint, t) in [(self, 0.0), (self, 1.0), (other, 0.0), (other, 1.0)] {
                let [least, greatest] = glint.edges_at(axis, t).map(|edge| edge - velocity * t);
                let [before_least, before_greatest] = all.edges[axis];
                all.edges[axis] = [
                    if least < before_least { least } else { before_least },
                    if greatest > before_greatest { greatest } else { before_greatest },
                ];
            }
        }
        all.times = [
            if other.times[0] < self.times[0] { other.times[0] } else { self.times[0] },
            if other.times[1] > self.times[1] { other.times[1] } else { self.times[1] },
        ];
        all
    }
}

/// Share of a pixel's exposure from which on even samples meet an image often enough.
const VOLUME_MAX: f32 = 0.1;
/// Volume of two boxes as one, over the sum of theirs.
const JOINED_MAX: f32 = 1.2;
/// Half the width of what is seen by even samples however much of a pixel it takes.
const HALF_MAX_PX: f64 = 0.5;
/// Boxes of a pixel at most: those beyond are left to even samples.
pub const EACH_MAX: usize = 8;
/// How much wider a box is than the image that slopes foretell, and by how many pixels: rounding of rays.
const WIDER: f64 = 1.1;
const ROUNDING_PX: f64 = 2e-4;
/// How far beyond its triangle's rim an image may lie at first glance, in weights: the eye moves on until a row is exposed.
const GLANCE_BEYOND: f64 = 0.5;
/// Beyond any picture.
const FAR_PX: f64 = 1e9;
/// Lamps of which half is no wider have one box that moves with them.
const SMALL_PX: f64 = 0.25;
/// Instants at which outlines are looked at, by pixel of their way.
const STEPS_PER_PX: f64 = 8.0;
/// How far bearings that are linear between a pixel's corners are off, in pixels times the focal length in pixels (`Camera::new`).
const BENT_PX: f64 = 0.25;
/// Pixels that an image may pass in an exposure, each way; of faster ones nothing is known.
const TRACK_MAX_PX: f64 = 128.0;

/// The way of a lamp's image over an exposure, in pixels from the picture's upper left corner.
#[derive(Clone, Copy, Debug)]
struct Track {
    start: DVec2,
    end: DVec2,
    half: DVec2,
}

impl Track {
    /// The upper left and lower right corner of all that it passes.
    fn bounds(&self) -> [DVec2; 2] {
        [self.start.min(self.end) - self.half, self.start.max(self.end) + self.half]
    }
}

/// Where an eye sees a target: weights of a triangle, near some, and the point of it.
type See<'a> = dyn Fn(DVec3, DVec3, Weights) -> Option<(Weights, DVec3)> + 'a;

/// The middle of a triangle.
const AMID: Weights = [1.0 / 3.0; 2];

/// What images of lamps are looked for with.
pub struct Finder<'a> {
    pub view: View<'a>,
    pub timelines: &'a [Timeline],
}

impl Finder<'_> {
    /// All boxes of all pixels, by place in the picture.
    pub fn all(&self) -> Vec<(usize, Vec<Glint>)> {
        const EACH: usize = 256;
        let mut all: Vec<(usize, Glint)> = Vec::new();
        let [_, height] = self.size();
        let eye_m = self.sight(height / 2, 0.5).eye_m;
        let shows = self.view.reflections > 0;
        let worlds = &self.view.scene.glints().worlds;
        // The first is what is seen without a mirror.
        let seen = &worlds[..if shows { worlds.len() } else { worlds.len().min(1) }];
        for world in seen.iter().filter(|world| world.is_seen_from(eye_m)) {
            let of = |chunk: usize| {
                let mut found = Vec::new();
                for mirror in &world.mirrors[chunk * EACH..((chunk + 1) * EACH).min(world.mirrors.len())] {
                    self.look_at(mirror, eye_m, &world.lamps, &mut found);
                }
                found
            };
            let chunks = if shows { world.mirrors.len().div_ceil(EACH) } else { 0 };
            all.extend(collected(chunks, of).into_iter().flatten());
            let of = |number: usize| self.rims(&world.lamps[number]);
            all.extend(collected(world.own, of).into_iter().flatten());
        }
        // Stable: those of one pixel stay in their order.
        all.sort_by_key(|(at, _)| *at);
        all.chunk_by(|a, b| a.0 == b.0).map(|of_one| (of_one[0].0, joined(of_one))).collect()
    }

    /// The boxes of pixels that a lamp itself just reaches into.
    fn rims(&self, lamp: &Lamp) -> Vec<(usize, Glint)> {
        let mut found = Vec::new();
        let [width, height] = self.size();
        let middle = self.project(&self.sight(height / 2, 0.5), lamp.middle_m);
        let Some(row) = middle.and_then(|place| row_within(place.y, height)) else { return found };
        let itself = |target_m: DVec3, _: DVec3, near: Weights| Some((near, target_m));
        if self.track(&itself, lamp, AMID, row).is_some_and(|track| track.half.max_element() < SMALL_PX) {
            self.add(&itself, lamp, AMID, &mut found);
            return found;
        }
        let Some(([least, greatest], way_px)) = self.swept(lamp, row) else { return found };
        if !((greatest - least).max_element() < TRACK_MAX_PX) {
            return found;
        }
        let amid = self.sight(row, 0.5);
        let places: Option<Vec<DVec2>> = lamp.corners_m.iter().map(|corner_m| self.project(&amid, *corner_m)).collect();
        let Some(places) = places else { return found };
        let rim_m: Vec<DVec3> = hull(&places).into_iter().map(|corner| lamp.corners_m[corner]).collect();
        let steps = index_of((way_px * STEPS_PER_PX).ceil());
        for y in pixels_between(least.y - 2.0, greatest.y + 2.0, height) {
            let Some(outlines) = self.outlines(&rim_m, y, steps) else { continue };
            for x in pixels_between(least.x - 2.0, greatest.x + 2.0, width) {
                found.extend(self.rim(&outlines, [x, y]).map(|glint| (y * width + x, glint)));
            }
        }
        found
    }

    /// What of the picture a lamp passes over a row's exposure, and how far it goes.
    fn swept(&self, lamp: &Lamp, row: usize) -> Option<([DVec2; 2], f64)> {
        let sights = [0.0, 1.0].map(|t| self.sight(row, t));
        let [mut least, mut greatest] = [self.project(&sights[0], lamp.middle_m)?; 2];
        for sight in &sights {
            for corner_m in &lamp.corners_m {
                let place = self.project(sight, *corner_m)?;
                (least, greatest) = (least.min(place), greatest.max(place));
            }
        }
        let way_px = self.project(&sights[1], lamp.middle_m)? - self.project(&sights[0], lamp.middle_m)?;
        Some(([least, greatest], way_px.abs().max_element()))
    }

    /// Instants of a row's exposure, and what of a convex outline lies in the row at each.
    fn outlines(&self, rim_m: &[DVec3], row: usize, steps: usize) -> Option<Vec<(f64, Vec<DVec2>)>> {
        let (top, pad) = (f64_from_usize(row), self.pad());
        let at = |t: f64| {
            let sight = self.sight(row, f32_nearest(t));
            let places: Option<Vec<DVec2>> = rim_m.iter().map(|corner_m| self.project(&sight, *corner_m)).collect();
            let [least, greatest] = [DVec2::new(-FAR_PX, top - pad), DVec2::new(FAR_PX, top + 1.0 + pad)];
            Some((t, clipped(&places?, least, greatest)))
        };
        if steps == 0 {
            return Some(vec![at(0.5)?]);
        }
        (0..=steps).map(|step| at(f64_from_usize(step) / f64_from_usize(steps))).collect()
    }

    /// How far beyond a pixel's sides something may lie that it sees.
    fn pad(&self) -> f64 {
        BENT_PX / self.view.camera.lens.focal_px() + ROUNDING_PX
    }

    /// The part of a pixel's exposure that outlines reach into.
    fn rim(&self, outlines: &[(f64, Vec<DVec2>)], [x, y]: [usize; 2]) -> Option<Glint> {
        let corner = DVec2::new(f64_from_usize(x), f64_from_usize(y));
        let pad = self.pad();
        let (left, right) = (DVec2::new(corner.x - pad, -FAR_PX), DVec2::new(corner.x + 1.0 + pad, FAR_PX));
        let mut bounds: Option<([DVec2; 2], [f64; 2])> = None;
        for (t, outline) in outlines {
            for place in clipped(outline, left, right) {
                let ([least, greatest], times) = bounds.unwrap_or(([place; 2], [*t; 2]));
                bounds = Some(([least.min(place), greatest.max(place)], [times[0], *t]));
            }
        }
        let ([least, greatest], times) = bounds?;
        let [least, greatest] =
            [least - pad - corner, greatest + pad - corner].map(|at| at.clamp(DVec2::ZERO, DVec2::ONE));
        // Between two instants it may have come or gone.
        let step = 1.0 / f64_from_usize(outlines.len().max(2) - 1);
        let times = [crate::num::greater(times[0] - step, 0.0), crate::num::lesser(times[1] + step, 1.0)];
        let edges = [[least.x, greatest.x], [least.y, greatest.y]].map(|pair| pair.map(f32_nearest));
        let glint = Glint { edges, velocity: [0.0; 2], times: times.map(f32_nearest) };
        (glint.volume() > 0.0 && glint.volume() < VOLUME_MAX).then_some(glint)
    }

    fn size(&self) -> [usize; 2] {
        [index(self.view.camera.size.width_px), index(self.view.camera.size.height_px)]
    }

    /// Adds the boxes of images that lamps may have in a triangle.
    fn look_at(&self, mirror: &Mirror, eye_m: DVec3, lamps: &[Lamp], found: &mut Vec<(usize, Glint)>) {
        let Some(cone) = mirror.cone(eye_m) else { return };
        for lamp in lamps.iter().filter(|lamp| cone.may_meet(lamp)) {
            let Some(at) = mirror.image_of(lamp.middle_m, eye_m, AMID) else { continue };
            if beyond(at) < GLANCE_BEYOND {
                let see = |target_m: DVec3, eye_m: DVec3, near: Weights| {
                    let at = mirror.image_of(target_m, eye_m, near)?;
                    Some((at, mirror.place_m(at)))
                };
                self.add(&see, lamp, at, found);
            }
        }
    }

    /// Adds the boxes of a lamp's image.
    fn add(&self, see: &See, lamp: &Lamp, near: Weights, found: &mut Vec<(usize, Glint)>) {
        let [width, height] = self.size();
        let sight = self.sight(height / 2, 0.5);
        let Some((_, place_m)) = see(lamp.middle_m, sight.eye_m, near) else { return };
        let Some(seen) = self.project(&sight, place_m) else { return };
        let Some(row) = row_within(seen.y, height) else { return };
        let Some(track) = self.track(see, lamp, near, row) else { return };
        let [least, greatest] = track.bounds();
        if !((greatest - least).max_element() < TRACK_MAX_PX) {
            return;
        }
        for y in pixels_between(least.y - 1.0, greatest.y + 1.0, height) {
            let Some(track) = self.track(see, lamp, near, y) else { continue };
            let [least, greatest] = track.bounds();
            for x in pixels_between(least.x, greatest.x, width) {
                let Some(shift) = self.shift(&track, [x, y]) else { continue };
                found.extend(Glint::within(&track, [x, y], shift).map(|glint| (y * width + x, glint)));
            }
        }
    }

    /// How an image goes over a row's exposure.
    fn track(&self, see: &See, lamp: &Lamp, near: Weights, row: usize) -> Option<Track> {
        let image = |target_m: DVec3, near: Weights, sight: &Sight| {
            let (at, place_m) = see(target_m, sight.eye_m, near)?;
            Some((at, self.project(sight, place_m)?))
        };
        let amid = self.sight(row, 0.5);
        let (at, middle) = image(lamp.middle_m, near, &amid)?;
        let (_, start) = image(lamp.middle_m, at, &self.sight(row, 0.0))?;
        let (_, end) = image(lamp.middle_m, at, &self.sight(row, 1.0))?;
        let (mut half, mut reach) = (DVec2::ZERO, 0.0);
        for half_m in lamp.half_m {
            let (other, place) = image(lamp.middle_m + half_m, at, &amid)?;
            half += (place - middle).abs();
            let [u, v] = [other[0] - at[0], other[1] - at[1]];
            reach += crate::num::greater(crate::num::greater(u.abs(), v.abs()), (u + v).abs());
        }
        if beyond(at) > reach {
            return None;
        }
        // An even motion misses the middle by as much.
        let bent = (middle - (start + end) * 0.5).abs();
        Some(Track { start, end, half: half * WIDER + bent + DVec2::splat(ROUNDING_PX) })
    }

    /// Pixels see along bearings that are linear between their corners: how far from the lens's own places that leads.
    fn shift(&self, track: &Track, [x, y]: [usize; 2]) -> Option<DVec2> {
        let corner = DVec2::new(f64_from_usize(x), f64_from_usize(y));
        let share = ((track.start + track.end) * 0.5 - corner).clamp(DVec2::ZERO, DVec2::ONE);
        let corners = self.view.camera.corners(x, y)?.map(|bearing| DVec3::from_array(bearing.map(f64::from)));
        let above = corners[0].lerp(corners[1], share.x);
        let below = corners[2].lerp(corners[3], share.x);
        let place = self.view.camera.lens.project(above.lerp(below, share.y))? + DVec2::splat(0.5);
        Some(corner + share - place)
    }

    /// From where a row sees at a share of its exposure.
    fn sight(&self, row: usize, t: f32) -> Sight {
        let pose = self.timelines[row / ROWS].turn_at(row % ROWS * COLUMNS, t);
        let wide = |vector: [f32; 3]| DVec3::from_array(vector.map(f64::from));
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| wide(pose.turned(axis)));
        Sight { eye_m: wide(pose.place_m()), camera_from_world: DMat3::from_cols(x, y, z).inverse() }
    }

    fn project(&self, sight: &Sight, point_m: DVec3) -> Option<DVec2> {
        let place = self.view.camera.lens.project(sight.camera_from_world * (point_m - sight.eye_m))?;
        Some(place + DVec2::splat(0.5))
    }
}

/// A camera at an instant.
struct Sight {
    eye_m: DVec3,
    camera_from_world: DMat3,
}

/// The row that a place lies in or near, where that is near the picture.
fn row_within(y: f64, height: usize) -> Option<usize> {
    const NEAR_PX: f64 = 8.0;
    let last = f64_from_usize(height - 1);
    (y > -NEAR_PX && y < last + NEAR_PX).then(|| index_of(y.clamp(0.0, last)))
}

/// Pixels of a line of some that lie between two places.
fn pixels_between(least: f64, greatest: f64, count: usize) -> std::ops::Range<usize> {
    let end = f64_from_usize(count);
    let first = if least > 0.0 { index_of(crate::num::lesser(least, end)) } else { 0 };
    let last = if greatest < 0.0 { 0 } else { index_of(crate::num::lesser(greatest, end)) + 1 };
    first..last.min(count)
}

fn index_of(place: f64) -> usize {
    index(u32_truncated(place))
}

/// The boxes of one pixel: as one where that is hardly greater, and none beyond what even samples serve.
fn joined(found: &[(usize, Glint)]) -> Vec<Glint> {
    let mut all: Vec<Glint> = Vec::new();
    for &(_, glint) in found {
        let mut one = glint;
        while let Some(other) = all.iter().position(|other| one.is_nearly(other)) {
            one = one.joined(&all.swap_remove(other));
        }
        all.push(one);
    }
    all.retain(|glint| glint.volume() < VOLUME_MAX);
    all
}

/// Numbers of the places on the convex hull of some, in turn (Andrew's monotone chain).
fn hull(places: &[DVec2]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|&a, &b| places[a].x.total_cmp(&places[b].x).then(places[a].y.total_cmp(&places[b].y)));
    let mut rim: Vec<usize> = Vec::new();
    for half in [order.clone(), order.into_iter().rev().collect()] {
        let from = rim.len();
        for at in half {
            while rim.len() >= from + 2 {
                let [a, b] = [places[rim[rim.len() - 2]], places[rim[rim.len() - 1]]];
                if (b - a).perp_dot(places[at] - a) > 0.0 {
                    break;
                }
                rim.pop();
            }
            rim.push(at);
        }
        // The end of one half begins the other.
        rim.pop();
    }
    rim
}

/// The corners of a convex outline's part within a rectangle (Sutherland and Hodgman 1974).
fn clipped(outline: &[DVec2], least: DVec2, greatest: DVec2) -> Vec<DVec2> {
    let mut part = outline.to_vec();
    for (axis, edge, side) in [(0, least.x, 1.0), (1, least.y, 1.0), (0, greatest.x, -1.0), (1, greatest.y, -1.0)] {
        let within = |place: DVec2| side * (place[axis] - edge);
        let mut next = Vec::with_capacity(part.len() + 1);
        for (number, &from) in part.iter().enumerate() {
            let to = part[(number + 1) % part.len()];
            let [a, b] = [within(from), within(to)];
            if a >= 0.0 {
                next.push(from);
            }
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                next.push(from + (to - from) * (a / (a - b)));
            }
        }
        part = next;
    }
    part
}

#[cfg(test)]
mod tests;
