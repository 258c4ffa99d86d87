//! The bytes of a waveform file, FST or VCD, of signals and their changes. One tick is a picosecond. No date stands in them: the same
//! waves give the same bytes.

use std::io::Write;

use fst_writer::{
    FstBodyWriter, FstFileType, FstHeaderWriter, FstInfo, FstScopeType, FstSignalId, FstSignalType, FstVarDirection,
    FstVarType,
};
use vcd::{IdCode, TimescaleUnit, VarType};

use super::{Signal, SignalKind, Value, Waves};

/// Who wrote the file.
const VERSION: &str = concat!("sensel ", env!("CARGO_PKG_VERSION"));

/// The scope around all others.
const TOP: &str = "sensor";

/// 10^-12 s.
const PICOSECONDS: i8 = -12;

/// The waves as VCD.
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

/// The waves as FST. Fails on a name that is too long for the format.
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
    let bit = |position: u32| match value {
        Value::Bits(word) if word >> position & 1 == 1 => b'1',
        Value::Bits(_) => b'0',
        Value::Unknown | Value::Real(_) => b'x',
    };
    (0..width).rev().map(bit).collect()
}
