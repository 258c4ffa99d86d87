//! Gates and area of the sensor's digital half.

use super::parts::{section, table};
use crate::num::significant;
use crate::report::gates_record::GateBlock;
use crate::report::html::text::{escaped, grouped, rough};
use crate::report::record::Report;

pub(super) fn gates(report: &Report) -> String {
    let gates = &report.gates;
    if gates.blocks.is_empty() {
        return String::new();
    }
    let row = |block: &GateBlock, class: &str| {
        let count = |value: f64| grouped(significant(value, 3));
        let [cells_low, cells_high] = block.cells_interval.map(count);
        let [area_low, area_high] = block.area_interval_mm2.map(rough);
        let cells = [
            count(block.cells),
            format!("{cells_low} to {cells_high}"),
            count(block.flip_flops),
            count(block.sram_bits),
            rough(block.area_mm2),
            format!("{area_low} to {area_high}"),
        ];
        let cells: String = cells.iter().map(|cell| format!("<td class=\"num\">{cell}</td>")).collect();
        format!("<tr{class}><th scope=\"row\">{}</th>{cells}</tr>", escaped(&block.name))
    };
    let blocks: String = gates.blocks.iter().map(|block| row(block, "")).collect();
    let rows = blocks + &row(&gates.total, " class=\"own\"");
    let heads = "block|#cells|#likely|#flip-flops|#SRAM bits|#mm\u{b2}|#likely mm\u{b2}";
    let content = table("gates and area", "", heads, &rows);
    let lead = format!(
        "The digital half of one sensor at {} nm, between points that Yosys synthesised. Cells are those of its generic \
         library. The pixels alone take {:.3} mm\u{b2}.",
        gates.node_nm, gates.pixel_array_mm2
    );
    section("Gates and area", &lead, &content)
}
