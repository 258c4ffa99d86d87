//! SystemVerilog sources and the C++ harnesses that play rows and pictures to them, as text for a build.

/// A file of Verilog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerilogModule {
    /// Its module.
    pub module: &'static str,
    /// All of it.
    pub text: &'static str,
}

const fn file(module: &'static str, text: &'static str) -> VerilogModule {
    VerilogModule { module, text }
}

/// Every module, by name.
pub const SOURCES: &[VerilogModule] = &[
    file("cds", include_str!("../verilog/cds.sv")),
    file("csi2_packetiser", include_str!("../verilog/csi2_packetiser.sv")),
    file("extractor_core", include_str!("../verilog/extractor_core.sv")),
    file("fx_back", include_str!("../verilog/fx_back.sv")),
    file("fx_brief", include_str!("../verilog/fx_brief.sv")),
    file("fx_cells", include_str!("../verilog/fx_cells.sv")),
    file("fx_dumps", include_str!("../verilog/fx_dumps.sv")),
    file("fx_engine", include_str!("../verilog/fx_engine.sv")),
    file("fx_fast", include_str!("../verilog/fx_fast.sv")),
    file("fx_fifo", include_str!("../verilog/fx_fifo.sv")),
    file("fx_fit", include_str!("../verilog/fx_fit.sv")),
    file("fx_front", include_str!("../verilog/fx_front.sv")),
    file("fx_half", include_str!("../verilog/fx_half.sv")),
    file("fx_harris", include_str!("../verilog/fx_harris.sv")),
    file("fx_memory", include_str!("../verilog/fx_memory.sv")),
    file("fx_nms", include_str!("../verilog/fx_nms.sv")),
    file("fx_orient", include_str!("../verilog/fx_orient.sv")),
    file("fx_pattern", include_str!("../verilog/fx_pattern.sv")),
    file("fx_ring", include_str!("../verilog/fx_ring.sv")),
    file("fx_rows", include_str!("../verilog/fx_rows.sv")),
    file("fx_smooth", include_str!("../verilog/fx_smooth.sv")),
    file("fx_window", include_str!("../verilog/fx_window.sv")),
    file("lane_shift", include_str!("../verilog/lane_shift.sv")),
    file("ramp_counter", include_str!("../verilog/ramp_counter.sv")),
    file("readout_seq", include_str!("../verilog/readout_seq.sv")),
    file("sensor_core", include_str!("../verilog/sensor_core.sv")),
];

/// C++ for Verilator that plays rows of crossings to `sensor_core`.
pub const ROWS_HARNESS: &str = include_str!("../verilator/rows.cpp");
/// C++ for Verilator that plays pictures to `extractor_core`.
pub const FRAMES_HARNESS: &str = include_str!("../verilator/frames.cpp");

/// Whether `module` stands as a word in the code of this one.
fn uses(source: &VerilogModule, module: &str) -> bool {
    let code = source.text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    code.flat_map(|line| line.split(move |c| !is_word(c))).any(|word| word == module)
}

/// Whether a module is built of another, directly or not. Both are names in `SOURCES`.
fn is_built_of(top: &str, module: &str) -> bool {
    let parts = |of: &str| SOURCES.iter().find(|source| source.module == of);
    let Some(source) = parts(top) else { return false };
    let used = |other: &&VerilogModule| other.module != top && uses(source, other.module);
    SOURCES.iter().filter(used).any(|other| other.module == module || is_built_of(other.module, module))
}

/// The files that a module needs, its own among them.
pub fn sources_of(top: &str) -> impl Iterator<Item = &'static VerilogModule> {
    SOURCES.iter().filter(move |source| source.module == top || is_built_of(top, source.module))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_core_is_built_of_its_blocks_and_of_no_others() {
        let of_core = ["cds", "lane_shift", "ramp_counter", "readout_seq", "sensor_core"];
        assert!(sources_of("sensor_core").map(|source| source.module).eq(of_core));
        assert!(
            sources_of("extractor_core")
                .all(|source| source.module.starts_with("fx_") || source.module == "extractor_core")
        );
        let taken = sources_of("extractor_core").count();
        assert_eq!(taken, SOURCES.iter().filter(|source| source.module.starts_with("fx_")).count() + 1);
        assert_eq!(sources_of("nothing").count(), 0);
    }
}
