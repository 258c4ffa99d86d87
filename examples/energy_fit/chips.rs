//! Published power of image sensors: what the model is fitted to and judged by. Each has a scenario in `scenes/chips` with its public facts
//! and the source of its figure.

/// What a figure rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// A datasheet that was read.
    Datasheet,
    /// A datasheet's upper bound; counted as if it were the figure.
    Bound,
    /// A paper's abstract.
    Abstract,
    /// An article or a vendor's comparison that quotes the datasheet.
    Article,
    /// Memory of a datasheet or paper; no public source was read. Not fitted, and judged apart.
    Memory,
}

impl Evidence {
    /// Whether a public source was read: the condition for taking part in fit and score.
    pub fn is_public(self) -> bool {
        self != Self::Memory
    }

    /// The word in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Datasheet => "datasheet",
            Self::Bound => "datasheet, upper bound",
            Self::Abstract => "abstract",
            Self::Article => "article",
            Self::Memory => "memory, not fitted",
        }
    }
}

/// A published sensor.
#[derive(Clone, Copy, Debug)]
pub struct Chip {
    /// Its scenario in `scenes/chips`, without the ending.
    pub file: &'static str,
    /// As its vendor calls it.
    pub name: &'static str,
    /// Who designed it: the house at that time, since houses were bought later. Its sensors are left out together.
    pub vendor: &'static str,
    /// Power at the frame rate of the scenario, in mW.
    pub published_mw: f64,
    /// What the figure rests on.
    pub evidence: Evidence,
}

/// All of them, by vendor; sensors of one die count once.
pub const CHIPS: &[Chip] = &[
    Chip { file: "mt9m001", name: "MT9M001", vendor: "Aptina", published_mw: 325.0, evidence: Evidence::Datasheet },
    Chip { file: "mt9m111", name: "MT9M111", vendor: "Aptina", published_mw: 170.0, evidence: Evidence::Memory },
    Chip { file: "mt9d131", name: "MT9D131", vendor: "Aptina", published_mw: 348.0, evidence: Evidence::Datasheet },
    Chip { file: "mt9m114", name: "MT9M114", vendor: "Aptina", published_mw: 135.0, evidence: Evidence::Datasheet },
    Chip { file: "mt9p031", name: "MT9P031", vendor: "Aptina", published_mw: 381.0, evidence: Evidence::Datasheet },
    Chip { file: "ar0330", name: "AR0330", vendor: "Aptina", published_mw: 450.0, evidence: Evidence::Bound },
    Chip { file: "mt9m413", name: "MT9M413", vendor: "Photobit", published_mw: 500.0, evidence: Evidence::Bound },
    Chip { file: "mt9m002", name: "MT9M002", vendor: "Aptina", published_mw: 345.3, evidence: Evidence::Datasheet },
    Chip { file: "mt9v024", name: "MT9V024", vendor: "Aptina", published_mw: 160.0, evidence: Evidence::Bound },
    Chip { file: "mt9v124", name: "MT9V124", vendor: "Aptina", published_mw: 55.0, evidence: Evidence::Datasheet },
    Chip { file: "mt9v111", name: "MT9V111", vendor: "Aptina", published_mw: 80.0, evidence: Evidence::Bound },
    Chip { file: "mt9m024", name: "MT9M024", vendor: "Aptina", published_mw: 270.0, evidence: Evidence::Datasheet },
    Chip { file: "ar0135", name: "AR0135AT", vendor: "Aptina", published_mw: 400.0, evidence: Evidence::Bound },
    Chip { file: "ar0141", name: "AR0141CS", vendor: "Aptina", published_mw: 326.0, evidence: Evidence::Datasheet },
    Chip { file: "ar0230", name: "AR0230CS", vendor: "Aptina", published_mw: 386.0, evidence: Evidence::Datasheet },
    Chip { file: "ar0238", name: "AR0238", vendor: "Aptina", published_mw: 190.0, evidence: Evidence::Bound },
    Chip { file: "ar0835hs", name: "AR0835HS", vendor: "Aptina", published_mw: 420.0, evidence: Evidence::Datasheet },
    Chip {
        file: "python480",
        name: "PYTHON 480",
        vendor: "Cypress",
        published_mw: 265.0,
        evidence: Evidence::Datasheet,
    },
    Chip {
        file: "python1300",
        name: "PYTHON 1300",
        vendor: "Cypress",
        published_mw: 620.0,
        evidence: Evidence::Datasheet,
    },
    Chip {
        file: "python5000",
        name: "PYTHON 5000",
        vendor: "Cypress",
        published_mw: 1450.0,
        evidence: Evidence::Datasheet,
    },
    Chip {
        file: "lupa1300_2",
        name: "LUPA1300-2",
        vendor: "Cypress",
        published_mw: 1350.0,
        evidence: Evidence::Datasheet,
    },
    Chip { file: "lupa300", name: "LUPA-300", vendor: "Cypress", published_mw: 190.0, evidence: Evidence::Datasheet },
    Chip { file: "ibis5", name: "IBIS5-1300", vendor: "Cypress", published_mw: 200.0, evidence: Evidence::Datasheet },
    Chip { file: "ev76c560", name: "EV76C560", vendor: "e2v", published_mw: 200.0, evidence: Evidence::Datasheet },
    Chip { file: "ev76c570", name: "EV76C570", vendor: "e2v", published_mw: 200.0, evidence: Evidence::Datasheet },
    Chip { file: "vd55g4", name: "VD55G4", vendor: "ST", published_mw: 35.0, evidence: Evidence::Article },
    Chip { file: "vv6501", name: "VV6501", vendor: "ST", published_mw: 99.0, evidence: Evidence::Bound },
    Chip { file: "ov7670", name: "OV7670", vendor: "OmniVision", published_mw: 60.0, evidence: Evidence::Article },
    Chip { file: "ov2640", name: "OV2640", vendor: "OmniVision", published_mw: 125.0, evidence: Evidence::Article },
    Chip { file: "ov9655", name: "OV9655", vendor: "OmniVision", published_mw: 90.0, evidence: Evidence::Memory },
    Chip { file: "ov7725", name: "OV7725", vendor: "OmniVision", published_mw: 120.0, evidence: Evidence::Memory },
    Chip { file: "ov7251", name: "OV7251", vendor: "OmniVision", published_mw: 119.0, evidence: Evidence::Memory },
    Chip { file: "ov9281", name: "OV9281", vendor: "OmniVision", published_mw: 156.0, evidence: Evidence::Memory },
    Chip { file: "imx219", name: "IMX219", vendor: "Sony", published_mw: 190.0, evidence: Evidence::Memory },
    Chip { file: "exmor2006", name: "Exmor 2006", vendor: "Sony", published_mw: 580.0, evidence: Evidence::Memory },
    Chip { file: "cmv300", name: "CMV300", vendor: "CMOSIS", published_mw: 700.0, evidence: Evidence::Datasheet },
    Chip { file: "cmv4000", name: "CMV4000", vendor: "CMOSIS", published_mw: 650.0, evidence: Evidence::Memory },
    Chip { file: "naneye2d", name: "NanEye 2D", vendor: "Awaiba", published_mw: 4.2, evidence: Evidence::Memory },
    Chip { file: "hm01b0", name: "HM01B0", vendor: "Himax", published_mw: 4.0, evidence: Evidence::Article },
    Chip { file: "lm9617", name: "LM9617", vendor: "National", published_mw: 90.0, evidence: Evidence::Datasheet },
    Chip { file: "hv7131rp", name: "HV7131RP", vendor: "MagnaChip", published_mw: 86.0, evidence: Evidence::Datasheet },
    Chip { file: "pas005b", name: "PAS005B", vendor: "PixArt", published_mw: 150.0, evidence: Evidence::Bound },
    Chip {
        file: "kac12040",
        name: "KAC-12040",
        vendor: "Truesense",
        published_mw: 1500.0,
        evidence: Evidence::Datasheet,
    },
    Chip {
        file: "dongguk2020",
        name: "Dongguk 2020",
        vendor: "Dongguk",
        published_mw: 1.12,
        evidence: Evidence::Abstract,
    },
    Chip { file: "meta_dps", name: "Meta DPS", vendor: "Meta", published_mw: 5.3, evidence: Evidence::Abstract },
];
