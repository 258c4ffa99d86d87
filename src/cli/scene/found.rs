//! What a file holds.

use sensel::scene::Scene;
use sensel::scene::file_units::FileUnits;
use sensel::scene::views::{CameraView, SceneBox};

pub(super) struct FileSummary {
    pub(super) name: String,
    pub(super) scene: Scene,
    pub(super) units: FileUnits,
    pub(super) extent: SceneBox,
    pub(super) views: Vec<CameraView>,
    /// Materials that shine, and directional lights.
    pub(super) lamps: Vec<String>,
    /// What lights the best view.
    pub(super) light: Light,
}

/// What a scenario has to bring so that the best view is lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Light {
    /// Nothing: the file's own is enough.
    Own,
    /// A sky, which is seen from there.
    Sky,
    /// A lamp so far above the camera, because all is closed.
    Lamp { above_m: f64 },
}
