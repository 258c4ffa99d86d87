//! Refuses keys of image sources that the user changed and nothing reads.

use super::resolved::Resolved;
use crate::error::Error;

/// Keys of `[scene]` that say something about pictures.
const OF_PICTURES: [&str; 7] = [
    "scene.images_camera",
    "scene.images_fps",
    "scene.images_start_s",
    "scene.images_blend",
    "scene.images_transfer",
    "scene.images_depth",
    "scene.images_depth_per_m",
];

/// Refuses a key of pictures without pictures, and one of rays with them. Fails with the first such key, with what would make it act.
pub fn check_idle(resolved: &Resolved) -> Result<(), Error> {
    let scene = &resolved.scenario.scene;
    let has_images = scene.images.is_some();
    let groups: [(bool, &str, &[&str]); 3] = [
        (!has_images, "scene.images", &OF_PICTURES),
        (scene.images_depth.is_none(), "scene.images_depth", &["scene.images_depth_per_m"]),
        (
            has_images,
            "a scene with geometry",
            &[
                "run.samples_per_pixel",
                "run.render_tolerance",
                "run.render_seed",
                "run.render_quantum_efficiency",
                "run.render_full_well_e",
                "scene.reflectance",
                "scene.surroundings",
            ],
        ),
    ];
    for (is_off, would_do, keys) in groups {
        keys.iter().try_for_each(|key| resolved.check_idle(is_off, key, would_do))?;
    }
    Ok(())
}
