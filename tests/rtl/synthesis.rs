//! Yosys reads and maps every block without a warning, infers no latch, and finds the cells that docs/rtl.md tells.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::judge::sources;
use crate::verilate::version;

const BLOCKS: [&str; 6] = ["ramp_counter", "cds", "readout_seq", "lane_shift", "sensor_core", "csi2_packetiser"];

/// Warnings that do not matter, each with its reason. None does.
const ALLOWED: [&str; 0] = [];

/// Cells of the flat netlist by type.
fn cells(block: &str) -> BTreeMap<String, u32> {
    let files: Vec<_> = sources(block).iter().map(|path| path.display().to_string()).collect();
    let script = format!(
        "read_verilog -sv {}; hierarchy -check -top {block}; proc; check -assert; synth -flatten -top {block}; check -assert; \
         tee -o /dev/stderr stat",
        files.join(" ")
    );
    let output = Command::new("yosys").args(["-q", "-p", &script]).output().expect("yosys runs: ./check --install");
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{block}: {text}");
    let warnings = text.lines().filter(|line| line.to_lowercase().contains("warning"));
    let bad: Vec<_> = warnings.filter(|line| !ALLOWED.iter().any(|allowed| line.contains(allowed))).collect();
    assert!(bad.is_empty(), "{block}: {bad:?}");
    // "     $_DFF_P_     123"
    let table = text.lines().filter_map(|line| {
        let (name, count) = line.trim().split_once(char::is_whitespace)?;
        Some((name.to_owned(), count.trim().parse().ok()?)).filter(|_| name.starts_with('$'))
    });
    table.collect()
}

/// Rows "| `block` | cells | flip-flops |" of the documentation.
fn documented() -> BTreeMap<String, [u32; 2]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/rtl.md");
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let mut fields = line.split('|').map(|field| field.trim().trim_matches('`').replace(',', ""));
        let name = fields.nth(1).filter(|name| BLOCKS.contains(&name.as_str()))?;
        Some((name, [fields.next()?.parse().ok()?, fields.next()?.parse().ok()?]))
    };
    text.lines().filter_map(row).collect()
}

#[test]
fn every_block_is_synthesisable_and_as_large_as_documented() {
    println!("{}", version("yosys", "-V"));
    let documented = documented();
    for block in BLOCKS {
        let cells = cells(block);
        let all: u32 = cells.values().sum();
        let count =
            |mark: &str| cells.iter().filter(|(name, _)| name.contains(mark)).map(|(_, count)| count).sum::<u32>();
        let (flops, latches) = (count("DFF"), count("LATCH"));
        println!("| `{block}` | {all} | {flops} |");
        assert!(latches == 0 && flops > 0, "{block}: {latches} latches, {flops} flip-flops");
        let told = documented.get(block).unwrap_or_else(|| panic!("docs/rtl.md has no row of {block}"));
        for (found, told) in [(all, told[0]), (flops, told[1])] {
            // The mapper's choices differ a little from version to version.
            assert!(found.abs_diff(told) * 10 <= told, "{block}: Yosys finds {found}, docs/rtl.md tells {told}");
        }
    }
}
