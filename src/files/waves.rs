//! Writes signals and their changes as an FST or VCD file, by its extension, for GTKWave and Surfer.
//!
//! Both hold the same: one tick is a picosecond, and only changes are written. No date stands in them: the same waves give the same bytes.

use std::io::Write;
use std::path::{Path, PathBuf};

use fst_writer::{
    FstBodyWriter, FstFileType, FstHeaderWriter, FstInfo, FstScopeType, FstSignalId, FstSignalType, FstVarDirection,
    FstVarType,
};
use vcd::{IdCode, TimescaleUnit, VarType};

use super::folder::{check_file, replace_file};
use crate::error::Error;
use crate::waves::{Signal, SignalKind, Value, Waves};

/// Who wrote the file.
const VERSION: &str = concat!("sensel ", env!("CARGO_PKG_VERSION"));

/// The scope around all others.
const TOP: &str = "sensor";

/// 10^-12 s.
const PICOSECONDS: i8 = -12;

/// Kinds of waveform file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaveFormat {
    /// GTKWave's compressed format.
    Fst,
    /// IEEE 1364's text format.
    Vcd,
}

/// A waveform file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WaveFile {
    path: PathBuf,
    format: WaveFormat,
}

impl WaveFile {
    /// A file of the format that its extension says.
    ///
    /// # Errors
    /// Another extension, or a folder of this name.
    pub fn new(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("fst") => WaveFormat::Fst,
            Some("vcd") => WaveFormat::Vcd,
            _ => {
                return Err(Error::key(
                    "--waves",
                    path.display(),
                    "is no waveform file; use a name ending in .fst or .vcd",
                ));
            }
        };
        if path.is_dir() {
            return Err(Error::key("--waves", path.display(), "is a folder; name a file"));
        }
        Ok(Self { path: path.to_owned(), format })
    }

    /// Where it goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it could be written, before long work is done for it.
    ///
    /// # Errors
    /// The disk says no.
    pub fn check(&self) -> Result<(), Error> {
        check_file(&self.path)
    }

    /// Writes the file beside its place and renames it.
    ///
    /// # Errors
    /// The disk says no; then what stood there still stands.
    pub fn write(&self, waves: &Waves) -> Result<(), Error> {
        let bytes = match self.format {
            WaveFormat::Fst => fst_bytes(waves),
            WaveFormat::Vcd => vcd_bytes(waves),
        };
        replace_file(&self.path, &bytes.map_err(super::io_error(&self.path))?)
    }
}

/// The waves as VCD.
///
/// # Errors
/// None in practice: memory takes what it is given.
pub fn vcd_bytes(waves: &Waves) -> std::io::Result<Vec<u8>> {
    let mut writer = vcd::Writer::new(Vec::new());
    writer.version(VERSION)?;
    writer.timescale(1, TimescaleUnit::PS)?;
    writer.add_module(TOP)?;
    let mut ids = Vec::with_capacity(waves.signals.len());
    for scope in scopes(&waves.signals) {
        writer.add_module(&scope[0].scope)?;
        for signal in scope {
            let (kind, bits) = match signal.kind {
                SignalKind::Bits(bits) => (VarType::Wire, bits),
                SignalKind::Signed(bits) => (VarType::Integer, bits),
                SignalKind::Real => (VarType::Real, 64),
            };
            ids.push(writer.add_var(kind, bits, &signal.name, None)?);
        }
        writer.upscope()?;
    }
    writer.upscope()?;
    writer.enddefinitions()?;
    let mut time_ps = None;
    for change in &waves.changes {
        if time_ps != Some(change.time_ps) {
            time_ps = Some(change.time_ps);
            writer.timestamp(change.time_ps)?;
        }
        write_vcd_value(&mut writer, ids[change.signal.0], waves.signals[change.signal.0].kind, change.value)?;
    }
    writer.timestamp(waves.end_ps)?;
    Ok(std::mem::take(writer.writer()))
}

fn write_vcd_value<W: Write>(
    writer: &mut vcd::Writer<W>,
    id: IdCode,
    kind: SignalKind,
    value: Value,
) -> std::io::Result<()> {
    if let Value::Real(value) = value {
        return writer.change_real(id, value);
    }
    let bits = bit_text(kind, value);
    let mut bits = bits.iter().map(|&bit| match bit {
        b'0' => vcd::Value::V0,
        b'1' => vcd::Value::V1,
        _ => vcd::Value::X,
    });
    match (bits.len(), bits.next()) {
        (1, Some(bit)) => writer.change_scalar(id, bit),
        (_, first) => writer.change_vector(id, first.into_iter().chain(bits)),
    }
}

/// The waves as FST.
///
/// # Errors
/// A name that is too long for the format.
pub fn fst_bytes(waves: &Waves) -> std::io::Result<Vec<u8>> {
    let info = FstInfo {
        start_time: 0,
        timescale_exponent: PICOSECONDS,
        version: VERSION.to_owned(),
        date: String::new(),
        file_type: FstFileType::Verilog,
    };
    fst(waves, &info).map_err(std::io::Error::other)
}

fn fst(waves: &Waves, info: &FstInfo) -> fst_writer::Result<Vec<u8>> {
    let mut header = FstHeaderWriter::write_to_mem(info)?;
    header.scope(TOP, "", FstScopeType::Module)?;
    let mut ids = Vec::with_capacity(waves.signals.len());
    for scope in scopes(&waves.signals) {
        header.scope(&scope[0].scope, "", FstScopeType::Module)?;
        for signal in scope {
            let (shape, kind) = match signal.kind {
                SignalKind::Bits(bits) => (FstSignalType::bit_vec(bits), FstVarType::Wire),
                SignalKind::Signed(bits) => (FstSignalType::bit_vec(bits), FstVarType::Integer),
                SignalKind::Real => (FstSignalType::real(), FstVarType::Real),
            };
            ids.push(header.var(&signal.name, shape, kind, FstVarDirection::Implicit, None)?);
        }
        header.up_scope()?;
    }
    header.up_scope()?;
    let mut body = header.finish()?;
    for change in &waves.changes {
        body.time_change(change.time_ps)?;
        write_fst_value(&mut body, ids[change.signal.0], waves.signals[change.signal.0].kind, change.value)?;
    }
    body.time_change(waves.end_ps)?;
    Ok(body.finish()?.into_inner())
}

fn write_fst_value(
    body: &mut FstBodyWriter<std::io::Cursor<Vec<u8>>>,
    id: FstSignalId,
    kind: SignalKind,
    value: Value,
) -> fst_writer::Result<()> {
    match value {
        Value::Real(value) => body.signal_change(id, &value.to_le_bytes()),
        Value::Bits(_) | Value::Unknown => body.signal_change(id, &bit_text(kind, value)),
    }
}

/// Signals by scope; those of one scope stand together.
fn scopes(signals: &[Signal]) -> impl Iterator<Item = &[Signal]> {
    signals.chunk_by(|before, after| before.scope == after.scope)
}

/// A value's bits as characters, the greatest first.
fn bit_text(kind: SignalKind, value: Value) -> Vec<u8> {
    let (SignalKind::Bits(width) | SignalKind::Signed(width)) = kind else { unreachable!("a real number has no bits") };
    let bit = |place: u32| match value {
        Value::Bits(word) if word >> place & 1 == 1 => b'1',
        Value::Bits(_) => b'0',
        Value::Unknown | Value::Real(_) => b'x',
    };
    (0..width).rev().map(bit).collect()
}
