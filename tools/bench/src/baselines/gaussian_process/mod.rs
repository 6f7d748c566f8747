//! Gaussian process occupancy maps: binary classifiers of the plane, exact on what they keep.
//!
//! S. O'Callaghan and F. Ramos, *Gaussian process occupancy maps*, IJRR 2012. Inference is Laplace's approximation, Rasmussen and
//! Williams, *Gaussian Processes for Machine Learning*, 2006, algorithms 3.1 and 3.2: Newton's method, each step of which
//! factorises a matrix of as many rows as there are points.
//!
//! The cost grows with the cube of the points, so that one process cannot hold a log. The plane is divided into squares; each has
//! a process of its own for a uniform sample (a reservoir) of the points in it and in a margin around it, and is fitted again
//! after each scan that changed the sample, beginning at the mode before.
//!
//! Deviations: points are sampled, where the publication takes lines for free space; the covariance is the squared exponential,
//! with fixed hyperparameters, where the publication learns those of a neural-network covariance; squares do not share points
//! beyond the margin, so that the map may jump where they meet; the mean probability is `σ(m/√(1 + πs²/8))`. Hyperparameters were
//! chosen on a part of the training points of the Intel log. There, with a side of 2 m and 200 points, a Matérn 1/2 covariance
//! had a slightly better AUC (.988 against .985) and a worse negative log-likelihood (.215 against .195).

#[cfg(feature = "dense")]
mod laplace;
#[cfg(feature = "dense")]
mod model;
#[cfg(feature = "dense")]
mod region;
#[cfg(all(test, feature = "dense"))]
mod tests;

use super::{Entry, Size};

pub(super) const ENTRIES: &[Entry] = &[Entry {
    name: "gaussian-process",
    summary: "Gaussian process occupancy map: exact classifiers by Laplace's approximation, one for each square of the plane",
    source: "O'Callaghan and Ramos 2012, by Rasmussen and Williams 2006, algorithms 3.1 and 3.2; each square learns a sample of \
             its points, squared-exponential covariance",
    size: Size::Count(150.0, "points a region"),
    open: dense!(model::open),
}];
