//! Nyström features (Williams and Seeger 2001): `φ(x) = K⁻½ k(x)`, where `K` is the kernel between all inducing points and
//! `k(x)` that between them and `x`, so that `φ(x)ᵀφ(z) = k(x, z)` wherever one of the two is an inducing point.
//!
//! On a rectangle of points the squared exponential is a product of one along x and one along y, so `K` is a Kronecker product of
//! two small matrices and `K⁻½` that of their inverse square roots: the features of any number of inducing points cost little
//! more than writing them down. The symmetric root (by eigendecomposition) keeps each feature near its point: what it is further
//! away is small and dropped, so that rows are sparse and weights have rates and averages of their own.

use faer::{Mat, Side};

use super::{Features, Rows};
use crate::baselines::{Failed, Setup};

/// Most inducing points: rows of a scan are kept at once.
const MAX_POINTS: f32 = 1e5;
/// Most along an axis: what is decomposed is as wide.
const MAX_ALONG_AXIS: f64 = 2e3;
/// Length scale in spacings.
const LENGTH_SCALE: f64 = 0.7;
/// Features below this are dropped.
const LEAST_FEATURE: f32 = 1e-3;
/// Added to the diagonal along either axis.
const JITTER: f64 = 1e-6;

pub(super) struct Nystrom {
    spacing_m: f64,
    axes: [Axis; 2],
    /// Of the point at hand.
    along: [Vec<f32>; 2],
}

/// The inducing points along an axis.
struct Axis {
    first_m: f64,
    count: usize,
    /// `K⁻½` of this axis, row after row.
    whitening: Vec<f64>,
}

impl Nystrom {
    pub(super) fn new(setup: &Setup) -> Result<Self, Failed> {
        if !(1.0..=MAX_POINTS).contains(&setup.size) {
            return Err(Failed(format!("{} inducing points are not between 1 and {MAX_POINTS}", setup.size)));
        }
        let [min_m, max_m] = setup.area_m.map(|corner| corner.map(f64::from));
        let size_m = [0, 1].map(|axis| max_m[axis] - min_m[axis]);
        let spacing_m = (size_m[0] * size_m[1] / f64::from(setup.size)).sqrt();
        let counts = size_m.map(|size_m| (size_m / spacing_m).round().max(1.0));
        if !(spacing_m > 0.0 && spacing_m.is_finite() && counts.iter().all(|count| *count <= MAX_ALONG_AXIS)) {
            return Err(Failed(format!("no {} inducing points over {min_m:?} to {max_m:?} m", setup.size)));
        }
        let axis = |axis: usize| {
            let count = counts[axis] as usize;
            let first_m = (min_m[axis] + max_m[axis] - spacing_m * (count - 1) as f64) / 2.0;
            Ok(Axis { first_m, count, whitening: whitening(count)? })
        };
        let axes = [axis(0)?, axis(1)?];
        let along = [0, 1].map(|axis| vec![0.0; axes[axis].count]);
        Ok(Self { spacing_m, axes, along })
    }
}

/// `k(d) = exp(−d²/2ℓ²)`, `d` in spacings.
fn kernel(d: f64) -> f64 {
    (-d * d / (2.0 * LENGTH_SCALE * LENGTH_SCALE)).exp()
}

/// `K⁻½` of so many points a spacing apart.
fn whitening(count: usize) -> Result<Vec<f64>, Failed> {
    let jitter = |i, j| if i == j { JITTER } else { 0.0 };
    let covariance = Mat::from_fn(count, count, |i, j| kernel(i as f64 - j as f64) + jitter(i, j));
    let failed = |_| Failed(format!("the kernel of {count} points has no eigendecomposition"));
    let decomposition = covariance.self_adjoint_eigen(Side::Lower).map_err(failed)?;
    let (vectors, values) = (decomposition.U(), decomposition.S());
    let scaled = Mat::from_fn(count, count, |i, k| vectors[(i, k)] / values[k].max(JITTER).sqrt());
    let root = &scaled * vectors.transpose();
    Ok((0..count * count).map(|at| root[(at / count, at % count)]).collect())
}

impl Axis {
    fn features(&self, x_m: f32, spacing_m: f64, features: &mut [f32]) {
        /// Where the kernel is below 1e-16.
        const REACH: f64 = 9.0 * LENGTH_SCALE;
        let x = (f64::from(x_m) - self.first_m) / spacing_m;
        let last = self.count as f64;
        let near = (x - REACH).clamp(0.0, last) as usize..(x + REACH + 1.0).clamp(0.0, last) as usize;
        for (feature, row) in features.iter_mut().zip(self.whitening.chunks_exact(self.count)) {
            *feature = near.clone().map(|j| row[j] * kernel(x - j as f64)).sum::<f64>() as f32;
        }
    }
}

impl Features for Nystrom {
    const EPOCHS: usize = 5;
    const RATE: f32 = 2.0;
    const FIRST_SQUARES: f32 = 1e-2;

    fn count(&self) -> usize {
        self.axes[0].count * self.axes[1].count
    }

    fn description(&self) -> String {
        format!("inducing points {:.2} m apart", self.spacing_m)
    }

    fn bytes(&self) -> usize {
        self.axes.iter().map(|axis| size_of_val(&axis.whitening[..])).sum()
    }

    fn append(&mut self, points_m: &[[f32; 2]], rows: &mut Rows) {
        for point_m in points_m {
            for (axis, along) in self.along.iter_mut().enumerate() {
                self.axes[axis].features(point_m[axis], self.spacing_m, along);
            }
            let [along_x, along_y] = &self.along;
            for (row, y) in along_y.iter().enumerate().filter(|(_, y)| y.abs() >= LEAST_FEATURE) {
                for (column, x) in along_x.iter().enumerate() {
                    if (x * y).abs() >= LEAST_FEATURE {
                        rows.indices.push((row * along_x.len() + column) as u32);
                        rows.values.push(x * y);
                    }
                }
            }
            rows.end_row();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Row, *};
    use crate::baselines::test_support::setup;

    fn features(size: f32) -> Nystrom {
        Nystrom::new(&setup([[-3.0, 1.0], [4.0, 6.0]], size)).unwrap()
    }

    fn rows(features: &mut Nystrom, points_m: &[[f32; 2]]) -> Vec<Vec<f64>> {
        let mut rows = Rows::default();
        features.append(points_m, &mut rows);
        let dense = |row: usize| {
            let mut dense = vec![0.0; features.count()];
            match rows.get(row) {
                Row::Dense(_) => panic!("rows are sparse"),
                Row::Sparse(indices, values) => {
                    indices.iter().zip(values).for_each(|(index, value)| dense[*index as usize] = f64::from(*value));
                }
            }
            dense
        };
        (0..points_m.len()).map(dense).collect()
    }

    /// Against the kernel itself, in the plane and without products: the inner product of an inducing point's features and any
    /// point's is the kernel between them.
    #[test]
    fn inner_products_with_inducing_points_are_the_kernel() {
        // What is dropped: at most 35 features below 1e-3, each beside one no larger than 1, most of them far smaller.
        const TOLERANCE: f64 = 2e-3;
        let mut features = features(35.0);
        assert_eq!(features.count(), 35);
        let spacing_m = features.spacing_m;
        let inducing: Vec<[f32; 2]> =
            (0..5).flat_map(|row| (0..7).map(move |column| [-2.5 + column as f32, 1.5 + row as f32])).collect();
        let mut asked = inducing.clone();
        asked.extend([[0.3, 2.2], [-2.9, 5.9], [4.0, 1.0], [0.0, 9.0], [1e30, -1e30]]);
        let (at_inducing, at_asked) = (rows(&mut features, &inducing), rows(&mut features, &asked));
        for (z_m, z) in inducing.iter().zip(&at_inducing) {
            for (x_m, x) in asked.iter().zip(&at_asked) {
                let product: f64 = z.iter().zip(x).map(|(a, b)| a * b).sum();
                let d2: f64 = (0..2).map(|axis| f64::from(z_m[axis] - x_m[axis]).powi(2)).sum();
                let length_scale_m = LENGTH_SCALE * spacing_m;
                let expected = (-d2 / (2.0 * length_scale_m * length_scale_m)).exp();
                assert!((product - expected).abs() < TOLERANCE, "{z_m:?} {x_m:?}: {product}, not {expected}");
            }
        }
    }

    #[test]
    fn nonsense_is_refused_and_one_point_is_enough() {
        assert_eq!(features(1.0).count(), 1);
        for size in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e9] {
            assert!(Nystrom::new(&setup([[0.0, 0.0], [9.0, 9.0]], size)).is_err(), "{size}");
        }
        assert!(Nystrom::new(&setup([[0.0, 0.0], [1e30, 1e-30]], 100.0)).is_err());
    }
}
