//! Presets that come with the program: sensors and lenses, each number with its source in the file.

use crate::error::Error;

/// The lowest layer.
pub const DEFAULTS: &str = include_str!("defaults.toml");

/// What a preset describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The `[sensor]` section.
    Sensor,
    /// The `[optics]` section.
    Lens,
}

/// A named layer.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// As a scenario names it.
    pub name: &'static str,
    /// What it describes.
    pub kind: Kind,
    /// One line for a person.
    pub summary: &'static str,
    /// TOML.
    pub text: &'static str,
}

/// All presets.
pub const ALL: &[Preset] = &[
    Preset {
        name: "paper_6t_vga",
        kind: Kind::Sensor,
        summary: "the paper's sensor: VGA, monochrome, global shutter 6T, 10 uV/e-, 10 bit, 30 fps",
        text: include_str!("presets/paper_6t_vga.toml"),
    },
    Preset {
        name: "pinhole_90",
        kind: Kind::Lens,
        summary: "ideal mapping, 90 degrees across, f/2",
        text: include_str!("presets/pinhole_90.toml"),
    },
    Preset {
        name: "radtan_90",
        kind: Kind::Lens,
        summary: "90 degrees across with the mild barrel distortion of a small wide-angle lens, f/2",
        text: include_str!("presets/radtan_90.toml"),
    },
];

/// The preset of that name.
///
/// # Errors
/// `Error::Unknown` with the names of all presets of the kind.
pub fn find(kind: Kind, name: &str) -> Result<&'static Preset, Error> {
    ALL.iter().find(|preset| preset.kind == kind && preset.name == name).ok_or_else(|| Error::Unknown {
        what: match kind {
            Kind::Sensor => "sensor preset",
            Kind::Lens => "lens preset",
        },
        name: name.to_owned(),
        known: names(kind).join(", "),
    })
}

/// Names of all presets of a kind, in the order of the list.
pub fn names(kind: Kind) -> Vec<&'static str> {
    ALL.iter().filter(|preset| preset.kind == kind).map(|preset| preset.name).collect()
}
