//! Reads the first animation of a glTF file: tracks of translation and rotation of the nodes that it moves.

use std::collections::BTreeMap;

use gltf::animation::{Channel, Property};

use super::super::animation::{Interpolation, Track};
use super::buffers::Buffers;
use super::content::Notes;

/// What moves a node in its parent, in the file's units.
#[derive(Clone, Debug, Default)]
pub struct NodeTracks {
    pub(super) translation: Option<Track<3>>,
    pub(super) rotation: Option<Track<4>>,
}

pub type Tracks = BTreeMap<usize, NodeTracks>;

/// Reads what the first animation moves rigidly, and notes what is left out. Fails on accessors that are not there or not what they
/// should be, keys that make no track.
pub fn read(document: &gltf::Document, buffers: &Buffers<'_>, notes: &mut Notes) -> Result<Tracks, String> {
    let mut tracks = Tracks::new();
    for animation in document.animations() {
        let name = animation.name().map_or_else(|| animation.index().to_string(), |name| format!("'{name}'"));
        if animation.index() > 0 {
            notes.add(format!("animation {name} is not read: the first one plays"));
            continue;
        }
        let mut left: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for channel in animation.channels() {
            let node = channel.target().node();
            let whose = node.name().map_or_else(|| format!("node {}", node.index()), |name| format!("'{name}'"));
            let refused = |reason: String| format!("animation {name}, {whose}: {reason}");
            match channel.target().property() {
                Property::Scale if is_constant(&channel, buffers) => {}
                Property::Scale => left.entry("scale").or_default().push(whose),
                Property::MorphTargetWeights => left.entry("morph weights").or_default().push(whose),
                Property::Translation => {
                    let track = track(&channel, buffers).map_err(refused)?;
                    tracks.entry(node.index()).or_default().translation = Some(track);
                }
                Property::Rotation => {
                    let track = track(&channel, buffers).map_err(refused)?;
                    tracks.entry(node.index()).or_default().rotation = Some(track);
                }
            }
        }
        for (what, nodes) in left {
            let more = if nodes.len() > 3 { format!(" and {} more", nodes.len() - 3) } else { String::new() };
            let named = nodes[..nodes.len().min(3)].join(", ");
            notes.add(format!("animation {name}: {what} not read of {named}{more}"));
        }
    }
    Ok(tracks)
}

/// Whether all keys of a scale are the node's own, within rounding.
fn is_constant(channel: &Channel<'_>, buffers: &Buffers<'_>) -> bool {
    let Ok(values) = buffers.floats::<3>(&channel.sampler().output()) else { return false };
    let (_, _, own) = channel.target().node().transform().decomposed();
    let is_own = |value: &[f32; 3]| value.iter().zip(&own).all(|(a, b)| (a - b).abs() <= 1e-4 * b.abs());
    channel.sampler().interpolation() != gltf::animation::Interpolation::CubicSpline && values.iter().all(is_own)
}

fn track<const N: usize>(channel: &Channel<'_>, buffers: &Buffers<'_>) -> Result<Track<N>, String> {
    let sampler = channel.sampler();
    let times_s = buffers.floats::<1>(&sampler.input())?.into_iter().map(|[t_s]| f64::from(t_s)).collect();
    let values = buffers.floats::<N>(&sampler.output())?.into_iter().map(|value| value.map(f64::from)).collect();
    let interpolation = match sampler.interpolation() {
        gltf::animation::Interpolation::Step => Interpolation::Step,
        gltf::animation::Interpolation::Linear => Interpolation::Linear,
        gltf::animation::Interpolation::CubicSpline => Interpolation::CubicSpline,
    };
    Track::new(times_s, values, interpolation)
}
