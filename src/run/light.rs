//! The scene that a scenario names, under its light. Baked light is kept by content hash.

use glam::DVec3;

use super::assets::{Assets, Progress};
use crate::config::Scenario;
use crate::config::check::within;
use crate::error::Error;
use crate::scene::{Bake, BakeSettings, LitScene, Scene, generated, target};

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
    section.check_target_keys()?;
    let scene = match (&section.file, &section.generator, &section.target) {
        (Some(file), None, None) => {
            let named = |error: Error| error.named_by("scene.file", file);
            let bytes = assets.read(file).map_err(named)?;
            Scene::from_gltf_in(file, &bytes, &section.surroundings, &|name| assets.read(name)).map_err(named)?
        }
        (None, Some(generator), None) => generated::scene(generator, &section.surroundings, &|name| assets.read(name))?,
        (None, None, Some(target)) => {
            let scene = target::named(target, &section.target_wish())?;
            return Ok(scene.evenly_lit(lux, illuminant));
        }
        _ => return Err(not_one_scene(section)),
    };
    let bake = baked(&scene, assets, progress);
    scene.lit(&bake, start_m, lux, illuminant)
}

fn not_one_scene(section: &crate::config::scenario::Scene) -> Error {
    let reason = "exactly one of scene.file, scene.generator and scene.target would do";
    let all =
        [("scene.target", &section.target), ("scene.generator", &section.generator), ("scene.file", &section.file)];
    match all.into_iter().find_map(|(key, value)| Some((key, value.as_ref()?))) {
        Some((key, value)) => Error::key(key, value, format!("stands beside another; {reason}")),
        None => Error::key("scene", "nothing", reason),
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
