//! Reads a cell library in Liberty format: each cell's area (in the library's unit), leakage in nW, input capacitance in pF, and internal
//! energy of a switch in pJ.
//!
//! Synopsys' Liberty User Guide: a file is nested groups `name (arguments) { ... }` with attributes `name : value;` and `name
//! (values);`.

use std::collections::BTreeMap;

/// A group with what stands in it.
#[derive(Debug, Default)]
struct Group {
    name: String,
    argument: String,
    attributes: Vec<(String, String)>,
    groups: Vec<Group>,
}

impl Group {
    fn value(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(found, _)| found == name).map(|(_, value)| value.as_str())
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.value(name)?.trim().parse().ok()
    }

    fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Group> {
        self.groups.iter().filter(move |group| group.name == name)
    }
}

/// Reads what follows up to the closing brace.
fn parse(text: &mut &str, group: &mut Group) {
    loop {
        *text = text.trim_start_matches(|c: char| c.is_whitespace() || c == ';' || c == '\\');
        if let Some(rest) = text.strip_prefix("/*") {
            *text = rest.split_once("*/").map_or("", |(_, rest)| rest);
            continue;
        }
        if text.is_empty() || text.starts_with('}') {
            *text = text.get(1..).unwrap_or("");
            return;
        }
        let end = text.find([':', '(', ';', '\n']).unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        let name = name.trim().to_owned();
        if let Some(rest) = rest.strip_prefix(':') {
            let (value, rest) = rest.split_once([';', '\n']).unwrap_or((rest, ""));
            group.attributes.push((name, value.trim().trim_matches('"').to_owned()));
            *text = rest;
        } else if let Some(rest) = rest.strip_prefix('(') {
            let (argument, rest) = rest.split_once(')').expect("a parenthesis is closed");
            let argument = argument.trim().to_owned();
            let rest = rest.trim_start();
            if let Some(mut rest) = rest.strip_prefix('{') {
                let mut inner = Group { name, argument, ..Group::default() };
                parse(&mut rest, &mut inner);
                group.groups.push(inner);
                *text = rest;
            } else {
                group.attributes.push((name, argument));
                *text = rest;
            }
        } else {
            *text = rest.get(1..).unwrap_or("");
        }
    }
}

/// What a cell costs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell {
    /// In the library's unit, square micrometres in most.
    pub area: f64,
    /// In nW.
    pub leakage_nw: f64,
    /// Of all inputs but the clock, in pF.
    pub input_pf: f64,
    /// Of the clock, in pF; 0 without one.
    pub clock_pf: f64,
    /// Within the cell, a rise or fall of its output, in pJ.
    pub switch_pj: f64,
    /// Within the cell, both edges of its clock, in pJ.
    pub clock_pj: f64,
}

/// A library.
#[derive(Debug)]
pub struct Library {
    pub name: String,
    pub voltage_v: f64,
    cells: BTreeMap<String, Cell>,
}

/// Mean over the power tables of a pin, each at its least input transition and middle load: what a gate of moderate fan-out meets.
fn mean_power(pin: &Group) -> f64 {
    let tables = pin.named("internal_power").flat_map(|power| &power.groups);
    let values: Vec<f64> = tables
        .filter_map(|table| {
            let rows: Vec<&str> = table.value("values")?.split('"').filter(|part| part.contains('.')).collect();
            rows.get(rows.len() / 2)?.split(',').next()?.trim().parse().ok()
        })
        .collect();
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / f64::from(u32::try_from(values.len()).unwrap()) }
}

fn cell(group: &Group, to_nw: f64, to_pf: f64) -> Cell {
    let mut cell = Cell {
        area: group.number("area").unwrap_or(0.0),
        leakage_nw: group.number("cell_leakage_power").unwrap_or(0.0) * to_nw,
        ..Cell::default()
    };
    for pin in group.named("pin") {
        let capacitance = pin.number("capacitance").unwrap_or(0.0) * to_pf;
        // A table's energy is in volts squared times the library's capacitance.
        match (pin.value("clock"), pin.value("direction")) {
            (Some("true"), _) => {
                cell.clock_pf += capacitance;
                cell.clock_pj += 2.0 * mean_power(pin) * to_pf;
            }
            (_, Some("output")) => cell.switch_pj += mean_power(pin) * to_pf,
            _ => {
                cell.input_pf += capacitance;
                cell.switch_pj += mean_power(pin) * to_pf;
            }
        }
    }
    cell
}

impl Library {
    /// Reads a library. Panics on a file that is none: a wrong path is an error, not a table of zeros.
    pub fn parse(text: &str) -> Self {
        let mut file = Group::default();
        parse(&mut &*text, &mut file);
        let library = file.named("library").next().expect("the file holds a library group: is it a Liberty file?");
        let to_nw = match library.value("leakage_power_unit").unwrap_or("1nW") {
            "1W" => 1e9,
            "1mW" => 1e6,
            "1uW" => 1e3,
            "1nW" => 1.0,
            "1pW" => 1e-3,
            other => panic!("leakage_power_unit {other} is unknown"),
        };
        let unit = library.value("capacitive_load_unit").unwrap_or("1,pf").to_lowercase();
        let (factor, unit) = unit.split_once(',').expect("a factor and a unit");
        let unit = match unit.trim().trim_matches('"') {
            "pf" => 1.0,
            "ff" => 1e-3,
            other => panic!("capacitive_load_unit {other} is unknown"),
        };
        let to_pf = factor.trim().parse::<f64>().unwrap() * unit;
        let cells = library.named("cell").map(|group| {
            let name = group.argument.trim_matches('"').to_owned();
            (name, cell(group, to_nw, to_pf))
        });
        let voltage_v = library.number("nom_voltage").expect("the library names its voltage");
        Self { name: library.argument.clone(), voltage_v, cells: cells.collect() }
    }

    /// Sum over a netlist's cells.
    pub fn total(&self, cells: &BTreeMap<String, u32>) -> Cell {
        let mut total = Cell::default();
        for (name, &count) in cells {
            let cell = self.cells.get(name).unwrap_or_else(|| panic!("{name} is no cell of {}", self.name));
            let count = f64::from(count);
            total.area += cell.area * count;
            total.leakage_nw += cell.leakage_nw * count;
            total.input_pf += cell.input_pf * count;
            total.clock_pf += cell.clock_pf * count;
            total.switch_pj += cell.switch_pj * count;
            total.clock_pj += cell.clock_pj * count;
        }
        total
    }
}

/// Energy of a clock in pJ, where a share `activity` of all nets switches: half C V^2 at the inputs that a net drives and the cells'
/// own energy; the clock's pins switch twice in every clock. Wires, clock tree, glitches and memories are not in it.
pub fn clock_pj(total: &Cell, voltage_v: f64, activity: f64) -> f64 {
    let half_v2 = voltage_v * voltage_v / 2.0;
    activity * (total.input_pf * half_v2 + total.switch_pj) + 2.0 * total.clock_pf * half_v2 + total.clock_pj
}

#[test]
fn a_small_library_reads_as_written() {
    let text =
        "/* made */ library (made) { nom_voltage : 2.0; leakage_power_unit : \"1nW\"; capacitive_load_unit (1,pf);
        cell (INV) { area : 3; cell_leakage_power : 0.5; pin(A) { direction : input; capacitance : 0.25; }
          pin(Y) { direction : output; function : \"(!A)\"; internal_power() { rise_power(t) { values ( \\
            \"0.5, 9.0\", \\ \n \"0.1, 9.0\" ); } fall_power(t) { values ( \"0.3, 9.0\" ); } } } }
        cell (FF) { area : 7; pin(CK) { clock : true; direction : input; capacitance : 0.125; }
          pin(D) { direction : input; capacitance : 0.5; } }
      }";
    let library = Library::parse(text);
    assert_eq!((library.name.as_str(), library.voltage_v), ("made", 2.0));
    let total = library.total(&BTreeMap::from([("INV".to_owned(), 2), ("FF".to_owned(), 1)]));
    assert_eq!((total.area, total.leakage_nw, total.input_pf, total.clock_pf), (13.0, 1.0, 1.0, 0.125));
    // The middle one of two rows is the second: (0.1 + 0.3) / 2, for two cells.
    assert!((total.switch_pj - 0.4).abs() < 1e-12);
    // Half of V^2 is 2: 0.25 * (1 * 2 + 0.4) + 2 * 0.125 * 2.
    assert!((clock_pj(&total, 2.0, 0.25) - 1.1).abs() < 1e-12);
}
