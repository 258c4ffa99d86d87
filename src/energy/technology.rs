//! Energy constants of one technology, each with unit, node, voltage, source and uncertainty. Enters: TOML. Leaves:
//! checked constants in integer attojoules and nanowatts.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::error::Error;
use crate::events::{Block, Event};
use crate::num::u64_half_even;

/// The technologies that come with the program, by name.
const KNOWN: &[(&str, &str)] = &[("65nm", include_str!("65nm.toml")), ("28nm", include_str!("28nm.toml"))];

/// What one event costs.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EventEnergy {
    /// Picojoules a time.
    pub energy_pj: f64,
    /// What is counted once.
    pub unit: String,
    /// Node that the constant holds for, in nm.
    pub node_nm: f64,
    /// Supply that the constant holds for, in V.
    pub voltage_v: f64,
    /// The true value lies within this factor both ways, with 95 % confidence. At least 1.
    pub uncertainty_factor: f64,
    /// Where it comes from.
    pub source: String,
}

/// What a block draws whether or not anything happens.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaticPower {
    /// Milliwatts of one sensor.
    pub power_mw: f64,
    /// Node that the constant holds for, in nm.
    pub node_nm: f64,
    /// Supply that the constant holds for, in V.
    pub voltage_v: f64,
    /// The true value lies within this factor both ways, with 95 % confidence. At least 1.
    pub uncertainty_factor: f64,
    /// Where it comes from.
    pub source: String,
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    title: String,
    node_nm: f64,
    core_voltage_v: f64,
    rule: String,
    event: BTreeMap<String, EventEnergy>,
    #[serde(rename = "static")]
    static_power: BTreeMap<String, StaticPower>,
}

/// All constants of one technology.
#[derive(Clone, Debug, PartialEq)]
pub struct Technology {
    /// Name in configurations.
    pub name: String,
    /// For a person.
    pub title: String,
    /// Node of the logic, in nm.
    pub node_nm: f64,
    /// Supply of the logic, in V.
    pub core_voltage_v: f64,
    /// How the constants were brought to this node.
    pub rule: String,
    /// One for each of `Event::ALL`, in that order.
    events: Vec<EventEnergy>,
    /// One for each of `Block::ALL`, in that order.
    static_powers: Vec<StaticPower>,
}

impl Technology {
    /// Names that `by_name` knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        KNOWN.iter().map(|(name, _)| *name)
    }

    /// A technology that comes with the program.
    ///
    /// # Errors
    /// A name that is not among `names()`.
    pub fn by_name(name: &str) -> Result<Self, Error> {
        let unknown = || Error::Unknown {
            what: "technology",
            name: name.to_owned(),
            known: Self::names().collect::<Vec<_>>().join(", "),
        };
        let (name, text) = KNOWN.iter().find(|(known, _)| *known == name).ok_or_else(unknown)?;
        Self::parse(&format!("{name}.toml"), text)
    }

    /// Reads a technology file; `file` is its name for messages.
    ///
    /// # Errors
    /// Unknown or missing keys, an event or block without a constant, a negative energy, an uncertainty factor below 1.
    pub fn parse(file: &str, text: &str) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Content { file: file.to_owned(), reason };
        let mut parsed: File = toml::from_str(text).map_err(|error| refuse(error.to_string()))?;
        let events =
            take_all(&mut parsed.event, "event", Event::ALL.iter().map(|event| event.name())).map_err(refuse)?;
        let blocks = Block::ALL.iter().map(|block| block.name());
        let static_powers = take_all(&mut parsed.static_power, "static", blocks).map_err(refuse)?;
        for (event, constant) in Event::ALL.iter().zip(&events) {
            check(event.name(), constant.energy_pj, constant.uncertainty_factor).map_err(refuse)?;
        }
        for (block, constant) in Block::ALL.iter().zip(&static_powers) {
            check(block.name(), constant.power_mw, constant.uncertainty_factor).map_err(refuse)?;
        }
        let File { name, title, node_nm, core_voltage_v, rule, .. } = parsed;
        Ok(Self { name, title, node_nm, core_voltage_v, rule, events, static_powers })
    }

    /// The same without the static power of a block that a design leaves out.
    #[must_use]
    pub fn without(mut self, block: Block) -> Self {
        self.static_powers[block as usize].power_mw = 0.0;
        self
    }

    /// The constant of an event.
    pub fn event(&self, event: Event) -> &EventEnergy {
        &self.events[event as usize]
    }

    /// The static power of a block of one sensor.
    pub fn static_power(&self, block: Block) -> &StaticPower {
        &self.static_powers[block as usize]
    }

    /// Energy of one event in attojoules, rounded half-even from the file's picojoules.
    pub fn energy_aj(&self, event: Event) -> u64 {
        u64_half_even(self.event(event).energy_pj * 1e6)
    }

    /// Static power of one sensor's block in nanowatts, rounded half-even from the file's milliwatts.
    pub fn power_nw(&self, block: Block) -> u64 {
        u64_half_even(self.static_power(block).power_mw * 1e6)
    }
}

/// Takes one entry for each name, in the names' order; says which are missing or too many.
fn take_all<T>(
    entries: &mut BTreeMap<String, T>,
    kind: &str,
    names: impl Iterator<Item = &'static str>,
) -> Result<Vec<T>, String> {
    let mut taken = Vec::new();
    for name in names {
        taken.push(entries.remove(name).ok_or_else(|| format!("[{kind}.{name}] is missing"))?);
    }
    match entries.keys().next() {
        Some(name) => Err(format!("[{kind}.{name}] is not known")),
        None => Ok(taken),
    }
}

/// The greatest constant that stays within its integer: 10^9 pJ (or mW) is 10^15 aJ (or nW).
const CONSTANT_MAX: f64 = 1e9;

fn check(name: &str, value: f64, uncertainty_factor: f64) -> Result<(), String> {
    if !(0.0..=CONSTANT_MAX).contains(&value) {
        return Err(format!("{name} = {value}: a constant lies between 0 and {CONSTANT_MAX:e}"));
    }
    if !(1.0..=1000.0).contains(&uncertainty_factor) {
        return Err(format!("{name}: uncertainty_factor = {uncertainty_factor}: a factor lies between 1 and 1000"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technology_of_the_program_is_whole_and_bears_its_name() {
        let names: Vec<_> = Technology::names().collect();
        assert!(names.len() >= 2);
        for name in names {
            let technology = Technology::by_name(name).unwrap();
            assert_eq!(technology.name, name);
            for &event in Event::ALL {
                assert!(technology.energy_aj(event) > 0, "{name}: {}", event.name());
                assert!(technology.event(event).source.len() > 10);
            }
        }
    }

    #[test]
    fn an_unknown_technology_is_refused_with_the_known_ones() {
        let message = Technology::by_name("7nm").unwrap_err().to_string();
        assert!(message.contains("65nm, 28nm"), "{message}");
    }

    /// The rule stated in 28nm.toml: digital constants times (28 / 65) (0.9 / 1.2)^2, all others as they are.
    #[test]
    fn the_smaller_node_follows_its_stated_rule() {
        let (large, small) = (Technology::by_name("65nm").unwrap(), Technology::by_name("28nm").unwrap());
        let digital = (28.0 / 65.0) * (0.9 / 1.2) * (0.9 / 1.2);
        let mut scaled = 0;
        for &event in Event::ALL {
            let ratio = small.event(event).energy_pj / large.event(event).energy_pj;
            let expected = if small.event(event).node_nm < 65.0 { digital } else { 1.0 };
            scaled += usize::from(expected < 1.0);
            // The files hold six digits.
            assert!((ratio / expected - 1.0).abs() < 1e-5, "{}: {ratio}", event.name());
        }
        assert_eq!(scaled, 9);
    }

    #[test]
    fn a_broken_file_is_refused_and_the_message_names_the_place() {
        let good = KNOWN[0].1;
        for (from, to, part) in [
            ("[event.ramp_step]", "[event.rampstep]", "ramp_step"),
            ("[static.link]", "[static.links]", "link"),
            ("energy_pj = 3.0", "energy_pj = -3.0", "line_buffer_write"),
            ("uncertainty_factor = 5.0", "uncertainty_factor = 0.5", "column_settle"),
            ("node_nm = 65\ncore", "colour = 1\nnode_nm = 65\ncore", "colour"),
        ] {
            assert!(good.contains(from), "{from}");
            let message = Technology::parse("t.toml", &good.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains("t.toml") && message.contains(part), "{message}");
        }
    }
}
