//! Pictures of a glTF file: textures, holes and maps of its materials, each decoded once.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;

use super::super::cut_out::CutOut;
use super::super::light::{BANDS, with_infrared};
use super::super::maps::Maps;
use super::super::mesh::{Material, Mesh, pushed};
use super::super::source::Read;
use super::super::texture::picture::{Budget, TexturePicture};
use super::super::texture::{Texture, Wrap};
use super::buffers::{Buffers, fetched};
use super::content::Notes;
use super::placing::Placing;
use crate::num::{index, low_u8, u32_truncated_f32};

/// What alpha of a picture means.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Alpha {
    Ignored,
    /// Less of it is a hole.
    Least(f32),
    /// Times this, the share that is covered.
    Share(f32),
}

impl Alpha {
    fn of(material: &gltf::Material<'_>) -> Self {
        let alpha = share(material.pbr_metallic_roughness().base_color_factor()[3]);
        match material.alpha_mode() {
            AlphaMode::Opaque => Self::Ignored,
            // What the factor takes from coverage, the cutoff must take as well.
            AlphaMode::Mask => {
                let cutoff = material.alpha_cutoff().unwrap_or(0.5);
                Self::Least(if alpha > 0.0 { cutoff / alpha } else { 0.0 })
            }
            AlphaMode::Blend => Self::Share(alpha),
        }
    }

    fn key(self) -> (u8, u32) {
        match self {
            Self::Ignored => (0, 0),
            Self::Least(least) => (1, least.to_bits()),
            Self::Share(alpha) => (2, alpha.to_bits()),
        }
    }

    /// Whether anything is not wholly covered, and, if so, the holes.
    fn holes(self, [width, height]: [u32; 2], coverage: Vec<u8>, wrap: [Wrap; 2]) -> Option<CutOut> {
        let is_whole = coverage.iter().all(|&alpha| alpha == u8::MAX);
        match self {
            Self::Least(least) if !is_whole => Some(CutOut::new(width, height, coverage, wrap, least)),
            Self::Share(alpha) if !is_whole || alpha < 1.0 => {
                Some(CutOut::blended(width, height, coverage, wrap, alpha))
            }
            _ => None,
        }
    }
}

/// A material's name for messages.
pub fn called(material: &gltf::Material<'_>) -> String {
    match (material.name(), material.index()) {
        (Some(name), _) => format!("material '{name}'"),
        (None, Some(number)) => format!("material {number}"),
        (None, None) => "the default material".to_owned(),
    }
}

/// A number brought into its range, from 0; 0 for one that is not finite.
pub fn sound(value: f32, most: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, most) } else { 0.0 }
}

/// A share brought into 0 to 1; 1 for one that is not finite.
pub fn share(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, 1.0) } else { 1.0 }
}

fn wrapping(texture: &gltf::Texture<'_>) -> [Wrap; 2] {
    let sampler = texture.sampler();
    [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    })
}

fn of_image(texture: &gltf::Texture<'_>, reason: &str) -> String {
    format!("image {}: {reason}", texture.source().index())
}

/// Decodes pictures once for each texture and level of holes.
pub struct Pictures<'a, 'b> {
    buffers: &'a Buffers<'b>,
    read: Read<'a>,
    budget: Budget,
    /// Texture and holes in the mesh, by texture of the file and what its alpha means.
    textures: BTreeMap<(usize, (u8, u32)), (u32, Option<u32>)>,
    /// Texture in the mesh and the mean of its texels, by texture of the file and kind of map; none where there was no room for it.
    maps: BTreeMap<(usize, MapKind), Option<(u32, [f32; 3])>>,
}

/// What a map's texels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MapKind {
    Colours,
    Values,
}

impl<'a, 'b> Pictures<'a, 'b> {
    pub fn new(buffers: &'a Buffers<'b>, read: Read<'a>) -> Self {
        Self { buffers, read, budget: Budget::default(), textures: BTreeMap::new(), maps: BTreeMap::new() }
    }

    pub fn dress(
        &mut self,
        material: &gltf::Material<'_>,
        read: &mut Material,
        mesh: &mut Mesh,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let pbr = material.pbr_metallic_roughness();
        if let Some(info) = pbr.base_color_texture() {
            let (texture, cut_out) = self.texture(&info.texture(), Alpha::of(material), mesh)?;
            (read.texture, read.cut_out) = (Some(texture), cut_out);
        } else if let Some(holes) = Alpha::of(material).holes([1, 1], vec![u8::MAX], [Wrap::Repeat; 2]) {
            read.cut_out = Some(pushed(&mut mesh.cut_outs, holes));
        }
        if read.cut_out.is_some() && material.alpha_mode() == AlphaMode::Blend {
            notes.add(format!("{} is blended: it stops as large a share of rays as its alpha says", called(material)));
        }
        Ok(())
    }

    /// Makes a material that transmits light a thin pane, and says so. Its colour takes as much of all bands as of white light.
    fn make_pane(
        &mut self,
        material: &gltf::Material<'_>,
        read: &mut Material,
        mesh: &mut Mesh,
    ) -> Result<Option<String>, String> {
        let Some(transmission) = material.transmission().filter(|_| read.cut_out.is_none()) else { return Ok(None) };
        let (tint, clear) = (read.pane_tint(), sound(transmission.transmission_factor(), 1.0) * (1.0 - read.metallic));
        if clear * tint <= 0.0 {
            return Ok(None);
        }
        let mut said = format!("{} is a thin pane, which does not bend light", called(material));
        let (mut size, mut codes, mut wrap, mut mean) = ([1, 1], vec![u8::MAX], [Wrap::Repeat; 2], 1.0);
        if let Some(info) = transmission.transmission_texture() {
            let is_alike = Placing::of_texture(&info) == Placing::of_material(material);
            if is_alike && self.budget.has_room(&self.bytes(&info.texture())?) {
                let picture = self.decoded(&info.texture())?;
                (size, wrap, mean) = (picture.size_px, wrapping(&info.texture()), picture.mean_value()[0]);
                codes = picture.codes.iter().map(|code| code[0]).collect();
            } else {
                said += "; its texture of transmission is not read";
            }
        }
        let pane = CutOut::pane(size[0], size[1], codes, wrap, clear * tint);
        (read.cut_out, read.transmission) = (Some(pushed(&mut mesh.cut_outs, pane)), clear * mean);
        if read.base_colour[..3].iter().any(|&band| (band - tint).abs() > 0.02) {
            said += "; its tint dims all colours alike";
        }
        if read.roughness > 0.1 {
            said += "; it is not frosted";
        }
        Ok(Some(said))
    }

    /// Gives a material that was read its maps beside the base colour, and its transmission.
    pub fn add_maps(
        &mut self,
        material: &gltf::Material<'_>,
        number: usize,
        mesh: &mut Mesh,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let placing = Placing::of_material(material);
        let mut maps = Maps::default();
        let mut read = mesh.materials[number].clone();
        let mut left = Vec::new();
        let mut map = |texture: gltf::Texture<'_>, kind: MapKind, own: Placing, what: &'static str| {
            let found = if own == placing { self.map(&texture, kind, mesh)? } else { None };
            if found.is_none() {
                left.push(what);
            }
            Ok::<_, String>(found)
        };
        if let Some(info) = material.normal_texture()
            && let Some((texture, _)) = map(info.texture(), MapKind::Values, Placing::of_normals(&info), "normal")?
        {
            maps.normal = Some((texture, sound(info.scale().abs(), 100.0) * info.scale().signum()));
        }
        if let Some(info) = material.pbr_metallic_roughness().metallic_roughness_texture() {
            let (own, what) = (Placing::of_texture(&info), "metallic-roughness (its factors count)");
            if let Some((texture, [_, roughness, metallic])) = map(info.texture(), MapKind::Values, own, what)? {
                maps.roughness_metallic = Some((texture, [read.roughness, read.metallic]));
                (read.roughness, read.metallic) = (read.roughness * roughness, read.metallic * metallic);
            }
        }
        if let Some(info) = material.emissive_texture().filter(|_| read.is_emissive()) {
            let (own, what) = (Placing::of_texture(&info), "emissive (its factor counts)");
            if let Some((texture, mean)) = map(info.texture(), MapKind::Colours, own, what)? {
                maps.emission = Some((texture, read.emission));
                (0..BANDS).for_each(|band| read.emission[band] *= with_infrared(mean)[band]);
            }
        }
        if !left.is_empty() {
            notes.add(format!(
                "{}: not read, because their texture coordinates differ from those of its base colour or too many pictures came \
                 before, are its textures: {}",
                called(material),
                left.join(", ")
            ));
        }
        if maps != Maps::default() && read.texture.is_none() {
            let sizes = maps.textures_mut().map(|texture| mesh.textures[index(*texture)].size());
            let [width, height] = sizes.fold([1.0_f32; 2], |most, size| [0, 1].map(|axis| most[axis].max(size[axis])));
            let white = Texture::white(u32_truncated_f32(width), u32_truncated_f32(height));
            read.texture = Some(pushed(&mut mesh.textures, white));
        }
        read.maps = maps;
        // By the mean of its metallic map: no light passes metal.
        if let Some(said) = self.make_pane(material, &mut read, mesh)? {
            notes.add(said);
        }
        mesh.materials[number] = read;
        Ok(())
    }

    /// A texture of the mesh for a map, and the mean of its texels; none for one that there is no room for.
    fn map(
        &mut self,
        texture: &gltf::Texture<'_>,
        kind: MapKind,
        mesh: &mut Mesh,
    ) -> Result<Option<(u32, [f32; 3])>, String> {
        let key = (texture.index(), kind);
        if let Some(&known) = self.maps.get(&key) {
            return Ok(known);
        }
        let bytes = self.bytes(texture)?;
        if !self.budget.has_room(&bytes) {
            self.maps.insert(key, None);
            return Ok(None);
        }
        let picture = self.decoded(texture)?;
        let (texture, mean) = match kind {
            MapKind::Colours => (picture.texture(wrapping(texture)), picture.mean()),
            MapKind::Values => (picture.values(wrapping(texture)), picture.mean_value()),
        };
        let made = Some((pushed(&mut mesh.textures, texture), mean));
        self.maps.insert(key, made);
        Ok(made)
    }

    fn texture(
        &mut self,
        texture: &gltf::Texture<'_>,
        alpha: Alpha,
        mesh: &mut Mesh,
    ) -> Result<(u32, Option<u32>), String> {
        let key = (texture.index(), alpha.key());
        if let Some(&known) = self.textures.get(&key) {
            return Ok(known);
        }
        let wrap = wrapping(texture);
        let mut picture = self.decoded(texture)?;
        let least = match alpha {
            Alpha::Least(least) => low_u8(u32_truncated_f32((255.0 * least).clamp(0.0, 255.0))),
            _ => 0,
        };
        let holes = alpha.holes(picture.size_px, picture.alpha.clone(), wrap);
        if holes.is_some() {
            picture = picture.bled(least.max(1));
        }
        let cut_out = holes.map(|holes| pushed(&mut mesh.cut_outs, holes));
        let made = (pushed(&mut mesh.textures, picture.texture(wrap)), cut_out);
        self.textures.insert(key, made);
        Ok(made)
    }

    fn decoded(&mut self, texture: &gltf::Texture<'_>) -> Result<TexturePicture, String> {
        let bytes = self.bytes(texture)?;
        TexturePicture::decoded(&bytes, &mut self.budget).map_err(|reason| of_image(texture, &reason))
    }

    fn bytes(&self, texture: &gltf::Texture<'_>) -> Result<Cow<'a, [u8]>, String> {
        let buffers = self.buffers;
        match texture.source().source() {
            Source::View { view, .. } => buffers.view(&view).map(Cow::Borrowed),
            Source::Uri { uri, .. } => fetched(uri, self.read).map(Cow::from),
        }
        .map_err(|reason| of_image(texture, &reason))
    }
}
