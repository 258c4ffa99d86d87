//! Scenes made by code, by name. An unknown name gives an error that lists the known names.

use super::geometry::Scene;
use super::light::with_infrared;
use super::mesh::Mesh;
use super::source::Read;
#[cfg(feature = "pictures")]
use super::texture::Texture;
use super::{Surroundings, box_room, columns};
#[cfg(feature = "pictures")]
use super::{hall, photo_box, street};
use crate::error::Error;

/// The names.
pub const NAMES: [&str; 5] = ["box", "columns", "hall", "photo_box", "street"];

/// Of the rooms' textures: not the run's seed, so that two runs with different seeds look at the same room.
const ROOM_SEED: u64 = 1;

/// Makes a scene in its surroundings. "box" and "columns" need no files; the others read their pictures from the folder `textures` beside
/// the scenario. Fails on a name that is not among `NAMES`; a picture that is not there or is none.
pub fn scene(name: &str, surroundings: &Surroundings, read: Read<'_>) -> Result<Scene, Error> {
    let mut mesh = mesh(name, read)?;
    surroundings.furnish(&mut mesh);
    Scene::new(name, mesh, with_infrared(surroundings.sky))
}

fn mesh(name: &str, read: Read<'_>) -> Result<Mesh, Error> {
    match name {
        "box" => Ok(box_room::box_room(ROOM_SEED).mesh),
        "columns" => Ok(columns::columns(ROOM_SEED)),
        _ => with_photographs(name, read),
    }
}

fn unknown(name: &str) -> Error {
    Error::key("scene.generator", name, format!("not known; use one of {}", NAMES.join(", ")))
}

#[cfg(not(feature = "pictures"))]
fn with_photographs(name: &str, _: Read<'_>) -> Result<Mesh, Error> {
    if NAMES.contains(&name) {
        let reason = "needs photographs, which this build does not read; use box or columns";
        return Err(Error::key("scene.generator", name, reason));
    }
    Err(unknown(name))
}

#[cfg(feature = "pictures")]
fn with_photographs(name: &str, read: Read<'_>) -> Result<Mesh, Error> {
    match name {
        "hall" => Ok(hall::hall(hall::HallPictures {
            marble: photograph("marble", read)?,
            tiles: photograph("floor_tiles", read)?,
            wood: photograph("wood", read)?,
            cloth: [photograph("wallpaper-1", read)?, photograph("wallpaper-2", read)?],
        })),
        "photo_box" => {
            let [tiles, marble, wood] = ["floor_tiles", "marble", "wood"].map(|name| photograph(name, read));
            let [first, second] = ["wallpaper-1", "wallpaper-2"].map(|name| photograph(name, read));
            Ok(photo_box::photo_box([tiles?, marble?, wood?, first?, second?]))
        }
        "street" => Ok(street::street(photograph("wood", read)?)),
        _ => Err(unknown(name)),
    }
}

#[cfg(feature = "pictures")]
fn photograph(name: &str, read: Read<'_>) -> Result<Texture, Error> {
    use super::texture::picture::{Budget, TexturePicture};
    let file = format!("textures/{name}.jpg");
    let picture = TexturePicture::decoded(&read(&file)?, &mut Budget::default());
    let picture = picture.map_err(|reason| Error::Content { file, reason })?;
    Ok(picture.texture([super::texture::Wrap::Repeat; 2]))
}
