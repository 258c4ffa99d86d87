//! Pictures of the static scene alone, for cameras that stand still while something moves: rendered once and kept.

use std::sync::{Arc, Mutex, PoisonError};

use super::camera::Camera;
use super::render::{Exposure, Sampling};
use crate::num::u64_from;
use crate::units::Span;

/// Pictures that are kept: cameras times exposures a frame times bands that are rendered one by one.
const KEPT: usize = 64;

type Kept = ([u8; 32], Arc<Exposure>);

/// Pictures of one scene under steady light.
#[derive(Debug, Default)]
pub struct StaticPictures(Mutex<Vec<Kept>>);

impl StaticPictures {
    /// The picture of a still camera in one pose, which `render` makes where it is not known. What it shows depends on nothing else, so
    /// neither the order of calls nor what is forgotten changes a result.
    pub fn of(
        &self,
        camera: &Camera,
        shutter: &[Span],
        sampling: &Sampling,
        render: impl Fn() -> Exposure,
    ) -> Arc<Exposure> {
        let key = key(camera, shutter, sampling);
        let known = |all: &[Kept]| all.iter().find(|(known, _)| *known == key).map(|(_, picture)| picture.clone());
        // A thread that panicked has left whole pictures.
        if let Some(picture) = known(&self.0.lock().unwrap_or_else(PoisonError::into_inner)) {
            return picture;
        }
        let picture = Arc::new(render());
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() >= KEPT {
            all.remove(0);
        }
        all.push((key, picture.clone()));
        picture
    }
}

/// Under steady light only the length of exposures counts.
fn key(camera: &Camera, shutter: &[Span], sampling: &Sampling) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    camera.hash_into(&mut hasher);
    hasher.update(format!("{sampling:?}").as_bytes());
    hasher.update(&u64_from(shutter.len()).to_le_bytes());
    for row in shutter {
        // As the render takes it: to the picosecond.
        hasher.update(&(row.length_s() * 1e12).round_ties_even().to_le_bytes());
    }
    *hasher.finalize().as_bytes()
}
