//! Power over time: within a line in which a row is converted, by block, and its peak over the mean of a frame. What an analog designer
//! sizes rails and decoupling for.

use super::estimate::ESTIMATED_LEVEL;
use super::sensor::SensorSetup;
use super::timing::line_phases;
use crate::energy::{Amount, Constant, EnergyAccount, Item};
use crate::error::Error;
use crate::events::{Block, Event};
use crate::num::{f64_from_u64, f64_from_u128, greater};
use crate::report::energy_record::{LinePower, PowerSpan};
use crate::report::record::Phase;

/// When an item's energy of a line flows.
enum When<'a> {
    /// All the line long, at the given share of its power outside the conversion.
    Bias(f64),
    /// In spans of this lane's beginning and name's beginning.
    In(&'a str, &'a str),
    Always,
}

fn when(item: &Item, idle_bias: f64) -> When<'static> {
    let biases =
        [Constant::ColumnBias, Constant::ComparatorBias, Constant::ComparatorCharge, Constant::PixelComparator];
    if biases.contains(&item.of) {
        return When::Bias(idle_bias);
    }
    match (item.block, item.amount) {
        (Block::Pixel, Amount::Event(Event::PixelReset)) | (Block::Readout, Amount::Event(Event::RowSelect)) => {
            When::In("columns", "settle reset")
        }
        (Block::Pixel, Amount::Event(Event::ChargeTransfer)) => When::In("columns", "settle signal"),
        (Block::Pixel, Amount::Event(_)) => When::In("columns", "settle"),
        (Block::Adc, Amount::Event(_)) => When::In("columns", "ramp"),
        (Block::Link, Amount::Event(_) | Amount::LaneNanoseconds) => When::In("link", ""),
        _ => When::Always,
    }
}

/// Seconds of the overlap of a span with those phases that match.
fn overlap_us(phases: &[Phase], (lane, name): (&str, &str), from_us: f64, to_us: f64) -> f64 {
    let matching = phases.iter().filter(|phase| phase.lane.starts_with(lane) && phase.name.starts_with(name));
    matching.map(|phase| greater(crate::num::lesser(phase.end_us, to_us) - greater(phase.start_us, from_us), 0.0)).sum()
}

impl SensorSetup {
    /// Power over a line of one sensor, with every pixel at 0.4 of the greatest code. Fails on a row that the link cannot carry.
    pub fn line_power(&self) -> Result<LinePower, Error> {
        let (phases, line_us) = (line_phases(self)?, 1e6 * self.schedule.line_time_s());
        let account = self.estimated_energy(ESTIMATED_LEVEL)?;
        let mut edges_us: Vec<f64> = phases.iter().flat_map(|phase| [phase.start_us, phase.end_us]).collect();
        edges_us.extend([0.0, line_us]);
        edges_us.retain(|edge_us| (0.0..=line_us).contains(edge_us));
        edges_us.sort_by(f64::total_cmp);
        edges_us.dedup_by(|after, before| *after - *before < 1e-6);
        let spans = edges_us.windows(2).map(|edge_us| self.span(&account, &phases, (edge_us[0], edge_us[1]), line_us));
        let spans: Vec<PowerSpan> = spans.collect();
        let of = |span: &PowerSpan| span.blocks_mw.iter().map(|(_, mw)| *mw).sum::<f64>();
        let peak_mw = spans.iter().map(of).fold(0.0, greater);
        let mean_mw = account.power_mw();
        let peak_over_mean = if mean_mw > 0.0 { peak_mw / mean_mw } else { 0.0 };
        Ok(LinePower { line_us, spans, frame_mean_mw: mean_mw, peak_mw, peak_over_mean })
    }

    fn span(&self, account: &EnergyAccount, phases: &[Phase], (from_us, to_us): (f64, f64), line_us: f64) -> PowerSpan {
        let powered = &self.power.sensor;
        let conversion_us = 1e6 * powered.conversion_s;
        let lines = f64_from_u64(powered.active_lines.max(1));
        let idle_bias = powered.params.idle_bias;
        let length_us = to_us - from_us;
        let power_mw = |part: &crate::energy::Contribution| {
            // Attojoules a microsecond are 1e-9 mW.
            let line_mw = |share_us: f64, whole_us: f64| {
                let energy_aj = f64_from_u128(part.energy_aj) / lines;
                if whole_us > 0.0 {
                    1e-9 * energy_aj * share_us / whole_us / length_us
                } else {
                    1e-9 * energy_aj / line_us
                }
            };
            let bias_mw = 1e-6 * f64_from_u64(part.item.constant);
            match (when(&part.item, idle_bias), part.item.amount) {
                (When::Bias(idle), _) => {
                    let inside_us = greater(crate::num::lesser(conversion_us, to_us) - from_us, 0.0);
                    bias_mw * (inside_us + idle * (length_us - inside_us)) / length_us
                }
                (_, Amount::Nanoseconds(0)) => 0.0,
                (_, Amount::Nanoseconds(_)) => bias_mw,
                // What a frame counts on its own goes on in blanking too.
                (_, Amount::PerFrame(_)) => account.mean_power_mw(part.energy_aj),
                (When::In(lane, name), _) => {
                    let whole_us = overlap_us(phases, (lane, name), 0.0, line_us);
                    line_mw(overlap_us(phases, (lane, name), from_us, to_us), whole_us)
                }
                (When::Always, _) => line_mw(length_us, line_us),
            }
        };
        let of_block = |block: &Block| {
            let own = account.contributions.iter().filter(|part| part.item.block == *block);
            (block.name(), own.map(power_mw).sum::<f64>())
        };
        PowerSpan { start_us: from_us, end_us: to_us, blocks_mw: Block::ALL.iter().map(of_block).collect() }
    }
}
