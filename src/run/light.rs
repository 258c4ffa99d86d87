//! The scene that a scenario names, under its light. Baked light is kept by content hash.

use glam::DVec3;

use super::assets::{Assets, Progress};
use crate::config::Scenario;
use crate::config::check::within;
use crate::config::light::{BakeKind, BakeLimits, LightLevel};
use crate::error::Error;
use crate::scene::surroundings::PANEL;
use crate::scene::{Bake, BakeCost, BakeSettings, Environment, LitScene, Scene, generated, target};

/// A scene with what lights it.
enum LoadedScene {
    /// Lit evenly: nothing is baked.
    Target(Box<LitScene>),
    /// Before its bake.
    Scene(Box<Scene>),
}

/// Loads or generates the scene, gives it what lights it, bakes or loads its light, and scales it to the scenario's lux at `start_m`.
/// Fails on no scene or more than one named, a file that is no scene, no light at the start, a bake that takes more than is allowed.
pub fn lit_scene(
    scenario: &Scenario,
    start_m: DVec3,
    assets: &dyn Assets,
    progress: &dyn Progress,
) -> Result<LitScene, Error> {
    let (illuminant, lux) = scenario.light()?;
    let (level, limits, flicker) = (scenario.light_level()?, scenario.bake_limits()?, scenario.flicker()?);
    let scene = match load_scene(scenario, assets)? {
        LoadedScene::Target(lit) => {
            return Ok(match flicker {
                Some(flicker) => lit.all_flickering(flicker),
                None => *lit,
            });
        }
        LoadedScene::Scene(scene) => *scene,
    };
    let bake = bake_or_load(&scene, limits, assets, progress)?;
    let lit = match level {
        LightLevel::Scaled => scene.lit(&bake, start_m, lux, illuminant)?,
        LightLevel::Absolute => scene.lit_absolutely(&bake, start_m, illuminant)?,
    };
    let lit = if scenario.traces_shadows()? { lit } else { lit.with_baked_shadows() };
    Ok(match flicker {
        Some(flicker) => lit.with_flicker(flicker),
        None => lit,
    })
}

/// Refuses what `lit_scene` refuses before it bakes.
pub fn check_scene(scenario: &Scenario, assets: &dyn Assets) -> Result<(), Error> {
    let limits = scenario.bake_limits()?;
    scenario.traces_shadows()?;
    match load_scene(scenario, assets)? {
        LoadedScene::Scene(scene) => {
            let settings = settings(&scene, limits);
            match stored_bake(scene.bake_key(&settings), assets) {
                Some(_) => Ok(()),
                None => limits.check(BakeCost::of(&scene, &settings)),
            }
        }
        LoadedScene::Target(_) => Ok(()),
    }
}

/// Reads the scene that the scenario names and lights nothing.
pub fn read_scene(scenario: &Scenario, assets: &dyn Assets) -> Result<(), Error> {
    load_scene(scenario, assets).map(|_| ())
}

/// The scene that the scenario names, with its lamps.
fn load_scene(scenario: &Scenario, assets: &dyn Assets) -> Result<LoadedScene, Error> {
    let (illuminant, lux) = scenario.light()?;
    scenario.light_level()?;
    let flicker = scenario.flicker()?;
    let section = &scenario.scene;
    // Also where the scene has no use for them: a value that is written is a value that holds.
    section.surroundings.check()?;
    within("scene.reflectance", section.reflectance, 0.0..=1.0, "0 to 1")?;
    let environment = environment_of(scenario, assets)?;
    section.check_target_keys()?;
    let scene = match (&section.file, &section.generator, &section.target) {
        (Some(file), None, None) => {
            let named = |error: Error| error.named_by("scene.file", file);
            let bytes = assets.read(file).map_err(named)?;
            from_file(file, &bytes, section, assets).map_err(named)?
        }
        (None, Some(generator), None) => generated::scene(generator, &section.surroundings, &|name| assets.read(name))?,
        (None, None, Some(target)) => {
            return Ok(LoadedScene::Target(Box::new(
                target::named(target, &section.target_request())?.evenly_lit(lux, illuminant),
            )));
        }
        _ => return Err(not_one_scene(section)),
    };
    let scene = match environment {
        Some(environment) => scene.with_environment(environment),
        None => scene,
    };
    mark_flickering(scene, section, flicker.is_some())?
        .with_lamps(&section.lamp, illuminant)
        .map(|scene| LoadedScene::Scene(Box::new(scene)))
}

#[cfg(feature = "gltf")]
fn from_file(
    file: &str,
    bytes: &[u8],
    section: &crate::config::scenario::Scene,
    assets: &dyn Assets,
) -> Result<Scene, Error> {
    Scene::from_gltf_in(file, bytes, &section.file_units()?, &section.surroundings, &|name| assets.read(name))
}

#[cfg(not(feature = "gltf"))]
fn from_file(file: &str, _: &[u8], _: &crate::config::scenario::Scene, _: &dyn Assets) -> Result<Scene, Error> {
    let reason = "this build reads no glTF; use scene.generator, or a build with the feature gltf".to_owned();
    Err(Error::Content { file: file.to_owned(), reason })
}

/// Light from beyond all surfaces: of a picture or of sun and sky, if either is asked for.
fn environment_of(scenario: &Scenario, assets: &dyn Assets) -> Result<Option<Environment>, Error> {
    let section = &scenario.scene;
    let yaw_deg = within("scene.environment_yaw_deg", section.environment_yaw_deg, -360.0..=360.0, "-360 to 360")?;
    let sky = scenario.sky()?;
    let even = section.surroundings.sky.iter().any(|&band| band > 0.0);
    if even && (sky.is_some() || section.environment.is_some()) {
        let reason = "stands beside scene.environment or scene.sky; use one light from beyond the scene";
        return Err(Error::key("scene.surroundings.sky", "", reason));
    }
    match (&section.environment, sky) {
        (Some(file), Some(_)) => {
            Err(Error::key("scene.environment", file, "stands beside scene.sky; use one of the two"))
        }
        (Some(file), None) => {
            let named = |error: Error| error.named_by("scene.environment", file);
            let bytes = assets.read(file).map_err(named)?;
            picture(file, &bytes, yaw_deg).map(Some).map_err(named)
        }
        (None, sky) => Ok(sky.map(|sky| sky.environment())),
    }
}

#[cfg(feature = "exr")]
fn picture(file: &str, bytes: &[u8], yaw_deg: f64) -> Result<Environment, Error> {
    Environment::from_exr(file, bytes, yaw_deg)
}

#[cfg(not(feature = "exr"))]
fn picture(file: &str, _: &[u8], _: f64) -> Result<Environment, Error> {
    let reason = "this build reads no OpenEXR; use scene.sky, or a build with the feature exr".to_owned();
    Err(Error::Content { file: file.to_owned(), reason })
}

/// Marks what flickers, before lamps are added.
fn mark_flickering(scene: Scene, section: &crate::config::scenario::Scene, flickers: bool) -> Result<Scene, Error> {
    if !flickers {
        return Ok(scene);
    }
    let scene = scene.with_flickering(|name| section.flicker.own_lamps && name != PANEL);
    if scene.flickering.contains(&true) || section.lamp.iter().any(|lamp| lamp.flickers) {
        return Ok(scene);
    }
    let reason = "no lamp here flickers; use a scene with lamps, or a [[scene.lamp]] with flickers = true";
    Err(Error::key("scene.flicker.waveform", &section.flicker.waveform, reason))
}

/// Pictures stand alone: no scene beside them. Fails on a scene that is named as well.
#[cfg(feature = "pictures")]
pub fn only_images(section: &crate::config::scenario::Scene) -> Result<(), Error> {
    section.surroundings.check()?;
    within("scene.reflectance", section.reflectance, 0.0..=1.0, "0 to 1")?;
    let is_alone = section.file.is_none() && section.generator.is_none() && section.target.is_none();
    if is_alone { Ok(()) } else { Err(not_one_scene(section)) }
}

fn not_one_scene(section: &crate::config::scenario::Scene) -> Error {
    let reason = "use exactly one of scene.file, scene.generator, scene.target and scene.images";
    let all =
        [("scene.target", &section.target), ("scene.generator", &section.generator), ("scene.file", &section.file)];
    match all.into_iter().find_map(|(key, value)| Some((key, value.as_ref()?))) {
        Some((key, value)) => Error::key(key, value, format!("stands beside another; {reason}")),
        None => Error::key("scene", "nothing", reason),
    }
}

fn settings(scene: &Scene, limits: BakeLimits) -> BakeSettings {
    match limits.kind {
        BakeKind::Full => BakeSettings::of(scene),
        BakeKind::Draft => BakeSettings::DRAFT,
        BakeKind::Sketch => BakeSettings::SKETCH,
        BakeKind::Direct => BakeSettings::of(scene).direct(),
    }
}

/// The light of a key, where it was baked before.
fn stored_bake(key: [u8; 32], assets: &dyn Assets) -> Option<Bake> {
    let name = blake3::Hash::from_bytes(key).to_hex().to_string();
    let stored = assets.load(&name).and_then(|bytes| Bake::from_bytes(&name, &bytes).ok());
    stored.filter(|bake| bake.key() == key)
}

/// The scene's light: from the store if it is there, else baked and stored.
fn bake_or_load(
    scene: &Scene,
    limits: BakeLimits,
    assets: &dyn Assets,
    progress: &dyn Progress,
) -> Result<Bake, Error> {
    let settings = settings(scene, limits);
    let key = scene.bake_key(&settings);
    if let Some(bake) = stored_bake(key, assets) {
        return Ok(bake);
    }
    limits.check(BakeCost::of(scene, &settings))?;
    let bake = scene.bake_under(&settings, key, &|share| progress.at("light", share));
    assets.store(&blake3::Hash::from_bytes(key).to_hex(), &bake.to_bytes());
    Ok(bake)
}
