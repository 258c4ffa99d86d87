//! A packet of rays, its hits, and holes in triangles.

use super::super::lanes::{Floats, LANES, Mask, Vectors, dot3, unrolled};

/// Rays that are traced together. A lane whose `t_max` is below its `t_min` is idle.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// Origins in metres.
    pub origin_m: Vectors,
    /// Directions; distances along them are in units of their length.
    pub direction: Vectors,
    /// Least distance that counts.
    pub t_min: Floats,
    /// Greatest distance that counts.
    pub t_max: Floats,
}

impl Packet {
    /// No rays: all lanes are idle.
    #[inline(always)]
    pub fn idle() -> Self {
        let [zero, one] = [Floats::splat(0.0), Floats::splat(1.0)];
        Self { origin_m: [zero; 3], direction: [one, zero, zero], t_min: zero, t_max: Floats::splat(-1.0) }
    }

    /// Puts a ray into a lane of a packet that was idle.
    #[inline(always)]
    pub fn set_ray(&mut self, lane: usize, origin_m: [f32; 3], direction: [f32; 3], t_max: f32) {
        for axis in 0..3 {
            self.origin_m[axis].0[lane] = origin_m[axis];
            self.direction[axis].0[lane] = direction[axis];
        }
        self.t_max.0[lane] = t_max;
    }

    /// Which rays, as wide as `spread` radians, may meet a ball, by its middle and radius in metres.
    #[inline(always)]
    pub fn come_near(&self, (middle_m, radius_m): ([f32; 3], f32), spread: Floats) -> Mask {
        let way_m = unrolled!(AXIS in 3 => Floats::splat(middle_m[AXIS]) - self.origin_m[AXIS]);
        let along = dot3(way_m, self.direction);
        let reach_m = Floats::splat(radius_m) + along.abs() * (spread + Floats::splat(1e-3));
        come_near(&way_m, &self.direction, along, reach_m)
    }
}

/// Which lines along `to` pass a point as near as `reach_m`, and do not leave it behind: it lies `way_m` from their starts;
/// `along` is the product of both vectors.
#[inline(always)]
pub fn come_near(way_m: &Vectors, to: &Vectors, along: Floats, reach_m: Floats) -> Mask {
    let beyond2 = dot3(*way_m, *way_m) - reach_m * reach_m;
    let zero = Floats::splat(0.0);
    let is_near = (beyond2 * dot3(*to, *to)).at_most(along * along);
    is_near & (beyond2.at_most(zero) | zero.below(along))
}

/// Where cut-out triangles let rays through. It is called only for triangles that the tree has as cut out, and only for points
/// that would otherwise be hits; its answer must depend on its arguments alone.
pub trait Holes {
    /// Whether rays pass the backs of triangles that the tree has as culled.
    fn culls_backs(&self) -> bool {
        false
    }

    /// Whether a ray passes the triangle at these weights of its second and third corner; `cos` is that of its angle to the plane's normal.
    fn is_open(&self, triangle: u32, weights: [f32; 2], cos: &dyn Fn() -> f32) -> bool;
}

/// Every triangle is whole.
#[derive(Clone, Copy, Debug)]
pub struct NoHoles;

impl Holes for NoHoles {
    fn is_open(&self, _: u32, _: [f32; 2], _: &dyn Fn() -> f32) -> bool {
        false
    }
}

/// No triangle.
pub const MISS: u32 = u32::MAX;

/// The nearest hit of each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hits {
    /// Distance in units of the direction's length; the packet's `t_max` where nothing was hit.
    pub t: Floats,
    /// Triangle of the scene, or `MISS`.
    pub triangle: [u32; LANES],
    /// Weight of the second corner.
    pub u: Floats,
    /// Weight of the third corner.
    pub v: Floats,
}

impl Hits {
    /// Lanes that met something.
    #[inline(always)]
    pub fn met(&self) -> Mask {
        let mut met = Mask([0; LANES]);
        for lane in 0..LANES {
            met.0[lane] = if self.triangle[lane] == MISS { 0 } else { u32::MAX };
        }
        met
    }
}
