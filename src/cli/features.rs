//! `sensel features`: the extractor alone, on a picture.

use std::fmt::Write as _;
use std::path::Path;

use sensel::compute::fate::{Fate, PixelFate, fates};
use sensel::compute::{Extractor, ExtractorParams, Feature, every_corner};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::fidelity::Rung;
use sensel::files::grey::{self, Grey};
use sensel::rtl_simulator::SharedRtlSimulator;
use sensel::run::Assets;
use serde_json::json;

use super::args::{CommonOptions, FeaturesArguments};
use super::setup::FolderAssets;
use super::{draw, listing, paths, words};

pub fn main(arguments: &FeaturesArguments, shared: &CommonOptions) -> Result<(), Error> {
    let table: &[&str] = &["csv", "txt"];
    for (option, file, endings, what) in
        [("--csv", &arguments.csv, table, "CSV"), ("--draw", &arguments.draw, &["png"], "PNG")]
    {
        file.as_ref().map_or(Ok(()), |file| paths::check_ending(option, file, endings, what))?;
    }
    let (ending, what) = match (shared.json, arguments.at) {
        (true, _) => ("json", "JSON (with --json)"),
        (false, Some(_)) => ("txt", "text (with --at)"),
        (false, None) => ("csv", "CSV (without --json)"),
    };
    let out = paths::output_file(shared, &[ending], what, &format!("features.{ending}"))?;
    let mut assignments = shared.set.clone();
    assignments.extend(arguments.threshold.map(|threshold| format!("compute.threshold={threshold}")));
    assignments.extend(arguments.detector.as_ref().map(|name| format!("compute.detector='{name}'")));
    let resolved = Resolved::from_layers("command line", "", &assignments)?;
    let located = |error| resolved.tree.locate(error);
    let mut params = resolved.scenario.extractor().map_err(located)?;
    let rung = resolved.scenario.fidelity().map_err(located)?.rung;
    if arguments.threshold.is_some() {
        // A threshold from the command line does not adapt.
        params.target_features = 0;
    }
    let picture = grey::read(&arguments.image)?;
    let mut extractor = Extractor::new(&params).on_rung(rung);
    if rung == Rung::Rtl {
        let simulator = FolderAssets::new(Path::new("."), shared).rtl_simulator().map_err(located)?;
        extractor = extractor.in_verilog(Some(SharedRtlSimulator::new(simulator)));
    }
    let outputs =
        [("--out", shared.out.as_ref()), ("--csv", arguments.csv.as_ref()), ("--draw", arguments.draw.as_ref())];
    paths::refuse_same(&outputs)?;
    for (option, file) in outputs {
        file.map_or(Ok(()), |file| paths::refuse_input(option, file))?;
    }
    let as_text = |text: &str| -> Result<(), Error> {
        match &out {
            Some(file) => paths::write_output("--out", file, text.as_bytes()),
            None => {
                out!("{text}");
                Ok(())
            }
        }
    };
    if let (Some(full_scale), false) = (picture.full_scale, shared.quiet) {
        words::note(&format!(
            "{}: linear; code 65535 stands for {full_scale}, its brightest pixel",
            arguments.image.display()
        ));
    }
    if let Some(at) = arguments.at {
        let (threshold, fates) =
            fates(&picture.codes, picture.bits, &params, at).map_err(of_file(&picture, arguments))?;
        return as_text(&if shared.json {
            let listed = json!({"bits": picture.bits, "full_scale": picture.full_scale, "threshold": threshold,
                "pipeline_bits": params.pipeline_bits, "octaves": fates});
            format!("{}\n", listing::pretty(&listed))
        } else {
            fates.iter().map(|fate| said(fate, threshold)).collect()
        });
    }
    let (features, threshold) = features(&picture, arguments, &params, extractor)?;
    if let Some(file) = &arguments.draw {
        draw::features(file, &picture.codes, picture.bits, &features)?;
    }
    if let Some(file) = &arguments.csv {
        paths::write_output("--csv", file, csv(&features).as_bytes())?;
    }
    if shared.json {
        let all: Vec<_> = features.iter().map(as_json).collect();
        let size = picture.codes.size();
        let listed = json!({"width": size.width_px, "height": size.height_px, "bits": picture.bits,
            "full_scale": picture.full_scale, "threshold": threshold, "pipeline_bits": params.pipeline_bits,
            "features": all});
        as_text(&format!("{}\n", listing::pretty(&listed)))
    } else if shared.out.is_some() || (arguments.csv.is_none() && arguments.draw.is_none()) {
        as_text(&csv(&features))
    } else {
        Ok(())
    }
}

/// The named detector alone lists every corner at its pixel, without cells and choice. The threshold is the one that was used.
fn features(
    picture: &Grey,
    arguments: &FeaturesArguments,
    params: &ExtractorParams,
    extractor: Extractor,
) -> Result<(Vec<Feature>, u16), Error> {
    let found = if arguments.detector.is_some() {
        let params = ExtractorParams { subpixel: false, ..*params };
        every_corner(&picture.codes, picture.bits, &params).map(|features| (features, params.threshold))
    } else {
        extractor.first_frame(&picture.codes, picture.bits).map(|found| (found.features, found.threshold))
    };
    found.map_err(of_file(picture, arguments))
}

/// An error that names the picture and its size.
fn of_file(picture: &Grey, arguments: &FeaturesArguments) -> impl Fn(Error) -> Error {
    let (size, file) = (picture.codes.size(), arguments.image.display().to_string());
    move |error| Error::Content {
        file: file.clone(),
        reason: format!("is {} x {} pixels: {error}", size.width_px, size.height_px),
    }
}

/// A line on a pixel of an octave.
fn said(pixel: &PixelFate, threshold: u16) -> String {
    let PixelFate { octave, x_px, y_px, arc_difference, fate } = pixel;
    let score = arc_difference.saturating_sub(1);
    let what = match fate {
        Fate::NotInOctave => {
            "no pixel of it: the octave is not built, or leaves out an odd last column or row".to_owned()
        }
        Fate::AtEdge => "no corner: it is within 3 pixels of the edge".to_owned(),
        Fate::BelowThreshold => {
            format!("no corner: its arc difference of {arc_difference} is not above the threshold of {threshold}")
        }
        Fate::Suppressed { by_x_px, by_y_px, by_arc_difference } => format!(
            "suppressed: its arc difference is {arc_difference}, that of ({by_x_px}, {by_y_px}) beside it {by_arc_difference}"
        ),
        Fate::WithoutPatch => format!("a corner of score {score} without a patch: it is within 16 pixels of the edge"),
        Fate::Unselected { rank, least_rank } => format!(
            "a corner of score {score} that its cell does not keep: its rank is {rank}, the least one kept {least_rank} (of equal \
             ones the first stay)"
        ),
        Fate::Lost { dropped_in_picture: dropped, late_in_picture: late } => format!(
            "a corner of score {score} that no engine loads: in this picture the queue is full for {dropped} corners, and the rows of \
             {late} are overwritten"
        ),
        Fate::Feature { number } => format!("a corner of score {score}: feature {number} of the list, from 0"),
    };
    format!("octave {octave} ({x_px}, {y_px}): {what}\n")
}

fn descriptor(feature: &Feature) -> String {
    feature.descriptor.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("writing to a string cannot fail");
        text
    })
}

fn as_json(feature: &Feature) -> serde_json::Value {
    json!({"x": feature.x_px(), "y": feature.y_px(), "score": feature.score, "angle": feature.angle.to_bits(),
        "octave": feature.octave, "descriptor": descriptor(feature)})
}

/// One row a feature; the angle is in 1/256 of a turn.
pub fn csv(features: &[Feature]) -> String {
    let mut table = String::from("x,y,score,angle,octave,descriptor\n");
    for feature in features {
        let (x, y) = (feature.x_px(), feature.y_px());
        let (score, angle, octave) = (feature.score, feature.angle.to_bits(), feature.octave);
        let row = writeln!(table, "{x},{y},{score},{angle},{octave},{}", descriptor(feature));
        row.expect("writing to a string cannot fail");
    }
    table
}
