//! Parses the words of `--keep` and maps them to kinds of output and their folders.

use crate::error::Error;
use crate::text::named;

named! {
    /// A stage's output or a kind of ground truth.
    pub enum KeptOutput {
        /// Packets as they leave the link, back to back.
        Packets = "packets",
        /// Mean photons of each pixel behind its filter.
        Photons = "photons",
        /// Electrons of each pixel before conversion.
        Electrons = "electrons",
        /// Codes as they leave the readout.
        Codes = "codes",
        /// Features that the sensor sends; where it sends pictures alone, those of the host's extractor.
        Features = "features",
        /// Photons of each band at every pixel, before its filter.
        Colour = "colour",
        /// Pose of the camera at each row.
        Poses = "poses",
        /// Depth along the axis, and range.
        Depth = "depth",
        /// Normals of the surfaces.
        Normals = "normals",
        /// Materials of the surfaces.
        Materials = "materials",
        /// Number of the moving object from 1 in the order of the scenario, 0 for the static scene.
        Objects = "objects",
        /// Displacement to the next frame.
        Flow = "flow",
        /// What becomes of each point in the next frame.
        Visibility = "visibility",
        /// Displacement to the other camera, and what becomes of each point there.
        Stereo = "stereo",
        /// A folder as the TUM RGB-D benchmark's.
        Tum = "tum",
        /// The tracker's map as it stands at the end: landmarks and keyframes.
        Map = "map",
    }
}

impl KeptOutput {
    /// Folders that it fills in a run of so many cameras, relative to the run's.
    pub(super) fn folders(self, cameras: usize) -> Vec<String> {
        let name = self.name();
        match self {
            Self::Packets | Self::Tum | Self::Map => Vec::new(),
            Self::Stereo => {
                let others = 1..cameras;
                others.flat_map(|other| [pair(0, other), pair(other, 0)]).map(|pair| format!("{name}/{pair}")).collect()
            }
            _ => (0..cameras).map(|camera| format!("{name}/cam{camera}")).collect(),
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
pub struct Keep(Vec<KeptOutput>);

impl Keep {
    /// Reads the words of `--keep`. Fails on a word that names nothing that can be kept.
    pub fn parse(words: &[String]) -> Result<Self, Error> {
        let kept = |word: &String| {
            KeptOutput::ALL.into_iter().find(|kept| kept.name() == word).ok_or_else(|| {
                let known = KeptOutput::ALL.map(KeptOutput::name).join(", ");
                Error::Unknown { what: "stage to keep", name: word.clone(), known }
            })
        };
        Ok(Self(words.iter().map(kept).collect::<Result<_, _>>()?))
    }

    /// Whether a run with so many cameras can keep it. Fails on another camera's view where there is none.
    pub fn check(&self, cameras: usize) -> Result<(), Error> {
        if cameras < 2 && self.has(KeptOutput::Stereo) {
            let known = KeptOutput::ALL.into_iter().filter(|kept| *kept != KeptOutput::Stereo).map(KeptOutput::name);
            let (name, known) = ("stereo".to_owned(), known.collect::<Vec<_>>().join(", "));
            return Err(Error::Unknown { what: "stage to keep of one camera", name, known });
        }
        Ok(())
    }

    /// Whether a run on pictures can keep it: they have no surfaces, only depth at best. Fails on kinds of output that need geometry.
    pub(super) fn check_for_pictures(&self, has_depth: bool) -> Result<(), Error> {
        let missing = |kept: &KeptOutput| match kept {
            KeptOutput::Depth => !has_depth,
            other => other.needs_surfaces() || *other == KeptOutput::Tum,
        };
        let Some(kept) = self.all().find(missing) else { return Ok(()) };
        let reason = match kept {
            KeptOutput::Depth => {
                "the pictures that the scene is made of have no depth; use channel Z, or scene.images_depth"
            }
            _ => "pictures have no surfaces; use a scene with geometry",
        };
        Err(Error::key("--keep", kept.name(), reason))
    }

    /// Whether a kind is kept.
    pub fn has(&self, kept: KeptOutput) -> bool {
        self.0.contains(&kept)
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Every kind that is kept, once.
    pub fn all(&self) -> impl Iterator<Item = KeptOutput> + '_ {
        KeptOutput::ALL.into_iter().filter(|kept| self.has(*kept))
    }

    pub(super) fn needs_surfaces(&self) -> bool {
        self.0.iter().any(|kept| kept.needs_surfaces())
    }
}
