//! Which places call for wide supports and which for narrow ones: relevance detection (Figs. 3c and 4b of the paper).
//!
//! A Gaussian mixture whose means stay on the lattice while EM learns only the covariances, from hits and free points alike:
//! a support between walls grows round, one on a wall grows along it, one without data becomes a point. Streaming: each
//! observation adds to the statistics of the few nodes around it and is forgotten. Learned in a first pass over a log, then
//! fixed.
//!
//! ```text
//! rₙₘ ∝ πₘ N(xₙ; mₘ, Sₘ),  Σₘ rₙₘ = weight of xₙ       E-step, over the nodes of the observation's stencil
//! Sₘ = Σₙ rₙₘ dₙₘdₙₘᵀ / (Σₙ rₙₘ + ν)                   M-step, dₙₘ = xₙ − mₘ
//! πₘ ∝ Σₙ rₙₘ + ν
//! support: Σₙ rₙₘ (dₙₘ − d̄ₘ)(dₙₘ − d̄ₘ)ᵀ / (Σₙ rₙₘ + ν),  d̄ₘ = Σₙ rₙₘ dₙₘ / Σₙ rₙₘ      after the last pass
//! ```
//!
//! What a support covers is the spread of its data about their own mean. About the node, `Sₘ` itself would hold the way
//! from the node to a wall beside it, and such a support would point at the wall instead of lying along it.
//!
//! The paper's plain M-step (`ν = 0`) leaves a component to which little data falls as wide as the few far points are
//! scattered: `πₘ → 0` while `Sₘ` stays. With `ν > 0` it shrinks to a point, as the paper's figure shows it. A covariance wider
//! than the kernel's stencil holds is narrowed in its widest directions only, so that it keeps its orientation.

mod spread;

pub use spread::narrowed;

use nalgebra::SMatrix;

use crate::{
    geometry::Point,
    lattice::{Lattice, Window, offsets},
    support::{AnySupport, GaussianSupport},
};

/// What one node has seen in a pass, and what it made of the passes before. All-zero is a node before its first pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeStatistics {
    /// `Σ r`.
    weight: f32,
    /// `Σ r d`, in spacings.
    offset: [f32; 2],
    /// `Σ r ddᵀ` as xx, xy, yy, in spacings².
    scatter: [f32; 3],
    /// `πₘ` up to a factor, from the pass before.
    share: f32,
    /// `Sₘ` as xx, xy, yy, in spacings², from the pass before.
    covariance: [f32; 3],
    /// The same about the data's own mean: what the support covers.
    spread: [f32; 3],
}

/// What decides the learning.
///
/// How much a hit weighs is the caller's: there are several free points to a hit, and where both weigh the same in sum,
/// supports at a wall lie along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelevanceSettings {
    /// `ν`: as many observations at the node itself as each component is thought to have seen.
    pub pseudo_count: f32,
    /// Largest standard deviation along any direction, spacings: what the kernel's stencil has room for.
    pub max_deviation: f32,
}

impl RelevanceSettings {
    /// A component needs a few observations to be more than a point; as wide as a stencil of eight has room for with every
    /// sensible kernel.
    pub const DEFAULT: Self = Self { pseudo_count: 3.0, max_deviation: 0.8 };
}

/// Standard deviation of every component in the first pass, spacings: neighbours overlap, far points are somebody else's.
const FIRST_DEVIATION: f32 = 0.5;

/// Smallest variance of a component while it competes for observations, spacings²: a point's density would be infinite.
const LEAST_VARIANCE: f32 = 1e-3;

/// A mixture being learned, in memory that the caller lends: one [`NodeStatistics`] per node of a window.
#[derive(Debug)]
pub struct Relevance<'m> {
    lattice: Lattice<2>,
    window: Window<2>,
    settings: RelevanceSettings,
    nodes: &'m mut [NodeStatistics],
    outside: u64,
}

/// The lent memory does not have one entry per node of the window.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryMismatch {
    /// Nodes of the window.
    pub nodes: usize,
    /// Entries lent.
    pub lent: usize,
}

impl core::fmt::Display for MemoryMismatch {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "memory for {} nodes was lent for a window of {}", self.lent, self.nodes)
    }
}

impl core::error::Error for MemoryMismatch {}

impl<'m> Relevance<'m> {
    /// A mixture over the nodes of a window, before its first pass.
    ///
    /// # Errors
    /// [`MemoryMismatch`].
    pub fn new(
        lattice: Lattice<2>,
        window: Window<2>,
        settings: RelevanceSettings,
        nodes: &'m mut [NodeStatistics],
    ) -> Result<Self, MemoryMismatch> {
        if nodes.len() != window.supports() {
            return Err(MemoryMismatch { nodes: window.supports(), lent: nodes.len() });
        }
        let first = FIRST_DEVIATION * FIRST_DEVIATION;
        nodes.fill(NodeStatistics { share: 1.0, covariance: [first, 0.0, first], ..NodeStatistics::default() });
        Ok(Self { lattice, window, settings, nodes, outside: 0 })
    }

    /// Observations that fell outside the window, or could not be placed, since the beginning.
    #[must_use]
    pub const fn outside(&self) -> u64 {
        self.outside
    }

    /// The E-step of one observation that counts as `weight` of them: divides it among the nodes around it.
    pub fn observe(&mut self, point_m: &Point<2>, weight: f32) {
        let Some(stencil) = self.lattice.stencil_at(point_m) else {
            self.outside += 1;
            return;
        };
        let Some(base) = self.window.index_of_whole(&stencil.first, self.lattice.stencil) else {
            self.outside += 1;
            return;
        };
        let strides = self.window.strides();
        let from_first = stencil.from_first_m / self.lattice.spacing_m;
        let reach = [self.lattice.stencil; 2];
        let near = |[i, j]: [usize; 2]| {
            let d = Point::<2>::new(from_first.x - i as f32, from_first.y - j as f32);
            (base + i * strides[0] + j * strides[1], d)
        };
        let mut total = 0.0;
        for offset in offsets(reach) {
            let (index, d) = near(offset);
            total += self.nodes[index].density(&d);
        }
        if !(total > 0.0 && total.is_finite()) {
            self.outside += 1;
            return;
        }
        for offset in offsets(reach) {
            let (index, d) = near(offset);
            let node = &mut self.nodes[index];
            let responsibility = weight * node.density(&d) / total;
            node.weight += responsibility;
            node.offset[0] += responsibility * d.x;
            node.offset[1] += responsibility * d.y;
            for (sum, product) in node.scatter.iter_mut().zip([d.x * d.x, d.x * d.y, d.y * d.y]) {
                *sum += responsibility * product;
            }
        }
    }

    /// The M-step: what the pass has gathered becomes the mixture, and the next pass begins.
    pub fn maximise(&mut self) {
        let RelevanceSettings { pseudo_count, max_deviation } = self.settings;
        for node in self.nodes.iter_mut() {
            let covariance = node.scatter.map(|sum| sum / (node.weight + pseudo_count));
            let [x, y] = node.offset;
            // Written so that a node without data has no spread.
            let about_mean =
                [x * x, x * y, y * y].map(|square| if node.weight > 0.0 { square / node.weight } else { 0.0 });
            let mut spread = [0.0; 3];
            for ((spread, sum), square) in spread.iter_mut().zip(node.scatter).zip(about_mean) {
                *spread = (sum - square) / (node.weight + pseudo_count);
            }
            *node = NodeStatistics {
                share: node.weight + pseudo_count,
                covariance: narrowed(covariance, max_deviation * max_deviation),
                spread: narrowed(spread, max_deviation * max_deviation),
                ..NodeStatistics::default()
            };
        }
    }

    /// What the last M-step made of each node, in the window's order: a Gaussian, or a point where nothing was seen.
    pub fn supports(&self) -> impl Iterator<Item = AnySupport<2>> {
        let square_m2 = self.lattice.spacing_m * self.lattice.spacing_m;
        self.nodes.iter().map(move |node| {
            let [xx, xy, yy] = node.spread.map(|entry| entry * square_m2);
            // Narrower than a hundredth of a spacing, nobody can tell it from a point.
            if xx.max(yy) <= 1e-4 * square_m2 {
                return AnySupport::default();
            }
            GaussianSupport::new(SMatrix::from([[xx, xy], [xy, yy]]))
                .map_or_else(AnySupport::default, AnySupport::GaussianSupport)
        })
    }
}

impl NodeStatistics {
    /// `πₘ N(d; 0, Sₘ)` up to a factor that all nodes share.
    fn density(&self, d: &Point<2>) -> f32 {
        let [xx, xy, yy] = self.covariance;
        let (xx, yy) = (xx + LEAST_VARIANCE, yy + LEAST_VARIANCE);
        let determinant = xx * yy - xy * xy;
        let square = (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / determinant;
        self.share * libm::expf(-0.5 * square) / libm::sqrtf(determinant)
    }
}

#[cfg(test)]
mod tests;
