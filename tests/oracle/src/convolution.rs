//! A kernel averaged over a Gaussian, a box and a segment at once, by quadrature in `f64`.

use super::{
    Kernel,
    quadrature::{Square, apply, eigen, gauss_legendre, lower_inverse, lower_root, normal_trapezoid, times_transposed},
};

/// A function of the displacement, 1 at its peak.
#[derive(Clone, Debug, PartialEq)]
pub enum Bump<const D: usize> {
    /// `Σ weight · exp(−dᵀ G⁻¹ d)`, eq. (9); each pair a weight and a `G`, m².
    Exponentials(Vec<(f64, Square<D>)>),
    /// `Πᵢ β(dᵢ/h)/β(0)`, β the cardinal cubic B-spline.
    Spline {
        /// `h`, metres.
        spacing_m: f64,
    },
}

/// What a kernel is averaged over, all of it at once: `E[k(d + e + Σ ζᵢ sᵢ + ζ v)]`, `e ~ N(0, C)`, every `ζ` uniform in
/// `[−½, ½]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent<const D: usize> {
    /// `C`, m²: positive semidefinite.
    pub covariance_m2: Square<D>,
    /// `s`, the sides of a box, metres.
    pub sides_m: [f64; D],
    /// `v`, a segment, metres.
    pub along_m: [f64; D],
}

impl<const D: usize> Extent<D> {
    /// A point.
    pub const POINT: Self = Self { covariance_m2: [[0.0; D]; D], sides_m: [0.0; D], along_m: [0.0; D] };
}

/// An average, prepared once for many displacements.
///
/// Exponentials: in coordinates in which the kernel is `exp(−|t|²)` and `C` is diagonal, the average over the Gaussian is a
/// product of trapezoidal sums over ±9 standard deviations; the box and the segment are composite Gauss–Legendre sums of
/// it, eight nodes to each piece no longer than 1.5 widths. No pieces further than eight widths away are summed (1e-28).
///
/// Splines: piece by piece between the knots with nodes enough for the polynomial, and a tensor trapezoid over ±7 standard
/// deviations.
///
/// With `fineness` 2 everything is done with twice the nodes along each direction, which tells how exact it is with 1.
#[derive(Clone, Debug)]
pub struct Average<const D: usize> {
    parts: Vec<Exponential<D>>,
    spline: Option<Spline<D>>,
}

impl<const D: usize> Average<D> {
    /// Prepares an average.
    #[must_use]
    pub fn new(bump: &Bump<D>, extent: &Extent<D>, fineness: usize) -> Self {
        match bump {
            Bump::Exponentials(parts) => {
                let parts = parts.iter().map(|(weight, shape)| Exponential::new(*weight, shape, extent, fineness));
                Self { parts: parts.collect(), spline: None }
            }
            Bump::Spline { spacing_m } => {
                Self { parts: Vec::new(), spline: Some(Spline::new(*spacing_m, extent, fineness)) }
            }
        }
    }

    /// The average at the displacement of the middle, metres.
    #[must_use]
    pub fn at(&self, displacement_m: &[f64; D]) -> f64 {
        self.parts.iter().map(|part| part.at(displacement_m)).sum::<f64>()
            + self.spline.as_ref().map_or(0.0, |spline| spline.at(displacement_m))
    }

    /// Its derivative, per metre, by central differences of fourth order.
    #[must_use]
    pub fn gradient(&self, displacement_m: &[f64; D], step_m: f64) -> [f64; D] {
        core::array::from_fn(|axis| {
            let difference = |step: f64| {
                let at = |step: f64| {
                    let mut moved = *displacement_m;
                    moved[axis] += step;
                    self.at(&moved)
                };
                (at(step) - at(-step)) / (2.0 * step)
            };
            (4.0 * difference(step_m) - difference(2.0 * step_m)) / 3.0
        })
    }
}

#[derive(Clone, Debug)]
struct Exponential<const D: usize> {
    weight: f64,
    /// From metres to the coordinates in which everything is diagonal.
    to_diagonal: Square<D>,
    /// The Gaussian along each of those: how far, and with which weight.
    gaussian: [Vec<(f64, f64)>; D],
    /// How wide the blurred kernel is along each.
    widths: [f64; D],
    /// The box's sides and the segment there, the longest first, and their lengths in widths.
    directions: Vec<([f64; D], f64)>,
    rule: Vec<(f64, f64)>,
    fineness: usize,
}

impl<const D: usize> Exponential<D> {
    fn new(weight: f64, shape: &Square<D>, extent: &Extent<D>, fineness: usize) -> Self {
        let whiten = lower_inverse(&lower_root(shape));
        let whitened = times_transposed(&times_transposed(&whiten, &extent.covariance_m2), &whiten);
        let (variances, vectors) = eigen(&whitened);
        let columns: Square<D> = core::array::from_fn(|i| whiten.map(|row| row[i]));
        let to_diagonal = times_transposed(&vectors, &columns);
        let widths = variances.map(|variance| (1.0 + 2.0 * variance.max(0.0)).sqrt());
        let gaussian = core::array::from_fn(|i| {
            if variances[i] <= 0.0 {
                return vec![(0.0, 1.0)];
            }
            // exp(−z²/2 − (t + sz)²) is a bell of deviation 1/width: a step of 0.9 of it errs by exp(−2π²/0.81) = 3e-11.
            let rule = normal_trapezoid(9.0, 0.9 / widths[i] / fineness as f64);
            rule.iter().map(|(z, weight)| (z * variances[i].sqrt(), *weight)).collect()
        });
        let along = (0..D).map(|axis| {
            let mut side = [0.0; D];
            side[axis] = extent.sides_m[axis];
            side
        });
        let mut directions: Vec<_> = along
            .chain([extent.along_m])
            .map(|direction| {
                let direction = apply(&to_diagonal, &direction);
                (direction, norm(&core::array::from_fn::<_, D, _>(|i| direction[i] / widths[i])))
            })
            .filter(|(_, length)| *length > 0.0)
            .collect();
        directions.sort_by(|a, b| b.1.total_cmp(&a.1));
        Self { weight, to_diagonal, gaussian, widths, directions, rule: gauss_legendre(8), fineness }
    }

    fn at(&self, displacement_m: &[f64; D]) -> f64 {
        self.weight * self.over(&self.directions, &apply(&self.to_diagonal, displacement_m))
    }

    fn over(&self, directions: &[([f64; D], f64)], at: &[f64; D]) -> f64 {
        let Some(((direction, length), rest)) = directions.split_first() else { return self.blurred(at) };
        let pieces = (length / 1.5).ceil() as usize * self.fineness;
        let moved = |by: f64| core::array::from_fn::<_, D, _>(|i| at[i] + direction[i] * by);
        let reach = 8.0 + 0.5 * (length / pieces as f64 + rest.iter().map(|(_, length)| length).sum::<f64>());
        let mut sum = 0.0;
        for piece in 0..pieces {
            let middle = (piece as f64 + 0.5) / pieces as f64 - 0.5;
            let there = moved(middle);
            if norm(&core::array::from_fn::<_, D, _>(|i| there[i] / self.widths[i])) > reach {
                continue;
            }
            for (x, weight) in &self.rule {
                sum += weight * self.over(rest, &moved(middle + x / pieces as f64));
            }
        }
        sum / pieces as f64
    }

    fn blurred(&self, at: &[f64; D]) -> f64 {
        let axes = at.iter().zip(&self.gaussian);
        axes.map(|(t, rule)| rule.iter().map(|(s, weight)| weight * (-(t + s) * (t + s)).exp()).sum::<f64>()).product()
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[derive(Clone, Debug)]
struct Spline<const D: usize> {
    spacing_m: f64,
    extent: Extent<D>,
    /// The Gaussian's places, metres, and weights.
    gaussian: Vec<([f64; D], f64)>,
    rule: Vec<(f64, f64)>,
}

impl<const D: usize> Spline<D> {
    fn new(spacing_m: f64, extent: &Extent<D>, fineness: usize) -> Self {
        let mut gaussian = vec![([0.0; D], 1.0)];
        let root = lower_root(&extent.covariance_m2);
        let rule = normal_trapezoid(7.0, 0.2 / fineness as f64);
        for column in (0..D).filter(|j| root[*j][*j] > 0.0) {
            let all = gaussian.iter().flat_map(|(place, weight)| {
                let moved = |z: f64| core::array::from_fn(|i| place[i] + root[i][column] * z);
                rule.iter().map(move |(z, w)| (moved(*z), weight * w))
            });
            gaussian = all.collect();
        }
        Self { spacing_m, extent: *extent, gaussian, rule: gauss_legendre(8 * fineness) }
    }

    fn at(&self, displacement_m: &[f64; D]) -> f64 {
        let places = self.gaussian.iter().map(|(place, weight)| {
            let d = core::array::from_fn(|i| displacement_m[i] + place[i]);
            // Further than the spline, the box and the segment reach together.
            let near = |i: usize| {
                let reach = 2.0 * self.spacing_m + 0.5 * (self.extent.sides_m[i] + self.extent.along_m[i].abs());
                d[i].abs() < reach
            };
            if (0..D).all(near) { weight * self.over_segment(&d) } else { 0.0 }
        });
        places.sum()
    }

    fn over_segment(&self, d: &[f64; D]) -> f64 {
        let Extent { sides_m, along_m, .. } = &self.extent;
        if along_m.iter().all(|v| *v == 0.0) {
            return self.over_box(d);
        }
        let mut breaks = vec![-0.5, 0.5];
        for axis in (0..D).filter(|axis| along_m[*axis] != 0.0) {
            for knot in -2..=2 {
                for edge in [-0.5, 0.5] {
                    let place = f64::from(knot) * self.spacing_m + edge * sides_m[axis];
                    breaks.push(((place - d[axis]) / along_m[axis]).clamp(-0.5, 0.5));
                }
            }
        }
        self.pieces(breaks, |x| self.over_box(&core::array::from_fn(|i| d[i] + along_m[i] * x)))
    }

    fn over_box(&self, d: &[f64; D]) -> f64 {
        let kernel = Kernel::CubicBSpline { spacing_m: self.spacing_m };
        let mut product = 1.0;
        for (d, side) in d.iter().zip(&self.extent.sides_m) {
            product *= if *side == 0.0 {
                kernel.value(&[*d])
            } else {
                let mut breaks = vec![-0.5, 0.5];
                breaks.extend((-2..=2).map(|k| ((f64::from(k) * self.spacing_m - d) / side).clamp(-0.5, 0.5)));
                self.pieces(breaks, |x| kernel.value(&[d + side * x]))
            };
            if product == 0.0 {
                break;
            }
        }
        product
    }

    /// `∫ f` over `[−½, ½]`, piece by piece.
    fn pieces(&self, mut breaks: Vec<f64>, f: impl Fn(f64) -> f64) -> f64 {
        breaks.sort_by(f64::total_cmp);
        let mut sum = 0.0;
        for pair in breaks.windows(2).filter(|pair| pair[1] > pair[0]) {
            let (middle, length) = (0.5 * (pair[0] + pair[1]), pair[1] - pair[0]);
            sum += length * self.rule.iter().map(|(x, weight)| weight * f(middle + length * x)).sum::<f64>();
        }
        sum
    }
}
