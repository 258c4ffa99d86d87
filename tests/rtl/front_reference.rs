//! Reference for the extractor's front, computed picture by picture from the definitions: order of raster slots, half-scale pictures,
//! differences of the 16 arcs, suppression, smoothing, Harris ranks. Events carry the index of their slot.

use rtl_models::fx_front::{FxFrontConfig, FxFrontMemory, FxFrontOut, line_words};

/// A picture of any depth.
#[derive(Clone, Debug)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u16>,
}

impl Picture {
    pub fn at(&self, x: usize, y: usize) -> i64 {
        self.pixels[y * self.width + x].into()
    }

    fn half(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let sum = |x, y| self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1) + 2;
        let value = |i: usize| u16::try_from(sum(2 * (i % width), 2 * (i / width)) / 4).unwrap();
        Self { width, height, pixels: (0..width * height).map(value).collect() }
    }
}

/// What leaves the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    Smoothed { octave: u32, x: u32, y: u32, pixel: u16 },
    Corner { octave: u32, x: u32, y: u32, score: u16, resp: [u16; 9], rank: u16 },
    RowEnd { octave: u32, row: u32, is_virtual: bool, frame_end: bool },
}

/// What stands on the pins.
pub fn events_of(out: &FxFrontOut) -> Vec<Event> {
    let mut events = Vec::new();
    let octave = out.octave;
    if out.sm_valid {
        events.push(Event::Smoothed { octave, x: out.sm_x, y: out.sm_y, pixel: out.sm_pixel });
    }
    if out.corner_valid {
        let (x, y, score, resp, rank) =
            (out.corner_x, out.corner_y, out.corner_score, out.corner_resp, out.corner_rank);
        events.push(Event::Corner { octave, x, y, score, resp, rank });
    }
    if out.row_end {
        let (row, is_virtual, frame_end) = (out.row, out.row_end_virtual, out.frame_end);
        events.push(Event::RowEnd { octave, row, is_virtual, frame_end });
    }
    events
}

/// The front's memories.
pub struct Buffers {
    lines: Vec<[u16; 6]>,
    scores: Vec<[u16; 2]>,
    half_row: Vec<u16>,
    ranks: Vec<u16>,
}

impl Buffers {
    /// Memories that wake up with a value.
    pub fn new(config: &FxFrontConfig, waking: u16) -> Self {
        let words = line_words(config.max_width, config.octaves);
        Self {
            lines: vec![[waking; 6]; words],
            scores: vec![[waking; 2]; words],
            half_row: vec![waking; usize::try_from(config.max_width / 2).unwrap()],
            ranks: vec![waking; if config.harris { words } else { 0 }],
        }
    }

    pub fn memory(&mut self) -> FxFrontMemory<'_> {
        FxFrontMemory {
            lines: &mut self.lines,
            scores: &mut self.scores,
            half_row: &mut self.half_row,
            ranks: &mut self.ranks,
        }
    }
}

/// Offsets of the circle, clockwise from straight below (Rosten and Drummond 2006).
const CIRCLE: [(i32, i32); 16] = [
    (0, 3),
    (1, 3),
    (2, 2),
    (3, 1),
    (3, 0),
    (3, -1),
    (2, -2),
    (1, -3),
    (0, -3),
    (-1, -3),
    (-2, -2),
    (-3, -1),
    (-3, 0),
    (-3, 1),
    (-2, 2),
    (-1, 3),
];

fn near(x: usize, dx: i32) -> usize {
    usize::try_from(i32::try_from(x).unwrap() + dx).unwrap()
}

fn difference(picture: &Picture, x: usize, y: usize) -> i64 {
    if x < 3 || y < 3 || x + 3 >= picture.width || y + 3 >= picture.height {
        return 0;
    }
    let centre = picture.at(x, y);
    let around = CIRCLE.map(|(dx, dy)| picture.at(near(x, dx), near(y, dy)) - centre);
    let arc = |start: usize, sign: i64| (start..start + 9).map(|k| sign * around[k % 16]).min().unwrap();
    (0..16).map(|start| arc(start, 1).max(arc(start, -1))).max().unwrap().max(0)
}

fn smoothed(picture: &Picture, x: usize, y: usize) -> u16 {
    const WEIGHTS: [i64; 7] = [1, 2, 3, 4, 3, 2, 1];
    let mut sum = 128;
    for (dy, wy) in WEIGHTS.iter().enumerate() {
        for (dx, wx) in WEIGHTS.iter().enumerate() {
            sum += wx * wy * picture.at(x + dx - 3, y + dy - 3);
        }
    }
    u16::try_from(sum / 256).unwrap()
}

fn harris_rank(picture: &Picture, pix_bits: u32, x: usize, y: usize) -> u16 {
    let at = |x: usize, y: usize| picture.at(x, y) >> (pix_bits - 8);
    let (mut xx, mut yy, mut xy) = (0, 0, 0);
    for v in y - 2..=y + 2 {
        for u in x - 2..=x + 2 {
            let side = |u: usize| at(u, v - 1) + 2 * at(u, v) + at(u, v + 1);
            let level = |v: usize| at(u - 1, v) + 2 * at(u, v) + at(u + 1, v);
            let (gx, gy) = (side(u + 1) - side(u - 1), level(v + 1) - level(v - 1));
            (xx, yy, xy) = (xx + gx * gx, yy + gy * gy, xy + gx * gy);
        }
    }
    let r = xx * yy - xy * xy - (((xx + yy) * (xx + yy)) >> 4);
    if r <= 0 {
        return 0;
    }
    let exponent = r.ilog2();
    let below = i128::from(r) * 1024 / (1_i128 << exponent) - 1024;
    u16::try_from(i128::from(exponent) * 1024 + below).unwrap()
}

/// One octave's answers.
struct Octave {
    picture: Picture,
    differences: Vec<i64>,
}

/// Everything that leaves in a frame, in order, each with its slot's number from 0.
pub struct Reference<'a> {
    config: &'a FxFrontConfig,
    threshold: u16,
    octaves: Vec<Octave>,
    slots: u64,
    pub events: Vec<(u64, Event)>,
    pub corners: usize,
}

impl<'a> Reference<'a> {
    pub fn new(config: &'a FxFrontConfig, picture: &Picture, threshold: u16) -> Self {
        let mut octaves: Vec<Octave> = Vec::new();
        for octave in 0..config.octaves {
            let picture = octaves.last().map_or_else(|| picture.clone(), |last| last.picture.half());
            if octave > 0 && (picture.width < 33 || picture.height < 33) {
                break;
            }
            let differences =
                (0..picture.width * picture.height).map(|i| difference(&picture, i % picture.width, i / picture.width));
            octaves.push(Octave { differences: differences.collect(), picture });
        }
        let mut this = Self { config, threshold, octaves, slots: 0, events: Vec::new(), corners: 0 };
        for y in 0..picture.height {
            this.row_and_deeper(0, y);
        }
        let last = this.events.len() - 1;
        let Event::RowEnd { frame_end, .. } = &mut this.events[last].1 else { panic!("a frame ends with a row") };
        *frame_end = true;
        this
    }

    /// The picture of an octave, if it is built.
    pub fn picture(&self, octave: usize) -> Option<&Picture> {
        self.octaves.get(octave).map(|octave| &octave.picture)
    }

    /// Slots of the frame without those that drain.
    pub fn slots(&self) -> u64 {
        self.slots
    }

    fn row_and_deeper(&mut self, octave: usize, y: usize) {
        self.row(octave, y, false);
        let height = self.octaves[octave].picture.height;
        if y == height - 1 {
            self.row(octave, height, true);
        }
        if y % 2 == 1 && octave + 1 < self.octaves.len() {
            self.row_and_deeper(octave + 1, y / 2);
        }
    }

    fn row(&mut self, octave: usize, y: usize, is_virtual: bool) {
        let Octave { picture, differences } = &self.octaves[octave];
        let [k, row] = [octave, y].map(|value| u32::try_from(value).unwrap());
        let coordinate = |at: usize, back: usize| u32::try_from(at - back).unwrap();
        for x in 0..=picture.width {
            if x >= 6 && y >= 6 && x < picture.width && !is_virtual {
                let pixel = smoothed(picture, x - 3, y - 3);
                self.events
                    .push((self.slots, Event::Smoothed { octave: k, x: coordinate(x, 3), y: coordinate(y, 3), pixel }));
            }
            if x >= 7 && y >= 7 {
                let (cx, cy) = (x - 4, y - 4);
                let resp: [i64; 9] =
                    std::array::from_fn(|i| differences[(cy + i / 3 - 1) * picture.width + cx + i % 3 - 1]);
                let others = (0..9).filter(|&i| i != 4).map(|i| resp[i]).max().unwrap();
                if resp[4] > i64::from(self.threshold) && resp[4] > others {
                    let resp = resp.map(|value| u16::try_from(value).unwrap());
                    let score = resp[4] - 1;
                    let harris = self.config.harris.then(|| harris_rank(picture, self.config.pix_bits, cx, cy));
                    let rank = harris.unwrap_or(score);
                    let (x, y) = (coordinate(cx, 0), coordinate(cy, 0));
                    self.events.push((self.slots, Event::Corner { octave: k, x, y, score, resp, rank }));
                    self.corners += 1;
                }
            }
            if x == picture.width {
                self.events.push((self.slots, Event::RowEnd { octave: k, row, is_virtual, frame_end: false }));
            }
            self.slots += 1;
        }
    }
}
