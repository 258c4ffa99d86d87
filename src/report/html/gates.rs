//! Gates and area of the sensor's digital half.

use maud::{Markup, Render, html};

use super::parts::Head::{Number, Text};
use super::parts::{Table, section};
use crate::num::significant;
use crate::report::gates_record::GateBlock;
use crate::report::html::text::{grouped, rough};
use crate::report::record::Report;

pub(super) fn gates(report: &Report) -> Markup {
    let gates = &report.gates;
    if gates.blocks.is_empty() {
        return Markup::default();
    }
    let heads = [
        Text("block"),
        Number("cells"),
        Number("likely"),
        Number("flip-flops"),
        Number("SRAM bits"),
        Number("mm\u{b2}"),
        Number("likely mm\u{b2}"),
    ];
    let rows = html! {
        @for block in &gates.blocks { tr { (cells(block)) } }
        tr.own { (cells(&gates.total)) }
    };
    let table = Table { label: Some("gates and area"), class: None, heads: &heads, rows };
    let lead = format!(
        "The digital half of one sensor at {} nm, between points that Yosys synthesised. Cells are those of its generic \
         library. The pixels alone take {:.3} mm\u{b2}.",
        gates.node_nm, gates.pixel_array_mm2
    );
    section("Gates and area", &lead, table.render())
}

fn cells(block: &GateBlock) -> Markup {
    let count = |value: f64| grouped(significant(value, 3));
    let [cells_low, cells_high] = block.cells_interval.map(count);
    let [area_low, area_high] = block.area_interval_mm2.map(rough);
    html! {
        th scope="row" { (block.name) }
        td.num { (count(block.cells)) }
        td.num { (cells_low) " to " (cells_high) }
        td.num { (count(block.flip_flops)) }
        td.num { (count(block.sram_bits)) }
        td.num { (rough(block.area_mm2)) }
        td.num { (area_low) " to " (area_high) }
    }
}
