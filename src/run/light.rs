//! The scene that a scenario names, under its light. Baked light is kept by content hash.

use glam::DVec3;

use super::assets::{Assets, Progress};
use crate::config::Scenario;
use crate::config::check::within;
use crate::error::Error;
use crate::scene::{Bake, BakeSettings, LitScene, Scene, box_room, target};

/// The box room's textures: not the run's seed, so that two runs with different seeds look at the same room.
const BOX_ROOM_SEED: u64 = 1;

/// Loads or generates the scene, bakes or loads its light, and scales it to the scenario's lux at `start_m`.
///
/// # Errors
/// No scene or more than one named, a file that is no scene, no light at the start.
pub fn lit_scene(
    scenario: &Scenario,
    start_m: DVec3,
    assets: &dyn Assets,
    progress: &dyn Progress,
) -> Result<LitScene, Error> {
    let (illuminant, lux) = scenario.light()?;
    let section = &scenario.scene;
    // Also where the scene has no use for them: a value that is written is a value that holds.
    section.surroundings.check()?;
    within("scene.reflectance", section.reflectance, 0.0..=1.0, "0 to 1")?;
    let scene = match (&section.file, &section.generator, &section.target) {
        (Some(file), None, None) => {
            let named = |error: Error| error.named_by("scene.file", file);
            let bytes = assets.read(file).map_err(named)?;
            Scene::from_glb_in(file, &bytes, &section.surroundings).map_err(named)?
        }
        (None, Some(generator), None) => generated(generator)?,
        (None, None, Some(target)) => {
            let flat = flat_target(target, section.reflectance)?;
            return Ok(flat.evenly_lit(lux, illuminant));
        }
        _ => return Err(not_one_scene(section)),
    };
    let bake = baked(&scene, assets, progress);
    scene.lit(&bake, start_m, lux, illuminant)
}

/// Pictures stand alone: no scene beside them.
///
/// # Errors
/// A scene that is named as well.
pub fn only_images(section: &crate::config::scenario::Scene) -> Result<(), Error> {
    section.surroundings.check()?;
    within("scene.reflectance", section.reflectance, 0.0..=1.0, "0 to 1")?;
    let is_alone = section.file.is_none() && section.generator.is_none() && section.target.is_none();
    if is_alone { Ok(()) } else { Err(not_one_scene(section)) }
}

fn not_one_scene(section: &crate::config::scenario::Scene) -> Error {
    let reason = "exactly one of scene.file, scene.generator, scene.target and scene.images would do";
    let all =
        [("scene.target", &section.target), ("scene.generator", &section.generator), ("scene.file", &section.file)];
    match all.into_iter().find_map(|(key, value)| Some((key, value.as_ref()?))) {
        Some((key, value)) => Error::key(key, value, format!("stands beside another; {reason}")),
        None => Error::key("scene", "nothing", reason),
    }
}

fn generated(generator: &str) -> Result<Scene, Error> {
    match generator {
        "box" => Ok(box_room::box_room(BOX_ROOM_SEED)),
        _ => Err(Error::key("scene.generator", generator, "not known; \"box\" would do")),
    }
}

fn flat_target(target: &str, reflectance: f64) -> Result<Scene, Error> {
    match target {
        "flat" => target::flat(reflectance),
        _ => Err(Error::key("scene.target", target, "not known; \"flat\" would do")),
    }
}

fn baked(scene: &Scene, assets: &dyn Assets, progress: &dyn Progress) -> Bake {
    let settings = if scene.mesh.triangles.len() > 10_000 { BakeSettings::ROOM } else { BakeSettings::DRAFT };
    let key = blake3::Hash::from_bytes(scene.bake_key(&settings)).to_hex().to_string();
    let stored = assets.load(&key).and_then(|bytes| Bake::from_bytes(&key, &bytes).ok());
    if let Some(bake) = stored.filter(|bake| bake.key() == scene.bake_key(&settings)) {
        return bake;
    }
    let bake = scene.bake(&settings, &|share| progress.at("light", share));
    assets.store(&key, &bake.to_bytes());
    bake
}
