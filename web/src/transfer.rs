//! Photon transfer of the page's sensor, measured as EMVA 1288 measures it, under uniform light.

use sensel::characterize::analysis::{Summary, figures};
use sensel::characterize::{MeasurementSize, SensorBench};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::run::Progress;
use sensel::units::Size;
use serde_json::{Value, json};

use crate::host::Tell;

/// Pixels that are measured: enough for a variance to half a percent of itself.
const SIZE: Size = Size { width_px: 128, height_px: 96 };

/// The series' points and the figures read off them.
pub fn measured(resolved: &Resolved) -> Result<Value, Error> {
    let sensor_size = resolved.scenario.size()?;
    let size = Size {
        width_px: SIZE.width_px.min(sensor_size.width_px),
        height_px: SIZE.height_px.min(sensor_size.height_px),
    };
    let options = MeasurementSize { size: Some(size), points: 40, stack: 32, ..MeasurementSize::default() };
    let bench = SensorBench::new(resolved, &options)?;
    let frames = sensel::num::f64_from_u64(bench.set().frames());
    let measurement = bench.run(|shot, _| {
        Tell.at("photon transfer", f64::from(shot.frame.0) / frames);
        Ok(())
    })?;
    let summary = Summary::of(&measurement);
    let points = summary.transfer.points.iter().map(|point| {
        json!({
            "photons": point.photons,
            "signal_dn": point.signal_dn(),
            "variance_dn2": point.variance_dn2 - point.dark_variance_dn2,
            "total_dn2": point.variance_dn2,
        })
    });
    let points: Vec<Value> = points.collect();
    Ok(json!({
        "points": points,
        "saturation": summary.transfer.saturation(),
        "fitted": summary.transfer.sensitivity().len(),
        "figures": figures(&summary),
    }))
}
