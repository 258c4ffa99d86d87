//! The report's figures against evo's answers to the same files, and report.json against its own rules.

use std::path::PathBuf;

use sensel::pose::parse_tum;
use sensel::report::{Figure, NotMeasurable, TrajectoryFigures, figures::AlignedFigures, trajectory_figures};
use serde_json::Value;

/// evo works on 4 x 4 matrices, we on quaternions and differences: both round numbers below 200 m some fifty times, 50 * 200 * 2^-53
/// is 1.1e-12; where a tiny error is the difference of two such numbers, that is the whole disagreement.
const TOLERANCE_M: f64 = 1e-10;

fn vectors() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/vectors/evo")
}

fn figures_of(case: u64) -> TrajectoryFigures {
    let read = |name: &str| {
        let text = std::fs::read_to_string(vectors().join(format!("{case:02}_{name}.txt"))).unwrap();
        parse_tum(&text).unwrap()
    };
    trajectory_figures(&read("gt"), &read("est")).unwrap()
}

/// Compares one figure; both sides must lack it together. Returns 1 for a number compared.
fn check(case: u64, name: &str, evo: &Value, ours: Result<f64, NotMeasurable>) -> usize {
    match (evo.as_f64(), ours) {
        (Some(evo), Ok(ours)) => {
            assert!((evo - ours).abs() < TOLERANCE_M, "case {case}, {name}: evo {evo}, ours {ours}");
            1
        }
        (None, Err(_)) => 0,
        (evo, ours) => panic!("case {case}, {name}: evo {evo:?}, ours {ours:?}"),
    }
}

fn check_aligned(case: u64, evo: &Value, ours: &Result<AlignedFigures, NotMeasurable>) -> usize {
    let pick = |figure: &dyn Fn(&AlignedFigures) -> Figure| ours.as_ref().map_err(Clone::clone).and_then(figure);
    check(case, "ate_m", &evo["ate_m"], pick(&|f| Ok(f.ate_m)))
        + check(case, "rpe_m", &evo["rpe_m"], pick(&|f| f.rpe_m.clone()))
        + check(case, "jitter_frame_m", &evo["jitter_frame_m"], pick(&|f| Ok(f.jitter_frame_m)))
        + check(case, "jitter_d2_m", &evo["jitter_d2_m"], pick(&|f| f.jitter_d2_m.clone()))
}

#[test]
fn every_figure_equals_that_of_evo() {
    let answers = std::fs::read_to_string(vectors().join("answers.json")).unwrap();
    let answers: Vec<Value> = serde_json::from_str(&answers).unwrap();
    let mut compared = 0;
    for evo in &answers {
        let case = evo["case"].as_u64().unwrap();
        let ours = figures_of(case);
        assert_eq!(evo["associated"].as_u64(), Some(u64::try_from(ours.associated).unwrap()), "case {case}");
        compared += check_aligned(case, &evo["none"], &Ok(ours.unaligned.clone()));
        compared += check_aligned(case, &evo["se3"], &ours.se3);
        compared += check_aligned(case, &evo["sim3"], &ours.sim3);
        if let Ok(sim3) = &ours.sim3 {
            compared += check(case, "scale", &evo["sim3"]["scale"], Ok(sim3.alignment.scale));
        }
        compared += check(case, "covered", &evo["covered"], Ok(ours.covered));
        compared += check(case, "path_m", &evo["path_m"], Ok(ours.path_m));
        compared +=
            check(case, "rate over 1e4", &(evo["rate_hz"].as_f64().unwrap() / 1e4).into(), Ok(ours.rate_hz / 1e4));
        compared += check(case, "still", &evo["still_steps_under_1um"], Ok(ours.still.steps_under_1um));
        compared += check(case, "still d2", &evo["still_d2_m"], ours.still.jitter_d2_m.clone());
    }
    // 14 cases of 18 figures; two still rigs have no aligned figures (9 each), one short run no error over a second (3).
    assert_eq!((answers.len(), compared), (14, 14 * 18 - 2 * 9 - 3));
}
