//! What a user writes: one struct a section, one field a key, unknown keys refused. Ranges are checked on conversion.

macro_rules! sections {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident $(as $key:literal)? : $type:ty,)* })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$field_doc])* $(#[serde(rename = $key)])? pub $field: $type,)* }
    )* };
}

mod optics;
mod per_camera;
mod sensor;
mod world;

pub use optics::*;
pub use sensor::*;
pub use world::*;

use serde::{Deserialize, Serialize};

use crate::error::Error;
pub use per_camera::PerCamera;

sections! {
    /// A whole scenario, all layers merged.
    Scenario {
        /// Seed of the noise of sensors, link and IMU, and of the tracker's random draws. No photon depends on it.
        seed: u64,
        /// What is looked at.
        scene: Scene,
        /// How the rig moves.
        motion: Motion,
        /// How the run is carried out.
        run: Run,
        /// Cameras and IMU.
        rig: Rig,
        /// Lens and aperture.
        optics: Optics,
        /// The image sensor.
        sensor: Sensor,
        /// The extractor on the sensor.
        compute: Compute,
        /// The link to the host.
        link: Link,
        /// The host's tracker.
        tracker: Tracker,
        /// Power of the sensor.
        energy: Energy,
        /// The host's energy.
        host: Host,
    }
    /// How the run is carried out.
    Run {
        /// Frames of each camera, 1 to 1,000,000.
        frames: u32,
        /// Rung of the ladder: "expected", "sampled", "clocked", "rtl".
        rung: String,
        /// "auto", "all", "none", or names to add and take away from auto: "+name,-name".
        effects: String,
        /// Threads; 0: as many as cores. Changes no byte of the result.
        threads: u32,
        /// Rays of every pixel, 1 to 4096, in place of `render_tolerance`. With sub-frames, those of each; 1 unless given.
        samples_per_pixel: Option<u32>,
        /// Rays are sent where they tell most, until the mean of render variance is at most this many times photon variance, 0.001 to
        /// 1000; in place of `samples_per_pixel`.
        render_tolerance: Option<f64>,
        /// Rays per pixel at most, with a render tolerance, besides its first 2 (a tolerance of 1 or more) or 4; 16 to 65536.
        /// Few pixels get many: those in which small mirrors show a lamp, whose samples are thousands of times as bright as the rest.
        samples_max: u32,
        /// "stratified": every ray has its own instant. "subframes": still pictures are averaged, as others do; a reference.
        sampling: String,
        /// Still pictures an exposure with sampling = "subframes", 1 to 4096.
        subframes: u32,
        /// Reflections that a ray follows, 0 to 4; 0: every surface is diffuse.
        reflections: u32,
        /// Where: "mirrors": at metals of roughness up to 0.1, exactly. "all": at gloss and glaze too, by chance; noisy under bare
        /// lamps.
        gloss: String,
        /// Names the render's samples. Whatever lies behind the lens, and `seed`, leaves photons as they are.
        render_seed: u64,
        /// Electrons of a photon that a render tolerance counts with, fill factor included, 0 to 1; the sensor's own unless given. Designs
        /// that state the same here and in `render_full_well_e` have equal photons.
        render_quantum_efficiency: Option<f64>,
        /// Electrons from which on a pixel's render noise does not count, 1 to 2e9; what the sensor's pixel holds unless given.
        render_full_well_e: Option<f64>,
        /// Step to which mean photons are rounded, in sigmas of their photon noise, 0.01 to 1; 0: not rounded. Stored photons of a step
        /// of 0.3 take a third of the disk; the error is 0.29 steps.
        photon_rounding: f64,
        /// What all effects left out may add up to, in units of a pixel's own noise, 0 to 10.
        accuracy: f64,
    }
    /// The extractor on the sensor.
    Compute {
        /// "fast9".
        detector: String,
        /// Least difference to the arc of nine pixels, in DN of the pipeline, 1 to 2^pipeline_bits - 1; with a target the
        /// first frame's, and the least.
        threshold: u16,
        /// Corners a frame to which the threshold adapts from frame to frame, 0 to 1,000,000; 0: it stays.
        target_features: u32,
        /// Bits of the pipeline's words, 8 to 16; codes are shifted to them.
        pipeline_bits: u32,
        /// Before corners are looked for: "off", "binomial" (7x7), or "auto" (the latter where codes have 4 bits or fewer).
        smoothing: String,
        /// Octaves, each of half the sides of the one before, 1 to 4.
        octaves: u32,
        /// Side of the cells that share the features out: 16, 32 or 64.
        cell_px: u32,
        /// Corners that a cell keeps, 1 to 4.
        per_cell: u32,
        /// Which of a cell's corners are kept: "fast" (FAST's score) or "harris".
        rank: String,
        /// Positions to 1/16 px.
        subpixel: bool,
        /// Bits of an angle, 3 to 8.
        angle_bits: u32,
        /// Bits of a descriptor: 64, 128, 192 or 256.
        descriptor_bits: u32,
        /// Pairs that a descriptor compares: "gaussian" (turned by a rotator) or "symmetric" (turned by moving bytes).
        pattern: String,
        /// Descriptor engines in parallel, 1 to 4.
        engines: u32,
        /// Candidates that wait for an engine, 1 to 64.
        fifo_depth: u32,
        /// One more candidate than that: "stall", "drop_newest" or "drop_weakest".
        overflow: String,
        /// Clock of the extractor in Hz, 1,000 to 1,000,000,000; the pixel clock unless given.
        clock_hz: Option<u64>,
    }
    /// The link to the host.
    Link {
        /// D-PHY lanes, 1 to 4.
        lanes: u32,
        /// DDR clock of a lane.
        frequency_hz: u64,
        /// "auto": the smallest RAW kind that holds the codes; or "raw6", "raw7", "raw8", "raw10", "raw12", "raw14", "raw16".
        format: String,
        /// "frames", "features", "both".
        mode: String,
        /// With mode = "both": frames 0, N, 2 N, ... carry rows, every frame carries features; 1 or more.
        frames_every: u32,
        /// Line-start packets with their numbers in front of rows, so that the host can name a row that is missing.
        line_sync: bool,
        /// Rows that the FIFO in front of the link holds, the one that is being sent included, 1 to 65,535.
        fifo_rows: u32,
        /// What happens where it is full: "refuse": such a configuration is refused, with the HTS that suffices. "stall": the readout
        /// stands still and the stalls are counted; global shutter only.
        when_full: String,
        /// Share of bits that arrive flipped, 0 to 0.01.
        bit_error_rate: f64,
    }
    /// The host's tracker.
    Tracker {
        /// Keyframes refined together, 2 to 50.
        window: u32,
        /// Whether each keypoint counts at its row's own time: true or "auto" wherever the packets give times of rows, or false:
        /// a frame's rows count as simultaneous, as others take them.
        rolling_shutter: Switch,
        /// Whether loop closures bend the map: true or "auto", or false.
        loop_closing: Switch,
        /// Whether the readings of the rig's IMU are used: "on", "off", or "auto": where the rig has one (and a recording its
        /// readings).
        imu: String,
    }
    /// Power of the sensor: what timing and noise do not know already.
    Energy {
        /// A node from "180nm" to "22nm"; "auto": by `digital_v` or `year`; or a file of constants ("my.toml") beside the scenario.
        technology: String,
        /// Year of the design, 1990 to 2100; with technology = "auto" it chooses a node where `digital_v` is not given.
        year: Option<u32>,
        /// Supply of the logic in V, 0.2 to 5.5; not written: the core voltage of the node. Above that a linear regulator is on the chip.
        digital_v: Option<f64>,
        /// Supply of the port in V, 0.2 to 5.5.
        io_v: f64,
        /// Architecture of the converters, for energy alone: "single_slope", "sar", "cyclic", "sigma_delta", "in_pixel", "multi_column".
        adc: String,
        /// What carries the bits out, for energy alone: "dphy", "lvds", "parallel", "none".
        port: String,
        /// LVDS lanes without the clock lane, 1 to 128; not written: those of the link.
        port_lanes: Option<u32>,
        /// "full" (a product), "low_power" (sold as always-on), "external" (a test chip: clocks, references and port outside).
        periphery: String,
        /// Whether the chip processes pictures (colour, scaling, compression) before it sends them.
        image_processor: bool,
        /// Share of column and converter bias that flows while no row is converted, 0 to 1.
        idle_bias: f64,
        /// Node of the pixel die of a stacked sensor in nm, 5 to 1000; not written: one die.
        pixel_node_nm: Option<f64>,
        /// From frame to frame of a sensor that sleeps in between, above the frame's time, to 86,400,000; not written: it streams.
        sleep_period_ms: Option<f64>,
        /// From sleep to the first row, in us, 0 to 1e7.
        wake_us: f64,
        /// Constants in place of the technology's: a table of name to { unit = value }, as in constant.link_byte.pj = 12.
        constant: std::collections::BTreeMap<String, std::collections::BTreeMap<String, f64>>,
    }
    /// The host, as a stated model: its energy and time per frame beside the sensor's.
    Host {
        /// "none", "microcontroller", "single_board_computer": values of the keys below that are not written.
        model: String,
        /// Receiving a byte, in pJ, 0 to 1e9.
        receive_pj_per_byte: Option<f64>,
        /// Extracting features of pictures that arrive without, in pJ per pixel, 0 to 1e9.
        extract_pj_per_pixel: Option<f64>,
        /// Tracking, in uJ per frame, 0 to 1e9.
        track_uj_per_frame: Option<f64>,
        /// Tracking, in nJ per feature, 0 to 1e9.
        track_nj_per_feature: Option<f64>,
        /// Power that flows all the time, in mW, 0 to 1e6.
        idle_mw: Option<f64>,
        /// Its clock in Hz, 1e3 to 1e11.
        clock_hz: Option<f64>,
        /// Decoding a byte of a packet, in clocks, 0 to 1e9.
        decode_clk_per_byte: Option<f64>,
        /// Extracting features of pictures that arrive without, in clocks per pixel, 0 to 1e9.
        extract_clk_per_pixel: Option<f64>,
        /// Tracking, in clocks per frame, 0 to 1e12.
        track_clk_per_frame: Option<f64>,
        /// Tracking, in clocks per feature, 0 to 1e12.
        track_clk_per_feature: Option<f64>,
    }
}

/// Yes, no, or as the data say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected true, false or \"auto\"")]
pub enum Switch {
    /// By a person's choice.
    Set(bool),
    /// By a word: "auto".
    Word(String),
}

impl Switch {
    /// Whether it is on, where "auto" stands for `auto`. Fails on another word.
    pub fn is_on(&self, key: &str, auto: bool) -> Result<bool, Error> {
        match self {
            Self::Set(on) => Ok(*on),
            Self::Word(word) if word == "auto" => Ok(auto),
            Self::Word(word) => Err(Error::key(key, word, "use true, false or \"auto\"")),
        }
    }
}
