//! The feature vector φ(x) of eq. (1): which supports an observation sees and how strongly.
//!
//! Here lattice, kernel, support and observation meet, in one composition: the kernel is blurred by what is uncertain about
//! the observation, the support averages it over its area, and a segment averages that along itself. The posterior sees
//! only the numbers.

use heapless::Vec;
use nalgebra::SMatrix;

use crate::{
    geometry::{Place, Point},
    kernel::{AnyKernel, Averaging, Kernel, quadrature::sampled},
    lattice::{Lattice, MAX_STENCIL_NODES, Node, Stencil, displaced, offsets},
    support::Supports,
};

/// Supports, their kernel, and the optional bias: everything that turns a place into features.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis<'s, const D: usize> {
    /// Where the supports sit.
    pub lattice: Lattice<D>,
    /// How far each reaches.
    pub kernel: AnyKernel<D>,
    /// What each is centred on.
    pub supports: Supports<'s, D>,
    /// How features are averaged along a segment.
    pub segments: Averaging,
    /// What is subtracted from the constant feature 1, per unit of `Σₘ φₘ(x)`; `None` without bias. See [`Basis::new`].
    pub bias_coupling: Option<f32>,
    /// By how much an uncertain observation may widen the kernel, as a variance along each axis, m². See
    /// [`Basis::widening`].
    pub room_m2: f32,
}

/// φ(x): one value per node of the place's stencil, in the stencil's order, and the bias feature.
#[derive(Clone, Debug)]
pub struct Features<const D: usize> {
    /// The stencil the values belong to.
    pub stencil: Stencil<D>,
    /// `φₘ(x)` for the stencil's nodes.
    pub values: Vec<f32, MAX_STENCIL_NODES>,
    /// The bias feature; 0 without bias.
    pub bias: f32,
}

/// ∂φ/∂x, per metre, in the order of [`Features`].
#[derive(Clone, Debug)]
pub struct FeatureGradients<const D: usize> {
    /// `∂φₘ/∂x`.
    pub values: Vec<Point<D>, MAX_STENCIL_NODES>,
    /// The bias feature's.
    pub bias: Point<D>,
}

/// Largest feature at the edge of a stencil that is accepted: the paper's own public settings cut at 1.3e-3.
pub const MAX_CUT_OFF: f32 = 5e-3;

impl<'s, const D: usize> Basis<'s, D> {
    /// Composes a basis.
    ///
    /// With a bias the model is `f(x) = Σₘ wₘ φₘ(x) + b`. A lattice of bumps nearly spans the constant function, so that
    /// in these coordinates the information matrix is nearly singular along `(−c·1, 1)`, and `f32` loses the bias. The
    /// same model is therefore written as `f(x) = Σₘ w′ₘ φₘ(x) + b·r(x)` with `w′ₘ = wₘ + c·b` and
    /// `r(x) = 1 − c Σₘ φₘ(x)`: an exact change of variables for any `c`, and with `c` the reciprocal of the mean of
    /// `Σₘ φₘ`, `r` is the small ripple that the lattice cannot express (zero for a B-spline). What remains of the
    /// coupling stands in the prior.
    #[must_use]
    pub fn new(
        lattice: Lattice<D>,
        kernel: AnyKernel<D>,
        supports: Supports<'s, D>,
        segments: Averaging,
        bias: bool,
    ) -> Self {
        let mut basis = Self { lattice, kernel, supports, segments, bias_coupling: None, room_m2: 0.0 };
        basis.room_m2 = basis.room();
        if bias {
            const SAMPLES_A_SIDE: usize = 4;
            let mut sum = 0.0;
            for offset in offsets([SAMPLES_A_SIDE; D]) {
                let at = Point::from_fn(|axis, _| {
                    (offset[axis] as f32 + 0.5) / SAMPLES_A_SIDE as f32 * lattice.spacing_m + lattice.origin_m[axis]
                });
                sum += basis.features(&at).map_or(0.0, |features| features.values.iter().sum());
            }
            basis.bias_coupling = Some(SAMPLES_A_SIDE.pow(D as u32) as f32 / sum);
        }
        basis
    }

    /// φ of a point; `None` where the lattice cannot place it (see [`Lattice::stencil_at`]).
    #[inline]
    #[must_use]
    pub fn features(&self, point_m: &Point<D>) -> Option<Features<D>> {
        self.features_of(&Place::Point(*point_m), None)
    }

    /// φ of a point or of a segment whose every point sees the stencil of its middle (see [`Lattice::cut`]), widened by the
    /// covariance of where it is, m²; `None` where the lattice cannot place it.
    #[inline]
    #[must_use]
    pub fn features_of(&self, place: &Place<D>, spread_m2: Option<&SMatrix<f32, D, D>>) -> Option<Features<D>> {
        let mut values = Vec::new();
        values.resize(self.lattice.stencil_nodes(), 0.0).ok()?;
        let (stencil, bias) = self.write_features(place, spread_m2, &mut values)?;
        Some(Features { stencil, values, bias })
    }

    /// Writes [`features_of`](Self::features_of) over `values`, one for each node of a stencil; answers the stencil and the
    /// bias feature. `None` also if `values` has another length.
    #[inline]
    #[must_use]
    pub fn write_features(
        &self,
        place: &Place<D>,
        spread_m2: Option<&SMatrix<f32, D, D>>,
        values: &mut [f32],
    ) -> Option<(Stencil<D>, f32)> {
        let stencil = self.lattice.stencil_at(&place.middle_m())?;
        if values.len() != self.lattice.stencil_nodes() {
            return None;
        }
        Some((stencil, self.write_features_at(&stencil, place, spread_m2, values)))
    }

    /// [`write_features`](Self::write_features) of a place whose stencil is known, over as many values as the stencil has nodes;
    /// answers the bias feature.
    #[inline]
    pub(crate) fn write_features_at(
        &self,
        stencil: &Stencil<D>,
        place: &Place<D>,
        spread_m2: Option<&SMatrix<f32, D, D>>,
        values: &mut [f32],
    ) -> f32 {
        let blurred;
        let kernel = match spread_m2 {
            Some(spread_m2) => {
                blurred = self.kernel.blurred(spread_m2);
                &blurred
            }
            None => &self.kernel,
        };
        match place {
            Place::Point(_) => {
                let values = values.as_chunks_mut().0;
                self.write_features_of_points(kernel, &stencil.first, &[stencil.from_first_m], values);
            }
            Place::Segment { from_m, to_m } => {
                let along = to_m - from_m;
                for (slot, (node, middle)) in values.iter_mut().zip(self.nodes(stencil)) {
                    let support = self.supports.at(&node);
                    *slot = match self.segments {
                        Averaging::Exact => support.segment_feature(kernel, &middle, &along),
                        Averaging::Samples(count) => sampled(count, |x| support.feature(kernel, &(middle + along * x))),
                    };
                }
            }
        }
        self.bias_coupling.map_or(0.0, |coupling| 1.0 - coupling * values.iter().sum::<f32>())
    }

    /// Writes the features of `L` points of the cell whose stencil begins at `first`, node by node, without the bias's.
    #[inline(always)]
    pub(crate) fn write_features_of_points<const L: usize>(
        &self,
        kernel: &AnyKernel<D>,
        first: &Node<D>,
        from_first_m: &[Point<D>; L],
        values: &mut [[f32; L]],
    ) {
        let Lattice { spacing_m, stencil: width, .. } = self.lattice;
        if self.supports.table.is_empty() {
            self.supports.everywhere.over_lattice(kernel, from_first_m, spacing_m, width, values);
            return;
        }
        for (slots, offset) in values.iter_mut().zip(offsets([width; D])) {
            let support = self.supports.at(&core::array::from_fn(|axis| first[axis] + offset[axis] as i32));
            *slots = from_first_m.map(|from_first| support.feature(kernel, &displaced(&from_first, offset, spacing_m)));
        }
    }

    /// ∂φ/∂x at the point whose stencil is given.
    #[must_use]
    pub fn gradients(&self, stencil: &Stencil<D>) -> FeatureGradients<D> {
        let mut gradients = FeatureGradients { values: Vec::new(), bias: Point::zeros() };
        for (node, displacement) in self.nodes(stencil) {
            // A stencil larger than the capacity has no features, hence no gradients to ask for.
            let _ = gradients.values.push(self.supports.at(&node).feature_gradient(&self.kernel, &displacement));
        }
        if let Some(coupling) = self.bias_coupling {
            gradients.bias = gradients.values.iter().sum::<Point<D>>() * -coupling;
        }
        gradients
    }

    /// The largest feature that the stencil cuts off, over all supports.
    #[must_use]
    pub fn cut_off(&self) -> f32 {
        // Written so that a NaN is the largest.
        let largest = |a: f32, b: f32| if b > a || b.is_nan() { b } else { a };
        self.supports.all().map(|support| support.cut_off(&self.kernel, self.reach_m())).fold(0.0, largest)
    }

    /// What an observation's covariance, m², may widen the kernel by, and whether that is less than all of it.
    ///
    /// A kernel widened beyond its stencil would be cut off there: a covariance with a variance above
    /// [`room_m2`](Self::room_m2) along an axis is scaled down to it.
    #[inline]
    #[must_use]
    pub fn widening(&self, covariance_m2: &SMatrix<f32, D, D>) -> (SMatrix<f32, D, D>, bool) {
        let largest = (0..D).map(|axis| covariance_m2[(axis, axis)]).fold(0.0, f32::max);
        if largest > self.room_m2 { (covariance_m2 * (self.room_m2 / largest), true) } else { (*covariance_m2, false) }
    }

    /// The largest isotropic variance, m², by which every support can be blurred with no more than [`MAX_CUT_OFF`] cut off.
    fn room(&self) -> f32 {
        let reach = self.reach_m();
        let mut room = reach * reach;
        for support in self.supports.all() {
            let fits = |variance: f32| {
                let blur = SMatrix::from_diagonal_element(variance);
                support.cut_off(&self.kernel.blurred(&blur), reach) <= MAX_CUT_OFF
            };
            if fits(room) {
                continue;
            }
            let (mut low, mut high) = (0.0, room);
            for _ in 0..20 {
                let middle = 0.5 * (low + high);
                if fits(middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            room = low;
        }
        room
    }

    /// How far a stencil reaches: the nearest point that does not see a support is half a stencil from it along an axis.
    fn reach_m(&self) -> f32 {
        0.5 * self.lattice.stencil as f32 * self.lattice.spacing_m
    }

    /// The stencil's nodes, and the displacement of its point from each.
    #[inline]
    fn nodes(&self, stencil: &Stencil<D>) -> impl Iterator<Item = (Node<D>, Point<D>)> {
        let Stencil { first, from_first_m } = *stencil;
        let spacing_m = self.lattice.spacing_m;
        offsets([self.lattice.stencil; D]).map(move |offset| {
            let node = core::array::from_fn(|axis| first[axis] + offset[axis] as i32);
            (node, displaced(&from_first_m, offset, spacing_m))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings};
    use crate::support::{SupportSettings, SupportTable};

    const SPLINE: KernelSettings = KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT);
    const EXPONENTIAL: KernelSettings = KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT);

    fn basis(kernel: KernelSettings, stencil: usize) -> Basis<'static, 2> {
        let lattice = Lattice { origin_m: Point::zeros(), spacing_m: 0.5, stencil };
        let supports = Supports { everywhere: Default::default(), table: SupportTable::EMPTY };
        Basis::new(lattice, kernel.build(0.5), supports, Averaging::Exact, true)
    }

    #[test]
    fn the_bias_feature_is_what_the_lattice_cannot_express() {
        for i in 0..200 {
            let at = Point::<2>::new(i as f32 * 0.013, i as f32 * 0.027);
            let spline = basis(SPLINE, 4).features(&at).unwrap();
            assert!(spline.bias.abs() < 1e-6);
            let exponential = basis(EXPONENTIAL, 6).features(&at).unwrap();
            assert!(exponential.bias.abs() < 2e-2, "a ripple, not {}", exponential.bias);
        }
    }

    #[test]
    fn a_table_of_the_same_supports_is_the_same_function_bit_for_bit() {
        let window = crate::lattice::Window { first: [-8, -8], width: [24, 24] };
        for kernel in KernelSettings::ALL {
            for support in SupportSettings::ALL {
                let everywhere = support.build(0.2);
                let alike = std::vec![everywhere; window.supports()];
                let mut one = basis(*kernel, 6);
                one.supports.everywhere = everywhere;
                let mut each = one.clone();
                each.supports.table = SupportTable::new(window, alike.as_slice()).unwrap();
                for i in 0..50 {
                    let at = Point::<2>::new(i as f32 * 0.053, i as f32 * 0.027);
                    let (one, each) = (one.features(&at).unwrap(), each.features(&at).unwrap());
                    assert_eq!(one.values, each.values, "{} over a {}", kernel.name(), support.name());
                }
            }
        }
    }
}
