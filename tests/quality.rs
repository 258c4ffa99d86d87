//! Features found again in turned, scaled and tilted pictures, beside OpenCV's ORB at one level with as many features: a small set of
//! the study in `examples/quality`, whose modules these are.

#![cfg(feature = "outside")]
// A test fails by panicking; not every item of the study is used here.
#![allow(clippy::unwrap_used, dead_code)]

#[path = "../examples/quality/orb.rs"]
mod orb;
#[path = "../examples/quality/pictures.rs"]
mod pictures;
#[path = "../examples/quality/reference.rs"]
mod reference;
#[path = "../examples/quality/score.rs"]
mod score;
#[path = "../examples/quality/settings.rs"]
mod settings;
#[path = "../examples/quality/views.rs"]
mod views;

use score::{Score, inside, score};
use settings::SETTINGS;
use views::{VIEWS, View};

const MARGIN_PX: f64 = 32.0;
/// Of those that nothing was chosen on.
const PICTURES: [&str; 4] = ["grass", "hubble_deep_field", "immunohistochemistry", "stereo_motorcycle"];
const SMALL_SET: [&str; 5] = ["15 deg", "135 deg", "x 0.85", "x 1.2", "to the right"];

/// The bar: no more than two points under ORB, in repeatability at 3 px and in matching, at the default settings and with as many
/// features. The set has 20 pairs of some 120 features; a share of 0.88 or 0.66 of 2400 has a standard error of 0.7 to 1.0 points, the
/// difference of two on the same pictures less.
#[test]
fn features_are_found_again_as_often_as_orbs() {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let out = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("quality");
    std::fs::create_dir_all(&out).unwrap();
    let mut all = pictures::read(&orb::pictures(&python, &out, "judged_on"));
    all.retain(|picture| PICTURES.contains(&picture.name.as_str()));
    let chosen: Vec<&View> = VIEWS.iter().filter(|view| SMALL_SET.contains(&view.name)).collect();
    let ours = &SETTINGS[0].method;
    let (mut our_scores, mut orb_scores) = (Vec::new(), Vec::new());
    for picture in &all {
        let codes: Vec<_> = std::iter::once(&View::SAME)
            .chain(chosen.iter().copied())
            .map(|view| views::codes(picture, view))
            .collect();
        let found: Vec<_> = codes.iter().map(|codes| ours.features(codes)).collect();
        let counts: Vec<usize> = found.iter().zip(&codes).map(|(found, codes)| inside(found, codes.size())).collect();
        let theirs = orb::Files::write(&out, codes.iter()).features(&python, &[counts]).remove(0);
        for (number, view) in (1..).zip(&chosen) {
            our_scores.push(score(&found[0], &found[number], view, codes[0].size()));
            orb_scores.push(score(&theirs[0], &theirs[number], view, codes[0].size()));
        }
    }
    assert_eq!(our_scores.len(), PICTURES.len() * SMALL_SET.len());
    let (ours, orb) = (Score::mean(&our_scores).unwrap(), Score::mean(&orb_scores).unwrap());
    println!("ours {ours:?}, ORB {orb:?}");
    assert!(ours.features > 80.0 && orb.features > 80.0);
    assert!(ours.repeatability > orb.repeatability - 0.02, "ours {ours:?}, ORB {orb:?}");
    assert!(ours.matching > orb.matching - 0.02, "ours {ours:?}, ORB {orb:?}");
}
