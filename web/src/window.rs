//! The window around a corner as the extractor sees it: words of its pipeline, and the circle of 16 pixels that decides the score.

use sensel::compute::blocks::{BORDER_PX, CIRCLE};
use sensel::error::Error;
use sensel::num::{f64_from_usize, index, u64_from};
use sensel::run::SensorSetup;
use sensel::run::session::CameraFrame;
use serde_json::{Value, json};

/// Pixels from the corner to the window's edge.
const REACH_PX: usize = 7;

/// The window of a feature of a frame.
pub fn corner(sensor: &SensorSetup, camera: &CameraFrame, number: u32) -> Result<Value, Error> {
    let Some(feature) = camera.features.get(index(number)) else {
        let reason = format!("not one of the {} features of this frame", camera.features.len());
        return Err(Error::key("feature", number, reason));
    };
    let (x_px, y_px) = feature.pixel();
    let (x, y) = (index(x_px), index(y_px));
    let params = &sensor.extractor;
    let words = sensel::compute::to_bits(&camera.codes, sensor.bits(), params.pipeline_bits);
    let (left, top) = (x.saturating_sub(REACH_PX), y.saturating_sub(REACH_PX));
    let (right, bottom) = ((x + REACH_PX + 1).min(words.width_px()), (y + REACH_PX + 1).min(words.height_px()));
    let rows: Vec<&[u16]> = (top..bottom).map(|row| &words.row(row)[left..right]).collect();
    let circle: Vec<[f64; 2]> = CIRCLE
        .iter()
        .map(|&(dx, dy)| [dx, dy].map(|offset| f64_from_usize(offset) - f64_from_usize(BORDER_PX)))
        .collect();
    Ok(json!({
        "number": number,
        "x": feature.x_px(),
        "y": feature.y_px(),
        "pixel": [x_px, y_px],
        "score": feature.score,
        "angle_turns": f64::from(feature.angle),
        "octave": feature.octave,
        "bits": params.pipeline_bits,
        "threshold": params.threshold,
        "smoothed": sensor.bits() <= 4,
        "left": u64_from(left),
        "top": u64_from(top),
        "values": rows,
        "circle": circle,
        "descriptor": feature.descriptor,
        "out_clk": camera.features_clk.get(index(number)),
        "pixel_rate_hz": sensor.schedule.pixel_rate_hz(),
    }))
}
