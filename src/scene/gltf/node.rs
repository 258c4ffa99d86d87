//! Reads the nodes of a checked glTF file: triangles in the world, cameras, and lights as lamps.

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::camera::Projection;
use gltf::material::AlphaMode;
use gltf::mesh::Mode;
use gltf::scene::Transform;
use gltf::{Node, Primitive, Semantic};

use super::super::animation::{Joint, JointChain};
use super::super::geometry::Viewpoint;
use super::super::light::{Bands, with_infrared};
use super::super::mesh::{Material, Mesh, Vertex, pushed};
use super::animation::Tracks;
use super::buffers::Buffers;
use super::container::Container;
use super::content::{Content, MovingPart, Notes};
use super::material::MaterialMapping;
use super::pictures::{called, share};
pub use super::reader::{NodeTransform, Part, Reader};
use crate::num::{f32_nearest, index, u32_from};
use crate::pose::Pose;

const DEPTH_MAX: usize = 64;

/// Most triangles, and thirds of vertices, of a scene, so that a small file that names one mesh a million times ends with an error before
/// it takes a gigabyte.
pub(super) const TRIANGLES_MAX: usize = 3_000_000;

impl<'a> Reader<'a> {
    /// Starts with the materials that were read before.
    pub fn new(
        container: &'a Container<'a>,
        buffers: &'a Buffers<'a>,
        kinds: Vec<MaterialMapping>,
        mesh: Mesh,
        tracks: Tracks,
        notes: Notes,
    ) -> Self {
        let met = vec![false; container.document.nodes().len()];
        let (viewpoints, parts) = (Vec::new(), Vec::new());
        Self { container, buffers, kinds, mesh, viewpoints, notes, met, flattened: 0, tracks, parts }
    }

    pub fn content(mut self) -> Content {
        if self.flattened > 0 {
            self.notes.add(format!("{} triangles without area are left out", self.flattened));
        }
        let ranges: Vec<_> = self.parts.iter().map(|part| part.triangles.as_slice()).collect();
        let meshes = self.mesh.split_off(&ranges);
        let parts = self.parts.into_iter().zip(meshes).filter(|(_, mesh)| !mesh.triangles.is_empty());
        let moving = parts.map(|(Part { name, chain, .. }, mesh)| MovingPart { name, chain, mesh }).collect();
        Content { mesh: self.mesh, moving, viewpoints: self.viewpoints, notes: self.notes.0 }
    }

    pub fn node(&mut self, node: &Node<'_>, parent: &NodeTransform, depth: usize) -> Result<(), String> {
        if depth > DEPTH_MAX {
            return Err(format!("its nodes are nested deeper than {DEPTH_MAX}"));
        }
        if std::mem::replace(&mut self.met[node.index()], true) {
            return Err(format!("node {} is in a cycle or has two parents; use a tree", node.index()));
        }
        let transform = self.node_transform(node, parent);
        let NodeTransform { world_from_node, part_from_node, part } = transform;
        if !world_from_node.is_finite() {
            return Err(format!("node {} has a transform that is not finite", node.index()));
        }
        if let Some(mesh) = node.mesh() {
            let name = node.name().or(mesh.name());
            let name = name.map_or_else(|| format!("node {}", node.index()), |name| format!("'{name}'"));
            if node.skin().is_some() {
                self.notes.add(format!("{name}: its skin is not read; it stands as its mesh was made"));
            }
            if mesh.primitives().any(|primitive| primitive.morph_targets().len() > 0) {
                self.notes.add(format!("{name}: its morph targets are not read"));
            }
            let instances = self.instances(node, &mesh)?;
            let before = self.mesh.triangles.len();
            for part_from_instance in
                instances.into_iter().map(|node_from_instance| part_from_node * node_from_instance)
            {
                for primitive in mesh.primitives() {
                    let whose = format!("mesh {} primitive {}", mesh.index(), primitive.index());
                    self.primitive(&primitive, part_from_instance).map_err(|reason| format!("{whose}: {reason}"))?;
                }
            }
            if let Some(part) = part {
                self.parts[part].triangles.push(before..self.mesh.triangles.len());
            }
        }
        if let Some(camera) = node.camera() {
            let name = node.name().unwrap_or("camera").to_owned();
            let horizontal_fov_rad = horizontal_fov_rad(&camera.projection());
            if horizontal_fov_rad.is_none() {
                self.notes.add(format!("camera '{name}' has no perspective, and is given one"));
            }
            if part.is_some() {
                self.notes.add(format!("camera '{name}' stays where it is without its animation"));
            }
            self.viewpoints.extend(viewpoint(name, world_from_node, horizontal_fov_rad));
        }
        if let Some(light) = node.light() {
            if part.is_some() {
                self.notes.add("lights that an animation moves stay where they are without it");
            }
            self.judge_light()?;
            super::lights::append(self, &light, world_from_node)?;
        }
        for child in node.children() {
            self.node(&child, &transform, depth + 1)?;
        }
        Ok(())
    }

    /// The transform of a node. One that the animation moves begins a new part.
    fn node_transform(&mut self, node: &Node<'_>, parent: &NodeTransform) -> NodeTransform {
        let parent_from_node = self.parent_from_node(node);
        let Some(tracks) = self.tracks.get(&node.index()).cloned() else { return parent.child(parent_from_node) };
        let name = node.name().map_or_else(|| format!("node {}", node.index()), str::to_owned);
        // An animated node has no matrix (glTF 2.0, 3.11), and what scales it unequally cannot be moved rigidly.
        let parts = (rigid(parent.part_from_node), node.transform());
        let (Some((pose, scale)), Transform::Decomposed { translation, rotation, scale: own }) = parts else {
            let reason = "what it hangs on is mirrored or scaled unequally, or it has a matrix";
            self.notes.add(format!("'{name}' stands still: {reason}"));
            return parent.child(parent_from_node);
        };
        let turn = self.unit_turn(rotation, || format!("node {}", node.index()));
        let translation_m = tracks.translation.map(|track| track.scaled(scale));
        let rest = Pose::new(turn, wide(translation) * scale);
        let joint = Joint { rest, translation: translation_m, rotation: tracks.rotation };
        let above = parent.part.map_or_else(JointChain::default, |part| self.parts[part].chain.clone());
        let chain = above.with(Joint::fixed(pose)).with(joint);
        self.parts.push(Part { name, chain, triangles: Vec::new() });
        let part_from_node = DMat4::from_scale(wide(own) * scale);
        NodeTransform { part_from_node, part: Some(self.parts.len() - 1), ..parent.child(parent_from_node) }
    }

    /// A node's own transform; a rotation that is no unit quaternion is made one.
    fn parent_from_node(&mut self, node: &Node<'_>) -> DMat4 {
        match node.transform() {
            Transform::Matrix { matrix } => DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))),
            Transform::Decomposed { translation, rotation, scale } => {
                let turn = self.unit_turn(rotation, || format!("node {}", node.index()));
                DMat4::from_scale_rotation_translation(wide(scale), turn, wide(translation))
            }
        }
    }

    /// A rotation as a unit quaternion. Numbers that are not finite stay, and are refused with the transform that they make.
    fn unit_turn(&mut self, rotation: [f32; 4], whose: impl Fn() -> String) -> DQuat {
        let turn = DQuat::from_array(rotation.map(f64::from));
        let length = turn.length();
        // Within rounding of f32 it is one already, and is left as it is.
        if !length.is_finite() || (length - 1.0).abs() < 1e-6 {
            return turn;
        }
        if (length - 1.0).abs() > 1e-3 {
            self.notes.add(format!("{}: its rotation is not a unit quaternion and is normalised", whose()));
        }
        if length > 1e-12 { turn / length } else { DQuat::IDENTITY }
    }

    /// Transforms of a node's mesh within the node: one, or as many as EXT_mesh_gpu_instancing lists.
    fn instances(&mut self, node: &Node<'_>, mesh: &gltf::Mesh<'_>) -> Result<Vec<DMat4>, String> {
        let Some(attributes) = self.container.instancing.get(node.index()).and_then(Option::as_ref) else {
            self.judge(mesh, 1)?;
            return Ok(vec![DMat4::IDENTITY]);
        };
        let refuse = |reason: String| format!("node {}: {reason}", node.index());
        let accessor = |name: &str| {
            let Some(&number) = attributes.get(name) else { return Ok(None) };
            let found = self.container.document.accessors().nth(number);
            found.map(Some).ok_or_else(|| refuse(format!("{name} names accessor {number}, which is not there")))
        };
        let [moves, turns, scales] = [accessor("TRANSLATION")?, accessor("ROTATION")?, accessor("SCALE")?];
        let count = [&moves, &turns, &scales].into_iter().flatten().map(gltf::Accessor::count).min().unwrap_or(0);
        self.judge(mesh, count)?;
        let moves = moves.map(|a| self.buffers.floats::<3>(&a)).transpose().map_err(refuse)?;
        let turns = turns.map(|a| self.buffers.floats::<4>(&a)).transpose().map_err(refuse)?;
        let scales = scales.map(|a| self.buffers.floats::<3>(&a)).transpose().map_err(refuse)?;
        let mut transforms = Vec::with_capacity(count);
        for number in 0..count {
            let turn = turns.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |turns| turns[number]);
            let turn = self.unit_turn(turn, || format!("an instance of node {}", node.index()));
            let scale = scales.as_ref().map_or(DVec3::ONE, |scales| wide(scales[number]));
            let translation = moves.as_ref().map_or(DVec3::ZERO, |moves| wide(moves[number]));
            let node_from_instance = DMat4::from_scale_rotation_translation(scale, turn, translation);
            if !node_from_instance.is_finite() {
                return Err(refuse(format!("instance {number} has a transform that is not finite")));
            }
            transforms.push(node_from_instance);
        }
        Ok(transforms)
    }

    /// Refuses what would make the scene too large, before anything of it is made.
    fn judge(&self, mesh: &gltf::Mesh<'_>, instances: usize) -> Result<(), String> {
        let size = |primitive: Primitive<'_>| {
            let vertices = primitive.get(&Semantic::Positions).map_or(0, |a| a.count());
            primitive.indices().map_or(vertices, |a| a.count()).max(vertices) / 3
        };
        let each = mesh.primitives().map(size).fold(0, usize::saturating_add);
        // Each instance takes memory, even that of an empty mesh.
        if each.max(1).saturating_mul(instances).saturating_add(self.size()) > TRIANGLES_MAX {
            let whose = format!("mesh {}, {instances} times", mesh.index());
            return Err(format!("{whose}: the scene has more than {TRIANGLES_MAX} triangles"));
        }
        Ok(())
    }

    /// Triangles, or thirds of vertices, so far.
    fn size(&self) -> usize {
        self.mesh.triangles.len().max(self.mesh.vertices.len() / 3)
    }

    /// Refuses one light more where the scene is full.
    fn judge_light(&self) -> Result<(), String> {
        if self.size() > TRIANGLES_MAX {
            return Err(format!("its lights and meshes have more than {TRIANGLES_MAX} triangles"));
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, world_from_node: DMat4) -> Result<(), String> {
        let number = primitive.material().index().unwrap_or(self.kinds.len() - 1);
        let kind = self.kinds[number];
        if kind.is_clear {
            let whose = called(&primitive.material());
            self.notes.add(format!("{whose} is transparent and left out: light passes"));
            return Ok(());
        }
        if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.notes.add("points and lines are left out");
            return Ok(());
        }
        let positions = primitive.get(&Semantic::Positions).ok_or("it has no positions")?;
        let positions = self.buffers.floats::<3>(&positions)?;
        let triangles = self.triangles(primitive, positions.len())?;
        let normals = primitive.get(&Semantic::Normals).map(|a| self.buffers.floats::<3>(&a)).transpose()?;
        let uvs = primitive.get(&Semantic::TexCoords(kind.placing.set));
        let uvs = uvs.map(|a| self.buffers.floats::<2>(&a)).transpose()?;
        let (material, colours) = (u32_from(number), self.colours(primitive)?);
        if colours.as_ref().is_some_and(|colours| colours.len() != positions.len()) {
            return Err(format!("it has {} positions and {} colours", positions.len(), colours.map_or(0, |c| c.len())));
        }
        let turned = DMat3::from_mat4(world_from_node);
        // Cofactors turn normals and exist where the inverse does not; of a mirrored node they point inwards, and glTF's front
        // stays the front.
        let [x, y, z] = [turned.x_axis, turned.y_axis, turned.z_axis];
        let is_mirrored = turned.determinant() < 0.0;
        let outward = if is_mirrored { -1.0 } else { 1.0 };
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * outward;
        let narrow = |v: DVec3| v.to_array().map(f32_nearest);
        let vertex = |number: usize| {
            let normal = normals.as_ref().and_then(|normals| normals.get(number).copied()).unwrap_or([0.0; 3]);
            let uv = uvs.as_ref().and_then(|uvs| uvs.get(number).copied()).unwrap_or([0.0; 2]);
            let position_m = narrow(world_from_node.transform_point3(wide(positions[number])));
            Vertex { position_m, normal: narrow(cofactors * wide(normal)), uv: kind.placing.of(uv) }
        };
        let known: Vec<Vertex> = (0..positions.len()).map(vertex).collect();
        let has_normals = normals.is_some();
        drop((positions, normals, uvs));
        if has_normals {
            self.flattened += self.mesh.append(material, known, &triangles)?;
            colours.iter().for_each(|colours| self.mesh.colour_last(colours));
            return Ok(());
        }
        // glTF 2.0, 3.7.2.1: without normals every triangle is flat, so no corner may be shared.
        let corners = || triangles.iter().flatten().copied().map(index);
        if let Some(bad) = corners().find(|&corner| corner >= known.len()) {
            return Err(format!("a triangle names vertex {bad} of {}", known.len()));
        }
        let loose: Vec<Vertex> = corners().map(|corner| known[corner]).collect();
        drop(known);
        let turn = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let own: Vec<[u32; 3]> = (0..u32_from(triangles.len())).map(|at| turn.map(|corner| 3 * at + corner)).collect();
        self.flattened += self.mesh.append(material, loose, &own)?;
        if let Some(colours) = colours {
            self.mesh.colour_last(&corners().map(|corner| colours[corner]).collect::<Vec<_>>());
        }
        Ok(())
    }

    /// Corners of a primitive's triangles: a list, a strip or a fan.
    fn triangles(&self, primitive: &Primitive<'_>, vertices: usize) -> Result<Vec<[u32; 3]>, String> {
        let indices = match primitive.indices() {
            Some(accessor) => self.buffers.indices(&accessor)?,
            None => (0..u32_from(vertices)).collect(),
        };
        Ok(match primitive.mode() {
            Mode::TriangleStrip => {
                let corners = |(number, three): (usize, &[u32])| match number % 2 {
                    0 => [three[0], three[1], three[2]],
                    _ => [three[1], three[0], three[2]],
                };
                indices.windows(3).enumerate().map(corners).collect()
            }
            Mode::TriangleFan => {
                indices.get(1..).unwrap_or(&[]).windows(2).map(|pair| [indices[0], pair[0], pair[1]]).collect()
            }
            _ => indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect(),
        })
    }

    /// Colours of a primitive's vertices, 0 to 1; none where they have no colours.
    fn colours(&mut self, primitive: &Primitive<'_>) -> Result<Option<Vec<Bands>>, String> {
        let Some(accessor) = primitive.get(&Semantic::Colors(0)) else { return Ok(None) };
        let colours: Vec<[f32; 4]> = if accessor.dimensions() == gltf::accessor::Dimensions::Vec4 {
            self.buffers.floats::<4>(&accessor)?
        } else {
            self.buffers.floats::<3>(&accessor)?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
        };
        if primitive.material().alpha_mode() != AlphaMode::Opaque && colours.iter().any(|colour| colour[3] < 1.0) {
            self.notes.add(format!("{}: alpha of vertex colours is not read", called(&primitive.material())));
        }
        Ok(Some(colours.into_iter().map(|[r, g, b, _]| with_infrared([r, g, b].map(share))).collect()))
    }

    /// Adds a material that the file does not have, or finds it among those added before.
    pub(super) fn push(&mut self, material: Material) -> u32 {
        let added = self.kinds.len()..self.mesh.materials.len();
        if let Some(same) = added.into_iter().rev().take(64).find(|&number| self.mesh.materials[number] == material) {
            return u32_from(same);
        }
        pushed(&mut self.mesh.materials, material)
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// A transform as a rotation, a translation and one scale; none where it is mirrored or scales unequally.
fn rigid(transform: DMat4) -> Option<(Pose, f64)> {
    let columns = DMat3::from_mat4(transform);
    let scale = columns.x_axis.length();
    let turn = columns * (1.0 / scale);
    let identity = turn.transpose() * turn;
    let is_rigid = (0..3).all(|column| {
        let expected = DMat3::IDENTITY.col(column);
        (identity.col(column) - expected).abs().max_element() < 1e-4
    });
    (scale > 1e-9 && is_rigid && turn.determinant() > 0.0)
        .then(|| (Pose::new(DQuat::from_mat3(&turn).normalize(), transform.w_axis.truncate()), scale))
}

/// glTF cameras look along -z with y up; ours look along +z with y down. None where the node's transform has no rotation.
fn viewpoint(name: String, world_from_node: DMat4, horizontal_fov_rad: Option<f64>) -> Option<Viewpoint> {
    let turned = DMat3::from_mat4(world_from_node);
    let z = -turned.z_axis.try_normalize()?;
    let x = (-turned.y_axis).cross(z).try_normalize()?;
    let rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize();
    let world_from_camera = Pose::new(rotation, world_from_node.w_axis.truncate());
    Some(Viewpoint { name, world_from_camera, horizontal_fov_rad })
}

/// Angle across of a perspective that a lens can have, 1 to 170 degrees; a file without an aspect ratio leaves it to the viewer: 4 to 3.
fn horizontal_fov_rad(projection: &Projection<'_>) -> Option<f64> {
    let Projection::Perspective(perspective) = projection else { return None };
    let aspect = f64::from(perspective.aspect_ratio().unwrap_or(4.0 / 3.0));
    let fov_rad = 2.0 * libm::atan(aspect * libm::tan(0.5 * f64::from(perspective.yfov())));
    (1.0..=170.0).contains(&fov_rad.to_degrees()).then_some(fov_rad)
}
