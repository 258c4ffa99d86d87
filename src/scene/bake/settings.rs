//! Settings of a bake.

use super::super::geometry::Scene;

/// Version of the method and of the stored form: part of the key, so a stale bake is never taken.
pub const BAKE_VERSION: u32 = 17;

/// How many rays a bake spends. Noise falls with the root of the count; time grows in proportion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeSettings {
    /// Cosine-weighted rays from each side of a sample on a grid. A multiple of 16.
    pub grid_rays: usize,
    /// The same for samples on vertices of small triangles. A multiple of 16.
    pub vertex_rays: usize,
    /// Points on lamps that samples on grids aim at.
    pub grid_lamp_rays: usize,
    /// Points on lamps that samples on vertices aim at.
    pub vertex_lamp_rays: usize,
    /// Whether light is followed over surfaces; without, only what sources send straight is known.
    pub bounces: bool,
    /// Whether samples on grids are interpolated where light changes little; without, rays are traced for each.
    pub interpolates: bool,
}

impl BakeSettings {
    /// Pictures of rooms.
    pub const ROOM: Self = Self::new([256, 64], [192, 96]);

    /// Enough for tests and a first look.
    pub const DRAFT: Self = Self::new([64, 32], [64, 32]);

    /// A first picture within a second, in one thread of a browser.
    pub const SKETCH: Self = Self::new([16, 16], [16, 16]);

    /// Scenes that take seconds even so.
    pub const FINE: Self = Self::new([1_024, 256], [768, 384]);

    /// Scenes whose light would take minutes and most of a gigabyte.
    pub const WIDE: Self = Self::new([128, 32], [96, 48]);

    /// Rays and points on lamps of samples on grids and on vertices.
    const fn new([grid_rays, vertex_rays]: [usize; 2], [grid_lamp_rays, vertex_lamp_rays]: [usize; 2]) -> Self {
        Self { grid_rays, vertex_rays, grid_lamp_rays, vertex_lamp_rays, bounces: true, interpolates: true }
    }

    /// What a scene affords: the finest of `FINE`, `ROOM` and `WIDE` that stays below its number of rays.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let affords = |settings: &Self, rays: u64| BakeCost::of(scene, settings).rays <= rays;
        if affords(&Self::FINE, FINE_RAYS_MAX) {
            Self::FINE
        } else if affords(&Self::ROOM, ROOM_RAYS_MAX) {
            Self::ROOM
        } else {
            Self::WIDE
        }
    }

    /// The same rays without bounces.
    #[must_use]
    pub const fn direct(self) -> Self {
        Self { bounces: false, ..self }
    }
}

/// Rays of a scene that is baked finely: a few seconds.
pub(super) const FINE_RAYS_MAX: u64 = 20_000_000;

/// Rays of a scene that is baked like a room: a minute, and 4 bytes each.
pub(super) const ROOM_RAYS_MAX: u64 = 100_000_000;

/// What a bake will take, known beforehand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeCost {
    /// Rays if all samples are traced, those that mirrors add not counted.
    pub rays: u64,
    /// Bytes that are held at the same time.
    pub bytes: u64,
}
