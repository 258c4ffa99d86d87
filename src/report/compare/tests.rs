//! Comparisons of runs made by hand, whose differences are known.

use crate::report::record::Report;
use glam::{DQuat, DVec3};

use super::*;
use crate::draw::DrawKey;
use crate::num::u64_from;
use crate::pose::Pose;
use crate::report::record::FrameRecord;
use crate::report::trajectory_figures;

const FPS: f64 = 30.0;

/// A run along a curve whose estimate is off by independent errors of the given metres per axis.
fn run(folder: &str, frames: usize, sigma_m: f64, shared_noise: f64, number: u64) -> FinishedRun {
    let key = |frame: usize, of: u64| DrawKey::root(of).with(u64_from(frame));
    // Uniform in -1..1, times the root of three: unit variance.
    let noise = |frame: usize, axis: u64| {
        let unit = |of| 3.0_f64.sqrt() * (2.0 * key(frame, of).with(axis).uniform() - 1.0);
        shared_noise * unit(1) + (1.0 - shared_noise * shared_noise).sqrt() * unit(number)
    };
    let truth = |frame: usize| {
        let t_s = f64_from_usize(frame) / FPS;
        let at_m = DVec3::new(libm::cos(t_s), libm::sin(1.3 * t_s), 0.5 * libm::sin(t_s));
        TimedPose { t_s, world_from_body: Pose::new(DQuat::from_rotation_y(0.3 * t_s), at_m) }
    };
    let estimate = |frame: usize| {
        let mut pose = truth(frame);
        let error = DVec3::new(noise(frame, 0), noise(frame, 1), noise(frame, 2));
        pose.world_from_body.translation_m += sigma_m * error;
        pose
    };
    let mut report = Report { seed: 1, ..Report::default() };
    report.scenario.cameras = 2;
    report.timing.fps = FPS;
    report.timing.frame_time_us = 1e6 / FPS;
    report.energy.power_mw = 3.0;
    report.energy.total_pj_per_frame = 1e8;
    report.frames = (0..frames)
        .map(|frame| FrameRecord {
            t_s: truth(frame).t_s,
            tracked: 100,
            found: 400,
            link_bits: Some(1e6),
            energy_pj: Some(1e8),
            latency_us: Some(11_000.0),
            ..FrameRecord::default()
        })
        .collect();
    FinishedRun {
        folder: folder.to_owned(),
        report,
        truth: (0..frames).map(truth).collect(),
        estimate: (0..frames).map(estimate).collect(),
        cameras_alone: None,
    }
}

fn figure<'a>(comparison: &'a Comparison, key: &str) -> &'a FigureDifference {
    comparison.others[0].figures.iter().find(|figure| figure.key == key).unwrap()
}

#[test]
fn a_run_against_itself_has_no_difference_in_any_figure() {
    let a = run("a", 90, 1e-3, 0.5, 2);
    let comparison = compare(&[a.clone(), a]).unwrap();
    let figures = &comparison.others[0].figures;
    assert!(figures.len() >= 13, "{}", figures.len());
    for figure in figures {
        assert_eq!((figure.verdict, figure.interval), (Verdict::NoDifference, Some([0.0, 0.0])), "{}", figure.key);
    }
    assert!(comparison.others[0].config.is_empty() && comparison.others[0].paired_frames == 90);
}

#[test]
fn a_run_with_half_the_noise_is_better_and_the_interval_holds_the_difference() {
    let (a, b) = (run("a", 300, 2e-3, 0.8, 2), run("b", 300, 1e-3, 0.8, 3));
    let comparison = compare(&[a, b]).unwrap();
    let ate = figure(&comparison, "ate_m");
    assert_eq!(ate.verdict, Verdict::Better);
    // The root mean square of three axes of one millimetre's sigma is 3^1/2 mm; B minus A is minus that.
    let [low, high] = ate.interval.unwrap();
    assert!(low < -3.0_f64.sqrt() * 1e-3 && high > -3.0_f64.sqrt() * 1e-3, "{low} to {high}");
    assert_eq!(figure(&comparison, "jitter_d2_m").verdict, Verdict::Better);
    assert_eq!(figure(&comparison, "power_w").verdict, Verdict::NoDifference);
}

#[test]
fn figures_of_a_whole_run_are_those_of_its_report() {
    let a = run("a", 120, 1e-3, 0.0, 2);
    let expected = trajectory_figures(&a.truth, &a.estimate).unwrap();
    let se3 = expected.se3.unwrap();
    let comparison = compare(&[a.clone(), a]).unwrap();
    for (key, value) in [
        ("ate_m", se3.ate_m),
        ("rpe_m", se3.rpe_m.unwrap()),
        ("jitter_frame_m", se3.jitter_frame_m),
        ("jitter_d2_m", se3.jitter_d2_m.unwrap()),
    ] {
        let found = figure(&comparison, key).a.unwrap();
        // A thousand roundings of numbers of size one, relative to a millimetre.
        assert!((found / value - 1.0).abs() < 1e-9, "{key}: {found} and {value}");
    }
}

#[test]
fn frames_are_paired_only_where_frame_times_agree() {
    let (a, mut b) = (run("a", 90, 1e-3, 0.5, 2), run("b", 60, 1e-3, 0.5, 3));
    assert_eq!(compare(&[a.clone(), b.clone()]).unwrap().others[0].paired_frames, 60);
    b.report.timing.frame_time_us *= 2.0;
    let comparison = compare(&[a, b]).unwrap();
    assert_eq!(comparison.others[0].paired_frames, 0);
    assert_eq!(figure(&comparison, "ate_m").frames, [90, 60]);
}

#[test]
fn a_frame_that_one_run_lost_counts_for_neither() {
    let (a, mut b) = (run("a", 90, 1e-3, 0.5, 2), run("b", 90, 1e-3, 0.5, 3));
    b.estimate.drain(40..50);
    let comparison = compare(&[a, b]).unwrap();
    assert_eq!(figure(&comparison, "ate_m").frames, [80, 80]);
    let tracked = figure(&comparison, "tracked_fraction");
    assert!((tracked.difference.unwrap() + 1.0 / 9.0).abs() < 1e-12, "{tracked:?}");
}

#[test]
fn runs_of_different_scenes_or_motions_are_refused_and_different_light_is_not() {
    let with = |section: &str, key: &str, value: &str| {
        let mut run = run(&format!("runs/{value}"), 30, 1e-3, 0.0, 2);
        let table = toml::Table::from_iter([(key.to_owned(), toml::Value::String(value.to_owned()))]);
        run.report.config.insert(section.to_owned(), table.into());
        run
    };
    for (section, key) in [("scene", "generator"), ("motion", "kind")] {
        let error = compare(&[with(section, key, "one"), with(section, key, "two")]).unwrap_err().to_string();
        assert!(error.contains(&format!("{section}.{key} is \"one\" there and \"two\" here")), "{error}");
        assert!(error.contains("runs/one") && error.contains("runs/two"), "{error}");
    }
    let comparison = compare(&[with("scene", "illuminant", "A"), with("scene", "illuminant", "D65")]).unwrap();
    assert_eq!(comparison.others[0].config.len(), 1);
    assert!(compare(&[run("a", 30, 1e-3, 0.0, 2)]).unwrap_err().to_string().contains("two or more"));
}

#[test]
fn ten_frames_have_a_difference_but_no_interval() {
    let (a, b) = (run("a", 10, 1e-3, 0.0, 2), run("b", 10, 2e-3, 0.0, 3));
    let comparison = compare(&[a, b]).unwrap();
    let ate = figure(&comparison, "ate_m");
    assert!(ate.verdict == Verdict::TooFewFrames && ate.interval.is_none() && ate.difference.is_some());
}

/// Runs of a design by seed.
fn replicates(name: &str, sigma_m: f64, count: u64) -> Vec<FinishedRun> {
    let of = |seed: u64| {
        let mut run = run(&format!("{name}{seed}"), 30, sigma_m, 0.0, 100 * seed + u64::from(sigma_m > 1.5e-3));
        run.report.seed = seed;
        run
    };
    (0..count).map(of).collect()
}

#[test]
fn pairs_of_runs_give_students_interval_of_their_differences() {
    let (a, b) = (replicates("a", 2e-3, 5), replicates("b", 1e-3, 5));
    let comparison = compare_replicates(&a, &b).unwrap();
    let differences: Vec<f64> = a
        .iter()
        .zip(&b)
        .map(|(a, b)| figure(&compare(&[a.clone(), b.clone()]).unwrap(), "ate_m").difference.unwrap())
        .collect();
    let mean = differences.iter().sum::<f64>() / 5.0;
    let sd = (differences.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / 4.0).sqrt();
    let ate = figure(&comparison, "ate_m");
    let [low, high] = ate.interval.unwrap();
    // t at 97.5 % and four degrees of freedom.
    let half = 2.776 * sd / 5.0_f64.sqrt();
    assert!((low - (mean - half)).abs() < 1e-12 && (high - (mean + half)).abs() < 1e-12, "{low} to {high}");
    assert_eq!((ate.verdict, comparison.others[0].paired_runs), (Verdict::Better, 5));
}

#[test]
fn a_share_that_no_pair_changed_may_still_change_by_what_so_few_pairs_cannot_show() {
    let (a, b) = (replicates("a", 2e-3, 8), replicates("b", 1e-3, 8));
    let tracked = figure(&compare_replicates(&a, &b).unwrap(), "tracked_fraction").clone();
    let [low, high] = tracked.interval.unwrap();
    // An event of this probability is missed by eight pairs in 2.5 % of studies: (1 - p)^8 = 0.025.
    assert!((libm::pow(1.0 - high, 8.0) / 0.025 - 1.0).abs() < 1e-9 && low == -high, "{low} to {high}");
    assert_eq!(tracked.verdict, Verdict::NoDifference);
}

#[test]
fn replicates_that_differ_in_more_than_their_seed_or_are_too_few_are_refused() {
    let (a, b) = (replicates("a", 2e-3, 3), replicates("b", 1e-3, 3));
    let error = compare_replicates(&a[..2], &b[..2]).unwrap_err().to_string();
    assert!(error.contains("3 or more"), "{error}");
    assert!(compare_replicates(&a, &b[..2]).is_err());
    let mut odd = b.clone();
    let table = toml::Table::from_iter([("bits".to_owned(), toml::Value::Integer(8))]);
    odd[1].report.config.insert("sensor".to_owned(), table.into());
    let error = compare_replicates(&a, &odd).unwrap_err().to_string();
    assert!(error.contains("b1") && error.contains("sensor.bits") && error.contains("no replicate"), "{error}");
    let error = compare_replicates(&[a[0].clone(), a[1].clone(), a[0].clone()], &b).unwrap_err().to_string();
    assert!(error.contains("once more"), "the same draw counts once: {error}");
}
