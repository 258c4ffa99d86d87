//! Plan of the hall: bays, walls and the surfaces they are made of.

use super::super::build::Surface;

pub(super) const BAY_M: f32 = 6.0;
pub(super) const BAYS: i32 = 10;
pub(super) const HALF_LENGTH_M: f32 = 30.0;
/// From the nave's middle to the axes of the columns.
pub(super) const COLUMN_M: f32 = 7.0;
/// Half of the thickness of the wall over the arches.
pub(super) const HALF_WALL_M: f32 = 0.45;
/// From the middle to the outer walls.
pub(super) const OUTER_M: f32 = 15.0;
/// Where arches spring, on top of the columns.
pub(super) const SPRING_M: f32 = 4.4;
/// Between the arches and the clerestory.
pub(super) const STRING_M: f32 = 7.4;
/// Where the nave's vault springs.
pub(super) const CORNICE_M: f32 = 10.0;
/// Highest point of the nave's vault over its springing.
pub(super) const SAGITTA_M: f32 = 2.0;

pub(super) struct HallMaterials {
    pub(super) stone: Surface,
    pub(super) plaster: Surface,
    pub(super) moulding: Surface,
    pub(super) column: Surface,
    pub(super) slabs: [Surface; 2],
    pub(super) tiles: Surface,
    pub(super) wood: Surface,
    pub(super) coffers: Surface,
    pub(super) banners: [Surface; 2],
    pub(super) lead: Surface,
    pub(super) pane: Surface,
}
