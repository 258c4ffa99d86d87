//! Yosys reads and maps every block without a warning, infers no latch, keeps memories as memories, and finds the cells, flip-flops
//! and memory bits that docs/rtl.md tells.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use super::found_before::unless_found_before;
use super::judge::sources;

/// A row of the table: its name, the module, and parameters other than the module's own.
pub struct Block {
    pub name: &'static str,
    pub top: &'static str,
    pub parameters: &'static str,
}

const fn block(name: &'static str) -> Block {
    Block { name, top: name, parameters: "" }
}

pub const BLOCKS: [Block; 15] = [
    block("ramp_counter"),
    block("cds"),
    block("readout_seq"),
    block("lane_shift"),
    block("sensor_core"),
    block("csi2_packetiser"),
    block("fx_rows"),
    block("fx_window"),
    block("fx_fast"),
    block("fx_nms"),
    block("fx_smooth"),
    block("fx_half"),
    block("fx_harris"),
    block("fx_front"),
    Block { name: "fx_front, 3 octaves", top: "fx_front", parameters: "-chparam OCTAVES 3" },
];

/// Warnings that do not matter, each with its reason. None does.
const ALLOWED: [&str; 0] = [];

/// What a flat netlist consists of.
pub struct Netlist {
    /// Cells by type, without memories.
    pub cells: BTreeMap<String, u32>,
    /// Bits of all memories.
    pub memory_bits: u32,
}

impl Netlist {
    pub fn all(&self) -> u32 {
        self.cells.values().sum()
    }

    /// Cells of types whose name contains a word.
    pub fn count(&self, mark: &str) -> u32 {
        self.cells.iter().filter(|(name, _)| name.contains(mark)).map(|(_, count)| count).sum()
    }
}

/// Runs Yosys up to gates, memories left as they are (what `synth` does, without `memory_map`), then `map`.
pub fn netlist(block: &Block, map: &str) -> Netlist {
    let (top, parameters) = (block.top, block.parameters);
    let files: Vec<_> = sources(top).iter().map(|path| path.display().to_string()).collect();
    let script = format!(
        "read_verilog -sv {}; hierarchy -check -top {top} {parameters}; proc; check -assert; synth -flatten -top {top} -run begin:fine; \
         opt -fast -full; opt -full; techmap; opt -fast; {map}; check -assert; tee -o /dev/stderr stat; tee -o /dev/stderr dump t:$mem_v2",
        files.join(" ")
    );
    let output = Command::new("yosys").args(["-q", "-p", &script]).output().expect("yosys runs: ./check --install");
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    let name = block.name;
    assert!(output.status.success(), "{name}: {text}");
    let warnings = text.lines().filter(|line| line.to_lowercase().contains("warning"));
    let bad: Vec<_> = warnings.filter(|line| !ALLOWED.iter().any(|allowed| line.contains(allowed))).collect();
    assert!(bad.is_empty(), "{name}: {bad:?}");
    // "     $_DFF_P_     123" before the dump, "parameter \SIZE 640" in it.
    let table = text.lines().filter_map(|line| {
        let (name, count) = line.trim().split_once(char::is_whitespace)?;
        let cell = name.starts_with('$') || name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit());
        Some((name.to_owned(), count.trim().parse().ok()?)).filter(|_| cell && name != "$mem_v2")
    });
    let numbers = |mark: &str| {
        let values = text.lines().filter_map(|line| line.trim().strip_prefix(mark)?.trim().parse::<u32>().ok());
        values.collect::<Vec<_>>()
    };
    let (words, widths) = (numbers("parameter \\SIZE "), numbers("parameter \\WIDTH "));
    let memory_bits = words.iter().zip(&widths).map(|(words, width)| words * width).sum();
    Netlist { cells: table.collect(), memory_bits }
}

/// Rows "| `block` | cells | flip-flops | memory bits |" of the documentation.
fn documented() -> BTreeMap<String, [u32; 3]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/rtl.md");
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let mut fields = line.split('|').map(|field| field.trim().replace('`', ""));
        let name = fields.nth(1).filter(|name| BLOCKS.iter().any(|block| block.name == name))?;
        let mut number = || fields.next()?.replace(',', "").parse().ok();
        Some((name, [number()?, number()?, number()?]))
    };
    text.lines().filter_map(row).collect()
}

#[test]
fn every_block_is_synthesisable_and_as_large_as_documented() {
    let word = Command::new("yosys").arg("-V").output().expect("yosys runs: ./check --install");
    println!("{}", String::from_utf8_lossy(&word.stdout));
    let documented = documented();
    let words = format!("{} {documented:?}", include_str!("synthesis.rs"));
    unless_found_before("synthesis", &BLOCKS.map(|block| block.top), &words, || every_block_is(&documented));
}

fn every_block_is(documented: &BTreeMap<String, [u32; 3]>) {
    let mut grown = Vec::new();
    for block in &BLOCKS {
        let netlist = netlist(block, "abc -fast; opt -fast; opt_clean");
        let (name, all, memory) = (block.name, netlist.all(), netlist.memory_bits);
        let (flops, latches) = (netlist.count("DFF"), netlist.count("LATCH"));
        println!("| `{name}` | {all} | {flops} | {memory} |");
        assert!(latches == 0 && flops + memory > 0, "{name}: {latches} latches, {flops} flip-flops");
        let told = documented.get(name).copied().unwrap_or_default();
        for (found, told) in [(all, told[0]), (flops, told[1]), (memory, told[2])] {
            // The mapper's choices differ a little from version to version.
            if found.abs_diff(told) * 10 > told {
                grown.push(format!("{name}: Yosys finds {found}, docs/rtl.md tells {told}"));
            }
        }
    }
    assert!(grown.is_empty(), "{grown:#?}");
}
