//! Numbers in a glTF file's binary chunk. Enters: accessors. Leaves: checked lists.

use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, buffer::View};

use crate::num::index;

/// The binary chunk.
pub struct Buffer<'a> {
    /// Its bytes.
    pub binary: &'a [u8],
}

impl<'a> Buffer<'a> {
    /// Bytes of a view.
    pub fn view(&self, view: &View<'_>) -> Result<&'a [u8], String> {
        if view.buffer().index() != 0 || !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
            return Err(format!(
                "buffer view {} lies outside the file; a .glb with everything embedded would do",
                view.index()
            ));
        }
        let end = view.offset().checked_add(view.length()).filter(|&end| end <= self.binary.len());
        let end = end.ok_or_else(|| {
            let (from, length) = (view.offset(), view.length());
            format!("buffer view {} takes {length} bytes from {from}, of {}", view.index(), self.binary.len())
        })?;
        Ok(&self.binary[view.offset()..end])
    }

    /// One slice of `bytes` bytes for each element.
    fn elements(&self, accessor: &Accessor<'_>, bytes: usize) -> Result<Vec<&'a [u8]>, String> {
        if accessor.sparse().is_some() {
            return Err(format!("accessor {} is sparse; a dense one would do", accessor.index()));
        }
        let view = accessor.view().ok_or_else(|| format!("accessor {} has no data", accessor.index()))?;
        let (data, stride) = (self.view(&view)?, view.stride().unwrap_or(bytes));
        let short = || {
            let (count, have) = (accessor.count(), data.len());
            format!(
                "accessor {} needs {count} elements of {bytes} bytes every {stride}, its view has {have} bytes",
                accessor.index()
            )
        };
        if accessor.count() == 0 {
            return Ok(Vec::new());
        }
        let last = (accessor.count() - 1).checked_mul(stride).and_then(|last| last.checked_add(accessor.offset()));
        let end = last.and_then(|last| last.checked_add(bytes)).filter(|&end| end <= data.len() && stride >= bytes);
        end.ok_or_else(short)?;
        let start = |number: usize| accessor.offset() + number * stride;
        Ok((0..accessor.count()).map(|number| &data[start(number)..start(number) + bytes]).collect())
    }

    /// Vectors of N numbers: `f32`, or normalised unsigned 8 or 16 bits, as glTF allows for texture coordinates.
    pub fn floats<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        let dimensions = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3, Dimensions::Vec4];
        let kind = accessor.data_type();
        let bytes = match kind {
            DataType::F32 => 4,
            DataType::U16 => 2,
            DataType::U8 => 1,
            DataType::I8 | DataType::I16 | DataType::U32 => 0,
        };
        if dimensions[N - 1] != accessor.dimensions() || bytes == 0 {
            let found = format!("{:?} of {kind:?}", accessor.dimensions());
            return Err(format!(
                "accessor {} holds {found}; {:?} of F32 would do",
                accessor.index(),
                dimensions[N - 1]
            ));
        }
        let number = |word: &[u8]| match *word {
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            [a, b] => f32::from(u16::from_le_bytes([a, b])) / 65_535.0,
            [a] => f32::from(a) / 255.0,
            _ => 0.0,
        };
        let elements = self.elements(accessor, N * bytes)?;
        Ok(elements.into_iter().map(|e| std::array::from_fn(|at| number(&e[at * bytes..(at + 1) * bytes]))).collect())
    }

    /// Indices of 8, 16 or 32 bits.
    pub fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, String> {
        let bytes = match accessor.data_type() {
            DataType::U8 => 1,
            DataType::U16 => 2,
            DataType::U32 => 4,
            kind @ (DataType::I8 | DataType::I16 | DataType::F32) => {
                return Err(format!(
                    "accessor {} holds indices as {kind:?}; unsigned integers would do",
                    accessor.index()
                ));
            }
        };
        let elements = self.elements(accessor, bytes)?;
        let number = |element: &[u8]| element.iter().rev().fold(0_u32, |number, &byte| number << 8 | u32::from(byte));
        assert!(index(u32::MAX) >= elements.len(), "a file's indices fit its memory");
        Ok(elements.into_iter().map(number).collect())
    }
}
