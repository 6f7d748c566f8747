//! Just enough dense linear algebra.

/// A square matrix, row by row.
pub type Matrix = Vec<Vec<f64>>;

/// The upper Cholesky factor `U` of a symmetric positive definite matrix, `A = UᵀU`.
#[derive(Clone, Debug)]
pub struct Factor {
    upper: Matrix,
}

impl Factor {
    /// Factors a matrix.
    ///
    /// # Errors
    /// The row of the first pivot that is not a positive number.
    pub fn of(matrix: &Matrix) -> Result<Self, usize> {
        let mut upper = matrix.clone();
        let n = upper.len();
        for i in 0..n {
            let (done, below) = upper.split_at_mut(i + 1);
            let row = &mut done[i];
            let pivot = row[i];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(i);
            }
            let root = pivot.sqrt();
            row[..i].fill(0.0);
            for value in &mut row[i..] {
                *value /= root;
            }
            for j in i + 1..n {
                let factor = row[j];
                if factor != 0.0 {
                    for (target, source) in below[j - i - 1][j..].iter_mut().zip(&row[j..]) {
                        *target -= factor * source;
                    }
                }
            }
        }
        Ok(Self { upper })
    }

    /// `ln |A|`.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        self.upper.iter().enumerate().map(|(i, row)| 2.0 * row[i].ln()).sum()
    }

    /// `A⁻¹ = U⁻¹U⁻ᵀ`.
    #[must_use]
    pub fn inverse(&self) -> Matrix {
        let n = self.upper.len();
        // Rows of L⁻¹, L = Uᵀ, by forward substitution.
        let mut lower: Matrix = Vec::with_capacity(n);
        for i in 0..n {
            let mut row = vec![0.0; n];
            row[i] = 1.0;
            for (k, above) in lower.iter().enumerate() {
                let factor = self.upper[k][i];
                if factor != 0.0 {
                    for (target, source) in row[..=k].iter_mut().zip(&above[..=k]) {
                        *target -= factor * source;
                    }
                }
            }
            for value in &mut row[..=i] {
                *value /= self.upper[i][i];
            }
            lower.push(row);
        }
        let mut inverse = vec![vec![0.0; n]; n];
        for row in &lower {
            for (target, &factor) in inverse.iter_mut().zip(row) {
                if factor != 0.0 {
                    for (t, s) in target.iter_mut().zip(row) {
                        *t += factor * s;
                    }
                }
            }
        }
        inverse
    }
}

/// `A x`.
#[must_use]
pub fn times(a: &Matrix, x: &[f64]) -> Vec<f64> {
    a.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

/// `xᵀA x`.
#[must_use]
pub fn quadratic(a: &Matrix, x: &[f64]) -> f64 {
    let present: Vec<usize> = (0..x.len()).filter(|i| x[*i] != 0.0).collect();
    present.iter().map(|&i| x[i] * present.iter().map(|&j| a[i][j] * x[j]).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_the_identity() {
        let n = 9;
        let a: Matrix = (0..n)
            .map(|i| (0..n).map(|j| if i == j { 3.0 } else { 1.0 / (1.0 + (i as f64 - j as f64).powi(2)) }).collect())
            .collect();
        let inverse = Factor::of(&a).unwrap().inverse();
        for i in 0..n {
            let column: Vec<f64> = inverse.iter().map(|row| row[i]).collect();
            for (j, value) in times(&a, &column).iter().enumerate() {
                assert!((value - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn determinant_and_failure_of_two_by_two() {
        let factor = Factor::of(&vec![vec![2.0, 1.0], vec![1.0, 3.0]]).unwrap();
        assert!((factor.log_determinant() - 5.0_f64.ln()).abs() < 1e-15);
        assert_eq!(Factor::of(&vec![vec![1.0, 2.0], vec![2.0, 1.0]]).unwrap_err(), 1);
    }
}
