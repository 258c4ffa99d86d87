//! From `[energy]` and `[host]` to what the energy model takes, and the technology that a scenario names.

use super::check::{member, within};
use super::resolved::Resolved;
use super::scenario::Scenario;
use crate::energy::{Architecture, EnergyParams, HostParams, Periphery, Port, Technology};
use crate::error::Error;

impl Scenario {
    /// Keys of `[energy]` beside its constants. Fails on values out of range, unknown words.
    pub fn energy_params(&self) -> Result<EnergyParams, Error> {
        let energy = &self.energy;
        let within_option = |key: &str, value: Option<f64>, least: f64, most: f64| {
            value.map(|value| within(key, value, least..=most, &format!("{least} to {most}"))).transpose()
        };
        if let Some(year) = energy.year {
            within("energy.year", year, 1990..=2100, "1990 to 2100")?;
        }
        if let Some(lanes) = energy.port_lanes {
            within("energy.port_lanes", lanes, 1..=128, "1 to 128")?;
        }
        Ok(EnergyParams {
            adc_architecture: member("energy.adc", &energy.adc, &Architecture::ALL, Architecture::name)?,
            port: member("energy.port", &energy.port, &Port::ALL, Port::name)?,
            port_lanes: energy.port_lanes,
            periphery: member("energy.periphery", &energy.periphery, &Periphery::ALL, Periphery::name)?,
            image_processor: energy.image_processor,
            digital_v: within_option("energy.digital_v", energy.digital_v, 0.2, 5.5)?,
            io_v: within("energy.io_v", energy.io_v, 0.2..=5.5, "0.2 to 5.5")?,
            idle_bias: within("energy.idle_bias", energy.idle_bias, 0.0..=1.0, "0 to 1")?,
            pixel_node_nm: within_option("energy.pixel_node_nm", energy.pixel_node_nm, 5.0, 1000.0)?,
            period_s: within_option("energy.sleep_period_ms", energy.sleep_period_ms, 0.001, 86_400_000.0)?
                .map(|period_ms| 1e-3 * period_ms),
            wake_s: 1e-6 * within("energy.wake_us", energy.wake_us, 0.0..=1e7, "0 to 1e7")?,
        })
    }

    /// The host's model; none where `host.model` is "none". Fails on values out of range, an unknown model, keys of a host that is not
    /// there.
    pub fn host_params(&self) -> Result<Option<HostParams>, Error> {
        let host = &self.host;
        let keys: [(&str, Option<f64>, f64, fn(&mut HostParams) -> &mut f64); 10] = [
            ("host.receive_pj_per_byte", host.receive_pj_per_byte, 1e9, |params| &mut params.receive_pj_per_byte),
            ("host.extract_pj_per_pixel", host.extract_pj_per_pixel, 1e9, |params| &mut params.extract_pj_per_pixel),
            ("host.track_uj_per_frame", host.track_uj_per_frame, 1e9, |params| &mut params.track_uj_per_frame),
            ("host.track_nj_per_feature", host.track_nj_per_feature, 1e9, |params| &mut params.track_nj_per_feature),
            ("host.idle_mw", host.idle_mw, 1e6, |params| &mut params.idle_mw),
            ("host.clock_hz", host.clock_hz, 1e11, |params| &mut params.clock_hz),
            ("host.decode_clk_per_byte", host.decode_clk_per_byte, 1e9, |params| &mut params.decode_clk_per_byte),
            ("host.extract_clk_per_pixel", host.extract_clk_per_pixel, 1e9, |params| &mut params.extract_clk_per_pixel),
            ("host.track_clk_per_frame", host.track_clk_per_frame, 1e12, |params| &mut params.track_clk_per_frame),
            ("host.track_clk_per_feature", host.track_clk_per_feature, 1e12, |params| {
                &mut params.track_clk_per_feature
            }),
        ];
        let Some(mut params) = HostParams::by_name(&host.model)? else {
            let reason = "has no effect here; use host.model = \"microcontroller\" with it, or leave it out";
            let given = keys.iter().find_map(|(key, value, ..)| value.map(|value| (key, value)));
            return given.map_or(Ok(None), |(key, value)| Err(Error::key(key, value, reason)));
        };
        for (key, value, most, field) in keys {
            if let Some(value) = value {
                // A host whose clock stands still never answers.
                let least = if key == "host.clock_hz" { 1e3 } else { 0.0 };
                *field(&mut params) = within(key, value, least..=most, &format!("{least} to {most:e}"))?;
            }
        }
        Ok(Some(params))
    }
}

impl Resolved {
    /// Reads the technology file that the scenario names, and those that it extends. Without such a file nothing is read. Fails on a file
    /// that is not there or no text.
    pub fn read_technology(&mut self, read: &dyn Fn(&str) -> Result<Vec<u8>, Error>) -> Result<(), Error> {
        let mut wanted = vec![self.scenario.energy.technology.clone()];
        while let Some(name) = wanted.pop() {
            if !Technology::is_file(&name) || self.technology_files.contains_key(&name) {
                continue;
            }
            let refused = |error: Error| self.tree.locate(error.named_by("energy.technology", &name));
            let bytes = read(&name).map_err(refused)?;
            let text = String::from_utf8(bytes).map_err(|_| {
                refused(Error::Content { file: name.clone(), reason: "is no UTF-8 text; use a TOML file".to_owned() })
            })?;
            // A file that is no TOML is refused where it is used, with its line.
            let table: toml::Table = toml::from_str(&text).unwrap_or_default();
            wanted.extend(table.get("extends").and_then(toml::Value::as_str).map(str::to_owned));
            self.technology_files.insert(name, text);
        }
        Ok(())
    }

    /// The technology that the scenario names, with the constants that it sets. Fails on an unknown name, a file that was not read or is
    /// not as it should be, constants out of range.
    pub fn technology(&self) -> Result<Technology, Error> {
        let energy = &self.scenario.energy;
        let name = match energy.technology.as_str() {
            "auto" => Technology::auto_name(energy.digital_v, energy.year),
            name => name,
        };
        let read = |name: &str| {
            let missing =
                || Error::key("energy.technology", name, "was not read; use 65nm, or a file beside the scenario");
            self.technology_files.get(name).cloned().ok_or_else(missing)
        };
        let mut technology = Technology::load(name, &read).map_err(|error| match error {
            unknown @ Error::Unknown { .. } => Error::key("energy.technology", name, unknown.to_string()),
            other => other,
        })?;
        for (constant, values) in &energy.constant {
            for (unit, &value) in values {
                technology.set(constant, unit, value)?;
            }
        }
        Ok(technology)
    }
}
