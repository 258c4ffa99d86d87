//! Yosys maps the extractor's back in one run, block by block, without a warning or a latch, and finds what docs/rtl.md tells of
//! each.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use super::found_before::unless_found_before;
use super::judge::sources;

const BLOCKS: [&str; 10] = [
    "fx_back",
    "fx_brief",
    "fx_cells",
    "fx_dumps",
    "fx_engine",
    "fx_fifo",
    "fx_fit",
    "fx_orient",
    "fx_pattern",
    "fx_ring",
];

/// One module: its cells by type, other modules among them, and the bits of its own memories.
#[derive(Debug, Default)]
struct Module {
    cells: BTreeMap<String, u32>,
    memory_bits: u32,
}

/// Cells, flip-flops, memory bits, latches.
type Sum = [u32; 4];

/// `\fx_ring` of `$paramod$1f2e\fx_ring`, or of `$paramod\fx_fit\PIX_BITS=s32'1000`: the part that is a block's name.
fn block_of(name: &str) -> String {
    let mut parts = name.split('\\').filter(|part| part.starts_with("fx_"));
    parts.next().unwrap_or(name).to_owned()
}

/// Reads what `stat` and `dump t:$mem_v2` write.
fn modules(stat: &str, dump: &str) -> BTreeMap<String, Module> {
    let mut modules: BTreeMap<String, Module> = BTreeMap::new();
    let mut block = String::new();
    for line in stat.lines() {
        if let Some(name) = line.strip_prefix("=== ") {
            block = block_of(name.trim_end_matches(" ==="));
        } else if let Some((name, count)) = line.trim().split_once(char::is_whitespace)
            && let Ok(count) = count.trim().parse::<u32>()
            && (name.starts_with('$') || name.starts_with("fx_"))
            && name != "$mem_v2"
            && block != "design hierarchy"
        {
            modules.entry(block.clone()).or_default().cells.insert(block_of(name), count);
        }
    }
    let (mut block, mut words) = (String::new(), 0);
    let number = |text: &str| text.trim().parse::<u32>().unwrap();
    for line in dump.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("module ") {
            block = block_of(name);
        } else if let Some(text) = line.strip_prefix("parameter \\SIZE ") {
            words = number(text);
        } else if let Some(text) = line.strip_prefix("parameter \\WIDTH ")
            && words > 0
        {
            modules.entry(block.clone()).or_default().memory_bits += std::mem::take(&mut words) * number(text);
        }
    }
    modules
}

/// A module with all that it consists of.
fn sum(modules: &BTreeMap<String, Module>, block: &str) -> Sum {
    let module = modules.get(block).unwrap_or_else(|| panic!("{block} is not in the netlist"));
    let mut total = [0, 0, module.memory_bits, 0];
    for (name, &count) in &module.cells {
        if modules.contains_key(name) {
            let part = sum(modules, name);
            (0..4).for_each(|field| total[field] += count * part[field]);
        } else {
            total[0] += count;
            total[1] += if name.contains("DFF") { count } else { 0 };
            total[3] += if name.contains("LATCH") { count } else { 0 };
        }
    }
    total
}

/// Rows "| `block` | cells | flip-flops | memory bits |" of the documentation.
fn documented() -> BTreeMap<String, [u32; 3]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/rtl.md");
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let mut fields = line.split('|').map(|field| field.trim().replace(['`', ','], ""));
        let name = fields.nth(1)?;
        let mut number = || fields.next()?.parse().ok();
        Some((name, [number()?, number()?, number()?]))
    };
    text.lines().filter_map(row).collect()
}

/// Runs a script; anything that looks like a warning is a failure.
fn yosys(script: &str) {
    let output = Command::new("yosys").args(["-q", "-p", script]).output().expect("yosys runs: ./check --install");
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    let warnings: Vec<_> = text.lines().filter(|line| line.to_lowercase().contains("warning")).collect();
    assert!(warnings.is_empty(), "{warnings:?}");
}

fn files(block: &str) -> String {
    sources(block).iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_core_is_joined_without_a_warning_or_a_latch_at_both_ends_of_its_parameters() {
    let words = include_str!("extractor_synthesis.rs");
    unless_found_before("core at both ends", &["extractor_core"], words, the_core_is_joined);
}

fn the_core_is_joined() {
    let other = "-chparam OCTAVES 4 -chparam HARRIS 1 -chparam ENGINES 1 -chparam PER_CELL 3 -chparam FIFO_DEPTH 1 \
                 -chparam SYMMETRIC 1 -chparam SUBPIXEL 0 -chparam PIX_BITS 10";
    for parameters in ["", other] {
        yosys(&format!(
            "read_verilog -sv {}; hierarchy -check -top extractor_core {parameters}; proc; check -assert; opt -fast; \
             memory -nomap; check -assert; select -assert-none t:$dlatch t:$adlatch",
            files("extractor_core")
        ));
    }
}

#[test]
fn every_block_of_the_back_is_synthesisable_and_as_large_as_documented() {
    let documented = documented();
    let words = format!("{} {documented:?}", include_str!("extractor_synthesis.rs"));
    unless_found_before("back", &["fx_back"], &words, || every_block_is(&documented));
}

fn every_block_is(documented: &BTreeMap<String, [u32; 3]>) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let [stat, dump] = ["back_stat.txt", "back_memories.txt"].map(|name| folder.join(name));
    let script = format!(
        "read_verilog -sv {}; hierarchy -check -top fx_back; proc; check -assert; synth -top fx_back -run begin:fine; opt -fast -full; \
         opt -full; techmap; opt -fast; abc -fast; opt -fast; opt_clean; check -assert; tee -o {} stat; tee -o {} dump t:$mem_v2",
        files("fx_back"),
        stat.display(),
        dump.display()
    );
    yosys(&script);
    let modules = modules(&std::fs::read_to_string(stat).unwrap(), &std::fs::read_to_string(dump).unwrap());
    let mut grown = Vec::new();
    for block in BLOCKS {
        let [cells, flops, memory, latches] = sum(&modules, block);
        println!("| `{block}` | {cells} | {flops} | {memory} |");
        assert!(latches == 0 && flops + memory > 0, "{block}: {latches} latches, {flops} flip-flops");
        let told = documented.get(block).copied().unwrap_or_default();
        for (found, told) in [cells, flops, memory].into_iter().zip(told) {
            // The mapper's choices differ a little from version to version.
            if found.abs_diff(told) * 10 > told {
                grown.push(format!("{block}: Yosys finds {found}, docs/rtl.md tells {told}"));
            }
        }
    }
    assert!(grown.is_empty(), "{grown:#?}");
}
