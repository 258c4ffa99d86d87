//! A sensor of the user's own: a file beside the scenario that stands for a preset, as in sensor.preset = "./mine.toml".

use toml::Value;

use super::presets::{self, NO_PRESET, PresetKind};
use super::tree::Tree;
use crate::error::Error;

/// Sections that such a file may have: those of the presets that come with the program, and the supplies that its power follows.
const SECTIONS: [&str; 3] = ["sensor", "link", "energy"];

pub(super) fn is_file(name: &str) -> bool {
    name.ends_with(".toml")
}

/// The preset below the file, and the file itself. What the file does not write has the values of the preset that it names, or of the
/// base. Fails on a file that cannot be read, is no TOML, has other sections, or builds on another file.
pub(super) fn layers(name: &str, read: &dyn Fn(&str) -> Result<Vec<u8>, Error>) -> Result<[Tree; 2], Error> {
    let bytes = read(name.strip_prefix("./").unwrap_or(name))?;
    let text = String::from_utf8(bytes).map_err(|_| Error::Content {
        file: name.to_owned(),
        reason: "is no UTF-8 text; use a TOML file with a [sensor] section".to_owned(),
    })?;
    let own = Tree::parse(name, &text)?;
    if let Some(other) = own.values().keys().find(|key| !SECTIONS.contains(&key.as_str())) {
        let reason = "does not belong in a sensor file; use [sensor], [link] and [energy] here, and write the rest in the scenario";
        return Err(own.locate(Error::key(other, "", reason)));
    }
    if !matches!(own.get("sensor"), Some(Value::Table(_))) {
        let reason = "has no [sensor] section; a sensor file needs one".to_owned();
        return Err(Error::Content { file: name.to_owned(), reason });
    }
    let base = match own.get("sensor.preset").and_then(Value::as_str) {
        Some(NO_PRESET) | None => PresetKind::Sensor.base(),
        Some(named) if is_file(named) => {
            let reason = format!("names another file; use one of {}", presets::names(PresetKind::Sensor).join(", "));
            return Err(own.locate(Error::key("sensor.preset", "", reason)));
        }
        Some(named) => named,
    };
    let preset = presets::find(PresetKind::Sensor, base)
        .map_err(|error| own.locate(Error::key("sensor.preset", "", error.to_string())))?;
    Ok([Tree::parse(&format!("preset {base}"), preset.text)?, own])
}

#[cfg(test)]
mod tests {
    use super::super::Resolved;
    use super::*;

    const SCENARIO: &str = "[sensor]\npreset = \"./mine.toml\"\n[sensor.adc]\nbits = 9\n";

    fn resolved(file: &str) -> Result<Resolved, Error> {
        let read = |name: &str| {
            assert_eq!(name, "mine.toml");
            Ok(file.as_bytes().to_vec())
        };
        Resolved::from_layers_and_files("scene.toml", SCENARIO, &[], &read)
    }

    #[test]
    fn a_sensor_file_stands_between_its_preset_and_the_scenario() {
        let mine =
            resolved("[sensor]\npreset = \"ov7251\"\nwidth = 320\nheight = 240\n[sensor.adc]\nbits = 8\n").unwrap();
        let sensor = &mine.scenario.sensor;
        assert_eq!((sensor.width, sensor.height, sensor.adc.bits), (320, 240, 9));
        let layer = |key: &str| mine.tree.origin(key).unwrap().layer.clone();
        assert_eq!(layer("sensor.width"), "./mine.toml");
        assert_eq!(layer("sensor.pixel.pitch_um"), "preset ov7251");
        assert_eq!(layer("sensor.adc.bits"), "scene.toml");
        assert_eq!(mine.label(PresetKind::Sensor), "./mine.toml, changed: adc.bits");
        // The record has every value, and needs no file.
        let again = Resolved::from_layers("config.toml", &mine.recorded_text(), &[]).unwrap();
        assert_eq!((again.hash(), again.scenario.sensor.width), (mine.hash(), 320));
        let plain = resolved("[sensor]\nwidth = 320\n").unwrap();
        assert_eq!(plain.tree.origin("sensor.height").unwrap().layer, "preset paper_6t_vga");
    }

    #[test]
    fn a_sensor_file_with_a_scenario_s_keys_or_without_a_sensor_is_refused_by_file_line_and_key() {
        for (file, words) in [
            (
                "[sensor]\nwidth = 320\n[scene]\ntarget = \"flat\"\n",
                &["./mine.toml:3", "scene", "write the rest in the scenario"][..],
            ),
            ("seed = 1\n[sensor]\n", &["./mine.toml:1", "seed"]),
            ("[link]\nlanes = 2\n", &["mine.toml", "[sensor]"]),
            ("[sensor]\npreset = \"other.toml\"\n", &["./mine.toml:2", "sensor.preset", "ov7251"]),
            ("[sensor]\npreset = \"nothing\"\n", &["./mine.toml:2", "sensor.preset", "ov7251"]),
            ("[sensor]\nwidht = 320\n", &["./mine.toml:2", "width"]),
            ("[sensor\n", &["mine.toml", "line 1"]),
        ] {
            let error = resolved(file).err().expect("refused").to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{file}: {error}");
        }
        let error = Resolved::from_layers("scene.toml", SCENARIO, &[]).err().expect("refused").to_string();
        assert!(error.contains("preset"), "{error}");
    }
}
