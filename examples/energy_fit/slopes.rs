//! Published ratios of two modes of one chip: what the model is fitted to and judged by beside the chips' totals. What is the chip's own
//! cancels in a ratio, so that it says what flows always and what follows the frames.

/// How a mode differs from its scenario in `scenes/chips`.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// As the file says.
    None,
    /// Slower by a longer vertical blanking to this frame rate: lines and clocks stay.
    Blanked(f64),
    /// At this frame rate by slower clocks: lines get longer in proportion, and by the rule ramps and settling with them.
    Clocked(f64),
    /// Over so many LVDS lanes, each at its bit rate, so that clocks follow the lanes; blanked to this frame rate.
    Lanes(u32, f64),
    /// Every second row and column is read, at this frame rate; lines and clocks stay.
    Halved(f64),
}

/// A mode of a chip.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Its scenario in `scenes/chips`, without the ending.
    pub file: &'static str,
    /// What is changed in it.
    pub change: Change,
}

/// A published ratio.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    /// What is compared.
    pub what: &'static str,
    /// Who designed the chip; a fit that leaves a vendor out leaves out its ratios too.
    pub vendor: &'static str,
    /// The mode above the line.
    pub over: Mode,
    /// The mode below it.
    pub under: Mode,
    /// Their published powers, in one unit.
    pub published: [f64; 2],
    /// Where both were read.
    pub source: &'static str,
    /// Why a model of these facts misses it by more than a quarter; none where it does not.
    pub reason: Option<&'static str>,
}

impl Slope {
    /// The published ratio.
    pub fn ratio(&self) -> f64 {
        self.published[0] / self.published[1]
    }
}

const fn as_filed(file: &'static str) -> Mode {
    Mode { file, change: Change::None }
}

const fn lanes(file: &'static str, lanes: u32, fps: f64) -> Mode {
    Mode { file, change: Change::Lanes(lanes, fps) }
}

const PYTHON_1300: &str = "onsemi NOIP1SN1300A/D rev. 6, page 1";
const PYTHON_5000: &str = "onsemi NOIP1SN5000A/D rev. 1, page 1";

/// All of them, by vendor.
pub const SLOPES: &[Slope] = &[
    Slope {
        what: "MT9M024 (and MT9M034), HDR of three exposures over linear",
        vendor: "Aptina",
        over: as_filed("mt9m024_hdr"),
        under: as_filed("mt9m024"),
        published: [460.0, 270.0],
        source: "onsemi MT9M034/D rev. 9, table 1",
        reason: None,
    },
    Slope {
        what: "AR0230, HDR of two exposures over linear",
        vendor: "Aptina",
        over: as_filed("ar0230_hdr"),
        under: as_filed("ar0230"),
        published: [558.0, 386.0],
        source: "onsemi AR0230CS/D rev. 11, table 1",
        reason: None,
    },
    Slope {
        what: "AR0330, 60 over 30 fps at half the clock",
        vendor: "Aptina",
        over: as_filed("ar0330"),
        under: Mode { file: "ar0330", change: Change::Clocked(30.0) },
        published: [450.0, 300.0],
        source: "onsemi AR0330CM rev. 18, table 1: < 450 mW at 198 Mp/s, < 300 mW at 98 Mp/s",
        reason: None,
    },
    Slope {
        what: "MT9D131, 1600 x 1200 at 15 fps over its preview of 800 x 600 at 30 fps",
        vendor: "Aptina",
        over: as_filed("mt9d131"),
        under: Mode { file: "mt9d131", change: Change::Halved(30.0) },
        published: [348.0, 223.0],
        source: "Aptina MT9D131 rev. F, table 1",
        reason: None,
    },
    Slope {
        what: "MT9M413, 500 over 60 fps by its master clock",
        vendor: "Photobit",
        over: as_filed("mt9m413"),
        under: Mode { file: "mt9m413", change: Change::Clocked(60.0) },
        published: [500.0, 150.0],
        source: "Micron MT9M413 ver. 3.0 (1/04): < 500 mW at 500 fps, < 150 mW at 60 fps",
        reason: Some(
            "both figures are upper bounds, and the class whose clocks and references stand outside counts no overhead and a fraction of a \
             product's bias, while this product has its converters' timing on the chip",
        ),
    },
    Slope {
        what: "PYTHON 480, 120 over 60 fps",
        vendor: "Cypress",
        over: as_filed("python480"),
        under: Mode { file: "python480", change: Change::Blanked(60.0) },
        published: [265.0, 226.0],
        source: "onsemi NOIP1SN0480A/D rev. 3, page 1 (rev. 1: 185 mW at 60 fps)",
        reason: None,
    },
    Slope {
        what: "PYTHON 1300, four LVDS lanes over two",
        vendor: "Cypress",
        over: as_filed("python1300"),
        under: lanes("python1300", 2, 82.5),
        published: [620.0, 420.0],
        source: PYTHON_1300,
        reason: Some(
            "the sheet's three figures do not lie on a line over the frame rate (270, 420 and 620 mW at 41, 83 and 210 fps, the first two by the \
             number of lanes), and the model's do",
        ),
    },
    Slope {
        what: "PYTHON 1300, four LVDS lanes over one",
        vendor: "Cypress",
        over: as_filed("python1300"),
        under: lanes("python1300", 1, 41.25),
        published: [620.0, 270.0],
        source: PYTHON_1300,
        reason: None,
    },
    Slope {
        what: "PYTHON 5000, eight LVDS lanes over four",
        vendor: "Cypress",
        over: as_filed("python5000"),
        under: lanes("python5000", 4, 42.5),
        published: [1450.0, 925.0],
        source: PYTHON_5000,
        reason: None,
    },
    Slope {
        what: "PYTHON 5000, eight LVDS lanes over two",
        vendor: "Cypress",
        over: as_filed("python5000"),
        under: lanes("python5000", 2, 21.25),
        published: [1450.0, 520.0],
        source: PYTHON_5000,
        reason: None,
    },
    Slope {
        what: "PYTHON 5000, eight LVDS lanes over one",
        vendor: "Cypress",
        over: as_filed("python5000"),
        under: lanes("python5000", 1, 10.625),
        published: [1450.0, 370.0],
        source: PYTHON_5000,
        reason: None,
    },
    Slope {
        what: "HM01B0, 60 over 30 fps by its oscillator's divider",
        vendor: "Himax",
        over: as_filed("hm01b0"),
        under: Mode { file: "hm01b0", change: Change::Clocked(30.0) },
        published: [4.0, 2.0],
        source: "Bitcraze on the AI-deck's camera, quoting Himax: < 4 mW, < 2 mW",
        reason: None,
    },
    Slope {
        what: "HV7131RP, 30 over 15 fps",
        vendor: "MagnaChip",
        over: as_filed("hv7131rp"),
        under: Mode { file: "hv7131rp", change: Change::Blanked(15.0) },
        published: [86.0, 68.0],
        source: "MagnaChip HV7131RP V1.5, features",
        reason: None,
    },
    Slope {
        what: "180 nm test chip with a single slope, 112 over 14 fps",
        vendor: "HBKU",
        over: as_filed("hbku2026"),
        under: Mode { file: "hbku2026", change: Change::Blanked(14.0) },
        published: [82.4, 61.8],
        source: "HBKU, TCAS-I 2026, abstract; 64 x 64 at 1.8 V assumed",
        reason: None,
    },
];
