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

/// All presets.
pub const ALL: &[Preset] = &[
    Preset {
        name: "paper_6t_vga",
        kind: PresetKind::Sensor,
        summary: "the paper's sensor: VGA, monochrome, global shutter 6T, 10 uV/e-, 10 bit, 30 fps",
        text: include_str!("presets/paper_6t_vga.toml"),
    },
    Preset {
        name: "ov7251",
        kind: PresetKind::Sensor,
        summary: "class of OV7251: VGA, monochrome, 3 um, global shutter, 10 bit, 30 fps",
        text: include_str!("presets/ov7251.toml"),
    },
    Preset {
        name: "ov9282",
        kind: PresetKind::Sensor,
        summary: "class of OV9281/OV9282: 1280x800, monochrome, 3 um, global shutter, 10 bit, 120 fps",
        text: include_str!("presets/ov9282.toml"),
    },
    Preset {
        name: "mt9v024",
        kind: PresetKind::Sensor,
        summary: "class of MT9V024/MT9V034: 752x480, monochrome, 6 um, global shutter 5T with its reset noise, 10 bit, 60 fps",
        text: include_str!("presets/mt9v024.toml"),
    },
    Preset {
        name: "imx219",
        kind: PresetKind::Sensor,
        summary: "class of IMX219: 1080p crop, RGGB, 1.12 um, rolling shutter, 10 bit, 30 fps",
        text: include_str!("presets/imx219.toml"),
    },
    Preset {
        name: "rggb_rolling",
        kind: PresetKind::Sensor,
        summary: "pixel of IMX363 as measured: 1280x960 crop, RGGB, 1.4 um, rolling shutter, 10 bit, 30 fps",
        text: include_str!("presets/rggb_rolling.toml"),
    },
    Preset {
        name: "generic_3t",
        kind: PresetKind::Sensor,
        summary: "class of IBIS4-1300: 1280x1024, monochrome, 7 um 3T with its reset noise, rolling shutter, 10 bit, 7 fps",
        text: include_str!("presets/generic_3t.toml"),
    },
    Preset {
        name: "hdr_dual_gain",
        kind: PresetKind::Sensor,
        summary: "1280x960, RGGB, 2.8 um, 200 and 49 uV/e-, rolling shutter, 12 bit, 30 fps (Solhusvik et al. 2019)",
        text: include_str!("presets/hdr_dual_gain.toml"),
    },
    Preset {
        name: "hdr_3_exposures",
        kind: PresetKind::Sensor,
        summary: "class of MT9M034/AR0132: 1280x960, monochrome, 3.75 um, rolling shutter, three 12-bit exposures, 40 fps",
        text: include_str!("presets/hdr_3_exposures.toml"),
    },
    Preset {
        name: "pinhole_90",
        kind: PresetKind::Lens,
        summary: "ideal mapping, 90 degrees across, f/2",
        text: include_str!("presets/pinhole_90.toml"),
    },
    Preset {
        name: "radtan_90",
        kind: PresetKind::Lens,
        summary: "90 degrees across with the mild barrel distortion of a small wide-angle lens, f/2",
        text: include_str!("presets/radtan_90.toml"),
    },
    Preset {
        name: "kb4_120",
        kind: PresetKind::Lens,
        summary: "equidistant lens, 120 degrees across, f/2",
        text: include_str!("presets/kb4_120.toml"),
    },
    Preset {
        name: "kb4_190",
        kind: PresetKind::Lens,
        summary: "fisheye with the shape of TUM-VI's (BF2M2020S23), 190 degrees across, f/2",
        text: include_str!("presets/kb4_190.toml"),
    },
    Preset {
        name: "double_sphere_195",
        kind: PresetKind::Lens,
        summary: "the same fisheye as a double sphere (Usenko et al. 2018), 195 degrees across, f/2",
        text: include_str!("presets/double_sphere_195.toml"),
    },
];

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
