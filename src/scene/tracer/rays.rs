//! Prepares a packet of rays for traversal: groups that traverse every axis in the same direction, with the values that boxes and triangles
//! need, and the range of each value over the group.

use super::super::lanes::{Floats, LANES, Mask, Vectors, unrolled};
use super::packet::Packet;

/// Directions closer to zero than this are moved away from it, so that slabs need no rule for infinities. Over a scene of
/// 10 km the ray bends by 1e-14 m, which is below the rounding of its coordinates.
const DIRECTION_MIN: f32 = 1e-18;

/// Which way each ray goes: the sign of each component, and the axis of the greatest one.
#[derive(Clone, Copy)]
pub struct Courses([u32; LANES]);

/// No ray.
const IDLE: u32 = u32::MAX;

impl Courses {
    #[inline(always)]
    pub fn of(packet: &Packet) -> Self {
        let mut courses = [IDLE; LANES];
        let [x, y, z] = packet.direction;
        for lane in 0..LANES {
            let (x, y, z) = (x.0[lane], y.0[lane], z.0[lane]);
            let signs = u32::from(x < 0.0) | u32::from(y < 0.0) << 1 | u32::from(z < 0.0) << 2;
            let (wide, high, deep) = (x.abs(), y.abs(), z.abs());
            let axis = if wide >= high && wide >= deep { 0 } else { 8 + u32::from(high < deep) * 8 };
            let origin =
                packet.origin_m[0].0[lane].abs() + packet.origin_m[1].0[lane].abs() + packet.origin_m[2].0[lane].abs();
            // Whatever is not a number would spoil the spans of its neighbours.
            let sound = origin + (wide + high + deep) <= f32::MAX;
            let idle = !(packet.t_min.0[lane] <= packet.t_max.0[lane]) | !sound;
            courses[lane] = if idle { IDLE } else { signs | axis };
        }
        Self(courses)
    }

    /// Removes and returns the rays of one octant of directions; none once none is left.
    #[inline(always)]
    pub fn take(&mut self) -> Option<(Mask, u32)> {
        let course = self.0.iter().fold(IDLE, |least, &course| if course < least { course } else { least });
        if course == IDLE {
            return None;
        }
        let mut mask = [0; LANES];
        for lane in 0..LANES {
            let same = self.0[lane] == course;
            mask[lane] = if same { u32::MAX } else { 0 };
            self.0[lane] |= if same { IDLE } else { 0 };
        }
        Some((Mask(mask), course))
    }
}

/// Rays of one octant of directions. All other lanes have an empty interval.
pub struct Rays {
    pub origin_m: Vectors,
    pub inverse: Vectors,
    /// Along the axes in the order of `axes`.
    pub direction: Vectors,
    pub t_min: Floats,
    pub t_max: Floats,
    /// The two other axes and the one along which all go farthest.
    pub axes: [usize; 3],
    /// How far a ray goes along the two other axes while it goes 1 along the third.
    pub shear: [Floats; 2],
    /// 1 where rays have a negative direction along the axis.
    pub down: [usize; 3],
    /// Whether all start at one point.
    pub shared: bool,
    pub span: PacketSpan,
}

/// Least and greatest of each quantity over the rays.
pub struct PacketSpan {
    /// Origins' coordinates that give the earliest entry through a plane, and the latest exit.
    pub entry_m: [f32; 3],
    pub exit_m: [f32; 3],
    pub inverse: [[f32; 2]; 3],
    pub t_min: f32,
    /// A point amid the origins, and the sum of how far they lie from it along the axes.
    pub origin_m: [f32; 3],
    pub reach_m: f32,
    /// Middle of the shears and how far they lie from it.
    pub shear: [f32; 2],
    pub shear_reach: [f32; 2],
}

impl Rays {
    #[inline(always)]
    pub fn of(packet: &Packet, mask: Mask, course: u32) -> Self {
        let (mut origin_m, mut along) = (packet.origin_m, packet.direction);
        let (mut t_min, mut t_max) = (packet.t_min, packet.t_max);
        if let Some(lane) = mask.one_of_some() {
            // Lanes of another course repeat one of this, so that spans need not ask who is among them.
            for axis in 0..3 {
                origin_m[axis] = mask.select(origin_m[axis], Floats::splat(origin_m[axis].0[lane]));
                along[axis] = mask.select(along[axis], Floats::splat(along[axis].0[lane]));
            }
            t_min = mask.select(t_min, Floats::splat(f32::MAX));
            t_max = mask.select(t_max, Floats::splat(f32::MIN));
        }
        let down = [usize::from(course & 1 != 0), usize::from(course & 2 != 0), usize::from(course & 4 != 0)];
        // Adding zero makes all zeros positive, so that origins that are equal are so bit for bit.
        origin_m = unrolled!(AXIS in 3 => origin_m[AXIS] + Floats::splat(0.0));
        let inverse = unrolled!(AXIS in 3 => inverses(along[AXIS], down[AXIS] == 1));
        let [x, y, z] = along;
        let (axes, direction, scale) = match course >> 3 {
            0 => ([1, 2, 0], [y, z, x], inverse[0]),
            1 => ([2, 0, 1], [z, x, y], inverse[1]),
            _ => ([0, 1, 2], [x, y, z], inverse[2]),
        };
        let shear = [direction[0] * scale, direction[1] * scale];
        let (span, shared) = PacketSpan::of(&origin_m, &inverse, t_min, &shear, down);
        Self { origin_m, inverse, direction, t_min, t_max, axes, shear, down, shared, span }
    }
}

/// One over directions along an axis, none of which is zero.
#[inline(always)]
fn inverses(along: Floats, is_down: bool) -> Floats {
    let away = if is_down { -DIRECTION_MIN } else { DIRECTION_MIN };
    let mut inverse = along;
    for lane in 0..LANES {
        let d = along.0[lane];
        inverse.0[lane] = 1.0 / if d.abs() < DIRECTION_MIN { away } else { d };
    }
    inverse
}

impl PacketSpan {
    /// And whether all rays start at one point.
    #[inline(always)]
    fn of(origin_m: &Vectors, inverse: &Vectors, t_min: Floats, shear: &[Floats; 2], down: [usize; 3]) -> (Self, bool) {
        let mut span = Self {
            entry_m: [0.0; 3],
            exit_m: [0.0; 3],
            inverse: [[0.0; 2]; 3],
            t_min: t_min.least(),
            origin_m: [0.0; 3],
            reach_m: 0.0,
            shear: [0.0; 2],
            shear_reach: [0.0; 2],
        };
        for axis in 0..3 {
            let (least_m, most_m) = (origin_m[axis].least(), origin_m[axis].most());
            (span.entry_m[axis], span.exit_m[axis]) =
                if down[axis] == 1 { (least_m, most_m) } else { (most_m, least_m) };
            span.inverse[axis] = [inverse[axis].least(), inverse[axis].most()];
            span.origin_m[axis] = if least_m == most_m { least_m } else { 0.5 * (least_m + most_m) };
            span.reach_m += (most_m - span.origin_m[axis]).max(span.origin_m[axis] - least_m);
        }
        for side in 0..2 {
            let (least, most) = (shear[side].least(), shear[side].most());
            span.shear[side] = 0.5 * (least + most);
            span.shear_reach[side] = (most - span.shear[side]).max(span.shear[side] - least);
        }
        let shared = span.entry_m == span.exit_m;
        (span, shared)
    }
}
