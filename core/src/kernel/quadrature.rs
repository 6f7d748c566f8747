//! Averages over a line by weighted nodes.
#![allow(clippy::excessive_precision, reason = "nodes as tabulated; f32 takes what it can")]

/// Nodes and weights on `[−½, ½]`; the weights sum to 1.
pub(crate) type Nodes = [(f32, f32)];

/// Gauss–Legendre, exact for cubics.
#[rustfmt::skip]
pub(crate) const LEGENDRE_2: &Nodes = &[(-0.288_675_135, 0.5), (0.288_675_135, 0.5)];

/// Gauss–Legendre, exact to degree 9.
#[rustfmt::skip]
pub(crate) const LEGENDRE_5: &Nodes = &[
    (-0.453_089_923, 0.118_463_442_5), (-0.269_234_655_1, 0.239_314_335_2), (0.0, 0.284_444_444_4),
    (0.269_234_655_1, 0.239_314_335_2), (0.453_089_923, 0.118_463_442_5),
];

/// Gauss–Legendre, exact to degree 23.
#[rustfmt::skip]
pub(crate) const LEGENDRE_12: &Nodes = &[
    (-0.490_780_317_1, 0.023_587_668_19), (-0.452_058_628_2, 0.053_469_662_99), (-0.384_951_337_1, 0.080_039_164_27),
    (-0.293_658_977_1, 0.101_583_713_4), (-0.183_915_749_5, 0.116_746_268_3), (-0.062_616_704_26, 0.124_573_522_9),
    (0.062_616_704_26, 0.124_573_522_9), (0.183_915_749_5, 0.116_746_268_3), (0.293_658_977_1, 0.101_583_713_4),
    (0.384_951_337_1, 0.080_039_164_27), (0.452_058_628_2, 0.053_469_662_99), (0.490_780_317_1, 0.023_587_668_19),
];

/// Gauss–Hermite for the standard normal: nodes in standard deviations, weights that sum to 1.
#[rustfmt::skip]
pub(crate) const HERMITE_7: &Nodes = &[
    (-3.750_439_718, 0.000_548_268_856), (-2.366_759_411, 0.030_757_124), (-1.154_405_395, 0.240_123_178_6),
    (0.0, 0.457_142_857_1),
    (1.154_405_395, 0.240_123_178_6), (2.366_759_411, 0.030_757_124), (3.750_439_718, 0.000_548_268_856),
];

/// `Σ w f(x)`.
#[inline]
pub(crate) fn mean(nodes: &Nodes, mut f: impl FnMut(f32) -> f32) -> f32 {
    nodes.iter().map(|(x, weight)| weight * f(*x)).sum()
}

/// How a function is averaged over a line segment or a box; a configuration writes it as a number of samples, 0 for
/// [`Averaging::Exact`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u32", into = "u32"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Averaging {
    /// In closed form, or by quadrature of a stated error where there is none.
    #[default]
    Exact,
    /// By so many samples along each axis, equally spaced and equally weighed: eqs. (12) and (14) as printed.
    Samples(u32),
}

impl From<u32> for Averaging {
    fn from(samples: u32) -> Self {
        if samples == 0 { Self::Exact } else { Self::Samples(samples) }
    }
}

impl From<Averaging> for u32 {
    fn from(averaging: Averaging) -> Self {
        match averaging {
            Averaging::Exact => 0,
            Averaging::Samples(count) => count,
        }
    }
}

impl Averaging {
    /// Whether the number of samples, if any, is one that can be taken.
    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Exact => true,
            Self::Samples(count) => (1..=MAX_SAMPLES).contains(&count),
        }
    }
}

/// Most samples along an axis.
pub const MAX_SAMPLES: u32 = 64;

/// The mean of `f` over `count` equally spaced points of `[−½, ½]`, each in the middle of its share.
#[inline]
pub fn sampled(count: u32, mut f: impl FnMut(f32) -> f32) -> f32 {
    let count = count.clamp(1, MAX_SAMPLES);
    (0..count).map(|i| f((i as f32 + 0.5) / count as f32 - 0.5)).sum::<f32>() / count as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_measure() {
        for (nodes, degree) in [(LEGENDRE_2, 3), (LEGENDRE_5, 9), (LEGENDRE_12, 23)] {
            for power in 0..=degree {
                let exact = if power % 2 == 1 { 0.0 } else { 0.5_f32.powi(power) / (power + 1) as f32 };
                assert!((mean(nodes, |x| x.powi(power)) - exact).abs() < 1e-7, "{power} of {}", nodes.len());
            }
        }
        for (power, exact) in [(0, 1.0), (1, 0.0), (2, 1.0), (4, 3.0), (6, 15.0), (8, 105.0), (12, 10_395.0)] {
            assert!((mean(HERMITE_7, |x| x.powi(power)) - exact).abs() <= 1e-6 * (1.0 + exact), "{power}");
        }
    }
}
