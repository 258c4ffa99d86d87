//! Gates between the points of Yosys' table, against settings of the whole extractor that the table has not seen. The figures stand in
//! `vectors/gates_unseen.csv`; with the feature `outside` Yosys finds them again.

use std::collections::BTreeMap;

use rtl_models::fx_back::FxBackConfig;
use sensel::run::gates::{self, CELLS_FACTOR};

struct Unseen {
    words: String,
    hardware: FxBackConfig,
    cells: f64,
    flip_flops: f64,
    sram_bits: f64,
}

fn unseen() -> Vec<Unseen> {
    settings_of(include_str!("vectors/gates_unseen.csv"))
}

fn settings_of(text: &str) -> Vec<Unseen> {
    let of = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let values: BTreeMap<&str, u32> = fields[0]
            .split(' ')
            .map(|pair| pair.split_once('=').unwrap())
            .map(|(key, value)| (key, value.parse().unwrap()))
            .collect();
        let is = |key: &str| values[key] == 1;
        let hardware = FxBackConfig {
            max_width: values["MAX_WIDTH"],
            pix_bits: values["PIX_BITS"],
            octaves: values["OCTAVES"],
            harris: is("HARRIS"),
            cell_log2: values["CELL_LOG2"],
            per_cell: values["PER_CELL"],
            engines: values["ENGINES"],
            fifo_depth: values["FIFO_DEPTH"],
            desc_bits: values["DESC_BITS"],
            symmetric: is("SYMMETRIC"),
            subpixel: is("SUBPIXEL"),
            ring_log2: 7,
            width: values["MAX_WIDTH"],
            height: 480,
        };
        let number = |column: usize| fields[column].parse().unwrap();
        Unseen { words: fields[0].to_owned(), hardware, cells: number(1), flip_flops: number(2), sram_bits: number(3) }
    };
    text.lines().skip(1).map(of).collect()
}

/// Nine of ten lie within the stated factor, memories within a tenth.
fn assert_within(settings: &[Unseen]) {
    let mut held = [0_usize; 3];
    for one in settings {
        let told = gates::all(&one.hardware);
        let ratios = [told.cells / one.cells, told.flip_flops / one.flip_flops, told.sram_bits / one.sram_bits];
        println!("{}: {ratios:.3?}", one.words);
        for ((held, ratio), factor) in held.iter_mut().zip(ratios).zip([CELLS_FACTOR, CELLS_FACTOR, 1.1]) {
            *held += usize::from((1.0 / factor..=factor).contains(&ratio));
        }
    }
    println!("{held:?} of {}", settings.len());
    assert!(held.iter().all(|&held| 10 * held >= 9 * settings.len()), "{held:?} of {}", settings.len());
}

#[test]
fn settings_that_the_table_has_not_seen_lie_within_the_stated_interval() {
    assert_within(&unseen());
}

/// Twelve settings that were drawn after range and model had been chosen.
#[test]
fn settings_drawn_after_the_model_lie_within_the_stated_interval() {
    let settings = settings_of(include_str!("vectors/gates_fresh.csv"));
    assert_eq!(settings.len(), 12);
    assert_within(&settings);
}

#[cfg(feature = "outside")]
#[test]
fn yosys_finds_the_recorded_netlists_again() {
    let [judge, record, test] =
        [include_str!("judges/gates.py"), include_str!("vectors/gates_unseen.csv"), include_str!("gates.rs")];
    let words = format!("{judge} {record} {test}");
    crate::rtl::found_before::unless_found_before("gates", &["extractor_core"], &words, find_recorded_netlists);
}

#[cfg(feature = "outside")]
fn find_recorded_netlists() {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut settings = unseen();
    // A setting takes a core for about a minute: the two with the fewest cells where something has changed, all of them each week.
    settings.sort_by(|one, other| one.cells.total_cmp(&other.cells));
    settings.truncate(crate::common::cases(settings.len(), 2));
    for pair in settings.chunks(2) {
        let started: Vec<_> = pair
            .iter()
            .map(|one| {
                std::process::Command::new("python3")
                    .arg(format!("{root}/tests/judges/gates.py"))
                    .arg("core")
                    .args(one.words.split(' '))
                    .stdout(std::process::Stdio::piped())
                    .spawn()
                    .expect("python3 and yosys run: ./check --install")
            })
            .collect();
        for (one, child) in pair.iter().zip(started) {
            let output = child.wait_with_output().unwrap();
            let text = String::from_utf8(output.stdout).unwrap();
            let found: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
            assert!(output.status.success() && found.len() == 3, "{}: {text}", one.words);
            // The mapper's choices differ a little from version to version.
            for (found, told) in found.iter().zip([one.cells, one.flip_flops, one.sram_bits]) {
                assert!((found - told).abs() <= 0.1 * told, "{}: {found}, recorded {told}", one.words);
            }
        }
    }
}
