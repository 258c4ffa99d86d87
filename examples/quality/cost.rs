//! What a setting costs at VGA: memory from its words, energy from its counted events. Gates stand in docs/rtl.md.

use std::fmt::Write as _;
use std::path::Path;

use sensel::compute::{Extractor, ExtractorParams, Rank, extract};
use sensel::energy::{Constant, Technology};
use sensel::events::{Block, Event, Events};
use sensel::num::{f64_from_u64, f64_from_usize, index};
use sensel::plane::Plane;
use sensel::units::Size;

use super::score::Score;
use super::settings::{Method, Setting};

const VGA: Size = Size { width_px: 640, height_px: 480 };

/// What one setting costs.
pub struct Cost {
    name: &'static str,
    memory_bits: u64,
    /// Of a VGA frame.
    pub energy_nj: f64,
    features: usize,
}

impl Cost {
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({"name": self.name, "memory_bits": self.memory_bits,
            "energy_pj_per_frame": 1e3 * self.energy_nj, "features": self.features})
    }
}

/// The cost of our settings; floating point has none.
pub fn of(setting: &Setting) -> Option<Cost> {
    let Method::Fixed(params) = &setting.method else { return None };
    let frame = frame();
    // VGA has 25/9 of the pixels of the study's views, and so of the corners.
    let params = &ExtractorParams { target_features: params.target_features * 25 / 9, ..*params };
    let extracted = Extractor::new(params).first_frame(&frame, 10).expect("VGA is large enough");
    let at_rest = ExtractorParams { threshold: extracted.threshold, target_features: 0, ..*params };
    let mut events = Events::default();
    let features = extract(&frame, 10, &at_rest, &mut events).expect("VGA is large enough").len();
    let technology = Technology::by_name("65nm").expect("it comes with the program");
    // The extractor's events bear the names of their constants.
    let energy = |event: &Event| {
        let constant = Constant::from_name(event.name()).expect("every event of the extractor has a constant");
        f64_from_u64(events.count(*event)) * technology.value(constant)
    };
    let counted = Event::ALL.iter().filter(|event| event.block() == Block::Compute);
    let energy_nj = 1e-3 * counted.map(energy).sum::<f64>();
    Some(Cost { name: setting.name, memory_bits: memory_bits(params), energy_nj, features })
}

/// A ramp with a bar of its own contrast in each tile of 37 x 29 pixels, under noise: some 1000 corners.
fn frame() -> Plane<u16> {
    let mix = sensel::draw::mix;
    let value = |i: u64| {
        let (x, y) = (i % 640, i / 640);
        let tile = mix(x / 37 + 100 * (y / 29));
        let (dx, dy) = (x % 37, y % 29);
        let bar = dx > tile % 20 && dx < tile % 20 + 9 && dy > tile / 64 % 12 && dy < tile / 64 % 12 + 7;
        u16::try_from(4 * (50 + x / 8 + y / 10 + if bar { tile / 4096 % 90 } else { 0 } + mix(i) % 7).min(255))
            .expect("clipped")
    };
    Plane::from_values(VGA, (0..640 * 480).map(value).collect())
}

/// Bits of all memories for VGA: window, scores, half-scale row, ranks, lists, ring; and each engine's patch.
fn memory_bits(params: &ExtractorParams) -> u64 {
    let word = u64::from(params.pipeline_bits);
    let (mut bits, mut width) = (0, u64::from(VGA.width_px));
    let rank = if params.rank == Rank::Harris { 16 } else { 0 };
    let response = if params.subpixel { 9 * word } else { word };
    for octave in 0..params.octaves {
        bits += (6 + 2) * word * width + rank * width;
        bits += u64::from(params.ring_rows()) * word * width;
        let entry = 12 + 12 + rank + response;
        bits += 2 * width.div_ceil(params.cell_px.into()) * u64::from(params.per_cell) * entry;
        if octave + 1 < params.octaves {
            bits += word * (width / 2) * u64::from(octave == 0);
        }
        width /= 2;
    }
    bits + u64::from(params.engines) * 27 * 27 * word
}

pub fn print(costs: &[Cost]) {
    println!("\n| extractor | memory bits | features of a VGA frame | nJ per frame |\n|---|---|---|---|");
    for cost in costs {
        println!("| {} | {} | {} | {:.0} |", cost.name, cost.memory_bits, cost.features, cost.energy_nj);
    }
}

/// Matching score over energy, one point a setting; the line is ORB's.
pub fn draw(points: &[(&str, Score, Cost)], orb: Option<Score>, file: &Path) {
    let (width, height) = (860.0, 520.0);
    let most_nj = points.iter().map(|(_, _, cost)| cost.energy_nj).fold(0.0, sensel::num::greater) * 1.08;
    let scores = points.iter().map(|(_, score, _)| score.matching).chain(orb.map(|orb| orb.matching));
    let low = 0.95 * scores.clone().fold(1.0, sensel::num::lesser);
    let high = 1.03 * scores.fold(0.0, sensel::num::greater);
    let x = |nj: f64| 70.0 + nj / most_nj * (width - 330.0);
    let y = |share: f64| height - 50.0 - (share - low) / (high - low) * (height - 80.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\
         <text x=\"70\" y=\"20\" font-size=\"15\">Matching score over energy of a VGA frame (65 nm)</text>"
    );
    let mut line = |text: String| svg.push_str(&text);
    let axis = "stroke=\"#444\" fill=\"none\"";
    line(format!("<path d=\"M70 30V{:.0}H{:.0}\" {axis}/>", height - 50.0, width - 260.0));
    for k in 0..=5 {
        let part = f64::from(k) / 5.0;
        let (nj, share) = (part * most_nj, low + part * (high - low));
        line(format!(
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{:.1}</text>",
            x(nj),
            height - 32.0,
            1e-3 * nj
        ));
        line(format!("<text x=\"62\" y=\"{:.0}\" text-anchor=\"end\">{:.0} %</text>", y(share) + 4.0, 100.0 * share));
    }
    line(format!(
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">uJ a frame</text>",
        x(0.5 * most_nj),
        height - 12.0
    ));
    if let Some(orb) = orb {
        let at = y(orb.matching);
        line(format!("<path d=\"M70 {at:.1}H{:.0}\" stroke=\"#c33\" stroke-dasharray=\"5 4\"/>", width - 260.0));
        line(format!("<text x=\"76\" y=\"{:.1}\" fill=\"#c33\">OpenCV ORB, one level</text>", at - 5.0));
    }
    let mut number = String::new();
    for (rank, (name, score, cost)) in points.iter().enumerate() {
        number.clear();
        write!(number, "{}", rank + 1).expect("writing to a string cannot fail");
        let (px, py) = (x(cost.energy_nj), y(score.matching));
        let radius = 4.0 + f64_from_u64(cost.memory_bits) / 60_000.0;
        line(format!(
            "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{radius:.1}\" fill=\"#27c\" fill-opacity=\"0.35\" stroke=\"#27c\"/>"
        ));
        line(format!(
            "<text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"10\">{number}</text>",
            py + 3.5
        ));
        let row = 44.0 + 22.0 * f64_from_usize(index(u32::try_from(rank).expect("a few settings")));
        line(format!("<text x=\"{:.0}\" y=\"{row:.0}\">{number} {name}</text>", width - 245.0));
    }
    svg.push_str("</svg>\n");
    std::fs::write(file, svg).expect("the output folder takes files");
}
