//! One pixel on its way to a code: its figures, and the waveforms of its converter as the clocked twins compute them.

use sensel::error::Error;
use sensel::num::index;
use sensel::units::CameraIndex;
use sensel::waves::{Asked, SignalId, Value, WavePlan, WaveRow, Waves};
use serde_json::json;

use crate::{Session, check_inside};

/// Numbers an instant: time in us from the start of the row's line, sequencer phase, ramp in uV, comparator input in uV, comparator,
/// counter, latch, code. NaN: not known.
const FIELDS: usize = 8;

impl Session {
    /// Photons, electrons, microvolts and code of a pixel, with what turns one into the next.
    pub(crate) fn probed(&mut self, x_px: u32, y_px: u32) -> Result<serde_json::Value, Error> {
        let size = self.run.setup().sensor.size;
        check_inside(size, x_px, y_px)?;
        let pixel_index = index(y_px) * index(size.width_px) + index(x_px);
        let taken = self.taken()?;
        let electrons = taken.electrons.values()[pixel_index];
        let row = &taken.samples[index(y_px)];
        let (signal_uv, reset_uv) = (row.signal_uv[index(x_px)], row.reset_uv.get(index(x_px)).copied());
        let camera = &self.last()?.cameras[0];
        let sensor = &self.run.setup().sensor;
        let (pixel, adc) = (&sensor.parameters.pixel, &sensor.parameters.adc);
        Ok(json!({
            "x": x_px,
            "y": y_px,
            "photons": camera.photons.values()[pixel_index],
            "electrons": electrons,
            "signal_uv": signal_uv,
            "reset_uv": reset_uv,
            "code": camera.codes.values()[pixel_index],
            "bits": sensor.bits(),
            "black_level_dn": adc.black_level_dn,
            "lsb_uv": adc.lsb_uv(),
            "conversion_gain_uv_per_e": pixel.conversion_gain_uv_per_e,
            "quantum_efficiency": pixel.quantum_efficiency * pixel.fill_factor,
            "full_well_e": pixel.full_well_e,
            "code_max": adc.code_max(),
        }))
    }

    /// The waveforms of one pixel's row and column.
    pub(crate) fn waves(&mut self, x_px: u32, y_px: u32) -> Result<Waves, Error> {
        check_inside(self.run.setup().sensor.size, x_px, y_px)?;
        let samples = self.taken()?.samples[index(y_px)].clone();
        let setup = self.run.setup();
        let (row, column) = (y_px.to_string(), x_px.to_string());
        let asked = Asked { rows: Some(&row), columns: Some(&column), frame: Some(0) };
        let plan = WavePlan::new(&setup.sensor, asked, 1).map_err(|error| setup.resolved.tree.locate(error))?;
        let chain = setup.first_chain();
        let columns = chain.first_columns(CameraIndex(0), samples.signal_uv.len());
        plan.waves(&columns, &[WaveRow { samples, sent: None }])
    }

    /// The signals of the converter alone, one row of numbers for each instant of the line at which one of them changes.
    pub(crate) fn converted(&mut self, x_px: u32, y_px: u32) -> Result<Vec<f64>, Error> {
        let waves = self.waves(x_px, y_px)?;
        let column = format!("column_{x_px}");
        let named = [
            ("sequencer", "phase"),
            ("ramp", "ramp_uv"),
            (&column, "comparator_input_uv"),
            (&column, "comparator"),
            (&column, "counter"),
            (&column, "latched"),
            (&column, "code"),
        ];
        let signals = named.map(|(scope, name)| waves.find(scope, name));
        Ok(instants(&waves, signals))
    }
}

/// Values of these signals at each instant at which one of them changes, from the instant on at which the sequencer is known.
fn instants(waves: &Waves, signals: [Option<SignalId>; FIELDS - 1]) -> Vec<f64> {
    let mut held = [f64::NAN; FIELDS - 1];
    let mut counter_bits = 64;
    if let Some(SignalId(signal)) = signals[4]
        && let sensel::waves::SignalKind::Signed(bits) = waves.signals[signal].kind
    {
        counter_bits = bits;
    }
    let (mut table, mut start_ps) = (Vec::new(), None);
    for at_once in waves.changes.chunk_by(|before, after| before.time_ps == after.time_ps) {
        let mut changed = false;
        for change in at_once {
            let Some(field) = signals.iter().position(|signal| *signal == Some(change.signal)) else { continue };
            held[field] = match change.value {
                Value::Real(value) => value,
                Value::Unknown => f64::NAN,
                Value::Bits(word) if field == 4 => sensel::num::f64_from_i64(signed(word, counter_bits)),
                Value::Bits(word) => sensel::num::f64_from_u64(word),
            };
            changed = true;
        }
        if !changed || held[0].is_nan() {
            continue;
        }
        let start_ps = *start_ps.get_or_insert(at_once[0].time_ps);
        table.push(1e-6 * sensel::num::f64_from_u64(at_once[0].time_ps - start_ps));
        table.extend(held);
    }
    table
}

/// The two's complement number in the low bits of a word.
fn signed(word: u64, bits: u32) -> i64 {
    let unused = 64 - bits.clamp(1, 64);
    (word << unused).cast_signed() >> unused
}
