//! The moving objects of a scenario: read from their files, placed on their paths, and lit.

use super::assets::Assets;
use super::motion::placed;
use crate::config::Scenario;
use crate::config::check::{one_of, within};
use crate::config::motion::MotionSource;
use crate::config::scenario::SceneObject;
use crate::error::Error;
use crate::num::u32_from;
use crate::pose::Pose;
#[cfg(feature = "gltf")]
use crate::scene::Scene;
use crate::scene::file_units::{FileUnits, UpAxis};
use crate::scene::motion::Motion;
use crate::scene::object::{MovingObject, OBJECTS_MAX, ObjectMotion, UnlitObject};
use crate::scene::{LitScene, MovingScene};
use crate::units::Span;

/// An object before it is lit: parts that move by its motion and their own animation.
pub struct PlacedObject {
    name: String,
    parts: Vec<MovingScene>,
    motion: Motion,
    looks_ahead: bool,
    notes: Vec<String>,
}

/// The scenario's objects on their paths. Fails on a file that is no scene, keys out of range, too many of them, or a scene that nothing
/// can move through.
pub fn moving_objects(scenario: &Scenario, run: Span, assets: &dyn Assets) -> Result<Vec<PlacedObject>, Error> {
    let section = &scenario.scene;
    let count = section.object.len();
    if count > 0 && section.target.is_some() {
        let reason = "nothing moves before a target; use scene.file or scene.generator";
        return Err(Error::key("scene.object", format!("{count} objects"), reason));
    }
    check_count(count, "")?;
    let one = |(number, object)| placed_object(scenario, number, object, run, assets);
    section.object.iter().enumerate().map(one).collect()
}

fn check_count(count: usize, of: &str) -> Result<(), Error> {
    if count <= OBJECTS_MAX {
        return Ok(());
    }
    Err(Error::key("scene.object", format!("{count} objects"), format!("too many{of}; use at most {OBJECTS_MAX}")))
}

fn placed_object(
    scenario: &Scenario,
    number: usize,
    object: &SceneObject,
    run: Span,
    assets: &dyn Assets,
) -> Result<PlacedObject, Error> {
    let own_key = |key: &str| format!("scene.object.{number}.{key}");
    let metres = within(&own_key("scale"), object.scale.unwrap_or(1.0), 1e-6..=1e6, "1e-6 to 1e6")?;
    let up = one_of(&own_key("up"), object.up.as_deref().unwrap_or("y"), &[("y", UpAxis::Y), ("z", UpAxis::Z)])?;
    let named = |error: Error| error.named_by(&own_key("file"), &object.file);
    let bytes = assets.read(&object.file).map_err(named)?;
    let parts = parts(&object.file, &bytes, &FileUnits { metres, up }, assets).map_err(named)?;
    let name = object.name.clone().unwrap_or_else(|| object.file.clone());
    let mut notes: Vec<String> = parts[0].shape.notes.iter().map(|note| format!("{name}: {note}")).collect();
    let Some(keys) = &object.motion else {
        let motion = Motion::Still(Pose::IDENTITY);
        return Ok(PlacedObject { name, parts, motion, looks_ahead: false, notes });
    };
    let keys = keys.motion()?;
    let of_object = |error: Error| error.under(&format!("scene.object.{number}"), "motion");
    let source = keys.source().map_err(of_object)?;
    use MotionSource::{ControlPoses, Gait, Spin, Sway};
    let looks_ahead = matches!(source, Sway | Gait(_) | Spin { .. } | ControlPoses(_));
    let found = placed(&keys, scenario.run.frames, run, assets).map_err(of_object)?;
    notes.extend(found.notes.iter().map(|note| format!("{name}: {note}")));
    Ok(PlacedObject { name, parts, motion: found.motion, looks_ahead, notes })
}

#[cfg(feature = "gltf")]
fn parts(file: &str, bytes: &[u8], units: &FileUnits, assets: &dyn Assets) -> Result<Vec<MovingScene>, Error> {
    Scene::parts_from_gltf(file, bytes, units, &|name| assets.read(name))
}

#[cfg(not(feature = "gltf"))]
fn parts(file: &str, _: &[u8], _: &FileUnits, _: &dyn Assets) -> Result<Vec<MovingScene>, Error> {
    let reason = "this build reads no glTF; use a build with the feature gltf".to_owned();
    Err(Error::Content { file: file.to_owned(), reason })
}

/// Finds the light of the parts that the scene's file moves, and of objects, on their way. Adds to the notes what a person should know.
/// Fails on a run that leaves the time range of a motion, too many parts.
pub fn lit_objects(
    objects: Vec<PlacedObject>,
    fixed: &LitScene,
    run: Span,
    notes: &mut Vec<String>,
) -> Result<Vec<MovingObject>, Error> {
    let of_file = fixed.scene().moving.iter().map(|part| PlacedObject {
        name: part.name.clone(),
        parts: vec![part.clone()],
        motion: Motion::Still(Pose::IDENTITY),
        looks_ahead: false,
        notes: Vec::new(),
    });
    let first = fixed.scene().moving.len();
    let all: Vec<PlacedObject> = of_file.chain(objects).collect();
    let count: usize = all.iter().map(|object| object.parts.len()).sum();
    check_count(count, " with the parts that animations move")?;
    if count > 0 {
        notes.push(
            match fixed.traced_shadows() {
                Some(_) => {
                    "moving objects shade the static scene, themselves and each other, and send no light onto it"
                }
                None => "moving objects shade only themselves and each other, and send no light onto the static scene",
            }
            .to_owned(),
        );
    }
    let mut unlit = Vec::with_capacity(count);
    for (number, PlacedObject { name, parts, motion, looks_ahead, notes: own }) in all.into_iter().enumerate() {
        notes.extend(own);
        let key = format!("scene.object.{}.motion.start_s", number.saturating_sub(first));
        for MovingScene { chain, shape, .. } in parts {
            let motion = ObjectMotion { motion: motion.clone(), looks_ahead, chain };
            let part = UnlitObject::new((&name, u32_from(number + 1)), shape, motion, run);
            unlit.push(part.map_err(|error| error.at_key(&key, 0.0))?);
        }
    }
    Ok(UnlitObject::lit(unlit, fixed, run))
}
