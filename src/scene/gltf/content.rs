//! What a glTF file is read into, with notes on what was left out.

use super::super::animation::JointChain;
use super::super::geometry::Viewpoint;
use super::super::mesh::Mesh;
use crate::text::sentence_shown;

/// Most sentences about one file.
pub(super) const NOTES_MAX: usize = 100;

/// Sentences for the user, each once, in the order in which they came up.
#[derive(Debug, Default)]
pub struct Notes(pub(super) Vec<String>);

impl Notes {
    pub(super) fn add(&mut self, note: impl Into<String>) {
        // Names in it are the file's own.
        let note = sentence_shown(&note.into());
        if self.0.contains(&note) {
            return;
        }
        match self.0.len() {
            ..NOTES_MAX => self.0.push(note),
            NOTES_MAX => self.0.push("there is more of this kind".to_owned()),
            _ => {}
        }
    }
}

/// A part of a file that its animation moves rigidly.
#[derive(Clone, Debug)]
pub struct MovingPart {
    /// As the file calls its node.
    pub name: String,
    /// How it moves in the file's frame.
    pub chain: JointChain,
    /// In its own frame.
    pub mesh: Mesh,
}

pub struct Content {
    /// Geometry and materials of what no animation moves.
    pub mesh: Mesh,
    /// What the file's animation moves.
    pub moving: Vec<MovingPart>,
    pub viewpoints: Vec<Viewpoint>,
    /// What was left out or repaired.
    pub notes: Vec<String>,
}
