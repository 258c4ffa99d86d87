//! Moving objects in a render. A rigid object that moves in front of a camera is a camera that moves in front of the object: rays are
//! turned into the object's frame and traced against its own tree there, each at its own instant.

use super::super::motion::{PacketMotion, Parabolas, Timeline};
use super::settings::ROWS;
use crate::parallel::collected;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Mask, Vectors};
use crate::scene::lit::SourceBounds;
use crate::scene::object::{MovingObject, PlacedBall};
use crate::scene::tracer::Packet;
use crate::units::Span;

/// An object over one exposure.
pub struct ObjectInView {
    /// Under the light of the exposure's middle.
    pub lit: LitScene,
    /// `object_from_camera` over the exposures of each group of rows.
    pub timelines: Vec<Timeline>,
    /// Where it and its parts are in the world over the exposures of each group of rows.
    balls_m: Vec<(PlacedBall, Vec<PlacedBall>)>,
}

/// What of a timeline the rays of a packet belong to.
#[derive(Clone, Copy)]
pub enum Instants<'a> {
    /// A tile's rows, in one piece of their exposures.
    Tile(usize),
    /// One row, whose exposure is one piece.
    Row(usize),
    /// A lane's row, in a piece for each lane.
    Pieces(usize, &'a [usize; LANES]),
}

impl Instants<'_> {
    /// The motion of a timeline there; `gathered` holds what has to be put together.
    #[inline(always)]
    pub fn of<'t>(&self, timeline: &'t Timeline, gathered: &'t mut Option<Parabolas>) -> PacketMotion<'t> {
        match self {
            Self::Tile(piece) => PacketMotion::ByLane(&timeline.pieces[*piece]),
            Self::Row(row) => PacketMotion::Shared(timeline.first_of_row(*row)),
            Self::Pieces(lane, piece_of) => PacketMotion::ByLane(gathered.insert(timeline.gathered(*lane, piece_of))),
        }
    }
}

/// The objects as the rays of one packet may meet them.
#[derive(Clone, Copy)]
pub struct Objects<'a> {
    /// All of them.
    pub all: &'a [ObjectInView],
    /// The packet's group of rows.
    pub group: usize,
    /// Its rays' instants.
    pub instants: Instants<'a>,
}

impl ObjectInView {
    /// For the spans of groups of rows and the motion of a camera, in `pieces` of time a group.
    pub fn new(
        object: &MovingObject,
        groups: &[[Span; ROWS]],
        pieces: u32,
        world_from_camera: &(dyn Fn(f64) -> Pose + Sync),
    ) -> Self {
        let pose = |t_s: f64| object.world_from_object(t_s).inverse().then(&world_from_camera(t_s));
        let timelines = collected(groups.len(), |group| Timeline::of(groups[group], pieces, &pose));
        let balls_m = collected(groups.len(), |group| object.balls_over_m(Span::around(&groups[group])));
        let middle_s = Span::around(groups.as_flattened()).middle_s();
        Self { lit: object.lit_at(middle_s), timelines, balls_m }
    }

    /// Which lanes' points may be shaded by it over the exposures of a group of rows from the lanes' sources, by its whole.
    #[inline(always)]
    pub fn may_shade(&self, group: usize, at_m: &Vectors, sources: &SourceBounds, slack_m: Floats) -> Mask {
        sources.may_be_blocked(self.balls_m[group].0, at_m, slack_m)
    }

    /// The same by its parts.
    #[inline(always)]
    pub fn parts_may_shade(&self, group: usize, at_m: &Vectors, sources: &SourceBounds, slack_m: Floats) -> Mask {
        let (whole, parts) = &self.balls_m[group];
        let near = sources.may_be_blocked(*whole, at_m, slack_m);
        if !near.any() {
            return near;
        }
        // No fold: its closure would be compiled without the instructions of the kernel around it.
        let mut by_part = Mask([0; LANES]);
        for part in parts {
            by_part = by_part | sources.may_be_blocked(*part, at_m, slack_m);
        }
        near & by_part
    }

    /// Whether one of some rays of a group's exposures may meet it, each of which stands for a cone of `spread` radians.
    #[inline(always)]
    pub fn may_be_met(&self, group: usize, rays: &Packet, spread: Floats) -> bool {
        let live = Floats::splat(0.0).below(rays.t_max);
        let (whole, parts) = &self.balls_m[group];
        let mut near = Mask([0; LANES]);
        if (rays.come_near(*whole, spread) & live).any() {
            for part in parts {
                near = near | rays.come_near(*part, spread);
            }
        }
        (near & live).any()
    }
}
