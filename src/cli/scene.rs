//! `sensel scene`: what a glTF file holds, what of it is not read, and a scenario whose camera sees it.

mod contact_sheet;
mod found;
mod scenario;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use sensel::error::Error;
use sensel::files::input::InputFolders;
use sensel::files::open::is_there;
use sensel::num::index;
use sensel::pose::Pose;
use sensel::scene::file_units::{FileUnits, UpAxis};
use sensel::scene::images::PictureBytes as _;
use sensel::scene::mesh::Material;
use sensel::scene::views::{self, CameraView, SceneBox};
use sensel::scene::{Scene, Surroundings};
use serde_json::json;

use super::args::{CommonOptions, SceneArguments};
use super::{listing, paths, words};
use found::{FileSummary, Light};

/// Views of the contact sheet.
const VIEWS: usize = 6;
/// Scenes larger or smaller than this are probably not in metres.
const USUAL_M: [f64; 2] = [0.1, 100.0];

pub fn main(arguments: &SceneArguments, shared: &CommonOptions) -> Result<(), Error> {
    let SceneArguments { file, picture, .. } = arguments;
    let scenario = paths::output_file(shared, &["toml"], "a scenario", "scene.toml")?;
    if let Some(scenario) = &scenario {
        check_scenario_path(scenario, file)?;
    }
    if let Some(picture) = picture {
        paths::check_ending("--picture", picture, &["png"], "PNG")?;
        paths::check_output("--picture", picture)?;
    }
    let units = units_of(arguments)?;
    let (name, scene) = read(file, &units)?;
    let found = FileSummary::of(name, scene, units);
    if let Some(picture) = picture {
        let png = contact_sheet::png(&found.scene, &found.views)?;
        paths::write_output("--picture", picture, &png)?;
    }
    if let Some(scenario) = &scenario {
        let view = found.views.first().ok_or_else(|| {
            let reason = "has no place from which a camera sees a surface; no scenario was written";
            Error::Content { file: found.name.clone(), reason: reason.to_owned() }
        })?;
        paths::write_output("--out", scenario, scenario::text(&found, view).as_bytes())?;
    }
    words::warn(&found.warnings());
    if shared.json {
        listing::print_json(&found.as_json());
    } else {
        found.print();
        if let Some(scenario) = &scenario {
            outln!("  scenario      {0}: run it by 'sensel run {0}'", scenario.display());
        }
    }
    Ok(())
}

/// A scenario reads its files from its own folder, and no file of the user is replaced.
fn check_scenario_path(scenario: &Path, file: &Path) -> Result<(), Error> {
    let folder = |path: &Path| paths::real(path).parent().map(Path::to_owned);
    if folder(scenario) != folder(file) {
        let beside = file.with_extension("toml");
        let reason = format!("a scenario reads its scene from its own folder; use {}", beside.display());
        return Err(Error::key("--out", scenario.display(), reason));
    }
    if scenario.exists() {
        return Err(Error::key("--out", scenario.display(), "is there already; name a new file"));
    }
    paths::check_output("--out", scenario)
}

fn units_of(arguments: &SceneArguments) -> Result<FileUnits, Error> {
    let SceneArguments { scale, up, .. } = arguments;
    if !(1e-6..=1e6).contains(scale) {
        return Err(Error::key("--scale", scale, "out of range; use 1e-6 to 1e6"));
    }
    let up = match up.as_str() {
        "y" => UpAxis::Y,
        "z" => UpAxis::Z,
        other => return Err(Error::key("--up", other, "not known; use y or z")),
    };
    Ok(FileUnits { metres: *scale, up })
}

/// The scene of a file, and the file's own name.
fn read(file: &Path, units: &FileUnits) -> Result<(String, Scene), Error> {
    let folder = file.parent().map_or_else(PathBuf::new, Path::to_owned);
    let Some(name) = file.file_name().and_then(|name| name.to_str()) else {
        return Err(Error::key("FILE", file.display(), "names no file; use a .glb or .gltf"));
    };
    if !is_there(file) {
        return Err(Error::key("FILE", file.display(), "is not there; name a .glb or .gltf file"));
    }
    let files = InputFolders::new(vec![folder]);
    let bytes = files.read(name)?;
    let scene = Scene::from_gltf_in(name, &bytes, units, &Surroundings::default(), &|other| files.read(other))?;
    Ok((name.to_owned(), scene))
}

impl FileSummary {
    fn of(name: String, scene: Scene, units: FileUnits) -> Self {
        let (extent, views) = (SceneBox::of(&scene), views::best(&scene, VIEWS));
        let used: BTreeSet<u32> = scene.mesh.material_of.iter().copied().collect();
        let shining = |(number, material): &(u32, &Material)| material.is_emissive() && used.contains(number);
        let name_of = |(number, material): (u32, &Material)| match material.name.as_str() {
            "" => format!("material {number}"),
            name => name.to_owned(),
        };
        let distant = scene.mesh.distant.iter().map(|_| "directional".to_owned());
        let lamps = (0..).zip(&scene.mesh.materials).filter(shining).map(name_of).chain(distant).collect();
        let light = views.first().map_or(Light::Own, |view| light_for(&scene, &extent, view));
        Self { name, scene, units, extent, views, lamps, light }
    }

    /// Numbers of the materials that a triangle has, with how many have each.
    fn materials(&self) -> BTreeMap<u32, usize> {
        let mut used = BTreeMap::new();
        for &material in &self.scene.mesh.material_of {
            *used.entry(material).or_insert(0) += 1;
        }
        used
    }

    fn is_unusual(&self) -> bool {
        let largest_m = self.extent.size_m().max_element();
        !(USUAL_M[0]..=USUAL_M[1]).contains(&largest_m)
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.is_unusual() {
            let largest_m = self.extent.size_m().max_element();
            let scale = self.units.metres * if largest_m > 1.0 { 0.01 } else { 10.0 };
            warnings.push(format!(
                "{} is {} across if its units are metres; if they are not, use --scale, such as --scale {scale}",
                self.name,
                length(largest_m)
            ));
        }
        let viewpoints = self.scene.viewpoints.len();
        let own = self.views.iter().filter(|view| view.name != "found").count();
        if own < viewpoints.min(VIEWS) {
            warnings.push(format!(
                "{} of its {viewpoints} cameras see hardly any surface, or stand inside one",
                viewpoints.min(VIEWS) - own
            ));
        }
        warnings
    }

    fn print(&self) {
        let size_m = self.extent.size_m();
        let mesh = &self.scene.mesh;
        let (materials, textures) = (self.materials().len(), mesh.textures.len());
        outln!("{}", self.name);
        let [width, height, depth] = size_m.to_array().map(length);
        outln!("  extent        {width} x {height} x {depth} (width, height, depth)");
        outln!("  triangles     {}, of {materials} materials with {textures} textures", mesh.triangles.len());
        let lamps = if self.lamps.is_empty() { "none".to_owned() } else { self.lamps.join(", ") };
        outln!("  lights        {lamps}");
        let cameras: Vec<&str> = self.scene.viewpoints.iter().map(|view| view.name.as_str()).collect();
        outln!("  cameras       {}", if cameras.is_empty() { "none".to_owned() } else { cameras.join(", ") });
        let moving: Vec<&str> = self.scene.moving.iter().map(|part| part.name.as_str()).collect();
        if !moving.is_empty() {
            outln!("  moves         {} (not counted above)", moving.join(", "));
        }
        for note in &self.scene.notes {
            outln!("  note          {note}");
        }
        match self.views.first() {
            None => outln!("  view          none: no camera that was tried sees a surface"),
            Some(view) => {
                let [x_m, y_m, z_m] = view.world_from_camera.translation_m.to_array();
                let (percent, fov_deg) = (100.0 * view.covered, view.horizontal_fov_rad.to_degrees());
                outln!(
                    "  view          {} from ({x_m:.2}, {y_m:.2}, {z_m:.2}) m: surfaces fill {percent:.0} % of a picture of \
                     {fov_deg:.0} degrees, the nearest at {}",
                    view.name,
                    length(view.nearest_m)
                );
            }
        }
    }

    fn as_json(&self) -> serde_json::Value {
        let mesh = &self.scene.mesh;
        let material = |(number, triangles): (u32, usize)| {
            let material = &mesh.materials[index(number)];
            json!({
                "name": material.name, "triangles": triangles, "double_sided": material.double_sided,
                "has_texture": material.texture.is_some(), "is_emissive": material.is_emissive(),
                "metallic": material.metallic, "roughness": material.roughness,
            })
        };
        let view = |view: &CameraView| {
            json!({
                "name": view.name,
                "position_m": view.world_from_camera.translation_m.to_array(),
                "world_from_camera_xyzw": view.world_from_camera.rotation.to_array(),
                "horizontal_fov_deg": view.horizontal_fov_rad.to_degrees(),
                "covered": view.covered, "behind_surfaces": view.behind,
                "nearest_m": view.nearest_m, "median_m": view.median_m,
            })
        };
        json!({
            "file": self.name,
            "extent_m": {"least": self.extent.least_m.to_array(), "greatest": self.extent.greatest_m.to_array()},
            "triangles": mesh.triangles.len(),
            "textures": mesh.textures.len(),
            "materials": self.materials().into_iter().map(material).collect::<Vec<_>>(),
            "lights": self.lamps,
            "cameras": self.scene.viewpoints.iter().map(|camera| camera.name.clone()).collect::<Vec<_>>(),
            "moving": self.scene.moving.iter().map(|part| json!({
                "name": part.name,
                "triangles": part.shape.mesh.triangles.len(),
                "length_s": part.chain.length_s,
            })).collect::<Vec<_>>(),
            "views": self.views.iter().map(view).collect::<Vec<_>>(),
            "notes": self.scene.notes,
            "warnings": self.warnings(),
        })
    }
}

/// What lights a view. A file's lamps are meant to light its scene; materials that glow may only look as if they did, so that under an open
/// sky they are not enough.
fn light_for(scene: &Scene, extent: &SceneBox, view: &CameraView) -> Light {
    let at_m = view.world_from_camera.translation_m;
    let up = Pose::new(views::looking(0.0, 0.5 * std::f64::consts::PI), at_m);
    let overhead = views::judged(scene, extent, "overhead", up, views::FOV_RAD);
    let has_lamps =
        !scene.mesh.distant.is_empty() || scene.mesh.materials.iter().any(|material| material.bulb.is_some());
    let is_lit = scene.direct_light_at(at_m) > 0.0;
    match 1.0 - overhead.covered - overhead.behind > OPEN_MIN {
        _ if has_lamps && is_lit => Light::Own,
        true => Light::Sky,
        false if is_lit => Light::Own,
        false => Light::Lamp { above_m: 0.5 * overhead.nearest_m.min(extent.size_m().length()) },
    }
}

/// Share of the upper view that meets nothing, from which on a position is in the open.
const OPEN_MIN: f64 = 0.05;

/// A length in the unit that a person would use.
fn length(value_m: f64) -> String {
    match value_m {
        value_m if !value_m.is_finite() => "nothing".to_owned(),
        value_m if value_m < 0.01 => format!("{:.2} mm", 1e3 * value_m),
        value_m if value_m < 1.0 => format!("{:.1} cm", 1e2 * value_m),
        value_m if value_m < 1e4 => format!("{value_m:.2} m"),
        value_m => format!("{:.1} km", 1e-3 * value_m),
    }
}
