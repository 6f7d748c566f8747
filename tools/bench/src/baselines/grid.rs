//! Square cells over a fixed area, which several baselines share.

use super::{Failed, Setup};

/// Most cells a grid may have: a gigabyte of `f32`.
const MAX_CELLS: usize = 1 << 28;

/// Where cells lie; what is in them belongs to the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cells {
    pub(super) cell_m: f32,
    origin: [i64; 2],
    pub(super) shape: [usize; 2],
}

impl Cells {
    /// Cells whose edges lie at multiples of the setup's size, covering its area.
    pub(super) fn over(setup: &Setup) -> Result<Self, Failed> {
        let cell_m = setup.size;
        let [min_m, max_m] = setup.area_m;
        if !(cell_m > 0.0 && min_m.iter().chain(&max_m).all(|x| x.is_finite())) {
            return Err(Failed(format!("no grid of {cell_m} m cells over {min_m:?} to {max_m:?} m")));
        }
        let index = |x: f32| (f64::from(x) / f64::from(cell_m)).floor() as i64;
        let origin = min_m.map(index);
        let shape = [0, 1].map(|axis| (index(max_m[axis]).saturating_sub(origin[axis])).max(0) as usize + 1);
        match shape[0].checked_mul(shape[1]) {
            Some(cells) if cells <= MAX_CELLS => Ok(Self { cell_m, origin, shape }),
            _ => Err(Failed(format!("{} x {} cells of {cell_m} m are too many", shape[0], shape[1]))),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// The cell that a point lies in, by column and row; they may lie outside.
    pub(super) fn column_and_row(&self, point_m: [f32; 2]) -> [i64; 2] {
        // Saturating: a point may be so far outside that its column is no `i64`.
        let in_cells = self.in_cells(point_m);
        [0, 1].map(|axis| (in_cells[axis].floor() as i64).saturating_sub(self.origin[axis]))
    }

    /// Where a cell is kept; `None` outside the area.
    pub(super) fn slot(&self, column_and_row: [i64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| usize::try_from(column_and_row[axis]).ok().filter(|i| *i < self.shape[axis]));
        Some(y? * self.shape[0] + x?)
    }

    /// Where the cell of a point is kept; `None` outside the area.
    pub(super) fn slot_at(&self, point_m: [f32; 2]) -> Option<usize> {
        self.slot(self.column_and_row(point_m))
    }

    /// Visits the cells inside the area that a straight line passes through, in order, both ends' own included: Amanatides and
    /// Woo 1987, on the part of the line inside the area, so that no line takes more steps than the area has rows and columns.
    pub(super) fn traverse(&self, from_m: [f32; 2], to_m: [f32; 2], mut visit: impl FnMut([i64; 2])) {
        let (from, to) = (self.in_cells(from_m), self.in_cells(to_m));
        let direction = [0, 1].map(|axis| to[axis] - from[axis]);
        let Some([enter, leave]) = self.inside(from, direction) else { return };
        // An end inside keeps the cell that `column_and_row` gives it; where the line is cut, rounding may not push it outside.
        let cut = |part: f64| {
            [0, 1].map(|axis| {
                let index = (from[axis] + part * direction[axis]).floor() as i64;
                index.saturating_sub(self.origin[axis]).clamp(0, self.shape[axis] as i64 - 1)
            })
        };
        let mut cell = if enter > 0.0 { cut(enter) } else { self.column_and_row(from_m) };
        let last = if leave < 1.0 { cut(leave) } else { self.column_and_row(to_m) };
        let step = [0, 1].map(|axis| (last[axis] - cell[axis]).signum());
        // Where along the line, as a part of it, the next edge is crossed.
        let mut next = [0, 1].map(|axis| {
            let edge = cell[axis] + self.origin[axis] + i64::from(step[axis] > 0);
            (edge as f64 - from[axis]) / direction[axis]
        });
        visit(cell);
        while cell != last {
            let left = [0, 1].map(|axis| last[axis] != cell[axis]);
            let axis = usize::from(!left[0] || (left[1] && next[1] < next[0]));
            cell[axis] += step[axis];
            next[axis] += 1.0 / direction[axis].abs();
            visit(cell);
        }
    }

    fn in_cells(&self, point_m: [f32; 2]) -> [f64; 2] {
        point_m.map(|x| f64::from(x) / f64::from(self.cell_m))
    }

    /// The part of a line that lies inside the area (Liang and Barsky 1984); `None` if it misses.
    fn inside(&self, from: [f64; 2], direction: [f64; 2]) -> Option<[f64; 2]> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let low = self.origin[axis] as f64;
            let high = low + self.shape[axis] as f64;
            if direction[axis] == 0.0 {
                if !(low..high).contains(&from[axis]) {
                    return None;
                }
                continue;
            }
            let edges = [low, high].map(|edge| (edge - from[axis]) / direction[axis]);
            enter = enter.max(edges[0].min(edges[1]));
            leave = leave.min(edges[0].max(edges[1]));
        }
        // A line that touches a corner, or one that ends on the outer edge, which belongs to no cell, is outside.
        (enter < leave).then_some([enter, leave])
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::baselines::test_support::setup;

    fn cells(area_m: [[f32; 2]; 2], cell_m: f32) -> Cells {
        Cells::over(&setup(area_m, cell_m)).unwrap()
    }

    fn traversed(cells: &Cells, from_m: [f32; 2], to_m: [f32; 2]) -> Vec<[i64; 2]> {
        let mut visited = Vec::new();
        cells.traverse(from_m, to_m, |cell| visited.push(cell));
        visited
    }

    /// Length of a line inside each cell, by cutting it against every cell of the area.
    fn length_in(cells: &Cells, column_and_row: [i64; 2], from_m: [f32; 2], to_m: [f32; 2]) -> f64 {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        let mut squared_m2 = 0.0;
        for axis in 0..2 {
            let (from, to) = (f64::from(from_m[axis]), f64::from(to_m[axis]));
            let low = (column_and_row[axis] + cells.origin[axis]) as f64 * f64::from(cells.cell_m);
            let cross = [low, low + f64::from(cells.cell_m)].map(|edge| (edge - from) / (to - from));
            enter = enter.max(cross[0].min(cross[1]));
            leave = leave.min(cross[0].max(cross[1]));
            squared_m2 += (to - from).powi(2);
        }
        (leave - enter).max(0.0) * squared_m2.sqrt()
    }

    /// The oracle looks at every cell. Cells cut for less than rounding may be in either set.
    #[test]
    fn a_traversal_visits_exactly_the_cells_that_a_line_cuts() {
        const ROUNDING_M: f64 = 1e-6;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let cells = cells([[-3.0, -2.0], [2.0, 4.0]], 0.25);
        for _ in 0..500 {
            // Half of the ends lie outside.
            let mut end = || [rng.random_range(-6.0..5.0_f32), rng.random_range(-5.0..7.0_f32)];
            let (from_m, to_m) = (end(), end());
            let visited = traversed(&cells, from_m, to_m);
            for pair in visited.windows(2) {
                assert_eq!((pair[1][0] - pair[0][0]).abs() + (pair[1][1] - pair[0][1]).abs(), 1, "{visited:?}");
            }
            for slot in 0..cells.count() {
                let cell = [(slot % cells.shape[0]) as i64, (slot / cells.shape[0]) as i64];
                let length_m = length_in(&cells, cell, from_m, to_m);
                match visited.iter().filter(|visited| **visited == cell).count() {
                    0 => assert!(length_m < ROUNDING_M, "{from_m:?} {to_m:?} misses {cell:?}: {length_m}"),
                    1 => assert!(length_m > -ROUNDING_M && cells.slot(cell) == Some(slot)),
                    more => panic!("{cell:?} visited {more} times"),
                }
                let inside = |point_m: [f32; 2]| cells.column_and_row(point_m) == cell;
                assert!(!(inside(from_m) || inside(to_m)) || visited.contains(&cell), "an end's own cell");
            }
            assert!(visited.iter().all(|cell| cells.slot(*cell).is_some()));
        }
    }

    /// Edges, corners and cells along an axis, written down by hand.
    #[test]
    fn lines_along_the_lattice() {
        let cells = cells([[0.0, 0.0], [3.5, 3.5]], 1.0);
        assert_eq!(traversed(&cells, [0.5, 1.0], [2.5, 1.0]), [[0, 1], [1, 1], [2, 1]]);
        assert_eq!(traversed(&cells, [2.5, 1.5], [0.5, 1.5]), [[2, 1], [1, 1], [0, 1]]);
        assert_eq!(traversed(&cells, [1.5, 1.5], [1.5, 1.5]), [[1, 1]]);
        assert_eq!(traversed(&cells, [1.5, -9.0], [1.5, 1.5]), [[1, 0], [1, 1]]);
        assert_eq!(traversed(&cells, [9.0, 9.0], [9.0, 9.0]), [[0; 2]; 0]);
        assert_eq!(traversed(&cells, [-1.0, 2.0], [1.0, 9.0]), [[0; 2]; 0]);
        let diagonal = traversed(&cells, [0.0, 0.0], [2.0, 2.0]);
        assert_eq!((diagonal.first(), diagonal.last(), diagonal.len()), (Some(&[0, 0]), Some(&[2, 2]), 5));
    }

    #[test]
    fn far_away_is_outside_and_no_line_is_long() {
        let cells = cells([[-3.0, -2.0], [2.0, 4.0]], 0.25);
        let far = [[f32::MAX, 0.1], [-f32::MAX, 0.1], [f32::MAX, f32::MAX], [-1e30, 1e-30], [1e9, -1e9], [0.1, 0.1]];
        for from_m in far {
            assert_eq!(cells.slot_at(from_m).is_some(), from_m == [0.1, 0.1]);
            for to_m in far {
                assert!(traversed(&cells, from_m, to_m).len() <= cells.shape[0] + cells.shape[1]);
            }
        }
        assert_eq!(traversed(&cells, [-1e9, 0.1], [1e9, 0.1]).len(), cells.shape[0]);
        assert!(Cells::over(&setup([[-1e6, -1e6], [1e6, 1e6]], 0.1)).is_err());
        assert!(Cells::over(&setup([[f32::MIN, f32::MIN], [f32::MAX, f32::MAX]], 0.1)).is_err());
        assert!(Cells::over(&setup([[0.0; 2], [1.0; 2]], 0.0)).is_err());
    }
}
