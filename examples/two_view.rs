//! Prints the two-view rotation error, in degrees, over neighbouring frames of a real recording. Arguments: FEATURES (a folder with one
//! `sensel features --json` answer a picture, in the order of their names), TRAJECTORY (TUM, camera poses, one a picture) and FX FY CX CY
//! in pixels.
//!
//! `for f in images/*.png; do sensel features "$f" --json --quiet > "features/$(basename "$f" .png).json"; done`
//! `cargo run --release --example two_view -- features groundtruth.tum 495.57 495.48 269.50 169.19`

use glam::DVec2;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, u64_from};
use sensel::optics::lens::{Intrinsics, Lens, Mapping};
use sensel::pose::parse_tum;
use sensel::tracker::initial::{BearingPair, TwoViewModel, TwoViewSettings, two_view};
use sensel::tracker::matching::{Best, Descriptor, MatchRule};

/// Standard deviation of a position per axis, in pixels: the tracker's own figure for a full-size corner.
const POSITION_SIGMA_PX: f64 = 0.6;
/// Neighbouring frames of a hand-held camera move a point by less.
const REACH_PX: f64 = 150.0;
const RULE: MatchRule = MatchRule { distance_max: 64, ratio_max: 0.85 };

struct Corner {
    position_px: DVec2,
    descriptor: Descriptor,
}

type Failure = Box<dyn std::error::Error>;

fn corners(text: &str) -> Result<Vec<Corner>, Failure> {
    let answer: serde_json::Value = serde_json::from_str(text)?;
    let mut corners = Vec::new();
    for feature in answer["features"].as_array().ok_or("no list of features")? {
        let digits = feature["descriptor"].as_str().ok_or("a feature without descriptor")?;
        let mut bytes = [0_u8; 32];
        for (k, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(digits.get(2 * k..2 * k + 2).ok_or("a descriptor of another length")?, 16)?;
        }
        let number = |key: &str| feature[key].as_f64().ok_or("a feature without position");
        if bytes != [0; 32] {
            let position_px = DVec2::new(number("x")?, number("y")?);
            corners.push(Corner { position_px, descriptor: Descriptor::new(&bytes) });
        }
    }
    Ok(corners)
}

fn best(own: &Corner, others: &[Corner]) -> Option<usize> {
    let mut best = Best::NONE;
    for (number, other) in others.iter().enumerate() {
        if (other.position_px - own.position_px).length() < REACH_PX {
            best.offer(number, own.descriptor.distance(&other.descriptor));
        }
    }
    best.accepted(RULE)
}

/// Pairs of corners that are each other's best.
fn pairs(lens: &Lens, first: &[Corner], second: &[Corner]) -> Vec<BearingPair> {
    let pair = |(number, own): (usize, &Corner)| {
        let other = &second[best(own, second)?];
        let mutual = best(other, first) == Some(number);
        Some(BearingPair { first: lens.unproject(own.position_px)?, second: lens.unproject(other.position_px)? })
            .filter(|_| mutual)
    };
    first.iter().enumerate().filter_map(pair).collect()
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, trajectory, focal_and_centre @ ..] = arguments.as_slice() else {
        return Err("usage: two_view FEATURES TRAJECTORY FX FY CX CY".into());
    };
    let numbers: Vec<f64> = focal_and_centre.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
    let [fx_px, fy_px, cx_px, cy_px] = numbers[..] else { return Err("four numbers of the lens are wanted".into()) };
    let lens = Lens { intrinsics: Intrinsics { fx_px, fy_px, cx_px, cy_px }, mapping: Mapping::Pinhole };
    let mut names: Vec<_> =
        std::fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    names.sort();
    let frames: Vec<Vec<Corner>> =
        names.iter().map(|name| corners(&std::fs::read_to_string(name)?)).collect::<Result<_, _>>()?;
    let poses = parse_tum(&std::fs::read_to_string(trajectory)?)?;
    let search =
        TwoViewSettings { sigma_rad: POSITION_SIGMA_PX / lens.focal_px(), samples_max: 500, confidence: 0.999 };
    let (mut errors_deg, mut models, mut none) = (Vec::new(), [0_u32; 3], 0);
    for (n, (pair, truth)) in frames.windows(2).zip(poses.windows(2)).enumerate() {
        let truth = truth[1].world_from_body.inverse().then(&truth[0].world_from_body);
        let Some(view) = two_view(&pairs(&lens, &pair[0], &pair[1]), &search, DrawKey::root(u64_from(n))) else {
            none += 1;
            continue;
        };
        errors_deg.push(view.second_from_first.inverse().then(&truth).angle_rad().to_degrees());
        models[[TwoViewModel::General, TwoViewModel::Plane, TwoViewModel::Rotation]
            .iter()
            .position(|m| *m == view.model)
            .unwrap_or(0)] += 1;
    }
    errors_deg.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        let rank = sensel::num::u32_truncated(share * f64_from_usize(errors_deg.len()));
        errors_deg.get(sensel::num::index(rank).min(errors_deg.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
    };
    let [general, plane, rotation] = models;
    println!(
        "{} pairs of frames, {none} without an answer; rotation error: median {:.3}, 90 % {:.3}, worst {:.3} degrees; \
         {general} general, {plane} plane, {rotation} turning",
        errors_deg.len(),
        quantile(0.5),
        quantile(0.9),
        quantile(1.0)
    );
    Ok(())
}
