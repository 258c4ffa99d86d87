//! Presets that come with the program: sensors and lenses, each number with its source in the file.

use crate::error::Error;

/// The lowest layer.
pub const DEFAULTS: &str = include_str!("defaults.toml");

/// What a preset describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresetKind {
    /// The `[sensor]` section.
    Sensor,
    /// The `[optics]` section.
    Lens,
}

/// Stands where a scenario names no preset: what it does not write has the values of the kind's `base`.
pub const NO_PRESET: &str = "none";

impl PresetKind {
    /// The section of a scenario that presets of this kind fill.
    pub fn section(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Lens => "optics",
        }
    }

    /// The preset whose values hold where a scenario names none.
    pub fn base(self) -> &'static str {
        match self {
            Self::Sensor => "paper_6t_vga",
            Self::Lens => "pinhole_90",
        }
    }
}

/// A named layer.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// As a scenario names it.
    pub name: &'static str,
    /// What it describes.
    pub kind: PresetKind,
    /// One line for a person.
    pub summary: &'static str,
    /// TOML.
    pub text: &'static str,
}

macro_rules! presets {
    ($($kind:ident, $name:literal, $summary:literal;)*) => {
        /// All presets.
        pub const ALL: &[Preset] = &[$(Preset {
            name: $name,
            kind: PresetKind::$kind,
            summary: $summary,
            text: include_str!(concat!("presets/", $name, ".toml")),
        },)*];
    };
}

presets! {
    Sensor, "paper_6t_vga", "the paper's sensor: VGA, monochrome, global shutter 6T, 10 uV/e-, 10 bit, 30 fps";
    Sensor, "ov7251", "class of OV7251: VGA, monochrome, 3 um, global shutter, 10 bit, 30 fps";
    Sensor, "ov9282", "class of OV9281/OV9282: 1280x800, monochrome, 3 um, global shutter, 10 bit, 120 fps";
    Sensor, "mt9v024", "class of MT9V024/MT9V034: 752x480, monochrome, 6 um, global shutter 5T with its reset noise, 10 bit, 60 fps";
    Sensor, "imx219", "class of IMX219: 1080p crop, RGGB, 1.12 um, rolling shutter, 10 bit, 30 fps";
    Sensor, "rggb_rolling", "pixel of IMX363 as measured: 1280x960 crop, RGGB, 1.4 um, rolling shutter, 10 bit, 30 fps";
    Sensor, "generic_3t", "class of IBIS4-1300: 1280x1024, monochrome, 7 um 3T with its reset noise, rolling shutter, 10 bit, 7 fps";
    Sensor, "hdr_dual_gain", "1280x960, RGGB, 2.8 um, 200 and 49 uV/e-, rolling shutter, 12 bit, 30 fps (Solhusvik et al. 2019)";
    Sensor, "hdr_3_exposures", "class of MT9M034/AR0132: 1280x960, monochrome, 3.75 um, rolling shutter, three 12-bit exposures, 40 fps";
    Lens, "pinhole_90", "ideal mapping, 90 degrees across, f/2";
    Lens, "radtan_90", "90 degrees across with the mild barrel distortion of a small wide-angle lens, f/2";
    Lens, "kb4_120", "equidistant lens, 120 degrees across, f/2";
    Lens, "kb4_190", "fisheye with the shape of TUM-VI's (BF2M2020S23), 190 degrees across, f/2";
    Lens, "double_sphere_195", "the same fisheye as a double sphere (Usenko et al. 2018), 195 degrees across, f/2";
}

/// The preset of that name. Gives `Error::Unknown` with the names of all presets of the kind.
pub fn find(kind: PresetKind, name: &str) -> Result<&'static Preset, Error> {
    ALL.iter().find(|preset| preset.kind == kind && preset.name == name).ok_or_else(|| Error::Unknown {
        what: match kind {
            PresetKind::Sensor => "sensor preset",
            PresetKind::Lens => "lens preset",
        },
        name: name.to_owned(),
        known: names(kind).join(", "),
    })
}

/// Names of all presets of a kind, in the order of the list.
pub fn names(kind: PresetKind) -> Vec<&'static str> {
    ALL.iter().filter(|preset| preset.kind == kind).map(|preset| preset.name).collect()
}
