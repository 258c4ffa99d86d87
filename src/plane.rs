//! A picture of one value per pixel, row by row.

use crate::num::{index, u32_from};
use crate::units::{RowIndex, Size};

/// Values of a pixel array, row-major, the top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane<T> {
    size: Size,
    values: Vec<T>,
}

impl<T: Copy> Plane<T> {
    /// A plane of one value everywhere.
    pub fn filled(size: Size, value: T) -> Self {
        Self { size, values: vec![value; size.pixel_count()] }
    }

    /// Takes row-major values. Panics if their number is not width times height.
    pub fn from_values(size: Size, values: Vec<T>) -> Self {
        assert!(values.len() == size.pixel_count(), "a plane needs width times height values");
        Self { size, values }
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Columns.
    pub fn width_px(&self) -> usize {
        index(self.size.width_px)
    }

    /// Rows.
    pub fn height_px(&self) -> usize {
        index(self.size.height_px)
    }

    /// All values, row-major.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, row-major.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// One row, left to right. Panics outside the plane.
    pub fn row(&self, row: usize) -> &[T] {
        let width = self.width_px();
        &self.values[row * width..(row + 1) * width]
    }

    /// One row, left to right. Panics outside the plane.
    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        let width = self.width_px();
        &mut self.values[row * width..(row + 1) * width]
    }

    /// The value at column x, row y. Panics outside the plane.
    pub fn at(&self, x_px: usize, y_px: usize) -> T {
        assert!(x_px < self.width_px(), "column outside the plane");
        self.values[y_px * self.width_px() + x_px]
    }

    /// Rows with their index, top to bottom.
    pub fn rows(&self) -> impl Iterator<Item = (RowIndex, &[T])> {
        let rows = self.values.chunks_exact(self.width_px());
        rows.enumerate().map(|(row, values)| (RowIndex(u32_from(row)), values))
    }

    /// The same shape with every value mapped.
    pub fn map<U: Copy>(&self, map: impl Fn(T) -> U) -> Plane<U> {
        Plane { size: self.size, values: self.values.iter().map(|&value| map(value)).collect() }
    }
}
