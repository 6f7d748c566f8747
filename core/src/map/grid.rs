use super::{Map, Occupancy};
use crate::geometry::Point;

/// Equal cells along the axes: where a map is asked for a picture or for a planner's grid.
///
/// Cells are counted with the first axis fastest: in the plane row by row, each from left to right, from the bottom row up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<const D: usize> {
    /// The corner of the first cell with the least coordinates, metres.
    pub corner_m: Point<D>,
    /// Side of a cell, metres.
    pub resolution_m: f32,
    /// Cells along each axis.
    pub cells: [usize; D],
}

impl<const D: usize> Grid<D> {
    /// Number of cells; `usize::MAX` if there are more than can be counted.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.iter().fold(1, |product: usize, cells| product.saturating_mul(*cells))
    }

    /// Whether the grid has no cells.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The centre of the cell of that number, metres.
    #[must_use]
    pub fn centre_m(&self, mut number: usize) -> Point<D> {
        let mut centre = self.corner_m;
        for axis in 0..D {
            let cells = self.cells[axis].max(1);
            centre[axis] += ((number % cells) as f32 + 0.5) * self.resolution_m;
            number /= cells;
        }
        centre
    }
}

/// Side of the blocks of cells that are asked about at once: cells of a block lie close
/// together, and those of one cell of the lattice are answered together.
const BLOCK: usize = 8;

pub(super) fn raster<const D: usize>(map: &(impl Map<D> + ?Sized), grid: &Grid<D>, answers: &mut [Occupancy]) {
    let len = answers.len().min(grid.len());
    let row = grid.cells.first().map_or(1, |cells| (*cells).max(1));
    for first_row in (0..len.div_ceil(row)).step_by(BLOCK) {
        for first_column in (0..row).step_by(BLOCK) {
            let columns = first_column..(first_column + BLOCK).min(row);
            let numbers = (first_row..first_row + BLOCK)
                .flat_map(|number| columns.clone().map(move |column| number * row + column))
                .filter(|number| *number < len);
            let mut points = [Point::zeros(); BLOCK * BLOCK];
            let mut of_block = [Occupancy::UNKNOWN; BLOCK * BLOCK];
            let mut count = 0;
            for (point, number) in points.iter_mut().zip(numbers.clone()) {
                *point = grid.centre_m(number);
                count += 1;
            }
            map.occupancies(&points[..count], &mut of_block[..count]);
            for (answer, number) in of_block.iter().zip(numbers) {
                answers[number] = *answer;
            }
        }
    }
}
