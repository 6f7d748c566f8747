//! Random geometry, rounded to the `f32` that both sides see.

use bhm_core::{
    geometry::Point,
    kernel::{
        AnyKernel, Averaging, Kernel, KernelSettings, SquaredExponential, SquaredExponentialSettings, TwoScalesSettings,
    },
    support::{AnySupport, GaussianSupport, PointSupport, RectangularSupport},
};
use bhm_oracle::{Average, Bump, Extent, Square};
use nalgebra::SMatrix;

use crate::stream::Stream;

/// Uniform in the logarithm.
pub fn logarithmic(stream: &mut Stream, low: f64, high: f64) -> f64 {
    stream.between(low.ln(), high.ln()).exp()
}

/// Any length up to the longest, every fourth near that.
fn length(stream: &mut Stream, shortest: f64, longest: f64) -> f64 {
    let shortest = if stream.below(4) == 0 { shortest.max(0.9 * longest) } else { shortest };
    logarithmic(stream, shortest, longest)
}

pub fn wide<const D: usize>(point: &Point<D>) -> [f64; D] {
    core::array::from_fn(|i| f64::from(point[i]))
}

pub fn square<const D: usize>(matrix: &SMatrix<f32, D, D>) -> Square<D> {
    core::array::from_fn(|i| core::array::from_fn(|j| f64::from(matrix[(i, j)])))
}

/// A direction, by rejection from the cube.
pub fn direction<const D: usize>(stream: &mut Stream) -> [f64; D] {
    loop {
        let at: [f64; D] = core::array::from_fn(|_| stream.between(-1.0, 1.0));
        let norm = at.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (0.05..1.0).contains(&norm) {
            return at.map(|x| x / norm);
        }
    }
}

/// A symmetric matrix with these eigenvalues along random axes, or along the coordinates'.
pub fn symmetric<const D: usize>(stream: &mut Stream, values: &[f64; D], turned: bool) -> SMatrix<f32, D, D> {
    let mut axes = [[0.0; D]; D];
    for i in 0..D {
        axes[i][i] = 1.0;
        if turned {
            axes[i] = loop {
                // Gram–Schmidt; an axis nearly in the span of the others is drawn again.
                let mut axis = direction::<D>(stream);
                for other in &axes[..i] {
                    let along: f64 = axis.iter().zip(other).map(|(a, b)| a * b).sum();
                    axis = core::array::from_fn(|k| axis[k] - along * other[k]);
                }
                let norm = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
                if norm > 0.1 {
                    break axis.map(|x| x / norm);
                }
            };
        }
    }
    // The product of the axes first, so that rounding keeps it symmetric.
    SMatrix::from_fn(|i, j| (0..D).map(|k| values[k] * (axes[k][i] * axes[k][j])).sum::<f64>() as f32)
}

/// Which kernel to draw.
#[derive(Clone, Copy, PartialEq)]
pub enum Shape {
    /// `G = g·I`.
    Isotropic,
    /// Any `G`, its axes' widths up to four to one.
    Full,
    /// [`bhm_core::kernel::TwoScales`].
    TwoScales,
}

/// A kernel, the same for the oracle, and how wide it is along its narrowest axis, metres.
pub fn kernel<const D: usize>(stream: &mut Stream, shape: Shape) -> (AnyKernel<D>, Bump<D>, f64) {
    let shape_m2 = logarithmic(stream, 0.01, 16.0) as f32;
    // A power of two: in units of it a shape is the same number, shifted.
    let spacing_m = 0.5;
    let in_spacings = shape_m2 / (spacing_m * spacing_m);
    let g = f64::from(shape_m2);
    let isotropic = |g: f64| core::array::from_fn(|i| core::array::from_fn(|j| if i == j { g } else { 0.0 }));
    match shape {
        Shape::Isotropic => {
            let bump = Bump::Exponentials(vec![(1.0, isotropic(g))]);
            let kernel = KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: in_spacings });
            (kernel.build(spacing_m), bump, g.sqrt())
        }
        Shape::TwoScales => {
            let bump = Bump::Exponentials(vec![(0.5, isotropic(g)), (0.5, isotropic(4.0 * g))]);
            let kernel = KernelSettings::TwoScales(TwoScalesSettings { shape: in_spacings });
            (kernel.build(spacing_m), bump, g.sqrt())
        }
        Shape::Full => {
            let values = core::array::from_fn(|i| if i == 0 { g } else { g / logarithmic(stream, 1.0, 16.0) });
            let matrix = symmetric(stream, &values, true);
            let narrow = values.iter().fold(g, |a, b| a.min(*b)).sqrt();
            let kernel = SquaredExponential::with_shape(matrix).expect("positive definite");
            (AnyKernel::SquaredExponential(kernel), Bump::Exponentials(vec![(1.0, square(&matrix))]), narrow)
        }
    }
}

/// A covariance: from tiny to `largest_m2` and every other near that, round, long, nearly and quite singular.
pub fn covariance<const D: usize>(stream: &mut Stream, largest_m2: f64) -> SMatrix<f32, D, D> {
    let smallest = [1e-8, 0.5][stream.below(2)];
    let first = logarithmic(stream, smallest * largest_m2, largest_m2);
    let values = core::array::from_fn(|i| if i == 0 { first } else { first * [1.0, 1e-3, 1e-7, 0.0][stream.below(4)] });
    let turned = stream.unit() < 0.8;
    symmetric(stream, &values, turned)
}

/// What to average over.
#[derive(Clone, Copy)]
pub struct Over {
    /// A Gaussian support `S`.
    pub support: bool,
    /// An uncertain place `P`.
    pub spread: bool,
    /// A box, its sides from 1 mm up to so many widths of the kernel; 0 for none.
    pub sides_widths: f64,
    /// The sides at least so many widths of the kernel.
    pub sides_at_least: f64,
    /// A segment from 1 mm up to so many metres; 0 for none.
    pub along_m: f64,
    /// The segment no longer than so many widths of the kernel, as quadrature along it wants.
    pub along_widths: f64,
}

impl Over {
    pub const POINT: Self = Self {
        support: false,
        spread: false,
        sides_widths: 0.0,
        sides_at_least: 0.0,
        along_m: 0.0,
        along_widths: f64::INFINITY,
    };
    pub const SEGMENT: Self = Self { along_m: 100.0, ..Self::POINT };
}

/// One drawn case.
pub struct Case<const D: usize> {
    pub kernel: AnyKernel<D>,
    pub bump: Bump<D>,
    pub width_m: f64,
    pub support_m2: SMatrix<f32, D, D>,
    pub spread_m2: SMatrix<f32, D, D>,
    pub sides_m: Point<D>,
    pub along_m: Point<D>,
    pub middle_m: Point<D>,
}

impl<const D: usize> Case<D> {
    pub fn draw(stream: &mut Stream, shape: Shape, over: &Over) -> Self {
        let kernel = kernel::<D>(stream, shape);
        // Twice the variance of the kernel itself, seen as a density: it becomes √3 as wide.
        let largest_m2 = kernel.2 * kernel.2;
        Self::about(stream, kernel, largest_m2, over)
    }

    /// About this kernel, covariances up to so much.
    pub fn about(stream: &mut Stream, kernel: (AnyKernel<D>, Bump<D>, f64), largest_m2: f64, over: &Over) -> Self {
        let (kernel, bump, width_m) = kernel;
        let mut gaussian = |wanted: bool| if wanted { covariance(stream, largest_m2) } else { SMatrix::zeros() };
        let (support_m2, spread_m2) = (gaussian(over.support), gaussian(over.spread));
        let mut sides_m = Point::<D>::zeros();
        if over.sides_widths > 0.0 {
            let shortest = (over.sides_at_least * width_m).max(1e-3);
            sides_m = Point::from_fn(|_, _| length(stream, shortest, over.sides_widths * width_m) as f32);
        }
        let mut along_m = Point::<D>::zeros();
        if over.along_m > 0.0 {
            let length = length(stream, 1e-3, over.along_m.min(over.along_widths * width_m));
            // Every eighth along an axis.
            let mut to = direction::<D>(stream);
            if stream.below(8) == 0 {
                to = core::array::from_fn(|i| f64::from(u8::from(i == 0)));
            }
            along_m = Point::from_fn(|i, _| (to[i] * length) as f32);
        }
        // Some place that is covered lies within what of the kernel is above 1e-8 of its peak, or of one twice as wide.
        let furthest = [4.3, 8.6][stream.below(2)];
        let distance = stream.between(0.0, furthest) * width_m;
        let away = direction::<D>(stream);
        let at = stream.between(-0.6, 0.6) as f32;
        let middle_m = Point::from_fn(|i, _| {
            (away[i] * distance) as f32 + along_m[i] * at + sides_m[i] * stream.between(-0.5, 0.5) as f32
        });
        Self { kernel, bump, width_m, support_m2, spread_m2, sides_m, along_m, middle_m }
    }

    /// The support that it is about.
    pub fn support(&self) -> AnySupport<D> {
        if self.sides_m.iter().any(|side| *side > 0.0) {
            let support = RectangularSupport::new(self.sides_m, Averaging::Exact);
            AnySupport::RectangularSupport(support.expect("positive sides"))
        } else if self.support_m2.iter().any(|s| *s != 0.0) {
            AnySupport::GaussianSupport(GaussianSupport::new(self.support_m2).expect("a covariance"))
        } else {
            AnySupport::PointSupport(PointSupport)
        }
    }

    /// What the core says.
    pub fn feature(&self) -> f32 {
        let spread = self.spread_m2.iter().any(|s| *s != 0.0);
        let kernel = if spread { self.kernel.blurred(&self.spread_m2) } else { self.kernel };
        if self.along_m.iter().any(|v| *v != 0.0) {
            self.support().segment_feature(&kernel, &self.middle_m, &self.along_m)
        } else {
            self.support().feature(&kernel, &self.middle_m)
        }
    }

    /// What the oracle says.
    pub fn exact(&self) -> f64 {
        Average::new(&self.bump, &self.extent(), 1).at(&wide(&self.middle_m))
    }

    pub fn extent(&self) -> Extent<D> {
        Extent {
            covariance_m2: square::<D>(&self.support_m2)
                .iter()
                .zip(&square(&self.spread_m2))
                .map(|(a, b)| core::array::from_fn(|j| a[j] + b[j]))
                .collect::<Vec<_>>()
                .try_into()
                .expect("as many rows"),
            sides_m: wide(&self.sides_m),
            along_m: wide(&self.along_m),
        }
    }
}

impl<const D: usize> core::fmt::Display for Case<D> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "at {:?} along {:?} sides {:?} S {:?} P {:?} of {:?}",
            self.middle_m.as_slice(),
            self.along_m.as_slice(),
            self.sides_m.as_slice(),
            self.support_m2.as_slice(),
            self.spread_m2.as_slice(),
            self.bump
        )
    }
}
