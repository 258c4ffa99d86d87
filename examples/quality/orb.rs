//! Features of OpenCV's ORB, by `tests/judges/orb_features.py`.

use std::path::{Path, PathBuf};
use std::process::Command;

use sensel::compute::to_8_bits;
use sensel::units::Size;
use serde_json::{Value, json};

use super::score::Features;
use super::settings::words;
use super::views::Codes;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/judges/orb_features.py");

fn run(python: &str, arguments: &[&str]) {
    let output = Command::new(python).arg(SCRIPT).args(arguments).output().expect("the judges' Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// scikit-image's pictures of a set (`chosen_on` or `judged_on`), written into a folder.
pub fn pictures(python: &str, out: &Path, set: &str) -> PathBuf {
    let folder = out.join(set);
    std::fs::create_dir_all(&folder).expect("the output folder can be made");
    run(python, &["pictures", &folder.to_string_lossy(), set]);
    folder
}

/// Views of a picture as files that ORB reads.
pub struct Files {
    out: PathBuf,
    views: Vec<(PathBuf, Size)>,
}

impl Files {
    pub fn write<'a>(out: &Path, all: impl Iterator<Item = &'a Codes>) -> Self {
        let one = |(number, codes): (usize, &Codes)| {
            let file = out.join(format!("view{number}.raw"));
            std::fs::write(&file, to_8_bits(&codes.plane, codes.bits).values()).expect("the output folder takes files");
            (file, codes.size())
        };
        Self { out: out.to_owned(), views: all.enumerate().map(one).collect() }
    }

    /// Features of each view, as many as asked for at most, for each list of numbers.
    pub fn features(&self, python: &str, counts: &[Vec<usize>]) -> Vec<Vec<Features>> {
        let job = |(count, (file, size)): (&usize, &(PathBuf, Size))| {
            let (file, width, height) = (file.to_string_lossy(), size.width_px, size.height_px);
            json!({"file": file, "width": width, "height": height, "features": count})
        };
        let jobs: Vec<Value> = counts.iter().flat_map(|counts| counts.iter().zip(&self.views).map(job)).collect();
        let (list, answers) = (self.out.join("views.json"), self.out.join("orb.json"));
        std::fs::write(&list, Value::from(jobs).to_string()).expect("the output folder takes files");
        run(python, &["features", &list.to_string_lossy(), &answers.to_string_lossy()]);
        let text = std::fs::read_to_string(&answers).expect("the script wrote its answers");
        let answers: Vec<Vec<(f64, f64, Vec<u8>)>> = serde_json::from_str(&text).expect("the script writes JSON");
        let feature = |(x, y, bytes): &(f64, f64, Vec<u8>)| {
            ([*x, *y], words(bytes.as_slice().try_into().expect("a descriptor has 32 bytes")))
        };
        let all: Vec<Features> = answers.iter().map(|list| list.iter().map(feature).collect()).collect();
        all.chunks(self.views.len()).map(<[Features]>::to_vec).collect()
    }
}
