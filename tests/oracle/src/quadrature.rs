//! Quadrature rules and the little linear algebra that puts them where an integrand lives, in `f64`.
#![allow(clippy::needless_range_loop, reason = "indices as the formulas have them")]

/// A small matrix, row by row.
pub type Square<const D: usize> = [[f64; D]; D];

/// Gauss–Legendre nodes and weights on `[−½, ½]`, exact to degree `2·count − 1`: Newton's method on the polynomial's
/// three-term recursion.
#[must_use]
pub(super) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    (0..count)
        .map(|i| {
            let mut x = (core::f64::consts::PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..50 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=count {
                    let k = k as f64;
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                slope = count as f64 * (x * value - before) / (x * x - 1.0);
                x -= value / slope;
            }
            (0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The standard normal by the trapezoidal rule over `±reach`: nodes and weights that sum to 1.
#[must_use]
pub(super) fn normal_trapezoid(reach: f64, step: f64) -> Vec<(f64, f64)> {
    let half = (reach / step).ceil() as i64;
    let node = |i: i64| i as f64 * reach / half as f64;
    let total: f64 = (-half..=half).map(|i| (-0.5 * node(i) * node(i)).exp()).sum();
    (-half..=half).map(|i| (node(i), (-0.5 * node(i) * node(i)).exp() / total)).collect()
}

/// The lower triangular `L` with `LLᵀ = A`, `A` positive semidefinite: a column without a pivot is zero.
#[must_use]
pub(super) fn lower_root<const D: usize>(a: &Square<D>) -> Square<D> {
    let mut root = [[0.0; D]; D];
    for j in 0..D {
        let rest = a[j][j] - (0..j).map(|k| root[j][k] * root[j][k]).sum::<f64>();
        if rest <= 1e-15 * a[j][j] {
            continue;
        }
        for i in j..D {
            let entry = a[i][j] - (0..j).map(|k| root[i][k] * root[j][k]).sum::<f64>();
            root[i][j] = entry / rest.sqrt();
        }
    }
    root
}

/// The inverse of a lower triangular matrix without a zero on its diagonal.
#[must_use]
pub(super) fn lower_inverse<const D: usize>(lower: &Square<D>) -> Square<D> {
    let mut inverse = [[0.0; D]; D];
    for column in 0..D {
        for row in column..D {
            let unit = f64::from(u8::from(row == column));
            let known: f64 = (column..row).map(|k| lower[row][k] * inverse[k][column]).sum();
            inverse[row][column] = (unit - known) / lower[row][row];
        }
    }
    inverse
}

/// `A Bᵀ`.
#[must_use]
pub(super) fn times_transposed<const D: usize>(a: &Square<D>, b: &Square<D>) -> Square<D> {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..D).map(|k| a[i][k] * b[j][k]).sum()))
}

/// `A x`.
#[must_use]
pub(super) fn apply<const D: usize>(a: &Square<D>, x: &[f64; D]) -> [f64; D] {
    core::array::from_fn(|i| (0..D).map(|k| a[i][k] * x[k]).sum())
}

/// Eigenvalues of a symmetric matrix and, row by row, its eigenvectors: Jacobi's rotations.
#[must_use]
pub(super) fn eigen<const D: usize>(symmetric: &Square<D>) -> ([f64; D], Square<D>) {
    let mut a = *symmetric;
    let mut rows: Square<D> = core::array::from_fn(|i| core::array::from_fn(|j| f64::from(u8::from(i == j))));
    for _ in 0..20 {
        for p in 0..D {
            for q in p + 1..D {
                let angle = 0.5 * (2.0 * a[p][q]).atan2(a[q][q] - a[p][p]);
                let (s, c) = angle.sin_cos();
                // Rows p and q of both, then columns p and q of A.
                for matrix in [&mut a, &mut rows] {
                    for k in 0..D {
                        let (x, y) = (matrix[p][k], matrix[q][k]);
                        (matrix[p][k], matrix[q][k]) = (c * x - s * y, s * x + c * y);
                    }
                }
                for row in &mut a {
                    let (x, y) = (row[p], row[q]);
                    (row[p], row[q]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    (core::array::from_fn(|i| a[i][i]), rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_have_the_moments_of_their_measures() {
        let moment = |rule: &[(f64, f64)], power| rule.iter().map(|(x, w)| w * x.powi(power)).sum::<f64>();
        for power in 0..16 {
            let exact = if power % 2 == 1 { 0.0 } else { 0.5_f64.powi(power) / f64::from(power + 1) };
            assert!((moment(&gauss_legendre(8), power) - exact).abs() < 1e-15, "{power}");
        }
        for (power, exact) in [(0, 1.0), (1, 0.0), (2, 1.0), (4, 3.0), (6, 15.0)] {
            assert!((moment(&normal_trapezoid(9.0, 0.5), power) - exact).abs() < 1e-12, "{power}");
        }
    }

    #[test]
    fn roots_and_eigenvectors_make_the_matrix_again() {
        let a = [[2.0, 0.3, -0.4], [0.3, 1.0, 0.2], [-0.4, 0.2, 0.7]];
        let root = lower_root(&a);
        let again = times_transposed(&root, &root);
        let (values, vectors) = eigen(&a);
        let identity = times_transposed(&lower_inverse(&root), &core::array::from_fn(|i| root.map(|row| row[i])));
        for i in 0..3 {
            for j in 0..3 {
                assert!((again[i][j] - a[i][j]).abs() < 1e-15);
                assert!((identity[i][j] - f64::from(u8::from(i == j))).abs() < 1e-14);
                let sum: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((sum - a[i][j]).abs() < 1e-14);
            }
        }
    }
}
