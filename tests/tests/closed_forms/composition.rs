//! The whole composition: what a basis makes of a place is what the oracle makes of every node.

use std::collections::BTreeMap;

use bhm_core::{
    basis::Basis,
    geometry::{Place, Point},
    kernel::{Averaging, CubicBSplineSettings, KernelSettings, SquaredExponentialSettings, TwoScalesSettings},
    lattice::{Lattice, offsets},
    support::{GaussianSettings, PointSettings, RectangleSettings, SupportSettings, SupportTable, Supports},
};
use bhm_oracle::{Average, Bump, Extent};

use crate::{
    cubic_b_spline::{BLURRED_LITTLE, absolute},
    draw::{covariance, square, wide},
    stream::Stream,
    tally::{CLOSED, Tally},
};

const SPACING_M: f32 = 0.5;
/// `g` of the kernels that have one, square metres. The spacing is a power of two: in its units it is the same number, shifted.
const SHAPE_M2: f32 = 0.15;
const SHAPE: f32 = SHAPE_M2 / (SPACING_M * SPACING_M);

/// The kernel with that shape, if it has one.
fn shaped(kernel: KernelSettings) -> KernelSettings {
    match kernel {
        KernelSettings::CubicBSpline(_) => kernel,
        KernelSettings::SquaredExponential(_) => {
            KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: SHAPE })
        }
        KernelSettings::TwoScales(_) => KernelSettings::TwoScales(TwoScalesSettings { shape: SHAPE }),
    }
}

/// The support of that size, in spacings, if it has one.
fn sized(support: SupportSettings, size: f32) -> SupportSettings {
    match support {
        SupportSettings::PointSupport(_) => support,
        SupportSettings::GaussianSupport(_) => SupportSettings::GaussianSupport(GaussianSettings { size }),
        SupportSettings::RectangularSupport(_) => {
            SupportSettings::RectangularSupport(RectangleSettings { size, samples: Averaging::Exact })
        }
    }
}

fn basis(
    kernel: KernelSettings,
    support: SupportSettings,
    size: f32,
    stencil: usize,
    segments: Averaging,
) -> (Basis<'static, 2>, Bump<2>) {
    let lattice = Lattice { origin_m: Point::<2>::new(0.25, -1.0), spacing_m: SPACING_M, stencil };
    let supports = Supports { everywhere: sized(support, size).build(SPACING_M), table: SupportTable::EMPTY };
    let g = f64::from(SHAPE_M2);
    let diagonal = |g: f64| [[g, 0.0], [0.0, g]];
    let bump = match kernel {
        KernelSettings::SquaredExponential(_) => Bump::Exponentials(vec![(1.0, diagonal(g))]),
        KernelSettings::TwoScales(_) => Bump::Exponentials(vec![(0.5, diagonal(g)), (0.5, diagonal(4.0 * g))]),
        KernelSettings::CubicBSpline(_) => Bump::Spline { spacing_m: SPACING_M.into() },
    };
    (Basis::new(lattice, shaped(kernel).build(SPACING_M), supports, segments, false), bump)
}

/// A place within one cell, ten metres around: coordinates are a few 1e-7 m off, of a width of 0.4 m.
fn place(stream: &mut Stream, segment: bool) -> Place<2> {
    let cell = Point::<2>::from_fn(|_, _| stream.between(-20.0, 20.0).floor() as f32 * SPACING_M);
    let mut within = || cell + Point::<2>::from_fn(|_, _| stream.between(0.0, 1.0) as f32 * SPACING_M);
    let (from_m, to_m) = (within(), within());
    if segment { Place::Segment { from_m, to_m } } else { Place::Point(from_m) }
}

/// Which area a support of that size is to the oracle.
fn extent(support: SupportSettings, size: f32) -> Extent<2> {
    let length = f64::from(size * SPACING_M);
    match support {
        SupportSettings::PointSupport(_) => Extent::POINT,
        SupportSettings::GaussianSupport(_) => {
            let variance = length * length;
            Extent { covariance_m2: [[variance, 0.0], [0.0, variance]], ..Extent::POINT }
        }
        SupportSettings::RectangularSupport(_) => Extent { sides_m: [length; 2], ..Extent::POINT },
    }
}

fn agrees(kernel: KernelSettings, support: SupportSettings, segment: bool, spread: bool) {
    let size = if matches!(support, SupportSettings::RectangularSupport(_)) { 1.0 } else { 0.2 };
    let (basis, bump) = basis(kernel, support, size, 6, Averaging::Exact);
    let spline = matches!(kernel, KernelSettings::CubicBSpline(_));
    let blurred = spread || matches!(support, SupportSettings::GaussianSupport(_));
    let tolerance = match (spline, blurred) {
        // The spline's own statement for standard deviations up to 0.3 spacings.
        (true, true) => BLURRED_LITTLE,
        // Twelve nodes across the knots of the rectangle's average.
        (true, false) => absolute(3e-5),
        (false, _) => CLOSED,
    };
    let what = format!("{} of a {}, segment {segment}, spread {spread}", kernel.name(), support.name());
    let mut tally = Tally::new(&what, tolerance);
    let mut stream = Stream::new(99);
    // The oracle's blurred splines are dear; every place is compared at 36 nodes.
    let places = if spline && blurred { 2 } else { 300 };
    for _ in 0..places {
        let place = place(&mut stream, segment);
        let deviation_m = 0.2 * f64::from(SPACING_M);
        let spread_m2 = spread.then(|| covariance::<2>(&mut stream, deviation_m * deviation_m));
        let features = basis.features_of(&place, spread_m2.as_ref()).expect("near the origin");
        let mut extent = extent(support, size);
        if let Some(spread_m2) = &spread_m2 {
            for (row, more) in extent.covariance_m2.iter_mut().zip(square(spread_m2)) {
                *row = [row[0] + more[0], row[1] + more[1]];
            }
        }
        let middle = match place {
            Place::Point(at) => wide(&at),
            Place::Segment { from_m, to_m } => {
                let (from, to) = (wide(&from_m), wide(&to_m));
                extent.along_m = [to[0] - from[0], to[1] - from[1]];
                [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])]
            }
        };
        let average = Average::new(&bump, &extent, 1);
        for (offset, value) in offsets([6; 2]).zip(&features.values) {
            let displacement = core::array::from_fn(|axis| {
                let node = features.stencil.first[axis] + offset[axis] as i32;
                let origin = f64::from(basis.lattice.origin_m[axis]);
                middle[axis] - origin - f64::from(node) * f64::from(SPACING_M)
            });
            tally.add(*value, average.at(&displacement), &format!("{displacement:?} {extent:?}"));
        }
    }
    tally.finish();
}

#[test]
fn of_every_kernel_support_and_place() {
    for &kernel in KernelSettings::ALL {
        for &support in SupportSettings::ALL {
            for segment in [false, true] {
                for spread in [false, true] {
                    agrees(kernel, support, segment, spread);
                }
            }
        }
    }
}

/// The pieces of a cut segment, weighed by their lengths, are the segment.
fn pieces_are_the_whole(kernel: KernelSettings, stencil: usize) {
    let point = SupportSettings::PointSupport(PointSettings::DEFAULT);
    let (mut basis, mut bump) = basis(kernel, point, 0.0, stencil, Averaging::Exact);
    if let KernelSettings::SquaredExponential(settings) = kernel {
        let shape_m2 = settings.shape * SPACING_M * SPACING_M;
        basis.kernel = kernel.build(SPACING_M);
        bump = Bump::Exponentials(vec![(1.0, [[f64::from(shape_m2), 0.0], [0.0, f64::from(shape_m2)]])]);
    }
    let mut stream = Stream::new(3);
    // The spline is 1.2e-7 where a piece leaves its cell; the exponential 1e-9 where the stencil ends; and a mean of up to
    // a hundred pieces rounds to a few 1e-7.
    let mut tally = Tally::new(&format!("{} over a cut segment", kernel.name()), absolute(2e-6));
    for _ in 0..400 {
        let from = Point::<2>::from_fn(|_, _| stream.between(-10.0, 10.0) as f32);
        let reach = [0.3, 3.0, 20.0][stream.below(3)];
        let to = from + Point::<2>::from_fn(|_, _| stream.between(-reach, reach) as f32);
        let (from_m, to_m) = (wide(&from), wide(&to));
        let along_m = [to_m[0] - from_m[0], to_m[1] - from_m[1]];
        let mut sums = BTreeMap::new();
        for (begin, end) in basis.lattice.cut(from, to) {
            let (a, b) = (wide(&begin), wide(&end));
            let share = (b[0] - a[0]).hypot(b[1] - a[1]) / along_m[0].hypot(along_m[1]);
            let place = Place::Segment { from_m: begin, to_m: end };
            let features = basis.features_of(&place, None).expect("near the origin");
            for (offset, value) in offsets([stencil; 2]).zip(&features.values) {
                let first = features.stencil.first;
                let node = [first[0] + offset[0] as i32, first[1] + offset[1] as i32];
                *sums.entry(node).or_insert(0.0) += share * f64::from(*value);
            }
        }
        let average = Average::new(&bump, &Extent { along_m, ..Extent::POINT }, 1);
        for (node, sum) in sums {
            let displacement = core::array::from_fn(|axis| {
                let origin = f64::from(basis.lattice.origin_m[axis]);
                0.5 * (from_m[axis] + to_m[axis]) - origin - f64::from(node[axis]) * f64::from(SPACING_M)
            });
            tally.add(sum as f32, average.at(&displacement), &format!("node {node:?} of {from:?} to {to:?}"));
        }
    }
    tally.finish();
}

#[test]
fn of_cut_segments() {
    pieces_are_the_whole(KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT), 4);
    // exp(−(3 spacings)²/g) = 2e-10.
    pieces_are_the_whole(KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: 0.4 }), 6);
}
