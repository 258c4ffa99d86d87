//! Intersects rays of one octant of directions with a block of triangles, and keeps nearer hits.

use super::super::bvh::TriangleBlock;
use super::super::lanes::{Eight, Floats, LANES, Mask};
use super::super::vectors::dot;
use super::packet::{Hits, Holes};
use super::rays::Rays;
use crate::num::index;

/// Bound of the roundings of an edge function and of its estimate for a packet, in units of the square of the corners' greatest distance
/// along the axes. The sheared coordinates are off by 2.5 epsilon of it at most (shear, product, difference), which makes 5.5 of an edge
/// function
/// with its own products and difference; the estimate's cross product and sum, with the rounding of the shears' middle and reach, add 9.
const ROUNDING: f32 = 32.0 * f32::EPSILON;

/// What counts as a hit.
pub struct Search<'a> {
    pub holes: &'a dyn Holes,
    /// Whether rays pass the backs of culled triangles.
    pub culls_backs: bool,
    /// Whether any hit will do, or the nearest is asked for.
    pub any: bool,
}

impl<'a> Search<'a> {
    #[inline(always)]
    pub fn new(holes: &'a dyn Holes, any: bool) -> Self {
        Self { holes, culls_backs: holes.culls_backs(), any }
    }
}

/// Corners relative to the span's origin, along the two sheared axes and the third.
pub type Corners = [[Eight; 3]; 3];

/// Looks at all triangles of a block; gives back whether any became some ray's nearest hit.
#[inline(always)]
pub fn meet<const SHARED: bool>(
    rays: &Rays,
    search: &Search,
    block: &TriangleBlock,
    pad_m: f32,
    hits: &mut Hits,
) -> bool {
    let corners = relative_corners(rays, block);
    let mut open = candidates::<SHARED>(rays, &corners) & block.present;
    let mut met = false;
    while open != 0 {
        let slot = index(open.trailing_zeros() / 8);
        open &= !(0xFF << (8 * slot));
        let candidate = Candidate { block, slot, corners: &corners, pad_m };
        met |= take::<SHARED>(rays, search, &candidate, hits);
    }
    met
}

/// Corners relative to the span's origin.
#[inline(always)]
pub fn relative_corners(rays: &Rays, block: &TriangleBlock) -> Corners {
    let mut corners = [[Eight::splat(0.0); 3]; 3];
    for corner in 0..3 {
        for ray_axis in 0..3 {
            let axis = rays.axes[ray_axis];
            corners[corner][ray_axis] = Eight(block.corners_m[corner][axis]) - Eight::splat(rays.span.origin_m[axis]);
        }
    }
    corners
}

/// A byte for each triangle that any ray may be inside of. An edge function is linear in the shears, so over the packet it stays within
/// its value
/// at their middle plus or minus its slopes times their reach.
#[inline(always)]
pub fn candidates<const SHARED: bool>(rays: &Rays, corners: &Corners) -> u64 {
    let span = &rays.span;
    let mut size = Eight::splat(0.0);
    for corner in 0..3 {
        let [x, y, z] = corners[corner];
        size = (x.abs() + y.abs() + z.abs()).greater(size);
    }
    if !SHARED {
        size = size + Eight::splat(span.reach_m);
    }
    let rounding = Eight::splat(ROUNDING) * (size * size);
    let (mut least_most, mut most_least) = (Eight::splat(f32::MAX), Eight::splat(f32::MIN));
    for edge in 0..3 {
        let ([bx, by, bz], [cx, cy, cz]) = (corners[(edge + 1) % 3], corners[(edge + 2) % 3]);
        let across = cy * bz - cz * by;
        let along = cz * bx - cx * bz;
        let upright = cx * by - cy * bx;
        let middle = upright + Eight::splat(span.shear[0]) * across + Eight::splat(span.shear[1]) * along;
        let mut reach = Eight::splat(span.shear_reach[0]) * across.abs()
            + Eight::splat(span.shear_reach[1]) * along.abs()
            + rounding;
        if !SHARED {
            // An origin elsewhere turns an edge function by no more than its distance times the edge's length.
            let edge = (cx - bx).abs() + (cy - by).abs() + (cz - bz).abs();
            reach = reach + Eight::splat(span.reach_m) * edge;
        }
        least_most = (middle + reach).lesser(least_most);
        most_least = (middle - reach).greater(most_least);
    }
    let zero = Eight::splat(0.0);
    (zero.at_most(least_most) | most_least.at_most(zero)).bytes()
}

/// One triangle of a block, with all its corners relative to the span's origin.
pub struct Candidate<'a> {
    pub block: &'a TriangleBlock,
    pub slot: usize,
    pub corners: &'a Corners,
    pub pad_m: f32,
}

impl Candidate<'_> {
    /// A corner's coordinate relative to the origins of half the rays.
    #[inline(always)]
    fn relative<const SHARED: bool>(&self, rays: &Rays, corner: usize, ray_axis: usize) -> Floats {
        if SHARED {
            return Floats::splat(self.corners[corner][ray_axis].0[self.slot]);
        }
        let axis = rays.axes[ray_axis];
        Floats::splat(self.block.corners_m[corner][axis][self.slot]) - rays.origin_m[axis]
    }

    /// A corner in the plane across each ray.
    #[inline(always)]
    fn sheared<const SHARED: bool>(&self, rays: &Rays, corner: usize) -> [Floats; 2] {
        let z = self.relative::<SHARED>(rays, corner, 2);
        let x = self.relative::<SHARED>(rays, corner, 0) - rays.shear[0] * z;
        let y = self.relative::<SHARED>(rays, corner, 1) - rays.shear[1] * z;
        [x, y]
    }

    /// The plane's normal times each direction, and times the way from the origin to the plane. Their ratio is the distance; unlike the
    /// corner
    /// weights', which a needle's rounding moves along it.
    #[inline(always)]
    fn plane<const SHARED: bool>(&self, rays: &Rays) -> (Floats, Floats) {
        let (mut normal, mut height) = ([0.0; 3], [0.0; 3]);
        for ray_axis in 0..3 {
            normal[ray_axis] = self.block.normal[rays.axes[ray_axis]][self.slot];
            height[ray_axis] = self.corners[0][ray_axis].0[self.slot] * normal[ray_axis];
        }
        let [x, y, z] = [Floats::splat(normal[0]), Floats::splat(normal[1]), Floats::splat(normal[2])];
        let slope = x * rays.direction[0] + y * rays.direction[1] + z * rays.direction[2];
        let height = if SHARED {
            Floats::splat(height[0] + height[1] + height[2])
        } else {
            x * self.relative::<false>(rays, 0, 0)
                + y * self.relative::<false>(rays, 0, 1)
                + z * self.relative::<false>(rays, 0, 2)
        };
        (slope, height)
    }

    /// Where each ray enters and leaves the triangle's padded box, which bit for bit is the one that the tree was built from.
    #[inline(always)]
    fn slabs(&self, rays: &Rays) -> (Floats, Floats) {
        let (mut near, mut far) = (Floats::splat(0.0), Floats::splat(0.0));
        for axis in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|corner| self.block.corners_m[corner][axis][self.slot]);
            let (least, most) = if a < b { (a, b) } else { (b, a) };
            let least = if c < least { c } else { least } - self.pad_m;
            let most = if c > most { c } else { most } + self.pad_m;
            let (first, second) = if rays.down[axis] == 1 { (most, least) } else { (least, most) };
            let (origin_m, inverse) = (rays.origin_m[axis], rays.inverse[axis]);
            let enters = (Floats::splat(first) - origin_m) * inverse;
            let leaves = (Floats::splat(second) - origin_m) * inverse;
            near = if axis == 0 { enters } else { enters.greater(near) };
            far = if axis == 0 { leaves } else { leaves.lesser(far) };
        }
        (near, far)
    }
}

/// Keeps the hits of one triangle and half the rays that are nearer than those known; gives back whether there are any.
#[inline(always)]
pub fn take<const SHARED: bool>(rays: &Rays, search: &Search, candidate: &Candidate, hits: &mut Hits) -> bool {
    let zero = Floats::splat(0.0);
    let a = candidate.sheared::<SHARED>(rays, 0);
    let b = candidate.sheared::<SHARED>(rays, 1);
    let c = candidate.sheared::<SHARED>(rays, 2);
    let weight_a = c[0] * b[1] - c[1] * b[0];
    let weight_b = a[0] * c[1] - a[1] * c[0];
    let weight_c = b[0] * a[1] - b[1] * a[0];
    let least = weight_a.lesser(weight_b).lesser(weight_c);
    let most = weight_a.greater(weight_b).greater(weight_c);
    // All at least zero, or all at most zero; in one comparison, which is all that most triangles cost.
    let inside = zero.at_most(least.greater(zero - most));
    if !inside.any() {
        return false;
    }
    let (near, far) = candidate.slabs(rays);
    let reached = inside & near.at_most(far) & near.at_most(hits.t);
    if !reached.any() {
        return false;
    }
    let (slope, height) = candidate.plane::<SHARED>(rays);
    let (mut raw, mut share) = (zero, weight_a + weight_b + weight_c);
    for lane in 0..LANES {
        raw.0[lane] = height.0[lane] / slope.0[lane];
        share.0[lane] = 1.0 / share.0[lane];
    }
    let (t, known) = (raw.greater(near).lesser(far), hits.t);
    // A triangle seen exactly edge-on gives an infinite or undefined distance.
    let finite = Floats::splat(f32::MIN).at_most(raw) & raw.at_most(Floats::splat(f32::MAX));
    let within = reached & finite & rays.t_min.at_most(t) & t.at_most(known);
    let triangle = candidate.block.triangle[candidate.slot];
    let mut lower = [0; LANES];
    for lane in 0..LANES {
        lower[lane] = if triangle < hits.triangle[lane] { u32::MAX } else { 0 };
    }
    let mut wins = within & (t.below(known) | (t.equal(known) & Mask(lower)));
    if search.culls_backs && candidate.block.culled >> candidate.slot & 1 != 0 {
        // A ray along the normal comes from behind.
        wins = wins & slope.at_most(zero);
    }
    let (u, v) = (weight_b * share, weight_c * share);
    if candidate.block.cut_out >> candidate.slot & 1 != 0 {
        wins = solid(search.holes, (rays, candidate, &slope), wins, &u, &v, hits);
    }
    // A shadow ray is done with its first hit, so its lane falls idle.
    hits.t = wins.select(if search.any { Floats::splat(f32::MIN) } else { t }, known);
    hits.u = wins.select(u, hits.u);
    hits.v = wins.select(v, hits.v);
    hits.triangle = wins.select_u32([triangle; LANES], hits.triangle);
    true
}

/// The lanes among these that do not pass through a hole. That it is given the hits, and might change them, keeps them in memory, where
/// they are
/// read and written by whole registers.
#[inline(never)]
fn solid(
    holes: &dyn Holes,
    (rays, candidate, slope): (&Rays, &Candidate, &Floats),
    mut wins: Mask,
    u: &Floats,
    v: &Floats,
    hits: &mut Hits,
) -> Mask {
    let triangle = candidate.block.triangle[candidate.slot];
    for lane in 0..LANES {
        let cos = || {
            let normal = [0, 1, 2].map(|axis| candidate.block.normal[axis][candidate.slot]);
            let direction = [0, 1, 2].map(|ray_axis| rays.direction[ray_axis].0[lane]);
            slope.0[lane].abs() / (dot(normal, normal) * dot(direction, direction)).sqrt()
        };
        if wins.0[lane] != 0 && hits.triangle[lane] != triangle && holes.is_open(triangle, [u.0[lane], v.0[lane]], &cos)
        {
            wins.0[lane] = 0;
        }
    }
    wins
}
