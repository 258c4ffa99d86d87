//! Table of the hard cases: prints errors beside their bounds, writes the lines of docs/hard_cases.md, and fails where a bound does not
//! hold or a side was never tried.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use sensel::draw::DrawKey;
use sensel::num::{f64_from_u64, low_u32};

/// Seed of every random input.
pub const SEED: u64 = 20_261_122;

/// One hard case.
pub struct Case {
    name: &'static str,
    reference: &'static str,
    unit: &'static str,
    sides: Vec<Side>,
}

/// One side of its seam.
struct Side {
    name: &'static str,
    samples: u64,
    /// Error and bound where their quotient was greatest.
    worst: (f64, f64),
    worst_at: String,
}

/// The cases of one stage.
pub struct Stage {
    name: &'static str,
    cases: Vec<Case>,
}

impl Case {
    /// An error of a sample on one side of the seam, with what it may be. A bound of 0 asks for equality.
    pub fn see(&mut self, side: usize, error: f64, bound: f64, at: impl FnOnce() -> String) {
        assert!(bound >= 0.0, "{}: a bound is a size", self.name);
        let side = &mut self.sides[side];
        let (worst, of) = side.worst;
        if side.samples == 0 || share(error, bound) > share(worst, of) {
            side.worst = (error, bound);
            side.worst_at = at();
        }
        side.samples += 1;
    }

    /// A yes or no: an error of 0 or 1 against a bound of 0.
    pub fn hold(&mut self, side: usize, holds: bool, at: impl FnOnce() -> String) {
        self.see(side, if holds { 0.0 } else { 1.0 }, 0.0, at);
    }

    fn failures(&self) -> impl Iterator<Item = String> {
        self.sides.iter().filter_map(|side| {
            let ((error, bound), name) = (side.worst, format!("{}, {}", self.name, side.name));
            if side.samples == 0 {
                return Some(format!("{name}: no sample was tried"));
            }
            // False for NaN.
            let holds = error <= bound;
            (!holds).then(|| format!("{name}: error {error:e} over {bound:e} at {}", side.worst_at))
        })
    }

    /// A line a side; the first says what it is.
    fn lines(&self) -> String {
        let mut lines = String::new();
        for (number, side) in self.sides.iter().enumerate() {
            let [name, reference, unit] = if number == 0 { [self.name, self.reference, self.unit] } else { [""; 3] };
            let ((error, bound), samples) = (side.worst, side.samples);
            let figures = format!("{samples} | {} | {} | {unit}", short(error), short(bound));
            writeln!(lines, "| {name} | {reference} | {} | {figures} |", side.name).expect("a string takes all");
        }
        lines
    }
}

/// Error over bound; a bound of 0 is missed by anything.
fn share(error: f64, bound: f64) -> f64 {
    match (error == 0.0, bound == 0.0) {
        (true, _) => 0.0,
        (false, true) => f64::INFINITY,
        (false, false) if error.is_nan() => f64::INFINITY,
        (false, false) => error / bound,
    }
}

/// Two digits.
fn short(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

static PAGE: Mutex<()> = Mutex::new(());

impl Stage {
    pub fn new(name: &'static str) -> Self {
        Self { name, cases: Vec::new() }
    }

    /// A case with the sides of its seam.
    pub fn case(
        &mut self,
        name: &'static str,
        reference: &'static str,
        unit: &'static str,
        sides: &[&'static str],
    ) -> &mut Case {
        let side = |&name: &&'static str| Side { name, samples: 0, worst: (0.0, 0.0), worst_at: String::new() };
        self.cases.push(Case { name, reference, unit, sides: sides.iter().map(side).collect() });
        self.cases.last_mut().expect("just pushed")
    }

    /// Prints the table, past the harness that keeps the words of tests that pass; then judges every case; then compares the page.
    pub fn judge(self) {
        let lines: String = self.cases.iter().map(Case::lines).collect();
        let table = format!("\n{}, seed {SEED}\n{HEAD}{lines}", self.name);
        std::io::stdout().write_all(table.as_bytes()).expect("the table can be printed");
        let failures: Vec<String> = self.cases.iter().flat_map(Case::failures).collect();
        assert!(failures.is_empty(), "{}", failures.join("\n"));
        compare(self.name, &format!("{HEAD}{lines}"));
    }
}

/// The page's part between its marks is what this run found; `SENSEL_UPDATE=1` writes it anew.
pub fn compare(name: &str, table: &str) {
    let _turn = PAGE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let path = page();
    let text = std::fs::read_to_string(&path).expect("the page stands in docs");
    let (start, end) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->"));
    let (before, rest) = text.split_once(&start).unwrap_or_else(|| panic!("the page has no part '{name}'"));
    let (held, after) = rest.split_once(&end).expect("a part of the page ends");
    let part = format!("\n{table}\n");
    if held == part {
        return;
    }
    assert!(
        std::env::var_os("SENSEL_UPDATE").is_some(),
        "docs/hard_cases.md differs; SENSEL_UPDATE=1 cargo test --test all hard_cases writes it anew. This run:\n{part}"
    );
    std::fs::write(&path, format!("{before}{start}{part}{end}{after}")).expect("the page can be written");
}

const HEAD: &str = "\
| case | reference | side | samples | error reached | bound | unit |
|---|---|---|---:|---:|---:|---|
";

/// The page of the hard cases.
fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/hard_cases.md")
}

/// Random numbers of one case, one after the other.
pub struct Chance {
    key: DrawKey,
    drawn: u64,
}

impl Chance {
    pub fn new(case: u64) -> Self {
        Self { key: DrawKey::root(SEED).with(case), drawn: 0 }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.drawn += 1;
        self.key.with(self.drawn).0
    }

    /// 32 random bits.
    pub fn word(&mut self) -> u32 {
        low_u32(self.bits() >> 32)
    }

    /// In 0..1, of 53 bits.
    pub fn unit(&mut self) -> f64 {
        f64_from_u64(self.bits() >> 11) / 9_007_199_254_740_992.0
    }

    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.unit()
    }

    /// Even in the logarithm.
    pub fn decade(&mut self, least: f64, most: f64) -> f64 {
        libm::exp(self.between(libm::log(least), libm::log(most)))
    }

    pub fn below(&mut self, bound: u64) -> u64 {
        self.bits() % bound
    }

    /// A unit vector, even on the sphere.
    pub fn direction(&mut self) -> glam::DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sine, cosine) = libm::sincos(self.between(0.0, std::f64::consts::TAU));
        let flat = (1.0 - z * z).sqrt();
        glam::DVec3::new(flat * cosine, flat * sine, z)
    }
}
