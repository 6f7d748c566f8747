//! Rows of points on a small lattice.

use bhm_oracle::{Features, Kernel};

use super::SparseRow;

/// The row of a point on eight by eight cubic B-splines, a metre apart from (0, 0): 64 weights, a band of 28.
pub fn spline_row(at_m: [f64; 2], occupied: bool) -> SparseRow {
    let lattice = Features {
        origin_m: [0.0, 0.0],
        spacing_m: 1.0,
        width: [8, 8],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m: 1.0 },
        bias: false,
    };
    let phi = lattice.at(&at_m);
    let entries = phi.iter().enumerate().filter(|(_, v)| **v > 0.0).map(|(i, v)| (i as u32, *v as f32));
    SparseRow { entries: entries.collect(), occupied }
}
