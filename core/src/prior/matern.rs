use super::WeightPrior;
use crate::{
    define::settings,
    kernel::{KernelSettings, beta},
    lattice::Window,
    posterior::{NotPositiveDefinite, Posterior, Scratch},
    settings::{SettingsError, number},
};

settings! {
    /// A Matérn field on the splines: neighbouring places are believed to be alike.
    ///
    /// A field `f` of energy `∫ (κ²f − Δf)² dx` is a Gaussian process with a Matérn covariance, of smoothness `2 − D/2` and range
    /// `√8/κ` (Whittle 1954; Lindgren, Rue & Lindström 2011). By parts, the energy is `∫ κ⁴f² + 2κ²|∇f|² + ‖∇²f‖² dx` and what stands
    /// at the edge, which is left out. Written on a cubic B-spline, it is a quadratic form of the weights whose entries couple only
    /// splines that overlap: the band of the observations. With one-dimensional Gram matrices
    /// `M₀ = ∫ββᵀ`, `M₁ = ∫β′β′ᵀ`, `M₂ = ∫β″β″ᵀ` over the tile, in the plane
    ///
    /// ```text
    /// Λ₀ = τ [ κ⁴ M₀⊗M₀ + 2κ² (M₁⊗M₀ + M₀⊗M₁) + M₂⊗M₀ + 2 M₁⊗M₁ + M₀⊗M₂ ]
    /// ```
    ///
    /// and τ follows from the deviation wanted. The integrals end at the tile's edge (Neumann): there the variance is larger,
    /// twice to three times on an edge.
    MaternPrior {
        /// Standard deviation of the log-odds at a tile's middle: small makes the map cautious where data is dense.
        deviation: f32 = 30.0,
        /// Distance over which the field is correlated, metres: at it the correlation is about 0.1. Taken as no less than one
        /// spacing and no more than 32.
        range_m: f32 = 1.5,
    }
}

impl MaternPrior {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let deviation = self.deviation;
        number::expect("prior deviation", deviation, "0.1 to 1000", (0.1..=1e3).contains(&deviation))?;
        number::expect("prior range", self.range_m, "1 mm to 10 km", (1e-3..=1e4).contains(&self.range_m))
    }

    /// `κ²` times the square of the spacing. A range below a spacing cannot be told from none, one above 32 is wider than what a
    /// tile and single precision hold: both are taken as these.
    fn kappa_squared(&self, spacing_m: f32) -> f32 {
        let range = (self.range_m / spacing_m).clamp(1.0, 32.0);
        8.0 / (range * range)
    }
}

/// `∫ β⁽ᵏ⁾β⁽ᵏ⁾/β(0)²` over one cell, of the splines at the node before it, the two at its ends and the one behind it, for k = 0, 1
/// and 2: whole numbers, and what all of them are divided by.
const CELL_GRAMS: [([[i32; 4]; 4], i32); 3] = [
    ([[20, 129, 60, 1], [129, 1188, 933, 60], [60, 933, 1188, 129], [1, 60, 129, 20]], 2240),
    ([[18, 21, -36, -3], [21, 102, -87, -36], [-36, -87, 102, 21], [-3, -36, 21, 18]], 160),
    ([[6, -9, 0, 3], [-9, 18, -9, 0], [0, -9, 18, -9], [3, 0, -9, 6]], 8),
];

/// `∫ β⁽ᵏ⁾β⁽ᵏ⁾/β(0)²` of the splines at two of `count` nodes in a row, for k = 0, 1 and 2, over the cells that are in reach of four
/// nodes; in spacings.
fn spline_gram(one: usize, other: usize, count: usize) -> [f32; 3] {
    // Cell `c` lies between the nodes `c + 1` and `c + 2`, in reach of `c` to `c + 3`.
    let cells = one.max(other).saturating_sub(3)..=one.min(other).min(count.saturating_sub(4));
    CELL_GRAMS.map(|(gram, divisor)| {
        let sum: i32 = cells.clone().map(|cell| gram[one - cell][other - cell]).sum();
        sum as f32 / divisor as f32
    })
}

/// Which of the three: how often both splines are differentiated.
const MASS: usize = 0;
const SLOPE: usize = 1;
const CURVATURE: usize = 2;

/// The energy of two weights, up to τ, from the one-dimensional Gram entries along each axis.
fn energy<const D: usize>(along: &[[f32; 3]; D], kappa_squared: f32) -> f32 {
    // The product over the axes, with other entries than the mass along one or two of them.
    let with = |others: [(usize, usize); 2]| -> f32 {
        let entry = |(axis, entries): (usize, &[f32; 3])| {
            entries[others.iter().find(|(other, _)| *other == axis).map_or(MASS, |(_, which)| *which)]
        };
        along.iter().enumerate().map(entry).product()
    };
    let nowhere = (D, MASS);
    let mut sum = kappa_squared * kappa_squared * with([nowhere, nowhere]);
    for axis in 0..D {
        sum += 2.0 * kappa_squared * with([(axis, SLOPE), nowhere]) + with([(axis, CURVATURE), nowhere]);
        for other in axis + 1..D {
            sum += 2.0 * with([(axis, SLOPE), (other, SLOPE)]);
        }
    }
    sum
}

impl WeightPrior for MaternPrior {
    fn suits(&self, kernel: &KernelSettings) -> bool {
        matches!(kernel, KernelSettings::CubicBSpline(_))
    }

    fn write<const D: usize, const M: usize, const B: usize>(
        &self,
        width: &[usize; D],
        spacing_m: f32,
        belief: &mut Posterior<M, B>,
        scratch: &mut Scratch<M, B>,
    ) -> Result<(), NotPositiveDefinite> {
        let kappa_squared = self.kappa_squared(spacing_m);
        let strides = Window { first: [0; D], width: *width }.strides();
        let node = |weight: usize| core::array::from_fn(|axis| weight / strides[axis] % width[axis]);
        for (i, row) in belief.information.iter_mut().enumerate() {
            let here: [usize; D] = node(i);
            for (j, entry) in row.iter_mut().enumerate().take(M - i) {
                let there: [usize; D] = node(i + j);
                let along = core::array::from_fn(|axis| spline_gram(here[axis], there[axis], width[axis]));
                *entry = energy::<D>(&along, kappa_squared);
            }
        }
        belief.settle(scratch)?;
        // What the field is in the tile's middle.
        let middle = |weight: usize| -> f32 {
            let at: [usize; D] = node(weight);
            (0..D).map(|axis| beta(at[axis] as f32 - 0.5 * (width[axis] - 1) as f32)).product()
        };
        let mut variance = 0.0;
        for (i, row) in belief.covariance.iter().enumerate() {
            let here = middle(i);
            if here > 0.0 {
                let later: f32 = row.iter().enumerate().skip(1).map(|(j, entry)| entry * middle(i + j)).sum();
                variance += here * (row[0] * here + 2.0 * later);
            }
        }
        belief.scale_precision(variance / (self.deviation * self.deviation));
        Ok(())
    }
}
