//! Spreads the choice of corners over the picture. Enters: corners by rows. Leaves: the chosen ones, by rows.

use crate::compute::Corner;
use crate::num::index;
use crate::units::Size;

/// At most `most` corners: first the best of every cell, then every second best, and so on.
///
/// Within a cell, and among the last places, the higher score wins, then the upper row, then the left column. Corners
/// arrive by rows, so the order of arrival is the tie rule and a cell is a short insertion list in hardware.
pub(crate) fn spread(corners: &[Corner], cell_px: u32, size: Size, most: usize) -> Vec<Corner> {
    if corners.len() <= most {
        return corners.to_vec();
    }
    let columns = size.width_px.div_ceil(cell_px);
    let cell = |corner: &Corner| index(corner.y_px / cell_px) * index(columns) + index(corner.x_px / cell_px);
    let mut by_cell: Vec<usize> = (0..corners.len()).collect();
    by_cell.sort_unstable_by_key(|&i| (cell(&corners[i]), u8::MAX - corners[i].score, i));
    let mut ranked = Vec::with_capacity(corners.len());
    let mut rank = 0;
    for (place, &i) in by_cell.iter().enumerate() {
        let same_cell = place > 0 && cell(&corners[by_cell[place - 1]]) == cell(&corners[i]);
        rank = if same_cell { rank + 1 } else { 0 };
        ranked.push((rank, u8::MAX - corners[i].score, i));
    }
    ranked.select_nth_unstable(most);
    ranked.truncate(most);
    let mut chosen: Vec<usize> = ranked.into_iter().map(|(_, _, i)| i).collect();
    chosen.sort_unstable();
    chosen.into_iter().map(|i| corners[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width_px: 64, height_px: 64 };

    fn corner(x_px: u32, y_px: u32, score: u8) -> Corner {
        Corner { x_px, y_px, score }
    }

    #[test]
    fn a_weak_corner_of_an_empty_cell_goes_before_a_second_strong_one() {
        let corners = [corner(1, 1, 90), corner(5, 1, 80), corner(40, 1, 10)];
        assert_eq!(spread(&corners, 32, SIZE, 2), [corners[0], corners[2]]);
    }

    #[test]
    fn ties_go_to_the_upper_row_then_the_left_column_and_output_is_by_rows() {
        let corners = [corner(5, 1, 50), corner(9, 1, 50), corner(1, 2, 50), corner(3, 3, 60)];
        assert_eq!(spread(&corners, 32, SIZE, 2), [corners[0], corners[3]]);
        assert_eq!(spread(&corners, 32, SIZE, 3), [corners[0], corners[1], corners[3]]);
        assert_eq!(spread(&corners, 32, SIZE, 4), corners);
        assert_eq!(spread(&corners, 32, SIZE, 9), corners);
    }
}
