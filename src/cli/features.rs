//! `sensel features`: the extractor alone, on a picture.

use std::fmt::Write as _;
use std::path::Path;

use sensel::compute::{self, ExtractorParams, Feature};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::events::Events;
use sensel::files::picture;
use serde_json::json;

use super::args::{FeaturesArguments, Shared};
use super::{listing, place};

/// `sensel features`.
pub fn main(arguments: &FeaturesArguments, shared: &Shared) -> Result<(), Error> {
    let (codes, bits) = picture::read_grey(&arguments.image)?;
    let mut assignments = shared.set.clone();
    assignments.extend(arguments.threshold.map(|threshold| format!("compute.threshold={threshold}")));
    assignments.extend(arguments.detector.as_ref().map(|name| format!("compute.detector='{name}'")));
    let resolved = Resolved::from_layers("command line", "", &assignments)?;
    let mut params = resolved.scenario.extractor().map_err(|error| resolved.tree.locate(error))?;
    if arguments.detector.is_some() {
        // The named detector alone: every corner at its pixel, no grid and no choice.
        params = ExtractorParams { top_k: None, subpixel: false, ..params };
    }
    let size = codes.size();
    if size.width_px < 7 || size.height_px < 7 {
        let reason = format!("is {} x {} pixels; FAST-9 needs at least 7 x 7", size.width_px, size.height_px);
        return Err(Error::Content { file: arguments.image.display().to_string(), reason });
    }
    ExtractorParams::check_size(size)?;
    let features = compute::extract(&codes, bits, &params, &mut Events::default());
    if shared.json {
        listing::print_json(&json!({"features": features.iter().map(as_json).collect::<Vec<_>>()}));
        return Ok(());
    }
    let table = csv(&features);
    match &shared.out {
        Some(file) => write(file, &table),
        None => {
            out!("{table}");
            Ok(())
        }
    }
}

fn write(file: &Path, table: &str) -> Result<(), Error> {
    std::fs::write(file, table).map_err(|source| place::io(file, source))
}

fn descriptor(feature: &Feature) -> String {
    feature.descriptor.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("writing to a string cannot fail");
        text
    })
}

fn as_json(feature: &Feature) -> serde_json::Value {
    json!({"x": feature.x_px(), "y": feature.y_px(), "score": feature.score, "angle": feature.angle,
        "octave": feature.octave, "descriptor": descriptor(feature)})
}

/// One row a feature; the angle is in 1/256 of a turn.
pub fn csv(features: &[Feature]) -> String {
    let mut table = String::from("x,y,score,angle,octave,descriptor\n");
    for feature in features {
        let (x, y) = (feature.x_px(), feature.y_px());
        let row =
            writeln!(table, "{x},{y},{},{},{},{}", feature.score, feature.angle, feature.octave, descriptor(feature));
        row.expect("writing to a string cannot fail");
    }
    table
}
