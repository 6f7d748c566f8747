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
        [0, 1].map(|axis| (f64::from(point_m[axis]) / f64::from(self.cell_m)).floor() as i64 - self.origin[axis])
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
}
