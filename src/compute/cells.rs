//! Selection of corners, cell by cell. Keeps the best corners of each cell of an octave, in the order of the cell's list.

use super::fast::Corner;
use super::params::PATCH_MARGIN_PX;
use crate::num::{index, u32_from};
use crate::units::Size;

/// A corner that may become a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerCandidate {
    /// Where it is in its octave, and its score.
    pub corner: Corner,
    /// The criterion of the selection.
    pub rank: u16,
    pub octave: u8,
}

/// Lists of all cells of one octave.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellLists {
    /// Cells of a row of cells.
    pub columns: usize,
    /// The first entry of each cell, by rows of cells, and the end of the last one.
    first: Vec<u32>,
    entries: Vec<CornerCandidate>,
    /// Corners that found no entry in the list of their cell, or lost it.
    pub unselected: u64,
}

/// Whether a corner's whole patch lies in the picture.
pub(crate) fn has_patch(size: Size, corner: &Corner) -> bool {
    let inside =
        |position_px: u32, side_px: u32| position_px >= PATCH_MARGIN_PX && position_px + PATCH_MARGIN_PX < side_px;
    inside(corner.x_px, size.width_px) && inside(corner.y_px, size.height_px)
}

impl CellLists {
    /// Keeps up to `per_cell` candidates of each cell: the highest ranks, of equal ones the first that arrived. All have patches.
    pub fn of(candidates: &[CornerCandidate], size: Size, cell_px: u32, per_cell: usize) -> Self {
        let columns = index(size.width_px.div_ceil(cell_px));
        let mut lists = Self { columns, first: vec![0], ..Self::default() };
        let mut cells: Vec<Vec<CornerCandidate>> = vec![Vec::with_capacity(per_cell + 1); columns];
        let mut rest = candidates;
        for cell_row in 0..size.height_px.div_ceil(cell_px) {
            let end = rest.partition_point(|candidate| candidate.corner.y_px < (cell_row + 1) * cell_px);
            let (row, later) = rest.split_at(end);
            rest = later;
            for candidate in row {
                let cell = &mut cells[index(candidate.corner.x_px / cell_px)];
                let at = cell.iter().position(|other| other.rank < candidate.rank).unwrap_or(cell.len());
                cell.insert(at, *candidate);
                if cell.len() > per_cell {
                    cell.pop();
                    lists.unselected += 1;
                }
            }
            for cell in &mut cells {
                lists.entries.append(cell);
                lists.first.push(u32_from(lists.entries.len()));
            }
        }
        lists
    }

    #[inline]
    pub fn list(&self, cell_row: usize, column: usize) -> &[CornerCandidate] {
        let cell = cell_row * self.columns + column;
        &self.entries[index(self.first[cell])..index(self.first[cell + 1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width_px: 64, height_px: 70 };

    fn candidate(x_px: u32, y_px: u32, rank: u16) -> CornerCandidate {
        CornerCandidate { corner: Corner { x_px, y_px, score: rank }, rank, octave: 0 }
    }

    #[test]
    fn a_cell_keeps_its_highest_ranks_and_of_equal_ones_the_first() {
        let all = [
            candidate(20, 17, 5),
            candidate(40, 17, 9),
            candidate(30, 18, 7),
            candidate(22, 19, 7),
            candidate(31, 20, 8),
            candidate(40, 30, 9),
            candidate(33, 68, 1),
        ];
        let lists = CellLists::of(&all, SIZE, 32, 2);
        assert_eq!(lists.columns, 2);
        assert_eq!(lists.list(0, 0), [all[4], all[2]]);
        assert_eq!(lists.list(0, 1), [all[1], all[5]]);
        assert_eq!((lists.list(1, 0), lists.list(1, 1)), (&[][..], &[][..]));
        assert_eq!(lists.list(2, 1), [all[6]]);
        assert_eq!(lists.unselected, 2);
    }

    #[test]
    fn patches_reach_sixteen_pixels() {
        let whole = |x_px, y_px| has_patch(SIZE, &Corner { x_px, y_px, score: 1 });
        assert!(whole(16, 16) && whole(47, 53));
        assert!(!whole(15, 16) && !whole(16, 15) && !whole(48, 53) && !whole(47, 54));
    }
}
