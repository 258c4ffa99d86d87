//! Parses the words of `--keep` and maps them to kinds of output and their folders.

use crate::error::Error;

/// A stage's output or a kind of ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// Packets as they leave the link, back to back.
    Packets,
    /// Mean photons of each pixel behind its filter.
    Photons,
    /// Electrons of each pixel before conversion.
    Electrons,
    /// Codes as they leave the readout.
    Codes,
    /// Features as they leave the extractor.
    Features,
    /// Photons of each band at every pixel, before its filter.
    Colour,
    /// Pose of the camera at each row.
    Poses,
    /// Depth along the axis, and range.
    Depth,
    /// Normals of the surfaces.
    Normals,
    /// Materials of the surfaces.
    Materials,
    /// Number of the moving object from 1 in the order of the scenario, 0 for what stands.
    Objects,
    /// Displacement to the next frame.
    Flow,
    /// What becomes of each point in the next frame.
    Visibility,
    /// Displacement to the other camera, and what becomes of each point there.
    Stereo,
    /// A folder as the TUM RGB-D benchmark's.
    Tum,
    /// The tracker's map as it stands at the end: landmarks and keyframes.
    Map,
}

/// All of them, as a user names them.
const NAMES: [(Kept, &str); 16] = [
    (Kept::Packets, "packets"),
    (Kept::Photons, "photons"),
    (Kept::Electrons, "electrons"),
    (Kept::Codes, "codes"),
    (Kept::Features, "features"),
    (Kept::Colour, "colour"),
    (Kept::Poses, "poses"),
    (Kept::Depth, "depth"),
    (Kept::Normals, "normals"),
    (Kept::Materials, "materials"),
    (Kept::Objects, "objects"),
    (Kept::Flow, "flow"),
    (Kept::Visibility, "visibility"),
    (Kept::Stereo, "stereo"),
    (Kept::Tum, "tum"),
    (Kept::Map, "map"),
];

impl Kept {
    /// As a user names it.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(kept, _)| *kept == self).map(|(_, name)| *name).expect("every kind has a name")
    }

    /// Folders that it fills in a run of so many cameras, relative to the run's.
    pub(super) fn folders(self, cameras: usize) -> Vec<String> {
        let name = self.name();
        match self {
            Self::Packets | Self::Tum | Self::Map => Vec::new(),
            Self::Stereo => {
                let others = 1..cameras;
                others.flat_map(|other| [pair(0, other), pair(other, 0)]).map(|pair| format!("{name}/{pair}")).collect()
            }
            Self::Photons
            | Self::Electrons
            | Self::Codes
            | Self::Features
            | Self::Colour
            | Self::Poses
            | Self::Depth
            | Self::Normals
            | Self::Materials
            | Self::Objects
            | Self::Flow
            | Self::Visibility => (0..cameras).map(|camera| format!("{name}/cam{camera}")).collect(),
        }
    }

    /// Whether it needs to know what each pixel sees.
    fn needs_surfaces(self) -> bool {
        [Self::Depth, Self::Normals, Self::Materials, Self::Objects, Self::Flow, Self::Visibility, Self::Stereo]
            .contains(&self)
    }
}

/// Folder of what one camera's points are in another.
pub(super) fn pair(from: usize, to: usize) -> String {
    format!("cam{from}_to_cam{to}")
}

/// What a run keeps.
#[derive(Clone, Debug, Default)]
pub struct Keep(Vec<Kept>);

impl Keep {
    /// Reads the words of `--keep`.
    ///
    /// # Errors
    /// A word that names nothing that can be kept.
    pub fn parse(words: &[String]) -> Result<Self, Error> {
        let kept = |word: &String| {
            NAMES.iter().find(|(_, name)| name == word).map(|(kept, _)| *kept).ok_or_else(|| {
                let known = NAMES.map(|(_, name)| name).join(", ");
                Error::Unknown { what: "stage to keep", name: word.clone(), known }
            })
        };
        Ok(Self(words.iter().map(kept).collect::<Result<_, _>>()?))
    }

    /// Whether a run with so many cameras can keep it.
    ///
    /// # Errors
    /// Another camera's view where there is none.
    pub fn check(&self, cameras: usize) -> Result<(), Error> {
        if cameras < 2 && self.has(Kept::Stereo) {
            let known = NAMES.iter().filter(|(kept, _)| *kept != Kept::Stereo).map(|(_, name)| *name);
            let (name, known) = ("stereo".to_owned(), known.collect::<Vec<_>>().join(", "));
            return Err(Error::Unknown { what: "stage to keep of one camera", name, known });
        }
        Ok(())
    }

    /// Whether a run on pictures can keep it: they have no surfaces, only depth at best.
    ///
    /// # Errors
    /// Kinds of output that need geometry.
    pub(super) fn check_for_pictures(&self, has_depth: bool) -> Result<(), Error> {
        let missing = |kept: &Kept| match kept {
            Kept::Depth => !has_depth,
            other => other.needs_surfaces() || *other == Kept::Tum,
        };
        let Some(kept) = self.all().find(missing) else { return Ok(()) };
        let reason = match kept {
            Kept::Depth => "the pictures that the scene is made of have no depth; use channel Z, or scene.images_depth",
            _ => "pictures have no surfaces; use a scene with geometry",
        };
        Err(Error::key("--keep", kept.name(), reason))
    }

    /// Whether a kind is kept.
    pub fn has(&self, kept: Kept) -> bool {
        self.0.contains(&kept)
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Every kind that is kept, once.
    pub fn all(&self) -> impl Iterator<Item = Kept> + '_ {
        NAMES.iter().map(|(kept, _)| *kept).filter(|kept| self.has(*kept))
    }

    pub(super) fn needs_surfaces(&self) -> bool {
        self.0.iter().any(|kept| kept.needs_surfaces())
    }
}
