//! `sensel run --rung expected`: mean codes of every frame, and with `--keep variance` their variance. No features, packets or poses: the
//! rung ends at the image.

use std::path::Path;
use std::sync::atomic::Ordering;

use sensel::error::Error;
use sensel::files::folder::OutputFolder;
use sensel::files::picture::write_grey_16;
use sensel::files::{make_folder, write};
use sensel::num::{low_u16, u32_truncated_f32};
use sensel::picture::{Channel, to_exr};
use sensel::plane::Plane;
use sensel::run::Setup;
use sensel::run::probe::PictureId;
use sensel::units::FrameIndex;
use serde_json::json;

use super::args::{CommonOptions, RunVerbArguments};
use super::{interrupt, listing, paths, progress};

/// What `--keep` may add.
const VARIANCE: &str = "variance";

/// Refuses what this rung has nothing to keep of.
pub fn check(verb: &RunVerbArguments) -> Result<(), Error> {
    let unknown = verb.run.keep.iter().find(|word| *word != VARIANCE);
    if let Some(word) = unknown {
        let known = format!("{VARIANCE} (the rung expected ends at the image)");
        return Err(Error::Unknown { what: "stage to keep", name: word.clone(), known });
    }
    if verb.check_every.is_some() || verb.waves.waves.is_some() {
        let reason = "the rung expected converts nothing; leave out --check-every and --waves, or use sampled";
        return Err(Error::key("run.rung", "expected", reason));
    }
    Ok(())
}

/// Writes mean codes (rounded as 16-bit PNG, exact as EXR) and, where asked for, variances.
pub fn main(
    verb: &RunVerbArguments,
    shared: &CommonOptions,
    setup: &Setup,
    name: &str,
    target: &Path,
) -> Result<(), Error> {
    let interrupted = interrupt::watch();
    let folder = OutputFolder::create(target)?;
    let keeps_variance = verb.run.keep.iter().any(|word| word == VARIANCE);
    let chain = setup.first_chain();
    let bar = progress::bar("frames", u64::from(setup.frames), shared.quiet);
    for camera in 0..setup.cameras.len() {
        make_folder(&folder.path().join(format!("expected/cam{camera}")))?;
    }
    for frame in 0..setup.frames {
        for camera in 0..setup.cameras.len() {
            if interrupted.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let at = PictureId { frame: FrameIndex(frame), camera };
            let exposure = setup.exposures_at(at)?.swap_remove(0);
            let expected = setup.expected_at(&chain, at, &exposure.photons);
            let file = |kind: &str, ending: &str| {
                folder.path().join(format!("expected/cam{camera}/{frame:06}_{kind}.{ending}"))
            };
            // Halves up: a mean is no code, and ties mean nothing.
            let rounded = expected.mean_dn.map(|mean_dn| low_u16(u32_truncated_f32(mean_dn + 0.5)));
            write_grey_16(&file("mean", "png"), &rounded)?;
            write_exr(&file("mean", "exr"), expected.mean_dn)?;
            if keeps_variance {
                write_exr(&file(VARIANCE, "exr"), expected.variance_dn2)?;
            }
        }
        bar.inc();
    }
    bar.finish();
    write(&folder.path().join("config.toml"), setup.resolved.recorded_text())?;
    let resolved = &setup.resolved;
    let record = json!({
        "version": env!("CARGO_PKG_VERSION"), "config": resolved.recorded(), "config_hash": resolved.hash(),
        "seed": resolved.scenario.seed, "scenario": name, "rung": "expected", "frames": setup.frames,
        "cameras": setup.cameras.len(), "warnings": setup.warnings.texts(), "unit": "DN", "variance": keeps_variance,
        "absent": "features, packets and poses: the rung expected ends at the image"});
    write(&folder.path().join("expected.json"), listing::pretty(&record))?;
    paths::put(folder)?;
    if shared.json {
        listing::print_json(&record);
    } else if !shared.quiet {
        outln!("{name}: mean codes of {} frames of {} camera(s)", setup.frames, setup.cameras.len());
        outln!("no features, packets or poses: the rung expected ends at the image");
        outln!("pictures: {}", target.join("expected").display());
    }
    Ok(())
}

fn write_exr(path: &Path, plane: Plane<f32>) -> Result<(), Error> {
    write(path, to_exr(&[Channel { name: "Y".to_owned(), plane }])?)
}
