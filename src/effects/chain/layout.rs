//! Maps pixels of the array to pixels of the picture, as indices into rows.
//!
//! Rows run at the array's own columns, from its first column to the window's last, so that patterns of the die and draws stay where
//! they are for every window.

use crate::num::{index, low_u16, u32_from};
use crate::readout::{BinningMode, Geometry};
use crate::units::{RowIndex, Size};

/// Window and binning, ready for rows.
pub(super) struct WindowLayout {
    geometry: Geometry,
    /// First array column of each output column.
    firsts: Vec<usize>,
    /// Array columns of all output columns, one after another.
    members: Vec<usize>,
}

impl WindowLayout {
    pub fn new(geometry: Geometry) -> Self {
        let mut layout = Self { geometry, firsts: Vec::new(), members: Vec::new() };
        for column in 0..geometry.output_size().width_px {
            let mut members = geometry.columns_of(column).map(index).peekable();
            layout.firsts.push(*members.peek().expect("an output column is made of at least one"));
            layout.members.extend(members);
        }
        layout
    }

    /// The picture.
    pub fn output_size(&self) -> Size {
        self.geometry.output_size()
    }

    /// Columns that a row's buffers must hold.
    pub fn buffer_width(&self) -> usize {
        self.first_column() + index(self.geometry.window().width_px)
    }

    /// Array column at which the window begins.
    pub fn first_column(&self) -> usize {
        index(self.geometry.window().x_px)
    }

    /// Array row at which the window begins.
    pub fn first_row(&self) -> usize {
        index(self.geometry.window().y_px)
    }

    /// Array rows whose charges meet before they are converted into an output row.
    pub fn charge_rows(&self, row: usize) -> Vec<usize> {
        let all = self.rows(row);
        match self.mode() {
            Some(BinningMode::Charge) => all,
            Some(BinningMode::Average | BinningMode::Skip) | None => all[..1].to_vec(),
        }
    }

    /// All array rows of an output row.
    pub fn rows(&self, row: usize) -> Vec<usize> {
        self.geometry.rows_of(RowIndex(u32_from(row))).map(|row| index(row.0)).collect()
    }

    /// How pixels become one; none where each stays itself.
    pub fn mode(&self) -> Option<BinningMode> {
        (self.geometry.binning() > 1).then(|| self.geometry.mode())
    }

    /// Array rows whose charges become one row's.
    pub fn charge_rows_of_one(&self) -> u32 {
        if self.mode() == Some(BinningMode::Charge) { self.geometry.binning() } else { 1 }
    }

    /// Pixels that become one.
    pub fn pixels_of_one(&self) -> u32 {
        self.geometry.binning() * self.geometry.binning()
    }

    /// Adds up the charge of each output column in its first column.
    pub fn add_charges(&self, charge_e: &[f32], sums_e: &mut [f32]) {
        let count = self.members.len() / self.firsts.len();
        for (first, members) in self.firsts.iter().zip(self.members.chunks_exact(count)) {
            for &member in members {
                sums_e[*first] += charge_e[member];
            }
        }
    }

    /// Adds up the codes of each output column.
    pub fn add_codes(&self, codes: &[u16], sums_dn: &mut [u32]) {
        let count = self.members.len() / self.firsts.len();
        for (sum_dn, members) in sums_dn.iter_mut().zip(self.members.chunks_exact(count)) {
            for &member in members {
                *sum_dn += u32::from(codes[member]);
            }
        }
    }

    /// Array columns that are converted.
    pub fn read_columns(&self) -> Vec<usize> {
        match self.mode() {
            Some(BinningMode::Average) => (self.first_column()..self.buffer_width()).collect(),
            Some(BinningMode::Charge | BinningMode::Skip) | None => self.firsts.clone(),
        }
    }

    /// Takes the code of each output column's first column.
    pub fn pick(&self, codes: &[u16], picked: &mut [u16]) {
        for (picked, &first) in picked.iter_mut().zip(&self.firsts) {
            *picked = codes[first];
        }
    }
}

/// Means of sums over a given number of codes, halves up.
pub(super) fn means(sums_dn: &[u32], count: u32, codes: &mut [u16]) {
    for (code, &sum_dn) in codes.iter_mut().zip(sums_dn) {
        *code = low_u16((sum_dn + count / 2) / count);
    }
}
