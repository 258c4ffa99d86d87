//! What a glTF file's coordinates mean: metres of a unit, and the axis that points up. glTF says metres and y; many files do not.

use glam::DMat4;

use super::motion::Y_UP_FROM_Z_UP;

/// Axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// As glTF says.
    #[default]
    Y,
    /// As in CAD and robotics.
    Z,
}

/// How a file's coordinates become metres with y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileUnits {
    /// Metres of a unit.
    pub metres: f64,
    /// Axis that points up.
    pub up: UpAxis,
}

impl Default for FileUnits {
    fn default() -> Self {
        Self { metres: 1.0, up: UpAxis::Y }
    }
}

impl FileUnits {
    /// From the file's coordinates to metres with y up.
    pub fn world_from_file(&self) -> DMat4 {
        let scaled = DMat4::from_scale(glam::DVec3::splat(self.metres));
        match self.up {
            UpAxis::Y => scaled,
            UpAxis::Z => DMat4::from_quat(Y_UP_FROM_Z_UP) * scaled,
        }
    }
}
