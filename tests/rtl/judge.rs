//! Runs one Verilog block in its own process and compares its pins with its twin's, batch by batch. Panics with the first clock and pin
//! that differ.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use sensel::files::verilator::{self, Build};

/// A port's value in one clock.
pub enum Pin<'a> {
    /// Name, bits, value; bits above the width are 0.
    Narrow(&'static str, u32, u64),
    /// Name, bits, bytes from the least significant on.
    Wide(&'static str, u32, &'a [u8]),
}

/// A pin of one bit.
pub fn bit(name: &'static str, value: bool) -> Pin<'static> {
    Pin::Narrow(name, 1, value.into())
}

/// A pin of several bits.
pub fn bus(name: &'static str, bits: u32, value: impl Into<u64>) -> Pin<'static> {
    Pin::Narrow(name, bits, value.into())
}

impl Pin<'_> {
    fn name(&self) -> &'static str {
        match self {
            Pin::Narrow(name, ..) | Pin::Wide(name, ..) => name,
        }
    }

    /// Width of the port.
    pub fn bits(&self) -> u32 {
        match self {
            Pin::Narrow(_, bits, _) | Pin::Wide(_, bits, _) => *bits,
        }
    }

    fn bytes(&self) -> usize {
        usize::try_from(self.bits().div_ceil(8)).unwrap()
    }

    /// Puts the value behind a record.
    pub fn write(&self, record: &mut Vec<u8>) {
        match self {
            Pin::Narrow(name, bits, value) => {
                assert!(value >> bits == 0, "{name} has {bits} bits, not {value}");
                record.extend(&value.to_le_bytes()[..self.bytes()]);
            }
            Pin::Wide(_, _, bytes) => record.extend(&bytes[..self.bytes()]),
        }
    }
}

/// The block's process and what waits to be played to it.
pub struct Judge {
    block: &'static str,
    child: Child,
    inputs: Vec<(&'static str, usize)>,
    outputs: Vec<(&'static str, usize)>,
    stimulus: Vec<u8>,
    expected: Vec<u8>,
    waiting: u32,
    clocks: u64,
}

/// The Verilog files that a block needs, its own first.
pub fn sources(block: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("rtl_models/verilog");
    verilator::sources(block).iter().map(|(name, _)| folder.join(name)).collect()
}

fn list(macro_name: &str, pins: &[(&'static str, usize)]) -> String {
    let pins: String = pins.iter().map(|(name, bytes)| format!(" PIN({name}, {bytes})")).collect();
    format!("#define {macro_name}{pins}\n")
}

impl Judge {
    /// Builds and starts a block with the ports of these pins. `parameters` are Verilator flags such as "-GCOLUMNS=16".
    pub fn new(block: &'static str, parameters: &[&str], inputs: &[Pin<'_>], outputs: &[Pin<'_>]) -> Self {
        let ports = |pins: &[Pin<'_>]| pins.iter().map(|pin| (pin.name(), pin.bytes())).collect::<Vec<_>>();
        let (inputs, outputs) = (ports(inputs), ports(outputs));
        let header = list("INPUTS", &inputs) + &list("OUTPUTS", &outputs);
        // Warnings are errors.
        let mut flags = vec!["-Wall", "--x-initial", "unique", "--x-assign", "unique", "-O3", "-CFLAGS", "-O1"];
        flags.extend(parameters);
        let build = Build {
            verilator: "verilator",
            top: block,
            sources: verilator::sources(block),
            harness: include_str!("harness.cpp"),
            header: &header,
            flags: &flags,
        };
        let program = build.program(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("../rtl"));
        let mut command = Command::new(program.expect("Verilator takes it; without one: ./check --install"));
        let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program was built");
        Self { block, child, inputs, outputs, stimulus: Vec::new(), expected: Vec::new(), waiting: 0, clocks: 0 }
    }

    /// One clock: pins in, and what the twin says comes out.
    pub fn clock(&mut self, inputs: &[Pin<'_>], outputs: &[Pin<'_>]) {
        inputs.iter().for_each(|pin| pin.write(&mut self.stimulus));
        outputs.iter().for_each(|pin| pin.write(&mut self.expected));
        self.waiting += 1;
        if self.waiting == 1 << 15 {
            self.compare();
        }
    }

    /// Plays what waits and compares every byte.
    fn compare(&mut self) {
        let stdin = self.child.stdin.as_mut().expect("piped");
        stdin.write_all(&self.waiting.to_le_bytes()).unwrap();
        stdin.write_all(&self.stimulus).unwrap();
        stdin.flush().unwrap();
        let mut found = vec![0; self.expected.len()];
        self.child.stdout.as_mut().expect("piped").read_exact(&mut found).unwrap();
        if found != self.expected {
            self.explain(&found);
        }
        self.clocks += u64::from(self.waiting);
        self.waiting = 0;
        self.stimulus.clear();
        self.expected.clear();
    }

    fn explain(&self, found: &[u8]) -> ! {
        let at = found.iter().zip(&self.expected).position(|(a, b)| a != b).expect("they differ");
        let record: usize = self.outputs.iter().map(|(_, bytes)| bytes).sum();
        let (clock, mut offset) = (at / record, at % record);
        let mut pin = "";
        for (name, bytes) in &self.outputs {
            if offset < *bytes {
                pin = name;
                break;
            }
            offset -= bytes;
        }
        let entry: usize = self.inputs.iter().map(|(_, bytes)| bytes).sum();
        let stimulus = &self.stimulus[clock * entry..(clock + 1) * entry];
        let line = clock * record..(clock + 1) * record;
        panic!(
            "{}: pin {pin} differs in clock {}\nin {stimulus:02x?} ({:?})\nVerilog {:02x?}\ntwin    {:02x?}",
            self.block,
            self.clocks + u64::try_from(clock).unwrap(),
            self.inputs,
            &found[line.clone()],
            &self.expected[line]
        )
    }

    /// Compares the rest, stops the block and says what was done; fewer than a million clocks are a failure.
    pub fn finish(self, seed: u64) {
        self.finish_after(seed, 1_000_000);
    }

    /// The same with another least number of clocks.
    pub fn finish_after(mut self, seed: u64, clocks_min: u64) {
        self.compare();
        drop(self.child.stdin.take());
        assert!(self.child.wait().unwrap().success());
        println!("{}: seed {seed}, {} clocks equal on every pin", self.block, self.clocks);
        assert!(self.clocks > clocks_min, "{}: only {} clocks", self.block, self.clocks);
    }
}
