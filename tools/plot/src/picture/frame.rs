//! Where the map is, on the plane and on the canvas.

use embedded_graphics::{prelude::*, primitives::Rectangle};
use serde::Serialize;

/// An upright rectangle of the plane, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounds {
    /// Its least x and y, in metres.
    pub min: [f32; 2],
    /// Its greatest x and y, in metres.
    pub max: [f32; 2],
}

/// Beyond it `f32` steps by a metre and more.
const FARTHEST: f32 = 1e7;

/// Less cannot be labelled in few digits.
const SHORTEST: f32 = 1e-3;

/// Whether an axis can show and label this interval.
pub(super) fn is_drawable([min, max]: [f32; 2]) -> bool {
    min.abs() <= FARTHEST && max.abs() <= FARTHEST && max - min >= SHORTEST
}

impl Bounds {
    /// In metres.
    pub(super) fn width(&self) -> f64 {
        f64::from(self.max[0]) - f64::from(self.min[0])
    }

    /// In metres.
    pub(super) fn height(&self) -> f64 {
        f64::from(self.max[1]) - f64::from(self.min[1])
    }

    pub(super) fn are_drawable(&self) -> bool {
        [0, 1].into_iter().all(|axis| is_drawable([self.min[axis], self.max[axis]]))
    }
}

/// The correspondence between [`Bounds`] and the pixels that show them exactly, edge on edge. Both scales may therefore
/// differ by the part of a pixel that rounding the sides took or gave.
///
/// A pixel `(column, row)` of the canvas covers `[column, column + 1) × [row, row + 1)` of continuous pixel coordinates.
pub(super) struct Frame {
    bounds_m: Bounds,
    corner: Point,
    size: Size,
}

impl Frame {
    pub(super) fn new(bounds_m: Bounds, corner: Point, size: Size) -> Self {
        Self { bounds_m, corner, size }
    }

    pub(super) fn area(&self) -> Rectangle {
        Rectangle::new(self.corner, self.size)
    }

    /// The plane's points at the centres of the pixels, row by row from the top left.
    pub(super) fn centres_m(&self) -> impl Iterator<Item = [f32; 2]> {
        let [left, top] = [f64::from(self.bounds_m.min[0]), f64::from(self.bounds_m.max[1])];
        let column_m = self.bounds_m.width() / f64::from(self.size.width);
        let row_m = self.bounds_m.height() / f64::from(self.size.height);
        (0..self.size.height).flat_map(move |row| {
            let y = top - (f64::from(row) + 0.5) * row_m;
            (0..self.size.width).map(move |column| [(left + (f64::from(column) + 0.5) * column_m) as f32, y as f32])
        })
    }

    /// Where a point of the plane is on the canvas, in continuous pixel coordinates.
    pub(super) fn pixel_of(&self, [x_m, y_m]: [f32; 2]) -> [f64; 2] {
        [self.column_of(f64::from(x_m)), self.row_of(f64::from(y_m))]
    }

    pub(super) fn column_of(&self, x_m: f64) -> f64 {
        let columns_per_m = f64::from(self.size.width) / self.bounds_m.width();
        f64::from(self.corner.x) + (x_m - f64::from(self.bounds_m.min[0])) * columns_per_m
    }

    pub(super) fn row_of(&self, y_m: f64) -> f64 {
        let rows_per_m = f64::from(self.size.height) / self.bounds_m.height();
        f64::from(self.corner.y) + (f64::from(self.bounds_m.max[1]) - y_m) * rows_per_m
    }
}
