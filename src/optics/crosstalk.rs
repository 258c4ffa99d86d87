//! Optical and electrical crosstalk. Moves a share of each pixel's photons to its four neighbours, in equal parts.
//!
//! Both kinds act behind the filter: optical crosstalk is light that passed a pixel's filter and leaves its stack aslant;
//! electrical crosstalk is charge, freed below the depletion, that diffuses before it is collected, more of it where light is
//! absorbed deeper (near infrared). Each electron goes its own way, so the neighbours' counts stay independent and Poisson: to
//! share out mean photons before the shot noise is exact. Beyond the array's edge lie pixels like those one row or column further
//! in, of the same filter for patterns of two.

use crate::num::f32_nearest;
use crate::parallel::over_chunks;
use crate::plane::Plane;

/// A plane after `share` of each pixel's photons moved to its four neighbours. 0 changes nothing.
pub fn shared_out(plane: &Plane<f32>, share: f64) -> Plane<f32> {
    if share == 0.0 {
        return plane.clone();
    }
    let mut shared = Plane::filled(plane.size(), 0.0_f32);
    let (width, height) = (plane.width_px(), plane.height_px());
    over_chunks(shared.values_mut(), width, |y, values| {
        let (above, row, below) = (plane.row(before(y, height)), plane.row(y), plane.row(after(y, height)));
        for (x, value) in values.iter_mut().enumerate() {
            let around = [row[before(x, width)], row[after(x, width)], above[x], below[x]].map(f64::from);
            let received = 0.25 * share * (around[0] + around[1] + around[2] + around[3]);
            *value = f32_nearest((1.0 - share) * f64::from(row[x]) + received);
        }
    });
    shared
}

/// Index of the left (upper) neighbour, mirrored at the edge. A line of one value is its own neighbour.
fn before(index: usize, length: usize) -> usize {
    if index > 0 { index - 1 } else { 1.min(length - 1) }
}

/// Index of the right (lower) neighbour, mirrored at the edge.
fn after(index: usize, length: usize) -> usize {
    if index + 1 < length { index + 1 } else { length.max(2) - 2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    #[test]
    fn a_share_moves_to_the_four_neighbours_and_nothing_is_lost() {
        let mut plane = Plane::filled(Size { width_px: 7, height_px: 6 }, 0.0_f32);
        plane.row_mut(3)[2] = 1000.0;
        let shared = shared_out(&plane, 0.1);
        assert_eq!(shared.at(2, 3), 900.0);
        for (x, y) in [(1, 3), (3, 3), (2, 2), (2, 4)] {
            assert_eq!(shared.at(x, y), 25.0);
        }
        assert_eq!(shared.values().iter().sum::<f32>(), 1000.0);
        assert_eq!(shared_out(&plane, 0.0), plane);
    }

    #[test]
    fn edges_see_neighbours_of_their_own_colour() {
        // A pattern of two rows and columns under even light: every pixel of a filter sees the same, at the edges as well.
        let size = Size { width_px: 8, height_px: 6 };
        let filters = [[100.0, 50.0], [50.0, 20.0]];
        let values = (0..48).map(|n| filters[(n / 8) % 2][n % 2]).collect();
        let shared = shared_out(&Plane::from_values(size, values), 0.2);
        let mut tried = 0;
        for y in 0..6 {
            for x in 0..8 {
                assert_eq!(shared.at(x, y), shared.at(2 + x % 2, 2 + y % 2), "{x} {y}");
                tried += 1;
            }
        }
        assert_eq!(tried, 48);
        assert_eq!(shared_out(&Plane::filled(Size { width_px: 1, height_px: 1 }, 3.0), 0.2).at(0, 0), 3.0);
    }
}
