//! The report's figures against evo's answers to the same files, and report.json against its own rules.

// Helpers of tests may stop at the first surprise.
#![allow(clippy::unwrap_used)]

#[cfg(feature = "cli")]
#[path = "report/sample.rs"]
mod sample;

use std::path::PathBuf;

use sensel::pose::parse_tum;
use sensel::report::{Figure, NotMeasurable, TrajectoryFigures, figures::AlignedFigures, trajectory_figures};
use serde_json::Value;

/// evo works on 4 x 4 matrices, we on quaternions and differences: both round numbers below 200 m some fifty times, 50
/// * 200 * 2^-53 is 1.1e-12; where a tiny error is the difference of two such numbers, that is the whole disagreement.
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
    // 14 cases of 18 figures; two still rigs have no aligned figures (9 each), one short run no error over a second
    // (3).
    assert_eq!((answers.len(), compared), (14, 14 * 18 - 2 * 9 - 3));
}

#[cfg(feature = "cli")]
mod page {
    use super::sample;
    use sensel::report::{Report, html::html};

    #[test]
    fn report_json_holds_every_key_of_the_design_and_reads_back_equal() {
        let report = sample::report();
        let text = report.to_json().unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        let keys = [
            "/version",
            "/seed",
            "/config_hash",
            "/plan/kept",
            "/plan/omitted/0/name",
            "/plan/omitted/0/bias_e",
            "/plan/omitted/0/sigma_e",
            "/plan/omitted/0/reason",
            "/plan/bias_e",
            "/plan/sigma_e",
            "/timing/line_time_us",
            "/timing/frame_time_us",
            "/timing/fps",
            "/timing/latency_us",
            "/timing/clocks_per_frame",
            "/bandwidth/raw_bits_per_frame",
            "/bandwidth/feature_bits_per_frame",
            "/bandwidth/link_bits_per_s",
            "/bandwidth/reduction",
            "/energy/blocks/pixel",
            "/energy/blocks/link",
            "/energy/total_pj_per_frame",
            "/energy/power_mw",
            "/energy/pj_per_pixel",
            "/features/median_tracked",
            "/tracking/ate_m",
            "/tracking/rpe_m",
            "/tracking/jitter_frame_m",
            "/tracking/jitter_d2_m",
            "/tracking/prediction_error_m",
            "/tracking/innovation_px",
            "/tracking/tracked_fraction",
            "/tracking/ms_per_frame",
            "/hashes/photons",
            "/hashes/codes",
            "/hashes/features",
            "/hashes/energy",
            "/hashes/poses",
            "/cost/scene/ms_per_frame",
        ];
        for key in keys {
            assert!(value.pointer(key).is_some_and(|value| !value.is_null()), "{key}");
        }
        assert_eq!(Report::from_json(&text).unwrap(), report);
        let pixel = text.find("\"pixel\"").unwrap();
        assert!(pixel < text.find("\"adc\"").unwrap(), "blocks stand in the order of the data, not of the alphabet");
    }

    #[test]
    fn a_number_that_is_none_is_refused_by_its_path() {
        let mut report = sample::report();
        report.frames[7].mean_code_dn = f64::NAN;
        assert!(report.to_json().unwrap_err().to_string().contains("'frames.mean_code_dn'"));
        let mut report = sample::report();
        report.bandwidth.reduction = None;
        assert!(report.to_json().unwrap_err().to_string().contains("'bandwidth.reduction'"));
        report.not_measurable.insert("bandwidth.reduction".to_owned(), "no features were sent".to_owned());
        assert!(report.to_json().is_ok());
    }

    #[test]
    fn the_page_stands_alone_and_every_tag_is_closed() {
        let page = html(&sample::report(), &sample::pictures());
        std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("report.html"), &page).unwrap();
        let (shown, scripts) = without_scripts(&page);
        assert!(scripts.len() > 1 && scripts.iter().all(|script| !script.contains("http")), "scripts fetch nothing");
        for foreign in ["http:", "https:", "//", "<script", "@import", "url(", "NaN", "undefined"] {
            let page = shown.replace("base64,", "").replace("http://www.w3.org/2000/svg", "");
            let text: String =
                page.split("data:image/png").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect();
            assert!(!text.contains(foreign), "{foreign}");
        }
        for tag in [
            "html", "head", "body", "main", "header", "section", "figure", "svg", "table", "tr", "td", "div",
            "details", "dl", "ul", "p",
        ] {
            let (opened, closed) = (count(&shown, tag), shown.matches(&format!("</{tag}>")).count());
            assert!(opened > 0 && opened == closed, "<{tag}>: {opened} opened, {closed} closed");
        }
        assert_eq!(page.matches("role=\"img\"").count(), page.matches("role=\"img\"><title>").count());
    }

    /// A page without its own scripts, and those. A script with a source elsewhere stays.
    fn without_scripts(page: &str) -> (String, Vec<String>) {
        let (mut shown, mut scripts) = (String::new(), Vec::new());
        for (number, part) in page.split("<script").enumerate() {
            match part.split_once("</script>") {
                Some((script, rest)) if number > 0 && !script.split('>').next().unwrap().contains("src") => {
                    scripts.push(script.to_owned());
                    shown += rest;
                }
                _ if number > 0 => shown += &format!("<script{part}"),
                _ => shown += part,
            }
        }
        (shown, scripts)
    }

    fn count(page: &str, tag: &str) -> usize {
        page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count()
    }

    #[test]
    fn an_empty_report_is_a_page_too_and_the_same_report_the_same_page() {
        let page = html(&Report::default(), &Default::default());
        assert!(page.contains("not measured") && !page.contains("NaN") && !page.contains("inf "));
        let again = || html(&sample::report(), &sample::pictures());
        assert_eq!(again(), again());
    }

    #[test]
    fn no_page_figure_or_document_calls_the_single_picture_sigma_a_bound() {
        let report = sample::report();
        let page = html(&report, &sample::pictures());
        assert!(page.contains("Single-picture position sigma given the map"));
        let json: serde_json::Value = serde_json::from_str(&report.to_json().unwrap()).unwrap();
        assert!(json["tracking"]["single_picture_sigma_m"].is_number() && json["schema_version"] == 2);
        let tracking = json["tracking"].as_object().unwrap();
        assert!(tracking.keys().all(|key| !key.contains("bound") && !key.contains("crb")), "{tracking:?}");
        let root = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR"));
        for file in ["README.md", "docs/tracker.md", "docs/tracker_figures.md", "src/cli/words.rs", "src/cli/track.rs"]
        {
            let text = std::fs::read_to_string(root.join(file)).unwrap().to_lowercase();
            for word in ["cramer", "cram\u{e9}r", "jitter_bound", "| bound |"] {
                assert!(!text.contains(word), "{file} says '{word}'");
            }
        }
    }

    #[test]
    fn warnings_stand_in_the_report_and_escaped_on_top_of_the_page() {
        let mut report = sample::report();
        let without = html(&report, &sample::pictures());
        report.warnings = vec!["a.b = 3 is <odd>".to_owned()];
        let page = html(&report, &sample::pictures());
        assert!(!without.contains("<h2>Warnings") && page.contains("<li>a.b = 3 is &lt;odd&gt;</li>"));
        assert!(page.find("<h2>Warnings").unwrap() < page.find("Position error (ATE)").unwrap());
        assert_eq!(Report::from_json(&report.to_json().unwrap()).unwrap(), report);
    }

    #[test]
    fn markup_in_names_stays_text_between_tags_and_in_attributes() {
        let name = "\"><script>alert('&')</script>".to_owned();
        let safe = "&quot;&gt;&lt;script&gt;alert('&amp;')&lt;/script&gt;";
        let (mut report, mut pictures) = (sample::report(), sample::pictures());
        report.scenario.name = name.clone();
        report.timing.line[0].name = name.clone();
        pictures.waves = Some(name);
        let page = html(&report, &pictures);
        assert!(!page.contains("<script>alert"));
        for place in ["<h1>", "<title>", "<a href=\"", " title=\""] {
            assert!(page.contains(&format!("{place}{safe}")), "{place}");
        }
    }

    #[test]
    fn each_of_the_two_jitters_has_a_tile_and_a_name_of_its_own() {
        let mut report = sample::report();
        let page = html(&report, &sample::pictures());
        for name in ["Frame jitter (RPE over one frame)", "Second-difference jitter (d2)"] {
            assert!(page.contains(&format!("<dt>{name}</dt>")), "{name}");
        }
        report.tracking.jitter_frame_m = None;
        report.not_measurable.insert("tracking.jitter_frame_m".to_owned(), "one frame has no motion".to_owned());
        assert!(html(&report, &sample::pictures()).contains("one frame has no motion"));
    }

    #[test]
    fn a_page_compares_features_with_pixels_only_where_features_were_sent() {
        let mut report = sample::report();
        report.bandwidth.reduction = Some(0.5);
        assert!(html(&report, &sample::pictures()).contains("2.00 times more"));
        report.bandwidth.reduction = None;
        let reason = "link.mode = frames sends no features";
        report.not_measurable.insert("bandwidth.reduction".to_owned(), reason.to_owned());
        let page = html(&report, &sample::pictures());
        assert!(page.contains(reason) && !page.contains("times less") && !page.contains("saves a factor"));
    }
}
