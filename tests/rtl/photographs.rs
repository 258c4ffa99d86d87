//! Photographs of scikit-image, loaded by the judges' Python and cut to 8-bit pictures for the extractor.

use std::path::Path;
use std::process::Command;

/// The middle of each photograph, and the part at its upper left quarter.
pub fn photographs(width: u32, height: u32) -> Vec<Vec<u16>> {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/judges/orb_features.py");
    let mut parts = Vec::new();
    for set in ["chosen_on", "judged_on"] {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("photographs").join(set);
        std::fs::create_dir_all(&folder).unwrap();
        let output = Command::new(&python).arg(&script).arg("pictures").arg(&folder).arg(set).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        for file in files {
            let grey = image::open(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display())).into_luma8();
            for (left, top) in [(2, 2), (4, 4)].map(|(x, y)| ((grey.width() - width) / x, (grey.height() - height) / y))
            {
                let pixels = (top..top + height).flat_map(|y| (left..left + width).map(move |x| (x, y)));
                parts.push(pixels.map(|(x, y)| grey.get_pixel(x, y).0[0].into()).collect());
            }
        }
    }
    parts
}
