//! What a file holds.

use sensel::scene::Scene;
use sensel::scene::file_units::FileUnits;
use sensel::scene::views::{CameraView, SceneBox};

/// What a file holds.
pub(super) struct FileSummary {
    pub(super) name: String,
    pub(super) scene: Scene,
    pub(super) units: FileUnits,
    pub(super) extent: SceneBox,
    pub(super) views: Vec<CameraView>,
    /// Materials that shine.
    pub(super) lamps: Vec<String>,
    /// Share of the sky that is seen from the best view, straight up and around.
    pub(super) open: f64,
}
