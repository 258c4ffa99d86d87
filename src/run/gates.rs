//! Gates, flip-flops, SRAM and area of the digital half, interpolated from tables that Yosys made over the parameters of
//! `rtl_models/verilog`.
//!
//! Cells and flip-flops are a base and what each parameter adds to it alone; word length and octaves are crossed where both matter. An
//! area follows from typical standard cells and SRAM of 65 nm, scaled by the square of the node.

use rtl_models::fx_back::FxBackConfig;

use super::sensor::SensorSetup;
use crate::num::f64_from_u64;
use crate::report::gates_record::{GateBlock, Gates};

/// The table: block, parameters that differ from the block's base, cells, flip-flops, memory bits.
const TABLE: &str = include_str!("gates.csv");

/// Cells may be this factor more or fewer; held against settings that the table has not seen.
pub const CELLS_FACTOR: f64 = 1.2;
/// The same for area: libraries, placement and memory compilers differ.
const AREA_FACTOR: f64 = 1.6;
/// Mean area of a mapped cell that is no flip-flop, of a flip-flop, and of a bit of SRAM with its periphery, in um2 at 65 nm. Estimates of
/// typical libraries: a NAND2 of 1.4 um2, a flip-flop of 5 of them, a bit cell of 0.5 um2 in small macros.
const CELL_UM2: f64 = 2.0;
const FLOP_UM2: f64 = 7.2;
const SRAM_BIT_UM2: f64 = 1.2;
/// Share of the placed area that cells fill.
const UTILISATION: f64 = 0.7;

/// Cells, flip-flops and memory bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Netlist {
    /// Mapped cells, flip-flops among them.
    pub cells: f64,
    /// Flip-flops.
    pub flip_flops: f64,
    /// Bits of memories.
    pub sram_bits: f64,
}

impl Netlist {
    fn plus(self, other: Self, times: f64) -> Self {
        Self {
            cells: self.cells + times * other.cells,
            flip_flops: self.flip_flops + times * other.flip_flops,
            sram_bits: self.sram_bits + times * other.sram_bits,
        }
    }
}

/// The netlist of a row of the table.
fn row(block: &str, parameters: &str) -> Netlist {
    let line = TABLE.lines().find(|line| {
        let mut fields = line.split(',');
        fields.next() == Some(block) && fields.next() == Some(parameters)
    });
    let line = line.unwrap_or_else(|| panic!("the table of gates has no row {block} {parameters}"));
    let mut numbers = line.split(',').skip(2).map(|field| field.parse::<f64>().expect("a number of the table"));
    let mut next = || numbers.next().expect("three numbers per row");
    Netlist { cells: next(), flip_flops: next(), sram_bits: next() }
}

/// What a setting adds to its block's base.
fn added(block: &str, parameters: &str) -> Netlist {
    row(block, parameters).plus(row(block, ""), -1.0)
}

/// What more octaves than one add.
fn octaves_added(block: &str, octaves: u32) -> Netlist {
    match octaves {
        0 | 1 => Netlist::default(),
        2 => added(block, "OCTAVES=2"),
        3 => added(block, "OCTAVES=3"),
        _ => added(block, "OCTAVES=4"),
    }
}

/// Linear between points of one parameter: `(value, what the value adds)`, rising; beyond the ends by the nearest two.
fn between(points: &[(f64, Netlist)], at: f64) -> Netlist {
    let segment = points.windows(2).position(|pair| at <= pair[1].0).unwrap_or(points.len() - 2);
    let [(low, below), (high, above)] = [points[segment], points[segment + 1]];
    let share = (at - low) / (high - low);
    let none = Netlist::default();
    none.plus(below, 1.0 - share).plus(above, share)
}

/// The extractor's front: line buffers, corners, suppression, smoothing.
pub fn front(hardware: &FxBackConfig) -> Netlist {
    let block = "fx_front";
    let none = Netlist::default();
    let bits = f64::from(hardware.pix_bits);
    let words = between(&[(8.0, none), (12.0, added(block, "PIX_BITS=12")), (16.0, added(block, "PIX_BITS=16"))], bits);
    let octave = octaves_added(block, hardware.octaves);
    // Harris is mostly multipliers, which grow with the word.
    let harris = if hardware.harris {
        let wide = row(block, "PIX_BITS=16 HARRIS=1").plus(row(block, "PIX_BITS=16"), -1.0);
        between(&[(8.0, added(block, "HARRIS=1")), (16.0, wide)], bits)
    } else {
        none
    };
    let sum = row(block, "").plus(words, 1.0).plus(octave, 1.0).plus(harris, 1.0).plus(width(hardware, block), 1.0);
    // Bits of the line buffers are columns times words times what the octaves need.
    let lines = row(block, "").plus(octave, 1.0).sram_bits * f64::from(hardware.max_width) / 640.0 * bits / 8.0;
    let harris_lines = harris.sram_bits * f64::from(hardware.max_width) / 640.0;
    Netlist { sram_bits: lines + harris_lines, ..sum }
}

/// The extractor's back without its engines: choice, queue, patches.
pub fn back(hardware: &FxBackConfig) -> Netlist {
    let block = "fx_back";
    let none = Netlist::default();
    let bits = f64::from(hardware.pix_bits);
    let share = (bits - 8.0) / 8.0;
    let words = added(block, "PIX_BITS=16");
    let octave = octaves_added(block, hardware.octaves);
    let cell = match hardware.cell_log2 {
        0..=4 => none,
        5 => added(block, "CELL_LOG2=5"),
        _ => added(block, "CELL_LOG2=6 RING_LOG2=7"),
    };
    let subpixel = if hardware.subpixel {
        none
    } else {
        let wide = row(block, "PIX_BITS=16 SUBPIXEL=0").plus(row(block, "PIX_BITS=16"), -1.0);
        between(&[(8.0, added(block, "SUBPIXEL=0")), (16.0, wide)], bits)
    };
    // The queue and the cells' lists grow with the words of a candidate.
    let response_bits = if hardware.subpixel { 8.0 * bits } else { 0.0 };
    let rank_bits = if hardware.harris { 16.0 + bits } else { bits };
    let (word, body) = ((response_bits + rank_bits + 39.0) / 111.0, (response_bits + rank_bits + 8.0) / 80.0);
    // Lists: a bank for each octave twice, each with the corners that a cell keeps.
    let list = |octaves: &str| {
        let of = |corners: &str| row("fx_cells", format!("{octaves}PER_CELL={corners}").trim());
        let base = row("fx_cells", octaves.trim());
        between(&[(1.0, none), (4.0, of("4").plus(base, -1.0))], f64::from(hardware.per_cell))
    };
    let lists = between(&[(1.0, list("")), (4.0, list("OCTAVES=4 "))], f64::from(hardware.octaves));
    let per_cell = none.plus(lists, body);
    let depths = [(1.0, added("fx_fifo", "DEPTH=1")), (16.0, none), (64.0, added("fx_fifo", "DEPTH=64"))];
    let fifo = none.plus(between(&depths, f64::from(hardware.fifo_depth)), word);
    let desc = between(&[(64.0, added(block, "DESC_BITS=64")), (256.0, none)], f64::from(hardware.desc_bits));
    let harris = if hardware.harris { added(block, "HARRIS=1") } else { none };
    let parts = [octave, cell, subpixel, per_cell, fifo, desc, harris, width(hardware, block)];
    let sum = parts.into_iter().fold(row(block, "").plus(words, share), |sum, part| sum.plus(part, 1.0));
    // Memories are columns times words; octaves and cells change how many. Lists are one a cell of a row of cells.
    let columns = f64::from(hardware.max_width) / 640.0;
    let cells = columns * 16.0 / f64::from(1_u32 << hardware.cell_log2.clamp(4, 6));
    let one_octave = row(block, "").sram_bits;
    let all_octaves = 1.0 + octave.sram_bits / one_octave;
    let memories = (one_octave + cell.sram_bits) * all_octaves + harris.sram_bits;
    let sram_bits = memories * columns * bits / 8.0 + subpixel.sram_bits * columns + per_cell.sram_bits * cells;
    Netlist { sram_bits, ..sum }
}

/// One engine: orientation and descriptor of a patch.
pub fn engine(hardware: &FxBackConfig) -> Netlist {
    let block = "fx_engine";
    let share = f64::from(hardware.pix_bits - 8) / 8.0;
    let desc = added(block, "DESC_BITS=64");
    let pattern = if hardware.symmetric { added(block, "SYMMETRIC=1") } else { Netlist::default() };
    row(block, "")
        .plus(added(block, "PIX_BITS=16"), share)
        .plus(desc, f64::from(256 - hardware.desc_bits) / 192.0)
        .plus(pattern, 1.0)
}

/// Front, back and all engines.
pub fn all(hardware: &FxBackConfig) -> Netlist {
    front(hardware).plus(back(hardware), 1.0).plus(engine(hardware), f64::from(hardware.engines))
}

/// What other widths than 640 columns add in counters and selectors.
fn width(hardware: &FxBackConfig, block: &str) -> Netlist {
    let log = |width: f64| libm::log2(width / 640.0);
    let points = [
        (log(160.0), added(block, "MAX_WIDTH=160")),
        (0.0, Netlist::default()),
        (log(2560.0), added(block, "MAX_WIDTH=2560")),
    ];
    between(&points, log(f64::from(hardware.max_width)))
}

/// Columns of converters with their share of sequencer, counters and lanes.
fn converters(columns: u32) -> Netlist {
    let (few, many) = (row("sensor_core", "COLUMNS=16"), row("sensor_core", "COLUMNS=64"));
    between(&[(16.0, few), (64.0, many)], f64::from(columns))
}

impl SensorSetup {
    /// Gates and area of the digital half by block, and the area of the pixels beside it.
    pub fn gates(&self) -> Gates {
        let node_nm = self.power.technology.node_nm;
        let mut parts: Vec<(&str, u32, Netlist)> = Vec::new();
        // A window reads fewer columns and removes no converter.
        let columns = self.array.width_px.div_ceil(self.parameters.adc.columns_per_adc.max(1));
        parts.push(("converters and sequencer", 1, converters(columns)));
        if self.link.mode.sends_features() {
            let hardware = self.extractor.hardware(self.size);
            parts.push(("extractor front", 1, front(&hardware)));
            parts.push(("extractor back", 1, back(&hardware)));
            parts.push(("descriptor engines", hardware.engines, engine(&hardware)));
        }
        // The columns' latches hold one row; every further row of the FIFO is a memory.
        let fifo_bits = u64::from(self.link.fifo_rows - 1) * u64::from(self.size.width_px) * u64::from(self.bits());
        let fifo = Netlist {
            sram_bits: if self.link.mode.sends_codes() { f64_from_u64(fifo_bits) } else { 0.0 },
            ..Netlist::default()
        };
        parts.push(("packetiser", 1, row("csi2_packetiser", "").plus(fifo, 1.0)));
        let blocks: Vec<GateBlock> =
            parts.into_iter().map(|(name, times, one)| block(name, times, one, node_nm)).collect();
        let total = blocks.iter().fold(GateBlock { name: "total".to_owned(), ..GateBlock::default() }, GateBlock::plus);
        let pixels = f64_from_u64(u64::from(self.array.width_px) * u64::from(self.array.height_px));
        let pitch_um = self.parameters.pixel.pitch_um;
        Gates { node_nm, blocks, total, pixel_array_mm2: 1e-6 * pixels * pitch_um * pitch_um }
    }
}

fn block(name: &str, times: u32, one: Netlist, node_nm: f64) -> GateBlock {
    let all = Netlist::default().plus(one, f64::from(times));
    let (cells, flip_flops) = (all.cells.round_ties_even(), all.flip_flops.round_ties_even());
    let scale = (node_nm / 65.0) * (node_nm / 65.0);
    let logic_um2 = ((all.cells - all.flip_flops) * CELL_UM2 + all.flip_flops * FLOP_UM2) / UTILISATION;
    let area_mm2 = 1e-6 * scale * (logic_um2 + all.sram_bits * SRAM_BIT_UM2);
    GateBlock {
        name: name.to_owned(),
        cells,
        cells_interval: [all.cells / CELLS_FACTOR, all.cells * CELLS_FACTOR],
        flip_flops,
        sram_bits: all.sram_bits.round_ties_even(),
        area_mm2,
        area_interval_mm2: [area_mm2 / AREA_FACTOR, area_mm2 * AREA_FACTOR],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: FxBackConfig = FxBackConfig {
        max_width: 640,
        pix_bits: 8,
        octaves: 1,
        harris: false,
        cell_log2: 4,
        per_cell: 1,
        engines: 1,
        fifo_depth: 16,
        desc_bits: 256,
        symmetric: false,
        subpixel: true,
        ring_log2: 6,
        width: 640,
        height: 480,
    };

    #[test]
    fn the_table_s_own_points_come_out_as_they_stand() {
        assert_eq!(front(&USUAL), row("fx_front", ""));
        assert_eq!(back(&USUAL), row("fx_back", ""));
        assert_eq!(engine(&USUAL), row("fx_engine", ""));
        let wide = FxBackConfig { pix_bits: 16, ..USUAL };
        assert_eq!(front(&wide), row("fx_front", "PIX_BITS=16"));
        assert_eq!(engine(&wide), row("fx_engine", "PIX_BITS=16"));
        let (found, told) = (back(&wide), row("fx_back", "PIX_BITS=16"));
        assert_eq!((found.cells, found.flip_flops), (told.cells, told.flip_flops));
    }

    #[test]
    fn more_hardware_is_never_smaller() {
        let least = all(&USUAL);
        for more in [
            FxBackConfig { max_width: 1280, ..USUAL },
            FxBackConfig { pix_bits: 10, ..USUAL },
            FxBackConfig { octaves: 3, ..USUAL },
            FxBackConfig { harris: true, ..USUAL },
            FxBackConfig { per_cell: 3, ..USUAL },
            FxBackConfig { engines: 2, ..USUAL },
            FxBackConfig { fifo_depth: 40, ..USUAL },
        ] {
            let all = all(&more);
            assert!(all.cells > least.cells && all.sram_bits >= least.sram_bits, "{more:?}: {all:?} after {least:?}");
        }
    }
}
