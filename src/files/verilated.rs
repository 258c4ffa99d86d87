//! Runs the sensor's Verilog under Verilator for the rung `rtl`: row crossings or pictures to codes or feature records. A child process
//! simulates every clock; parallel rows have one process each.

use std::collections::BTreeMap;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Mutex;

use rtl_models::extractor_rows::ExtractorHost;
use rtl_models::fx_back::{FxBackConfig, FxCounts, Record};
use rtl_models::verilog::{FRAMES_HARNESS, ROWS_HARNESS};

use super::verilator::{self, Build, sources};
use crate::error::Error;
use crate::num::{low_u16, u32_from};
use crate::rtl_simulator::{FrameRequest, FrameResult, RowRequest, RtlSimulator};
use crate::words::{PositionPx, Turns};

/// Bytes of a whole descriptor in a record.
const DESCRIPTOR_BYTES: usize = 32;

/// A program that answers until its input ends.
#[derive(Debug)]
struct Player {
    child: Child,
    to: Option<BufWriter<ChildStdin>>,
    from: BufReader<ChildStdout>,
}

fn broken(what: impl std::fmt::Display) -> Error {
    Error::Run(format!("the Verilog's process does not answer: {what}"))
}

impl Player {
    fn start(program: &Path) -> Result<Self, Error> {
        let spawned = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = spawned.map_err(super::errors::io_error(program))?;
        let to = child.stdin.take().expect("piped above");
        let from = BufReader::new(child.stdout.take().expect("piped above"));
        Ok(Self { child, to: Some(BufWriter::new(to)), from })
    }

    fn to(&mut self) -> &mut BufWriter<ChildStdin> {
        self.to.as_mut().expect("open until it is dropped")
    }

    fn put32(&mut self, values: impl IntoIterator<Item = u32>) -> Result<(), Error> {
        values.into_iter().try_for_each(|value| self.put(&value.to_le_bytes()))
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.to().write_all(bytes).map_err(broken)
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.to().flush().map_err(broken)
    }

    fn get<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut bytes = [0; N];
        self.from.read_exact(&mut bytes).map_err(broken)?;
        Ok(bytes)
    }

    fn get16(&mut self) -> Result<u16, Error> {
        self.get().map(u16::from_le_bytes)
    }

    fn get32(&mut self) -> Result<u32, Error> {
        self.get().map(u32::from_le_bytes)
    }

    fn get64(&mut self) -> Result<u64, Error> {
        self.get().map(u64::from_le_bytes)
    }

    fn row(&mut self, asked: &RowRequest<'_>) -> Result<Vec<u16>, Error> {
        let flags = u32::from(asked.cds.latch_mode) | u32::from(asked.cds.gray) << 1;
        let columns = u32_from(asked.signal_clk.len());
        let black = u32::from(asked.cds.black);
        self.put32([columns, asked.reset_steps, asked.signal_steps, black, asked.cds.bits, flags])?;
        if asked.reset_steps > 0 {
            self.put32(asked.reset_clk.iter().copied())?;
        }
        self.put32(asked.signal_clk.iter().copied())?;
        self.flush()?;
        asked.signal_clk.iter().map(|_| self.get16()).collect()
    }

    fn frame(&mut self, asked: &FrameRequest<'_>, around: &mut dyn ExtractorHost) -> Result<FrameResult, Error> {
        let FrameRequest { hardware, settings, threshold, pixels } = *asked;
        let policy = settings.policy.code().into();
        let registers = [settings.threshold.into(), policy, settings.target.into(), settings.angle_bits];
        self.put32([hardware.width, hardware.height].into_iter().chain(registers).chain([threshold.into()]))?;
        pixels.iter().try_for_each(|pixel| self.put(&pixel.to_le_bytes()))?;
        self.flush()?;
        loop {
            match self.get::<1>()? {
                [b'P'] => {
                    let (x, y, clk) = (self.get32()?, self.get32()?, self.get64()?);
                    let mut next_clk = clk;
                    for x in x..hardware.width {
                        let offered_clk = around.offered_run(x, x + 1, y, next_clk);
                        self.put(&offered_clk.to_le_bytes())?;
                        next_clk = offered_clk + 1;
                    }
                    self.flush()?;
                }
                [b'R'] => {
                    let taken_clk = around.taken(self.get64()?);
                    self.put(&taken_clk.to_le_bytes())?;
                    self.flush()?;
                }
                [b'O'] => {
                    let clk = self.get64()?;
                    around.leaves(&self.record(hardware.desc_bits)?, clk);
                }
                [b'E'] => return self.given(),
                [other] => return Err(broken(format!("byte {other} begins no message"))),
            }
        }
    }

    fn record(&mut self, descriptor_bits: u32) -> Result<Record, Error> {
        let (x_q4, y_q4) = (PositionPx::from_bits(self.get16()?), PositionPx::from_bits(self.get16()?));
        let score = self.get16()?;
        let [angle, octave] = self.get()?;
        let mut descriptor = [0; DESCRIPTOR_BYTES];
        let bytes = crate::num::index(descriptor_bits / 8);
        self.from.read_exact(&mut descriptor[..bytes]).map_err(broken)?;
        Ok(Record { x_q4, y_q4, score, angle: Turns::from_bits(angle), octave, frame: false, descriptor })
    }

    fn given(&mut self) -> Result<FrameResult, Error> {
        let end_clk = self.get64()?;
        let mut next = || self.get32();
        let counts = FxCounts {
            corners: next()?,
            without_patch: next()?,
            unselected: next()?,
            dropped: next()?,
            late: next()?,
            stalled: next()?,
            ..FxCounts::default()
        };
        let (not_ready, threshold) = (next()?, next()?);
        Ok(FrameResult { counts, not_ready_clk: not_ready.into(), threshold: low_u16(threshold), end_clk })
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        // The end of its input is its end, unless it died before.
        self.to = None;
        let _ = self.child.wait();
    }
}

/// Programs by what they were built with, and those of their processes that nobody uses at the moment.
#[derive(Debug, Default)]
struct Players(Mutex<BTreeMap<String, Program>>);

#[derive(Debug, Default)]
struct Program {
    path: PathBuf,
    idle: Vec<Player>,
}

impl Players {
    /// A process of the program that is named by its parameters; `build` makes the program once.
    fn take(&self, name: &str, build: impl FnOnce() -> Result<PathBuf, Error>) -> Result<Player, Error> {
        let mut programs = self.0.lock().expect("nobody panics while it is held");
        if !programs.contains_key(name) {
            programs.insert(name.to_owned(), Program { path: build()?, idle: Vec::new() });
        }
        let program = programs.get_mut(name).expect("it was put there if it was not");
        match program.idle.pop() {
            Some(player) => Ok(player),
            None => Player::start(&program.path),
        }
    }

    /// Gives back a process that has answered in full.
    fn put(&self, name: &str, player: Player) {
        if let Some(program) = self.0.lock().expect("nobody panics while it is held").get_mut(name) {
            program.idle.push(player);
        }
    }
}

/// Verilator, with programs in a folder of the user's.
#[derive(Debug)]
pub struct Verilated {
    folder: PathBuf,
    players: Players,
}

/// Columns of the core that is built. Columns share ramp and count and nothing else, so that a wider row is converted in parts, and
/// one small program serves all sensors.
const COLUMNS: usize = 64;

/// Verilator's flags for an extractor.
pub fn extractor_parameters(config: &FxBackConfig) -> Vec<String> {
    let flag = |name: &str, value: u32| format!("-G{name}={value}");
    vec![
        flag("MAX_WIDTH", config.max_width),
        flag("PIX_BITS", config.pix_bits),
        flag("OCTAVES", config.octaves),
        flag("HARRIS", config.harris.into()),
        flag("CELL_LOG2", config.cell_log2),
        flag("PER_CELL", config.per_cell),
        flag("RING_LOG2", config.ring_log2),
        flag("ENGINES", config.engines),
        flag("FIFO_DEPTH", config.fifo_depth),
        flag("DESC_BITS", config.desc_bits),
        flag("SYMMETRIC", config.symmetric.into()),
        flag("SUBPIXEL", config.subpixel.into()),
    ]
}

/// Verilator's program, as the system finds it.
const VERILATOR: &str = "verilator";

impl Verilated {
    /// Programs are built when they are needed first, in this folder, or where there is none in the user's own among the temporary ones.
    /// Fails where there is no Verilator.
    pub fn new(folder: impl Into<Option<PathBuf>>) -> Result<Self, Error> {
        let folder = folder.into().unwrap_or_else(super::private::temporary_folder);
        verilator::version(VERILATOR).map(|_| Self { folder, players: Players::default() })
    }

    /// Registers wake up with any value, as in silicon; warnings of Verilators to come stop nobody.
    fn build(&self, top: &str, parameters: &[String], harness: &str, header: &str) -> Result<PathBuf, Error> {
        let mut flags = vec!["--x-initial", "unique", "--x-assign", "unique", "-O3", "-Wno-fatal", "-CFLAGS", "-O2"];
        flags.extend(parameters.iter().map(String::as_str));
        let sources = sources(top);
        Build { verilator: VERILATOR, top, sources, harness, header, flags: &flags }.program(&self.folder)
    }
}

impl RtlSimulator for Verilated {
    fn row(&self, asked: &RowRequest<'_>) -> Result<Vec<u16>, Error> {
        const NAME: &str = "sensor_core";
        let build = || {
            let header = format!("#define COLUMNS {COLUMNS}\n");
            self.build(NAME, &[format!("-GCOLUMNS={COLUMNS}")], ROWS_HARNESS, &header)
        };
        let mut player = self.players.take(NAME, build)?;
        let mut codes = Vec::with_capacity(asked.signal_clk.len());
        for (part, signal_clk) in asked.signal_clk.chunks(COLUMNS).enumerate() {
            let reset_clk = asked.reset_clk.chunks(COLUMNS).nth(part).unwrap_or_default();
            codes.extend(player.row(&RowRequest { reset_clk, signal_clk, ..*asked })?);
        }
        self.players.put(NAME, player);
        Ok(codes)
    }

    fn frame(&self, asked: &FrameRequest<'_>, around: &mut dyn ExtractorHost) -> Result<FrameResult, Error> {
        let parameters = extractor_parameters(&asked.hardware);
        let name = parameters.join(" ");
        let build = || {
            let header = format!("#define DESCRIPTOR_BYTES {}\n", asked.hardware.desc_bits / 8);
            self.build("extractor_core", &parameters, FRAMES_HARNESS, &header)
        };
        let mut player = self.players.take(&name, build)?;
        let given = player.frame(asked, around)?;
        self.players.put(&name, player);
        Ok(given)
    }
}
