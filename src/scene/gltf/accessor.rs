//! Reads numbers from a glTF file's buffers, through dense or sparse accessors, into checked lists.

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

use super::buffers::Buffers;
use super::node::TRIANGLES_MAX;
use crate::num::index;

/// Greatest number of elements of one accessor without bytes in the file: as many vertices as a scene may have.
const ELEMENTS_MAX: usize = 3 * TRIANGLES_MAX;

/// A number, brought to the range of -1 to 1 or 0 to 1 where the accessor says that it is a share.
fn number(word: &[u8], kind: DataType, is_share: bool) -> f32 {
    let (value, one) = match (kind, word) {
        (DataType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (DataType::U8, &[a]) => (f32::from(a), 255.0),
        (DataType::I8, &[a]) => (f32::from(i8::from_le_bytes([a])), 127.0),
        (DataType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65_535.0),
        (DataType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32_767.0),
        _ => (0.0, 1.0),
    };
    if is_share { (value / one).max(-1.0) } else { value }
}

impl Buffers<'_> {
    /// `count` elements of `bytes` bytes from an offset in a view, each `stride` bytes after the one before.
    fn spaced(
        &self,
        what: &str,
        view: &gltf::buffer::View<'_>,
        offset: usize,
        count: usize,
        bytes: usize,
    ) -> Result<impl Iterator<Item = &[u8]> + use<'_>, String> {
        let (data, stride) = (self.view(view)?, view.stride().unwrap_or(bytes));
        let last = count.saturating_sub(1).checked_mul(stride).and_then(|last| last.checked_add(offset));
        let end = last.and_then(|last| last.checked_add(bytes)).filter(|&end| end <= data.len() && stride >= bytes);
        if end.is_none() && count > 0 {
            let needed = format!("{count} elements of {bytes} bytes every {stride}");
            return Err(format!("{what} needs {needed}, its view has {} bytes", data.len()));
        }
        let start = move |number: usize| offset + number * stride;
        Ok((0..count).map(move |number| &data[start(number)..start(number) + bytes]))
    }

    /// Each element as `read` takes it from its `bytes` bytes, sparse replacements done.
    fn elements<T: Copy>(
        &self,
        accessor: &Accessor<'_>,
        bytes: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, String> {
        const ZEROS: &[u8] = &[0; 64];
        let what = format!("accessor {}", accessor.index());
        let count = accessor.count();
        let mut elements = match accessor.view() {
            Some(view) => self.spaced(&what, &view, accessor.offset(), count, bytes)?.map(&read).collect(),
            None if count > ELEMENTS_MAX => {
                return Err(format!("{what} needs {count} elements; use {ELEMENTS_MAX} or fewer"));
            }
            None => vec![read(&ZEROS[..bytes]); count],
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let width = indices.index_type().size();
            let what = format!("{what}'s sparse part");
            let indices = self.spaced(&what, &indices.view(), indices.offset(), sparse.count(), width)?;
            let values = self.spaced(&what, &values.view(), values.offset(), sparse.count(), bytes)?;
            for (element, value) in indices.map(little_endian).zip(values) {
                *elements
                    .get_mut(index(element))
                    .ok_or_else(|| format!("{what} names element {element} of {count}"))? = read(value);
            }
        }
        Ok(elements)
    }

    /// Vectors of N numbers: `f32`, or integers of 8 or 16 bits (texture coordinates, colours, KHR_mesh_quantization).
    pub fn floats<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        let dimensions = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3, Dimensions::Vec4];
        let kind = accessor.data_type();
        if dimensions[N - 1] != accessor.dimensions() || kind == DataType::U32 {
            let (found, wanted) = (format!("{:?} of {kind:?}", accessor.dimensions()), dimensions[N - 1]);
            return Err(format!("accessor {} holds {found}; use {wanted:?} of F32", accessor.index()));
        }
        let bytes = kind.size();
        let is_share = accessor.normalized();
        let vector = |e: &[u8]| std::array::from_fn(|at| number(&e[at * bytes..(at + 1) * bytes], kind, is_share));
        self.elements(accessor, N * bytes, vector)
    }

    /// Indices of 8, 16 or 32 bits.
    pub fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, String> {
        let kind = accessor.data_type();
        let is_unsigned = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
        if !is_unsigned || accessor.dimensions() != Dimensions::Scalar {
            let found = format!("indices as {:?} of {kind:?}", accessor.dimensions());
            return Err(format!("accessor {} holds {found}; use unsigned scalars", accessor.index()));
        }
        self.elements(accessor, kind.size(), little_endian)
    }
}

/// An unsigned number of up to 32 bits.
fn little_endian(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0_u32, |number, &byte| number << 8 | u32::from(byte))
}
