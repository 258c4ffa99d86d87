//! The constants of one technology, each with its value, uncertainty, scaling and source; read from TOML and brought to a node by the
//! scaling rule.
//!
//! Rule: a constant with `scaling = "analog"` goes as the node to the power `analog_exponent`, one with `"digital"` as the node to the
//! power `digital_exponent` (which holds the voltage of that node), one with `"none"` stays. The uncertainty factor of a scaled constant
//! grows by (greater node over smaller node) to the power 0.15: 1.16 from 65 to 180 nm.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

use super::constant::{Constant, Unit};
use crate::error::Error;
use crate::text::named;

/// The file of the base constants.
const BASE: &str = include_str!("65nm.toml");

/// Nodes that come with the program, in nm, with the usual core voltage of each.
const NODES: &[(&str, f64, f64)] = &[
    ("180nm", 180.0, 1.8),
    ("130nm", 130.0, 1.5),
    ("110nm", 110.0, 1.5),
    ("90nm", 90.0, 1.2),
    ("65nm", 65.0, 1.2),
    ("45nm", 45.0, 1.1),
    ("40nm", 40.0, 1.1),
    ("28nm", 28.0, 0.9),
    ("22nm", 22.0, 0.8),
];

/// Power of the ratio of two nodes by which the uncertainty factor of a scaled constant grows.
const UNCERTAINTY_EXPONENT: f64 = 0.15;
/// Technology files that extend one another, at most.
const CHAIN_MAX: usize = 16;
/// The greatest constant: in every unit its product with the model's counts stays an integer.
const CONSTANT_MAX: f64 = 1e9;

named! {
    /// How a constant follows the node.
    pub enum Scaling {
        /// It does not.
        None = "none",
        /// As the node to the power `analog_exponent`.
        Analog = "analog",
        /// As the node to the power `digital_exponent`.
        Digital = "digital",
    }
}

/// The value of a constant and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstantValue {
    /// In the constant's unit, 0 or more.
    pub value: f64,
    /// The true value lies within this factor both ways, with 95 % confidence. 1 to 1000.
    pub uncertainty_factor: f64,
    /// How it follows the node.
    pub scaling: Scaling,
    /// Where it comes from.
    pub source: String,
}

/// All constants of one technology.
#[derive(Clone, Debug, PartialEq)]
pub struct Technology {
    /// Name in configurations.
    pub name: String,
    /// Node of the logic, in nm.
    pub node_nm: f64,
    /// Supply of the logic, in V.
    pub core_voltage_v: f64,
    /// One for each of `Constant::ALL`, in that order.
    values: Vec<ConstantValue>,
}

impl Technology {
    /// Names of the nodes that come with the program.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NODES.iter().map(|(name, ..)| *name)
    }

    /// A technology that comes with the program. Fails on a name that is not among `names()`.
    pub fn by_name(name: &str) -> Result<Self, Error> {
        let &(name, node_nm, core_voltage_v) = NODES.iter().find(|(known, ..)| *known == name).ok_or_else(|| {
            let known = format!(
                "{}, auto, or the name of a file that ends in .toml",
                Self::names().collect::<Vec<_>>().join(", ")
            );
            Error::Unknown { what: "technology", name: name.to_owned(), known }
        })?;
        let base = Self::parse("65nm.toml", BASE, None)?;
        Ok(Self { name: name.to_owned(), core_voltage_v, ..base.scaled_to(node_nm) })
    }

    /// The node of a sensor of which no more is known than the supply of its logic or a year. One rule for all: by the supply (1.7 V and
    /// more 180 nm, 1.45 V 110 nm, 1.15 V 65 nm, 1.05 V 40 nm, less 28 nm), else by the year (to 2008 180 nm, to 2012 110 nm, to 2017
    /// 65 nm, to 2022 40 nm, later 28 nm), else 65 nm.
    pub fn auto_name(digital_v: Option<f64>, year: Option<u32>) -> &'static str {
        match (digital_v, year) {
            (Some(supply_v), _) if supply_v >= 1.7 => "180nm",
            (Some(supply_v), _) if supply_v >= 1.45 => "110nm",
            (Some(supply_v), _) if supply_v >= 1.15 => "65nm",
            (Some(supply_v), _) if supply_v >= 1.05 => "40nm",
            (Some(_), _) => "28nm",
            (None, Some(..=2008)) => "180nm",
            (None, Some(2009..=2012)) => "110nm",
            (None, Some(2013..=2017) | None) => "65nm",
            (None, Some(2018..=2022)) => "40nm",
            (None, Some(2023..)) => "28nm",
        }
    }

    /// A technology by name, or by the name of a file that `read` knows the text of. Fails on an unknown name; a file that is not there
    /// or not as it should be, or files that extend one another in a circle; with file, line, key and value.
    pub fn load(name: &str, read: &dyn Fn(&str) -> Result<String, Error>) -> Result<Self, Error> {
        Self::load_below(name, read, &mut Vec::new())
    }

    fn load_below(
        name: &str,
        read: &dyn Fn(&str) -> Result<String, Error>,
        above: &mut Vec<String>,
    ) -> Result<Self, Error> {
        if !Self::is_file(name) {
            return Self::by_name(name);
        }
        let text = read(name)?;
        above.push(name.to_owned());
        let lines = ValueLines::of(name, &text)?;
        let base = match lines.values.get("extends") {
            None => Self::by_name("65nm")?,
            Some(toml::Value::String(base)) => {
                let circle = above.contains(base);
                if circle || above.len() >= CHAIN_MAX {
                    let way = format!("{} -> {base}", above.join(" -> "));
                    let what = if circle { "a cycle of scaling rules" } else { "too long a chain" };
                    return Err(lines.refuse("extends", &format!("{what}: {way}; use 65nm, which extends nothing")));
                }
                Self::load_below(base, read, above).map_err(|error| match error {
                    Error::Unknown { known, .. } => {
                        lines.refuse("extends", &format!("is not known; use one of {known}"))
                    }
                    other => other,
                })?
            }
            Some(_) => return Err(lines.refuse("extends", "must be a text; use \"65nm\"")),
        };
        Self::parse(name, &text, Some(&base))
    }

    /// Whether a technology's name is that of a file.
    pub fn is_file(name: &str) -> bool {
        name.ends_with(".toml")
    }

    /// Reads a technology file over a base, whose constants it takes to its own node where it has none itself. `file` is its name for
    /// messages. Fails on unknown keys, constants and units; a missing node; a value out of range; with file, line, key and value.
    pub fn parse(file: &str, text: &str, base: Option<&Self>) -> Result<Self, Error> {
        let lines = ValueLines::of(file, text)?;
        for key in lines.values.keys() {
            if !["name", "title", "node_nm", "core_voltage_v", "extends", "constant"].contains(&key.as_str()) {
                let reason = "unknown key; use name, title, node_nm, core_voltage_v, extends or constant";
                return Err(lines.refuse(key, reason));
            }
        }
        let missing = "is missing: constants are scaled to a node; use the node of the logic in nm, as in 65";
        let node_nm = lines.number("node_nm", 5.0..=1000.0, "5 to 1000, as in 65")?;
        let node_nm = node_nm.ok_or_else(|| lines.refuse("node_nm", missing))?;
        let voltage = lines.number("core_voltage_v", 0.2..=5.5, "0.2 to 5.5, as in 1.2")?;
        let core_voltage_v = voltage.unwrap_or_else(|| usual_voltage_v(node_nm));
        let values = base.map_or_else(Vec::new, |base| base.scaled_to(node_nm).values);
        let mut made = Self { name: file.to_owned(), node_nm, core_voltage_v, values };
        lines.text("name")?;
        lines.text("title")?;
        let empty = toml::Table::new();
        let constants = match lines.values.get("constant") {
            None => &empty,
            Some(toml::Value::Table(constants)) => constants,
            Some(_) => return Err(lines.refuse("constant", "must be a table; use [constant.link_byte]")),
        };
        for name in constants.keys() {
            if Constant::from_name(name).is_none() {
                return Err(lines.refuse(&format!("constant.{name}"), &unknown_constant(name)));
            }
        }
        for (at, &constant) in Constant::ALL.iter().enumerate() {
            let below = made.values.get(at).cloned();
            let value = lines.constant(constant, constants, below)?;
            match made.values.get_mut(at) {
                Some(known) => *known = value,
                None => made.values.push(value),
            }
        }
        Ok(made)
    }

    /// The same at another node, by the rule.
    #[must_use]
    pub fn scaled_to(&self, node_nm: f64) -> Self {
        let ratio = node_nm / self.node_nm;
        let wider = libm::pow(if ratio > 1.0 { ratio } else { 1.0 / ratio }, UNCERTAINTY_EXPONENT);
        let powers = [Constant::AnalogExponent, Constant::DigitalExponent]
            .map(|exponent| libm::pow(ratio, self.value(exponent)));
        let scaled = |value: &ConstantValue| {
            let (factor, wider) = match value.scaling {
                Scaling::None => (1.0, 1.0),
                Scaling::Analog => (powers[0], wider),
                Scaling::Digital => (powers[1], wider),
            };
            ConstantValue {
                value: value.value * factor,
                uncertainty_factor: value.uncertainty_factor * wider,
                ..value.clone()
            }
        };
        let values = self.values.iter().map(scaled).collect();
        Self { node_nm, core_voltage_v: usual_voltage_v(node_nm), values, ..self.clone() }
    }

    /// Sets a constant: what `energy.constant.NAME.UNIT` in a scenario says. Fails on an unknown name, another unit than the constant's,
    /// a value out of range; by key, with a value that is accepted.
    pub fn set(&mut self, name: &str, unit: &str, value: f64) -> Result<(), Error> {
        let key = format!("energy.constant.{name}.{unit}");
        let constant = Constant::from_name(name).ok_or_else(|| Error::key(&key, value, unknown_constant(name)))?;
        let entry = &mut self.values[constant as usize];
        if unit == "uncertainty_factor" {
            entry.uncertainty_factor =
                in_range(value, 1.0, 1000.0).map_err(|reason| Error::key(&key, value, reason))?;
            return Ok(());
        }
        if unit != constant.unit().name() {
            return Err(Error::key(&key, value, wrong_unit(constant, unit)));
        }
        entry.value = in_range(value, 0.0, CONSTANT_MAX).map_err(|reason| Error::key(&key, value, reason))?;
        "set in the scenario".clone_into(&mut entry.source);
        Ok(())
    }

    /// The same with some constants multiplied: what a fit moves.
    #[must_use]
    pub fn multiplied(mut self, constants: &[Constant], factor: f64) -> Self {
        for &constant in constants {
            self.values[constant as usize].value *= factor;
        }
        self
    }

    /// The value of a constant in its unit.
    pub fn value(&self, constant: Constant) -> f64 {
        self.values[constant as usize].value
    }

    /// The value of a constant with what is known of it.
    pub fn of(&self, constant: Constant) -> &ConstantValue {
        &self.values[constant as usize]
    }
}

/// Core voltage of the nearest node that comes with the program.
fn usual_voltage_v(node_nm: f64) -> f64 {
    let distance = |known_nm: f64| libm::fabs(libm::log(known_nm / node_nm));
    let nearest = NODES.iter().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
    nearest.map_or(1.2, |&(.., voltage_v)| voltage_v)
}

fn unknown_constant(name: &str) -> String {
    let near = Constant::ALL.iter().filter(|constant| {
        let (known, asked) = (constant.name(), name.split('_').next().unwrap_or_default());
        asked.len() > 2 && known.contains(asked)
    });
    let known: Vec<&str> = near.map(|constant| constant.name()).collect();
    let known = if known.is_empty() { Constant::ALL.iter().map(|constant| constant.name()).collect() } else { known };
    format!("unknown constant; use one of {}", known.join(", "))
}

fn wrong_unit(constant: Constant, unit: &str) -> String {
    let unit_key = constant.unit().name();
    if Unit::ALL.iter().any(|known| known.name() == unit) {
        return format!("{} is given in {unit_key}; use {unit_key}", constant.name());
    }
    format!("unknown unit or key; use {unit_key}, uncertainty_factor, scaling, source")
}

fn in_range(value: f64, least: f64, most: f64) -> Result<f64, String> {
    if (least..=most).contains(&value) { Ok(value) } else { Err(format!("out of range; use {least} to {most:e}")) }
}

/// A file's values, and the line of each.
struct ValueLines<'a> {
    file: &'a str,
    values: toml::Table,
    lines: BTreeMap<String, usize>,
}

impl<'a> ValueLines<'a> {
    fn of(file: &'a str, text: &str) -> Result<Self, Error> {
        let line_at = |offset: usize| 1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count();
        let refused = |error: &toml::de::Error| {
            let line = error.span().map_or(0, |span| line_at(span.start));
            Error::Content { file: file.to_owned(), reason: format!("line {line}: {}", error.message()) }
        };
        let values: toml::Table = toml::from_str(text).map_err(|error| refused(&error))?;
        let spans = DeTable::parse(text).map_err(|error| refused(&error))?;
        let mut lines = BTreeMap::new();
        record(spans.get_ref(), "", &line_at, &mut lines);
        Ok(Self { file, values, lines })
    }

    /// An error about a key, with its line or that of the table around it.
    fn refuse(&self, key: &str, reason: &str) -> Error {
        let mut around = key;
        let line = loop {
            match (self.lines.get(around), around.rsplit_once('.')) {
                (Some(&line), _) => break line,
                (None, Some((outer, _))) => around = outer,
                (None, None) => break 0,
            }
        };
        let value = key.split('.').try_fold(None::<&toml::Value>, |table, part| {
            let inner = match table {
                None => self.values.get(part),
                Some(table) => table.get(part),
            };
            inner.map(Some)
        });
        let value = value.flatten().filter(|value| !value.is_table()).map(ToString::to_string).unwrap_or_default();
        let (file, key, reason) = (self.file.to_owned(), key.to_owned(), reason.to_owned());
        Error::Config { file, line, key, value, reason }
    }

    fn number(&self, key: &str, range: std::ops::RangeInclusive<f64>, valid: &str) -> Result<Option<f64>, Error> {
        let Some(value) = self.values.get(key) else { return Ok(None) };
        match as_number(value).filter(|value| range.contains(value)) {
            Some(value) => Ok(Some(value)),
            None => Err(self.refuse(key, &format!("out of range; use {valid}"))),
        }
    }

    fn text(&self, key: &str) -> Result<(), Error> {
        match self.values.get(key) {
            None | Some(toml::Value::String(_)) => Ok(()),
            Some(_) => Err(self.refuse(key, "must be a text; use \"my node\"")),
        }
    }

    /// A constant of the file over that of the base.
    fn constant(
        &self,
        constant: Constant,
        constants: &toml::Table,
        below: Option<ConstantValue>,
    ) -> Result<ConstantValue, Error> {
        let (name, unit) = (constant.name(), constant.unit().name());
        let path = format!("constant.{name}");
        let table = match (constants.get(name), &below) {
            (Some(toml::Value::Table(table)), _) => table,
            (Some(_), _) => return Err(self.refuse(&path, &format!("must be a table; use {{ {unit} = 1.0 }}"))),
            (None, Some(_)) => return Ok(below.expect("just matched")),
            (None, None) => return Err(self.refuse(&path, &format!("is missing; use {unit} = 1.0 in [{path}]"))),
        };
        let known = [unit, "uncertainty_factor", "scaling", "source"];
        if let Some(key) = table.keys().find(|key| !known.contains(&key.as_str())) {
            return Err(self.refuse(&format!("{path}.{key}"), &wrong_unit(constant, key)));
        }
        let number = |key: &str, least: f64, most: f64| {
            let Some(value) = table.get(key) else { return Ok(None) };
            let valid = as_number(value).ok_or_else(|| format!("must be a number; use {least} to {most:e}"));
            valid
                .and_then(|value| in_range(value, least, most))
                .map(Some)
                .map_err(|reason| self.refuse(&format!("{path}.{key}"), &reason))
        };
        let value = number(unit, 0.0, CONSTANT_MAX)?.or(below.as_ref().map(|below| below.value));
        let value = value.ok_or_else(|| self.refuse(&path, &format!("has no value; use {unit} = 1.0")))?;
        let factor =
            number("uncertainty_factor", 1.0, 1000.0)?.or(below.as_ref().map(|below| below.uncertainty_factor));
        let scaling = match table.get("scaling").map(|value| value.as_str()) {
            None => below.as_ref().map_or(Scaling::None, |below| below.scaling),
            Some(text) => Scaling::ALL
                .into_iter()
                .find(|scaling| text == Some(scaling.name()))
                .ok_or_else(|| self.refuse(&format!("{path}.scaling"), "not known; use none, analog or digital"))?,
        };
        let source = match table.get("source") {
            None => below.map_or_else(|| format!("{} without a source", self.file), |below| below.source),
            Some(toml::Value::String(source)) => source.clone(),
            Some(_) => return Err(self.refuse(&format!("{path}.source"), "must be a text; use \"measured\"")),
        };
        Ok(ConstantValue { value, uncertainty_factor: factor.unwrap_or(1.0), scaling, source })
    }
}

fn as_number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(value) => Some(*value),
        // Whole numbers up to 2^53 are exact, and greater ones are out of every range.
        toml::Value::Integer(value) => Some(crate::num::f64_from_i64(*value)),
        _ => None,
    }
}

fn record(table: &DeTable<'_>, prefix: &str, line_at: &dyn Fn(usize) -> usize, lines: &mut BTreeMap<String, usize>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        lines.insert(path.clone(), line_at(key.span().start));
        if let DeValue::Table(inner) = value.get_ref() {
            record(inner, &path, line_at, lines);
        }
    }
}
