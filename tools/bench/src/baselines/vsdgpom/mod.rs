//! Occupancy maps by stochastic variational inference in a sparse Gaussian process.
//!
//! R. Senanayake, S. O'Callaghan and F. Ramos, *Learning highly dynamic environments with stochastic variational inference*, ICRA
//! 2017. The bound and its stochastic gradient are those of J. Hensman, A. Matthews and Z. Ghahramani, *Scalable variational
//! Gaussian process classification*, AISTATS 2015; steps follow the natural gradient, as in J. Hensman, N. Fusi and N. Lawrence,
//! *Gaussian processes for big data*, UAI 2013, with the expected derivatives of M. E. Khan and W. Lin, *Conjugate-computation
//! variational inference*, AISTATS 2017.
//!
//! Each scan is one step: its own points enter the sums of the natural parameters whole, and points drawn from the history
//! stand for all that were seen before, with the rate ρ. A step costs `O(M³ + M² B)` for `M` inducing points and `B` points.
//! New ground gets inducing points by k-means until there are as many as the size says; after that, ground that is still new
//! has all of them clustered anew over the history, and a sample of it entered with the moments of the belief before. So `M`,
//! and the time of a scan, grow with the ground explored.
//!
//! Deviations: the likelihood is logistic, with expectations by the trapezoid rule in place of Gauss–Hermite, which is worse
//! for wide beliefs; covariances below 1e-10 of the variance are left out where a point meets an inducing point, and with them
//! the rows that are zero; hyperparameters are fixed, lengths in proportion to √(area/M), and not learned along with the rest; the
//! map is of a static place; the mean probability is `σ(m/√(1 + πs²/8))`. Constants were chosen on a part of the training
//! points of the Intel log.

#[cfg(feature = "dense")]
mod history;
#[cfg(feature = "dense")]
mod inducing;
#[cfg(feature = "dense")]
mod model;
#[cfg(feature = "dense")]
mod posterior;
#[cfg(all(test, feature = "dense"))]
mod tests;

use super::{Entry, Size};

pub(super) const ENTRIES: &[Entry] = &[Entry {
    name: "vsdgpom",
    summary: "sparse variational Gaussian process, inducing points where something was seen, natural gradients",
    source: "Senanayake, O'Callaghan and Ramos 2017; Hensman, Matthews and Ghahramani 2015; logistic likelihood, fixed \
             hyperparameters, new points enter with a whole step",
    size: Size::Count(800.0, "inducing points"),
    open: dense!(model::open),
}];
