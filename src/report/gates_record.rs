//! Gates and area as `report.json` has them.

use crate::num::significant;
use serde::{Deserialize, Serialize};

/// The digital half of one sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gates {
    /// Node of the areas, that of the energy's technology.
    pub node_nm: f64,
    /// In the order of the data.
    pub blocks: Vec<GateBlock>,
    /// Their sum.
    pub total: GateBlock,
    /// Area of the pixels alone: array times pitch squared.
    pub pixel_array_mm2: f64,
}

/// A block.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GateBlock {
    /// "converters and sequencer", "extractor front", "extractor back", "descriptor engines", "packetiser", "total".
    pub name: String,
    /// Cells of Yosys' generic library after mapping, flip-flops among them.
    pub cells: f64,
    /// Likely range of the cells.
    pub cells_interval: [f64; 2],
    /// Flip-flops.
    pub flip_flops: f64,
    /// Bits of memories.
    pub sram_bits: f64,
    /// Logic and memories, placed.
    pub area_mm2: f64,
    /// Likely range of the area.
    pub area_interval_mm2: [f64; 2],
}

impl GateBlock {
    /// The sum with another block, under this one's name. Ranges add up, as blocks share their errors.
    #[must_use]
    pub fn plus(self, other: &Self) -> Self {
        let sum = |own: [f64; 2], more: [f64; 2]| [own[0] + more[0], own[1] + more[1]];
        Self {
            cells: self.cells + other.cells,
            cells_interval: sum(self.cells_interval, other.cells_interval),
            flip_flops: self.flip_flops + other.flip_flops,
            sram_bits: self.sram_bits + other.sram_bits,
            area_mm2: self.area_mm2 + other.area_mm2,
            area_interval_mm2: sum(self.area_interval_mm2, other.area_interval_mm2),
            name: self.name,
        }
    }
}

impl Gates {
    /// The table as lines of text.
    pub fn text(&self) -> String {
        let node = format!("gates at {} nm", self.node_nm);
        let mut text = format!("{node:<26}      cells  flip-flops   SRAM bits        mm2           likely mm2\n");
        for block in self.blocks.iter().chain([&self.total]) {
            // As many digits as a table between points and an area within a factor hold.
            let [cells, flip_flops, sram_bits] =
                [block.cells, block.flip_flops, block.sram_bits].map(|count| significant(count, 3));
            let [low, high] = block.area_interval_mm2.map(|area| significant(area, 2));
            let area = significant(block.area_mm2, 2);
            text += &format!(
                "  {:<24} {cells:>10} {flip_flops:>11} {sram_bits:>11} {area:>10} {low:>9} .. {high:>7}\n",
                block.name
            );
        }
        text + &format!("  the digital half alone, beside {:.3} mm2 of pixels\n", self.pixel_array_mm2)
    }
}
