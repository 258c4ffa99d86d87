//! Plays pictures to the extractor's twin with gaps, stalls and resets, and passes the pins of every clock to an observer.

use super::cases::Random;
use rtl_models::extractor_core::{ExtractorCore, ExtractorIn, ExtractorOut, back_pins, front_config};
use rtl_models::fx_back::{
    CellList, Engine, FxBackConfig, FxBackIn, FxBackMemory, FxBackOut, FxBackToggles, FxCounts, FxSettings, Policy,
    QueuedCorner, Record,
};
use rtl_models::fx_front::{FxFrontMemory, FxFrontOut, line_words};

/// When the link takes records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Takes {
    /// In every clock.
    Always,
    /// In one clock of so many.
    OneIn(u32),
    /// Not at all for so many clocks, then for as many.
    Blocks(u32),
}

/// When pixels are offered and records taken: functions of the clock, 0 being the first after reset.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    pub seed: u64,
    /// One clock of so many has no pixel; 0: every clock has one.
    pub gaps: u32,
    pub takes: Takes,
}

impl Times {
    fn one_in(&self, what: u64, clk: u64, n: u32) -> bool {
        Random::new(self.seed ^ what << 60 ^ clk.wrapping_mul(0x9E37_79B9)).one_in(n)
    }

    pub fn offered(&self, clk: u64) -> bool {
        self.gaps == 0 || !self.one_in(1, clk, self.gaps)
    }

    pub fn taken(&self, clk: u64) -> bool {
        match self.takes {
            Takes::Always => true,
            Takes::OneIn(n) => self.one_in(2, clk, n),
            Takes::Blocks(n) => clk / u64::from(n) % 2 == 1,
        }
    }
}

/// One stretch of pictures under one setting.
#[derive(Clone, Debug)]
pub struct Case {
    pub config: FxBackConfig,
    pub settings: FxSettings,
    pub frames: u32,
    pub times: Times,
    /// One clock of so many is a reset; 0: the first only.
    pub resets: u32,
}

/// All pins of a clock: inputs as they stood at its edge, outputs after it.
pub struct Clock<'a> {
    /// Counted from the one after the first reset.
    pub clk: u64,
    pub pins: &'a ExtractorIn,
    pub out: &'a ExtractorOut,
    pub front: &'a FxFrontOut,
    pub back_pins: &'a FxBackIn,
    pub back_out: &'a FxBackOut,
    /// The record that leaves in this clock.
    pub left: Option<Record>,
    /// Counts before the edge.
    pub counts: FxCounts,
    /// Clocks without `in_ready` before the edge.
    pub not_ready: u32,
}

fn index(value: u32) -> usize {
    usize::try_from(value).unwrap()
}

/// Memories of the twin, full of something.
pub struct Memories {
    lines: Vec<[u16; 6]>,
    scores: Vec<[u16; 2]>,
    half_row: Vec<u16>,
    ranks: Vec<u16>,
    lists: Vec<CellList>,
    ring: Vec<u16>,
    queue: Vec<QueuedCorner>,
    engines: Vec<Engine>,
}

impl Memories {
    pub fn new(config: &FxBackConfig) -> Self {
        let words = line_words(config.max_width, config.octaves);
        Self {
            lines: vec![[0x55; 6]; words],
            scores: vec![[0x33; 2]; words],
            half_row: vec![0x0F; index(config.max_width / 2)],
            ranks: vec![7; if config.harris { words } else { 0 }],
            lists: vec![CellList::default(); config.lists()],
            ring: vec![0x5A; config.ring_pixels()],
            queue: vec![QueuedCorner::default(); index(config.fifo_depth)],
            engines: vec![Engine::default(); index(config.engines)],
        }
    }

    pub fn core(&mut self, config: FxBackConfig) -> ExtractorCore<'_> {
        let front = FxFrontMemory {
            lines: &mut self.lines,
            scores: &mut self.scores,
            half_row: &mut self.half_row,
            ranks: &mut self.ranks,
        };
        let back = FxBackMemory {
            lists: &mut self.lists,
            ring: &mut self.ring,
            queue: &mut self.queue,
            engines: &mut self.engines,
        };
        ExtractorCore::new(config, front, back)
    }
}

/// Plays a case until nothing is on its way; returns the last pins that left, and the bits that flipped in the back.
pub fn play(
    case: &Case,
    random: &mut Random,
    mut picture: impl FnMut(&mut Random) -> Vec<u16>,
    mut look: impl FnMut(&Clock<'_>),
) -> (ExtractorOut, FxBackToggles) {
    front_config(&case.config).check().unwrap();
    let mut memories = Memories::new(&case.config);
    let mut core = memories.core(case.config);
    let (mut pixels, mut next, mut frames, mut clock, mut quiet) = (picture(random), 0, 0, 0_u64, 0);
    loop {
        let rst = clock == 0 || (case.resets > 0 && frames < case.frames && random.one_in(case.resets));
        let clk = clock.wrapping_sub(1);
        let offered = frames < case.frames && case.times.offered(clk);
        let out_ready = case.times.taken(clk);
        let in_pixel = if offered { pixels[next] } else { 0 };
        let pins = ExtractorIn { rst, settings: case.settings, in_valid: offered, in_pixel, out_ready };
        let ready = core.in_ready(&case.settings);
        let front = core.front().out(core.out(&pins).back.row_ok);
        let back = back_pins(&front, rst, case.settings, out_ready);
        let left = core.back().record().copied().filter(|_| out_ready && !rst);
        let (counts, not_ready) = (*core.back().counts(), core.out(&pins).not_ready);
        let out = core.tick(&pins);
        let back_out = core.back().out(&back);
        look(&Clock {
            clk,
            pins: &pins,
            out: &out,
            front: &front,
            back_pins: &back,
            back_out: &back_out,
            left,
            counts,
            not_ready,
        });
        if rst {
            // The first picture has not begun.
            pixels = if clock == 0 { pixels } else { picture(random) };
            next = 0;
        } else if ready && offered {
            next += 1;
            if next == pixels.len() {
                (pixels, next) = (picture(random), 0);
                frames += 1;
            }
        }
        clock += 1;
        quiet = if frames == case.frames && core.back().is_idle() { quiet + 1 } else { 0 };
        // Longer than the longest row of the last positions.
        if quiet > 2 * case.config.max_width + 100 {
            return (out, core.toggles().1);
        }
        assert!(clock < 30_000_000, "{case:?} never ends");
    }
}

/// Hardware of the tests: small pictures, so that every path is met often.
pub fn hardware(kind: u32) -> FxBackConfig {
    let small = FxBackConfig {
        max_width: 96,
        pix_bits: 8,
        octaves: 1,
        harris: false,
        cell_log2: 4,
        per_cell: 1,
        ring_log2: 6,
        engines: 2,
        fifo_depth: 4,
        desc_bits: 256,
        symmetric: false,
        subpixel: true,
        width: 96,
        height: 96,
    };
    match kind {
        0 => FxBackConfig { octaves: 3, max_width: 160, ..small },
        1 => FxBackConfig {
            pix_bits: 10,
            harris: true,
            per_cell: 3,
            engines: 1,
            fifo_depth: 7,
            symmetric: true,
            cell_log2: 5,
            ..small
        },
        2 => {
            FxBackConfig { per_cell: 3, octaves: 2, fifo_depth: 1, engines: 3, desc_bits: 64, subpixel: false, ..small }
        }
        _ => small,
    }
}

/// The most hardware there is, and a picture whose fourth octave is built.
pub fn widest() -> FxBackConfig {
    FxBackConfig {
        max_width: 420,
        pix_bits: 16,
        octaves: 4,
        harris: true,
        cell_log2: 6,
        per_cell: 4,
        ring_log2: 7,
        engines: 4,
        fifo_depth: 64,
        width: 420,
        ..hardware(3)
    }
}

/// A stretch of `frames` pictures on this hardware: twelve numbers in a row meet each policy with each way of taking records.
pub fn case_on(hardware: FxBackConfig, number: u32, frames: u32, random: &mut Random) -> Case {
    let policy = [Policy::Stall, Policy::DropNewest, Policy::DropWeakest][index(number % 3)];
    let takes = match number / 3 % 4 {
        0 => Takes::Always,
        1 => Takes::OneIn(random.within(2, 600)),
        2 => Takes::Blocks(random.within(4000, 9000)),
        _ => Takes::Blocks(random.within(300, 2000)),
    };
    let small = number % 12 == 1;
    let [width, height] = if small {
        [random.within(20, 40), random.within(20, 40)]
    } else {
        [random.within(64, hardware.max_width), random.within(64, 140)]
    };
    let top = (1 << hardware.pix_bits) - 1;
    let threshold = u16::try_from(random.within(1, top / 6)).unwrap();
    let target = if random.one_in(3) { u16::try_from(random.within(1, 200)).unwrap() } else { 0 };
    let angle_bits = if random.one_in(2) { 8 } else { random.within(1, 7) };
    Case {
        config: FxBackConfig { width, height, ..hardware },
        settings: FxSettings { threshold, policy, target, angle_bits },
        frames,
        times: Times { seed: random.next(), gaps: [0, 3, 40][index(random.below(3))], takes },
        resets: if number % 5 == 4 { 15_000 } else { 0 },
    }
}

/// A picture of noise of several kinds, of few levels, or of rectangles over noise.
pub fn picture(random: &mut Random, config: &FxBackConfig) -> Vec<u16> {
    let top = (1_u32 << config.pix_bits) - 1;
    let (kind, cell) = (random.below(5), random.within(3, 12));
    let boxes: [[u32; 5]; 30] = std::array::from_fn(|_| {
        let (x, y) = (random.below(config.width), random.below(config.height));
        [x, y, random.within(3, 20), random.within(3, 20), random.below(top + 1)]
    });
    let mut pixel = |x: u32, y: u32| match kind {
        0 => random.below(top + 1),
        1 => random.below(2) * top,
        2 => (x / cell + y / cell) % 2 * (top / 2) + random.below(top / 8),
        _ => {
            let hit = boxes.iter().find(|[left, upper, wide, high, _]| {
                (*left..left + wide).contains(&x) && (*upper..upper + high).contains(&y)
            });
            (hit.map_or(top / 3, |hit| hit[4]) + random.below(top / 10)).min(top)
        }
    };
    let positions = (0..config.height).flat_map(|y| (0..config.width).map(move |x| (x, y)));
    positions.map(|(x, y)| u16::try_from(pixel(x, y)).unwrap()).collect()
}
