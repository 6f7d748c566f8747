//! The streaming Bayesian Hilbert map as it was published, with the full covariance of all weights.
//!
//! R. Senanayake and F. Ramos, *Building Continuous Occupancy Maps with Moving Robots*, AAAI 2018, eqs. (1) and (6)–(8), with the
//! labels 0 and 1 that (6) asks for. Squared-exponential features `exp(−d²/g)`, `g = 0.6 h²`, around the nodes of one lattice of
//! spacing `h` over the whole area, prior `N(0, 10⁴ I)`. Each scan is two passes of expectation–maximisation in which the belief
//! before the scan stays fixed, ξ begins at 1, and every pass factorises and inverts the whole matrix, in `f64`.
//!
//! Deviations: features below 1e-12 are taken as zero where rows of φ are formed; a lattice of more than 6 000 nodes is made
//! coarser. The matrix is never taken as sparse.

#[cfg(feature = "dense")]
mod lattice;
#[cfg(feature = "dense")]
mod model;
#[cfg(all(test, feature = "dense"))]
mod tests;

use super::{Entry, Size};

pub(super) const ENTRIES: &[Entry] = &[Entry {
    name: "dense-bhm",
    summary: "the published Bayesian Hilbert map: one lattice, full covariance in f64, inverted at each pass",
    source: "Senanayake and Ramos 2018; features below 1e-12 are dropped, and spacing is widened to 6 000 supports at most",
    size: Size::Metres(0.5),
    open: dense!(model::open),
}];
