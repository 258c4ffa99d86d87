//! What a scenario takes over from presets and defaults, and what a person should call its sensor and its lens.

use serde::Serialize;
use toml::{Table, Value};

use super::presets::{NO_PRESET, PresetKind};
use super::resolved::Resolved;

/// Changed keys that a label names.
const NAMED_MOST: usize = 3;

/// A value that the user did not write.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inherited {
    /// Dotted path.
    pub key: String,
    /// As TOML.
    pub value: Value,
    /// `preset NAME`, or `defaults`.
    pub layer: String,
    /// Counted from 1.
    pub line: usize,
}

impl Resolved {
    /// Every value of a section that comes from a preset or from the defaults, sorted by key.
    pub fn inherited(&self, section: &str) -> Vec<Inherited> {
        let mut leaves = Vec::new();
        collect(self.tree.values(), "", &mut leaves);
        let inside = format!("{section}.");
        leaves.retain(|(key, _)| key.starts_with(&inside));
        let inherited = |(key, value): (String, &Value)| {
            let origin = self.tree.origin(&key).filter(|_| !self.is_written(&key))?;
            Some(Inherited { value: value.clone(), layer: origin.layer.clone(), line: origin.line, key })
        };
        leaves.into_iter().filter_map(inherited).collect()
    }

    /// Whether the user wrote this key, in the scenario or on the command line.
    pub fn is_written(&self, key: &str) -> bool {
        self.tree.origin(key) != self.below.origin(key)
    }

    /// Where a value stands, in words.
    pub fn location_of(&self, key: &str) -> String {
        match self.tree.origin(key) {
            Some(origin) if origin.line > 0 => format!("{}:{}", origin.layer, origin.line),
            Some(origin) => origin.layer.clone(),
            None => "not written".to_owned(),
        }
    }

    /// What to call the sensor or the lens: the preset that the scenario names and what it changes. A scenario that names none is not
    /// called after the one whose values it takes over.
    pub fn label(&self, kind: PresetKind) -> String {
        let section = kind.section();
        let named = self.tree.get(&format!("{section}.preset")).and_then(Value::as_str).unwrap_or(NO_PRESET);
        let changed = self.changed(section);
        let list = match changed.len() {
            0 => String::new(),
            1..=NAMED_MOST => changed.join(", "),
            more => format!("{} and {} more", changed[..NAMED_MOST].join(", "), more - NAMED_MOST),
        };
        match (named == NO_PRESET, changed.is_empty()) {
            (false, true) => named.to_owned(),
            (false, false) => format!("{named}, changed: {list}"),
            (true, true) => format!("no preset (values of {})", kind.base()),
            (true, false) => format!("no preset (values of {} but for {list})", kind.base()),
        }
    }

    /// Keys of a section, without its name, to which the user gave other values than presets and defaults do.
    fn changed(&self, section: &str) -> Vec<String> {
        let mut leaves = Vec::new();
        collect(self.tree.values(), "", &mut leaves);
        let (inside, preset) = (format!("{section}."), format!("{section}.preset"));
        let changed = leaves
            .iter()
            .filter(|(key, value)| key.starts_with(&inside) && *key != preset && self.below.get(key) != Some(*value));
        changed.map(|(key, _)| key[inside.len()..].to_owned()).collect()
    }

    /// What a user should know of values that were taken over: those that scale what the user wrote.
    pub fn inheritance_warnings(&self) -> Vec<String> {
        let (factor, efficiency) = ("sensor.pixel.fill_factor", "sensor.pixel.quantum_efficiency");
        let by_filter = "sensor.pixel.qe_by_filter";
        let fill_factor = self.scenario.sensor.pixel.fill_factor;
        let written =
            [efficiency, by_filter].into_iter().find(|key| self.tree.get(key).is_some() && self.is_written(key));
        let Some(written) = written.filter(|_| !self.is_written(factor) && fill_factor != 1.0) else {
            return Vec::new();
        };
        let effect = match self.scenario.sensor.pixel.quantum_efficiency {
            Some(own) if written == efficiency => {
                format!("{written} = {own} to {}", (1e6 * own * fill_factor).round_ties_even() / 1e6)
            }
            _ => format!("every efficiency of {written}"),
        };
        let location = self.location_of(factor);
        vec![format!(
            "{factor} = {fill_factor} is inherited ({location}) and scales {effect}; write {factor} = 1.0 to keep it, or the pixel's own"
        )]
    }
}

/// Every value that is no table, with its dotted path, sorted.
fn collect<'a>(table: &'a Table, prefix: &str, leaves: &mut Vec<(String, &'a Value)>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Table(inner) => collect(inner, &path, leaves),
            _ => leaves.push((path, value)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(text: &str) -> Resolved {
        Resolved::from_layers("mine.toml", text, &[]).unwrap()
    }

    #[test]
    fn a_sensor_without_a_preset_is_not_called_after_one() {
        let cases = [
            ("", "no preset (values of paper_6t_vga)"),
            ("[sensor]\nwidth = 320\n", "no preset (values of paper_6t_vga but for width)"),
            ("[sensor]\npreset = \"paper_6t_vga\"\n", "paper_6t_vga"),
            ("[sensor]\npreset = \"ov7251\"\n[sensor.adc]\nbits = 8\n", "ov7251, changed: adc.bits"),
            (
                "[sensor]\npreset = \"ov7251\"\nheight = 64\nwidth = 64\n[sensor.adc]\nbits = 8\nclock_hz = 470000000\n",
                "ov7251, changed: adc.bits, adc.clock_hz, height and 1 more",
            ),
        ];
        for (text, expected) in cases {
            let first = resolved(text);
            assert_eq!(first.label(PresetKind::Sensor), expected, "{text}");
            // The configuration that a run writes has the same label, and the same hash.
            let again = resolved(&first.recorded_text());
            assert_eq!((again.label(PresetKind::Sensor), again.hash()), (expected.to_owned(), first.hash()), "{text}");
        }
        assert_eq!(resolved("").label(PresetKind::Lens), "no preset (values of pinhole_90)");
        assert_eq!(resolved("[optics]\npreset = \"kb4_120\"\n").label(PresetKind::Lens), "kb4_120");
    }

    #[test]
    fn what_is_inherited_is_listed_with_its_location_and_what_is_written_is_not() {
        let mine = resolved("[sensor.pixel]\nquantum_efficiency = 0.6\n");
        let inherited = mine.inherited("sensor");
        let of = |key: &str| inherited.iter().find(|value| value.key == key);
        let fill_factor = of("sensor.pixel.fill_factor").unwrap();
        assert_eq!((fill_factor.layer.as_str(), &fill_factor.value), ("preset paper_6t_vga", &Value::Float(0.9)));
        assert!(fill_factor.line > 0 && of("sensor.pixel.quantum_efficiency").is_none());
        assert!(of("sensor.corner").unwrap().layer == "defaults" && inherited.len() > 60, "{}", inherited.len());
    }

    #[test]
    fn an_inherited_factor_on_a_written_efficiency_is_said() {
        let said = resolved("[sensor.pixel]\nquantum_efficiency = 0.6\n").inheritance_warnings();
        assert!(
            said.len() == 1 && said[0].contains("fill_factor = 0.9") && said[0].contains("0.6 to 0.54"),
            "{said:?}"
        );
        let said = resolved("[sensor.pixel.qe_by_filter]\nM = [0.1, 0.2, 0.3]\n").inheritance_warnings();
        assert!(said.len() == 1 && said[0].contains("qe_by_filter"), "{said:?}");
        for silent in
            ["", "[sensor.pixel]\nfill_factor = 0.8\nquantum_efficiency = 0.6\n", "[sensor]\npreset = \"ov7251\"\n"]
        {
            assert_eq!(resolved(silent).inheritance_warnings(), Vec::<String>::new(), "{silent}");
        }
    }
}
