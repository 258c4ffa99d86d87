//! OpenCV's ORB through `tests/judges/orb_features.py`. Enters: codes, numbers of features. Leaves: features.

use std::path::{Path, PathBuf};
use std::process::Command;

use sensel::compute::to_8_bits;
use serde_json::{Value, json};

use crate::score::Features;
use crate::settings::words;
use crate::views::Codes;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/judges/orb_features.py");

fn run(python: &str, arguments: &[&str]) {
    let output = Command::new(python).arg(SCRIPT).args(arguments).output().expect("the judges' Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// scikit-image's pictures, written into a folder.
pub fn pictures(python: &str, out: &Path) -> PathBuf {
    let folder = out.join("pictures");
    std::fs::create_dir_all(&folder).expect("the output folder can be made");
    run(python, &["pictures", &folder.to_string_lossy()]);
    folder
}

/// Features of each picture, as many as asked for at most.
pub fn features<'a>(python: &str, out: &Path, all: impl Iterator<Item = &'a Codes>, counts: &[usize]) -> Vec<Features> {
    let jobs: Vec<Value> = all
        .zip(counts)
        .enumerate()
        .map(|(number, (codes, count))| {
            let file = out.join(format!("view{number}.raw"));
            std::fs::write(&file, to_8_bits(&codes.plane, codes.bits).values()).expect("the output folder takes files");
            let size = codes.size();
            json!({"file": file.to_string_lossy(), "width": size.width_px, "height": size.height_px, "features": count})
        })
        .collect();
    let (list, answers) = (out.join("views.json"), out.join("orb.json"));
    std::fs::write(&list, Value::from(jobs).to_string()).expect("the output folder takes files");
    run(python, &["features", &list.to_string_lossy(), &answers.to_string_lossy()]);
    let text = std::fs::read_to_string(&answers).expect("the script wrote its answers");
    let answers: Vec<Vec<(f64, f64, Vec<u8>)>> = serde_json::from_str(&text).expect("the script writes JSON");
    let feature = |(x, y, bytes): (f64, f64, Vec<u8>)| {
        ([x, y], words(bytes.as_slice().try_into().expect("a descriptor has 32 bytes")))
    };
    answers.into_iter().map(|list| list.into_iter().map(feature).collect()).collect()
}
