//! Clocked feature extractor, twin of `verilog/extractor_core.sv`: `fx_front` and `fx_back`. Converts pixels of successive pictures (DN)
//! to feature records.

use crate::fx_back::{
    FxBack, FxBackConfig, FxBackIn, FxBackMemory, FxBackOut, FxBackToggles, FxSettings, ListedCorner, Row,
};
use crate::fx_config::FxFrontConfig;
use crate::fx_front::{FrontToggles, FxFront, FxFrontIn, FxFrontMemory, FxFrontOut, Request};

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExtractorIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Settings.
    pub settings: FxSettings,
    /// A pixel is valid.
    pub in_valid: bool,
    /// Pixel in DN.
    pub in_pixel: u16,
    /// The valid record is taken.
    pub out_ready: bool,
}

/// Pins that leave, after the rising edge; those decoded from inputs with the pins of that clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExtractorOut {
    /// A pixel would be taken.
    pub in_ready: bool,
    /// The back's pins; `row_ok` answers the front's request.
    pub back: FxBackOut,
    /// Clocks since reset in which no pixel could be taken.
    pub not_ready: u32,
}

/// Both halves.
#[derive(Debug)]
pub struct ExtractorCore<'a> {
    front: FxFront<'a>,
    back: FxBack<'a>,
    not_ready: u32,
}

/// The front that goes with a back.
pub fn front_config(config: &FxBackConfig) -> FxFrontConfig {
    let FxBackConfig { max_width, pix_bits, octaves, harris, width, height, .. } = *config;
    FxFrontConfig { max_width, pix_bits, octaves, harris, width, height }
}

/// The front's pins as the back sees them.
pub fn back_pins(front: &FxFrontOut, rst: bool, settings: FxSettings, out_ready: bool) -> FxBackIn {
    let short = |value: u32| u16::try_from(value).expect("front's positions have 16 bits");
    let index = |octave: u32| usize::try_from(octave).expect("below four");
    FxBackIn {
        rst,
        settings,
        req: front.request.req,
        request: row_of(&front.request),
        octave: index(front.octave),
        row: front.row,
        smoothed: front.sm_valid.then(|| (short(front.sm_x), short(front.sm_y), front.sm_pixel)),
        corner: front.corner_valid.then(|| ListedCorner {
            x_px: short(front.corner_x),
            y_px: short(front.corner_y),
            score: front.corner_score,
            rank: front.corner_rank,
            resp: front.corner_resp,
        }),
        row_end: front.row_end,
        row_end_virtual: front.row_end_virtual,
        frame_end: front.frame_end,
        out_ready,
    }
}

fn row_of(request: &Request) -> Row {
    let octave = usize::try_from(request.octave).expect("below four");
    Row { octave, row: request.row, is_virtual: request.is_virtual }
}

impl<'a> ExtractorCore<'a> {
    /// A core in reset. Panics on parameters out of range or memories of another size.
    pub fn new(config: FxBackConfig, front: FxFrontMemory<'a>, back: FxBackMemory<'a>) -> Self {
        Self { front: FxFront::new(front_config(&config), front), back: FxBack::new(config, back), not_ready: 0 }
    }

    /// The front.
    pub fn front(&self) -> &FxFront<'a> {
        &self.front
    }

    /// The back.
    pub fn back(&self) -> &FxBack<'a> {
        &self.back
    }

    /// Bits that flipped in both halves.
    pub fn toggles(&self) -> (FrontToggles, FxBackToggles) {
        (self.front.toggles(), self.back.toggles())
    }

    /// Whether the coming edge would take a pixel.
    pub fn in_ready(&self, settings: &FxSettings) -> bool {
        self.front.in_ready(self.back.row_ok(row_of(&self.front.request()), settings.policy))
    }

    /// Pins as they stand, with those of this clock.
    pub fn out(&self, pins: &ExtractorIn) -> ExtractorOut {
        let row_ok = self.back.row_ok(row_of(&self.front.request()), pins.settings.policy);
        let front = self.front.out(row_ok);
        let back = self.back.out(&back_pins(&front, pins.rst, pins.settings, pins.out_ready));
        ExtractorOut { in_ready: front.in_ready, back, not_ready: self.not_ready }
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: &ExtractorIn) -> ExtractorOut {
        let ExtractorIn { rst, settings, in_valid, in_pixel, out_ready } = *pins;
        let row_ok = self.back.row_ok(row_of(&self.front.request()), settings.policy);
        let before = self.front.out(row_ok);
        let threshold = self.back.threshold(&settings);
        self.front.tick(&FxFrontIn { rst, in_valid, in_pixel, row_ok, threshold });
        self.back.tick(&back_pins(&before, rst, settings, out_ready));
        let lost = u32::from(!before.in_ready);
        self.not_ready = if rst { 0 } else { self.not_ready.wrapping_add(lost) };
        self.out(pins)
    }
}
