//! What accuracy costs in time: errors that repeat, settings that keep their word, rows that are checked on the rung above, and means in
//! closed form against draws. Small box rooms, so that the whole file takes seconds.

// Counts of a test are small; its reference mathematics need not be the same on all machines.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use crate::common;

use std::sync::LazyLock;

use common::assets::KeptBakes;
#[cfg(feature = "outside")]
use common::assets::WithVerilog;
use common::{Scratch, sensel, sensel_alone};
use sensel::config::Resolved;
use sensel::ladder::{
    EffectsKnob, Goal, LadderBench, LadderOptions, RayBudget, Setting, StudyClocks, choose, judge, ladder,
};
use sensel::plane::Plane;
use sensel::report::ladder_record::{LadderRecord, LadderRow};
use sensel::run::probe::PictureId;
use sensel::run::{NoClock, NoFiles, NoProgress, Setup};
use sensel::units::{FrameIndex, Size};

/// A stereo pair in the box room, walking; light for some hundred electrons.
const WALK: &str = r#"
    seed = 11
    [scene]
    generator = "box"
    illuminance_lux = 400.0
    [motion]
    kind = "sway"
    offset_m = [0.0, 1.5, 0.3]
    [run]
    frames = 12
    [sensor]
    width = 128
    height = 96
"#;

/// The room, lit once for all tests.
static ROOM: LazyLock<Setup> =
    LazyLock::new(|| Setup::new(Resolved::from_layers("test", WALK, &[]).unwrap(), &KeptBakes, &NoProgress).unwrap());

fn setup(more: &[&str]) -> Setup {
    let more: Vec<String> = more.iter().map(|&assignment| assignment.to_owned()).collect();
    ROOM.again(Resolved::from_layers("test", WALK, &more).unwrap()).unwrap()
}

fn bench(more: &[&str]) -> LadderBench<'static> {
    let clocks = StudyClocks { wall: &NoClock, work: &NoClock };
    LadderBench { setup: setup(more), clocks, progress: &NoProgress, assets: &NoFiles }
}

const OPTIONS: LadderOptions = LadderOptions { frames: 2, pose_frames: 6, finest: 0.4, repeats: 1 };

fn rows<'a>(record: &'a LadderRecord, knob: &str) -> Vec<&'a LadderRow> {
    record.rows.iter().filter(|row| row.knob == knob).collect()
}

#[test]
fn two_ladders_agree_on_every_error_and_every_rung_and_knob_has_its_row() {
    // Time stands still for both, so that the records must be equal as they are; the front is then the best setting alone.
    let [one, two] = [0, 1].map(|_| ladder(&bench(&[]), OPTIONS, "box", 1).unwrap());
    assert_eq!(one, two);
    assert!(one.reference.standard_error <= OPTIONS.finest / 3.0, "{:?}", one.reference);
    for (knob, least) in [
        ("reference", 1),
        ("rung", 4),
        ("samples_per_pixel", 5),
        ("render_tolerance", 7),
        ("effects", 5),
        ("window", 3),
        ("combination", 1),
    ] {
        assert!(rows(&one, knob).len() >= least, "{knob}: {}", rows(&one, knob).len());
    }
    let rung = |name: &str| *rows(&one, "rung").iter().find(|row| row.value == name).unwrap();
    let (sampled, clocked) = (rung("sampled"), rung("clocked"));
    let errors = |row: &LadderRow| (row.rms_dn, row.max_dn, row.feature_f1, row.energy_error, row.photon_noise_ratio);
    assert_eq!(errors(sampled), errors(clocked), "the rungs' codes are equal");
    assert!(rung("rtl").note.as_ref().unwrap().contains("not measured"));
    assert!(rung("expected").rms_dn.is_some() && rung("expected").feature_f1.is_none());
    // A picture this small holds too few corners for a pose: the run for it was made, and the row says why it has no figure.
    assert!(sampled.tracked_fraction.is_some(), "{:?}", sampled.note);
    for row in &one.rows {
        let missing = [row.photon_noise_ratio, row.rms_dn, row.ate_m].contains(&None);
        assert!(!missing || row.note.is_some(), "{} {} lacks a figure and does not say why", row.knob, row.value);
        assert!(row.feature_f1.is_none_or(|f1| (0.0..=1.0).contains(&f1)));
    }
}

/// 128 x 96 pixels are no more than a ladder gives the Verilog, so that the part is the picture; every eighth of 96 rows is checked, in
/// one frame of two cameras.
#[cfg(feature = "outside")]
#[test]
fn the_verilog_has_its_row_and_checks_the_rung_below() {
    let bench = LadderBench { assets: &WithVerilog, ..bench(&[]) };
    let record = ladder(&bench, LadderOptions { frames: 1, pose_frames: 0, finest: 2.0, ..OPTIONS }, "box", 1).unwrap();
    let row = rows(&record, "rung").into_iter().find(|row| row.value == "rtl").unwrap();
    let note = row.note.as_ref().unwrap();
    assert!(note.contains("96 of 96 rows") && note.contains("all codes equal"), "{note}");
    assert_eq!((row.rms_dn, row.max_dn), (Some(0.0), Some(0.0)));
    let mut session = sensel::run::Session::new(setup(&["run.rung=clocked"])).unwrap();
    assert_eq!(session.check_rows(8, &WithVerilog).unwrap(), sensel::fidelity::Rung::Rtl);
    session.step(&NoClock).unwrap();
    assert_eq!(session.rows_checked(), 2 * 12);
}

/// Photons of a picture of the run, rendered eight times with different draws.
fn eight_renders(setup: &Setup, id: PictureId) -> Vec<Vec<f32>> {
    let mut again = setup.again(setup.resolved.clone()).unwrap();
    (100..108)
        .map(|repeat| {
            again.fidelity.render.repeat = repeat;
            again.exposures_at(id).unwrap().swap_remove(0).photons.values().to_vec()
        })
        .collect()
}

/// Standard deviation of each setting's own renders over photon noise, as the last setting's mean tells that noise. By a pair's own mean, a
/// pixel that one ray in a hundred fills with a lamp would be divided by fifty times too much whenever it is hit.
fn own_ratios(setup: &Setup, settings: &[Setting; 3], frames: &[u32]) -> [f64; 3] {
    let efficiency = setup.sensor.electrons_per_photon();
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for &frame in frames {
        let id = PictureId { frame: FrameIndex(frame), camera: 0 };
        let renders = settings.each_ref().map(|setting| {
            let resolved = setup.resolved.with(&setting.assignments(&setup.resolved.scenario)).unwrap();
            eight_renders(&setup.again(resolved).unwrap(), id)
        });
        for pixel in 0..renders[2][0].len() {
            let mean_of = |renders: &[Vec<f32>]| {
                renders.iter().map(|render| efficiency * f64::from(render[pixel])).sum::<f64>() / 8.0
            };
            let photon_variance_e2 = mean_of(&renders[2]).max(1.0);
            for (sum, renders) in sums.iter_mut().zip(&renders) {
                let mean_e = mean_of(renders);
                let square = |render: &Vec<f32>| (efficiency * f64::from(render[pixel]) - mean_e).powi(2);
                *sum += renders.iter().map(square).sum::<f64>() / 7.0 / photon_variance_e2;
            }
            count += 1.0;
        }
    }
    sums.map(|sum| (sum / count).sqrt())
}

/// Rays of fixed number are unbiased but for filters that are much narrower than the tolerance here; so the mean square error of a
/// setting is the variance that its own renders tell. Both are means over 2 x 12,288 pixels whose errors stand on edges: their tails
/// are heavy, and single seeds differ by a fifth. The mean of five seeds may differ by 15 %.
#[test]
fn the_error_of_a_setting_is_what_its_own_renders_differ_by() {
    let counts = [1, 4, 16];
    let (mut judged, mut told) = ([0.0; 3], [0.0; 3]);
    for seed in 0..5 {
        let bench = bench(&["run.effects=all", &format!("run.render_seed={seed}")]);
        let own = Setting::of(&bench.setup.resolved.scenario);
        let settings = counts.map(|samples| Setting { rays: RayBudget::Fixed(samples), ..own.clone() });
        let verdicts = judge(&bench, &settings, &[3, 8], 0.3, 1).unwrap();
        let own_ratios = own_ratios(&bench.setup, &settings, &[3, 8]);
        for number in 0..3 {
            judged[number] += verdicts[number].photon_noise_ratio.powi(2) / 5.0;
            told[number] += own_ratios[number].powi(2) / 5.0;
        }
    }
    let [judged, told] = [judged, told].map(|squares| squares.map(f64::sqrt));
    println!("{counts:?} rays: {judged:?} against {told:?}");
    for (judged, told) in judged.iter().zip(told) {
        assert!((judged / told - 1.0).abs() < 0.15, "{judged} {told}");
    }
    assert!(judged.is_sorted_by(|few, many| few > many), "more rays, less error: {judged:?}");
}

/// The pilot sees frames 0, 2, 3, 5, 6, 8, 9 and 11 of 12; the word holds on others. Without a clock all settings take as long, so that
/// the first that meets the goal is taken: what is tested is the error alone.
#[test]
fn the_chosen_setting_keeps_its_word_on_frames_that_the_pilot_did_not_see() {
    let bench = bench(&[]);
    for accuracy in [0.7, 1.5] {
        let choice = choose(&bench, Goal::Accuracy(accuracy)).unwrap();
        let resolved = bench.setup.resolved.with(&choice.settings).unwrap();
        let chosen = Setting::of(&resolved.scenario);
        let verdict = judge(&bench, &[chosen], &[1, 4, 7, 10], 0.5 * accuracy, 1).unwrap()[0];
        println!("{accuracy}: {} claims {}, shows {}", choice.words, choice.with_margin, verdict.photon_noise_ratio);
        assert!(choice.with_margin <= accuracy && verdict.photon_noise_ratio <= accuracy, "{choice:?} {verdict:?}");
    }
}

#[test]
fn effects_left_out_count_in_the_error_and_none_left_out_count_nothing() {
    let bench = bench(&[]);
    let own = Setting::of(&bench.setup.resolved.scenario);
    let rays = RayBudget::Tolerance { tolerance: 0.05, most: 1024 };
    let planned = |tolerance| EffectsKnob::Planned { words: "auto".to_owned(), tolerance };
    let none = EffectsKnob::Planned { words: "none".to_owned(), tolerance: 0.0 };
    let settings = [EffectsKnob::All, planned(0.3), none].map(|effects| Setting { effects, rays, ..own.clone() });
    let found: Vec<f64> =
        judge(&bench, &settings, &[6], 0.5, 1).unwrap().iter().map(|verdict| verdict.photon_noise_ratio).collect();
    // The bound is in units of all noise of a pixel, which is more than its photon noise.
    assert!(found[0] <= found[1] && found[1] < found[2], "{found:?}");
    assert!(found[2] > 0.9, "without shot noise the draw itself is missing: {found:?}");
}

/// Mean and variance of every pixel over frames of a wedge from dark to beyond saturation, against the closed form, for sensors on both
/// sides of every seam of it. z = (mean of F codes - expected) / sqrt(variance / F): over P pixels its mean square is 1 within
/// 5 sqrt(2 / P). Where a code hardly ever changes its variance is rounding's, of few events: such pixels are held by their mean alone,
/// to 5 sqrt(0.05 / F) and rounding. The mean variance over pixels is right to 5 sqrt(2 / (F P)) and what is not normal: 3 %.
#[test]
fn means_and_variances_in_closed_form_are_those_of_drawn_frames() {
    const FRAMES: u32 = 96;
    let cases: [&[&str]; 6] = [
        &[],
        &["sensor.adc.cds='analog'", "sensor.adc.bits=12", "sensor.pixel.read_noise_uv=20.0"],
        &["sensor.pixel.gain_compression=0.1", "sensor.pixel.full_well_e=6000.0"],
        &["sensor.adc.bits=8", "sensor.pixel.dark_current_e_per_s=20000.0", "sensor.pixel.dsnu_e=8.0"],
        &[
            "sensor.adc.comparator_noise_uv=150.0",
            "sensor.adc.column_gain_sigma=0.01",
            "sensor.adc.column_offset_residual_uv=300.0",
        ],
        &["sensor.adc.black_level_dn=2", "sensor.adc.cds='none'", "sensor.pixel.prnu=0.03"],
    ];
    for more in cases {
        let with = |rung: &str| {
            let mut all = vec!["run.effects=all", "sensor.width=64", "sensor.height=48"];
            let rung = format!("run.rung={rung}");
            all.extend(more);
            all.push(&rung);
            setup(&all)
        };
        let (expected, sampled) = (with("expected"), with("sampled"));
        let size = Size { width_px: 64, height_px: 48 };
        let pixels = size.pixel_count();
        // From 0 to 20,000 photons by squares: two fifths of the pixels below 3,000, a third beyond the well.
        let share = |pixel: usize| pixel as f32 / pixels as f32;
        let photons =
            Plane::from_values(size, (0..pixels).map(|pixel| 25_000.0 * share(pixel) * share(pixel)).collect());
        let at = |frame| PictureId { frame: FrameIndex(frame), camera: 0 };
        let closed = expected.expected_at(&expected.first_chain(), at(0), &photons);
        let chain = sampled.first_chain();
        let (mut sums, mut squares) = (vec![0.0; pixels], vec![0.0; pixels]);
        for frame in 0..FRAMES {
            let codes = sampled.sense_at(&chain, at(frame), std::slice::from_ref(&photons)).codes;
            for (pixel, &code) in codes.values().iter().enumerate() {
                sums[pixel] += f64::from(code);
                squares[pixel] += f64::from(code) * f64::from(code);
            }
        }
        let count = f64::from(FRAMES);
        let (mut z2, mut judged, mut drawn_variance, mut closed_variance) = (0.0, 0.0, 0.0, 0.0);
        for pixel in 0..pixels {
            let (mean, variance) =
                (f64::from(closed.mean_dn.values()[pixel]), f64::from(closed.variance_dn2.values()[pixel]));
            let found = sums[pixel] / count;
            if variance < 0.05 {
                assert!((found - mean).abs() <= 0.25, "{more:?}, pixel {pixel}: {found} for {mean}");
                continue;
            }
            z2 += (found - mean) * (found - mean) * count / variance;
            judged += 1.0;
            drawn_variance += (squares[pixel] - sums[pixel] * sums[pixel] / count) / (count - 1.0);
            closed_variance += variance;
        }
        println!(
            "{more:?}: z^2 {:.4} of {judged} pixels, variance {:.4}",
            z2 / judged,
            drawn_variance / closed_variance
        );
        assert!(judged > 500.0, "{more:?}: only {judged} pixels were judged");
        // Two hundredths for codes that are not quite normal beside an end, and for f32.
        let allowed = 5.0 * (2.0_f64 / judged).sqrt() + 0.02;
        assert!((z2 / judged - 1.0).abs() <= allowed, "{more:?}: z^2 {}", z2 / judged);
        assert!((drawn_variance / closed_variance - 1.0).abs() <= 0.03, "{more:?}");
    }
}

#[test]
fn what_has_no_closed_form_is_refused_by_name() {
    for (key, word) in [
        ("sensor.pixel.blooming=0.5", "blooming"),
        ("sensor.pixel.hot_ppm=100.0", "hot_pixels"),
        ("sensor.adc.kickback_uv=10.0", "ramp"),
        ("sensor.readout.binning=2", "binned"),
    ] {
        let more: Vec<String> = [key, "run.rung=expected", "run.effects=all", "sensor.pixel.hot_dark_e_per_s=500.0"]
            .into_iter()
            .filter(|assignment| !assignment.contains("hot_dark") || key.contains("hot"))
            .map(str::to_owned)
            .collect();
        let resolved = Resolved::from_layers("test", WALK, &more).unwrap();
        let error = ROOM.again(resolved).err().unwrap_or_else(|| panic!("{key} was taken"));
        assert!(error.exit_code() == 2 && error.to_string().contains(word), "{key}: {error}");
    }
}

const SMALL: [&str; 8] =
    ["--set", "sensor.width=96", "--set", "sensor.height=64", "--set", "scene.illuminance_lux=300.0", "--frames", "3"];

fn run(out: &str, more: &[&str]) -> common::Outcome {
    let mut words = vec!["run", "box", "--out", out];
    words.extend(SMALL);
    words.extend(more);
    sensel(&words)
}

#[test]
fn a_goal_becomes_a_configuration_that_gives_the_same_bytes_again() {
    let folder = Scratch::new("goal");
    let first = run(&folder.join("first"), &["--accuracy", "2", "--json"]);
    assert!(first.stderr.contains("at most 2 of photon noise"), "{}", first.stderr);
    let again = sensel(&["run", &folder.join("first/config.toml"), "--out", &folder.join("again"), "--json"]);
    let (first, again) = (first.json(), again.json());
    assert_eq!(first["hashes"], again["hashes"]);
    assert_eq!(first["config_hash"], again["config_hash"]);
    let slow = run(&folder.join("slow"), &["--time-budget", "0.1ms"]);
    assert!(slow.code == 2 && slow.stderr.contains("ms or more"), "{slow:?}");
    for refused in [&["--accuracy", "99"][..], &["--accuracy", "1", "--time-budget", "5ms"], &["--time-budget", "5"]] {
        assert_eq!(run(&folder.join("refused"), refused).code, 2, "{refused:?}");
    }
    let both = run(&folder.join("refused"), &["--accuracy", "1", "--set", "run.render_tolerance=2.0"]);
    assert!(both.code == 2 && both.stderr.contains("--accuracy"), "{both:?}");
    assert!(!folder.names().contains(&"refused".to_owned()));
}

#[test]
fn rows_are_checked_while_running_and_the_expected_rung_ends_at_the_image() {
    let folder = Scratch::new("rungs");
    let checked = run(&folder.join("checked"), &["--check-every", "5"]);
    // 13 of 64 rows, two cameras, three frames.
    assert!(checked.code == 0 && checked.stdout.contains("78 rows converted once more"), "{checked:?}");
    assert_eq!(run(&folder.join("none"), &["--check-every", "0"]).code, 2);
    // The rung above clocked is the Verilog's; who has none is told so.
    let mut words = vec!["run", "box", "--check-every", "2", "--rung", "clocked"];
    let out = folder.join("none");
    words.extend(SMALL);
    words.extend(["--out", &out]);
    let without = sensel_alone(&words);
    assert!(without.code == 2 && without.stderr.contains("needs Verilator"), "{without:?}");
    assert_eq!(run(&out, &["--check-every", "2", "--rung", "expected"]).code, 2);
    let expected = run(&folder.join("expected"), &["--rung", "expected", "--keep", "variance"]);
    assert!(expected.code == 0 && expected.stdout.contains("no features, packets or poses"), "{expected:?}");
    let names = common::names(&folder.path().join("expected/expected/cam1"));
    assert_eq!(names.len(), 9, "{names:?}");
    assert_eq!(run(&folder.join("none"), &["--rung", "expected", "--keep", "packets"]).code, 2);
    let power = sensel(&["power", "box", "--rung", "expected"]);
    assert!(power.code == 2 && power.stderr.contains("ends at the image"), "{power:?}");
}

#[test]
fn the_command_writes_the_keys_of_the_design_a_picture_and_a_page_and_later_reports_show_it() {
    let folder = Scratch::new("ladder");
    let scenario = ["--set", "sensor.width=96", "--set", "sensor.height=64", "--set", "scene.illuminance_lux=310.0"];
    let mut words =
        vec!["ladder", "box", "--frames", "1", "--pose-frames", "4", "--finest", "1", "--repeats", "1", "--json"];
    let out = folder.join("out");
    words.extend(scenario);
    words.extend(["--out", &out]);
    // Without other programs, so that the test does the same everywhere.
    let outcome = sensel_alone(&words);
    assert!(outcome.stderr.contains("renders"), "progress: {}", outcome.stderr);
    let record = outcome.json();
    let rows = record["rows"].as_array().unwrap();
    let keys = [
        "rung",
        "knob",
        "value",
        "ms_per_frame",
        "time_ratio",
        "rms_dn",
        "max_dn",
        "photon_noise_ratio",
        "feature_f1",
        "ate_m",
    ];
    for row in rows {
        assert!(keys.iter().all(|key| row.get(key).is_some()), "{row}");
    }
    assert_eq!(folder.names(), ["out"]);
    let page = std::fs::read_to_string(folder.path().join("out/ladder.html")).unwrap();
    assert!(
        page.contains("type=\"radio\"") && !page.contains("<script") && !page.contains("http"),
        "one page, no scripts"
    );
    assert!(std::fs::read_to_string(folder.path().join("out/ladder.svg")).unwrap().starts_with("<svg"));
    let mut words = vec!["run", "box", "--frames", "2", "--json"];
    let run_out = folder.join("run");
    words.extend(scenario);
    words.extend(["--out", &run_out]);
    assert_eq!(sensel(&words).json()["ladder"]["rows"].as_array().unwrap().len(), rows.len());
    assert_eq!(sensel(&["ladder", "box", "--finest", "0.01"]).code, 2);
}
