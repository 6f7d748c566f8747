//! Dense linear algebra that several baselines share: thin names over faer's blocked routines, on one thread.

use faer::{
    Accum, Auto, Conj, Mat, MatMut, MatRef, Par, Spec,
    dyn_stack::{MemBuffer, MemStack},
    linalg::{
        cholesky::llt::{
            factor::{LltParams, cholesky_in_place, cholesky_in_place_scratch},
            inverse::{inverse, inverse_scratch},
        },
        matmul::{
            self,
            triangular::{self, BlockStructure},
        },
        triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place},
    },
};

use super::Failed;

/// `A = L Lᵀ`.
#[derive(Clone)]
pub(super) struct Cholesky {
    /// Its upper triangle means nothing.
    lower: Mat<f64>,
}

impl Cholesky {
    /// Of a matrix, of which the lower triangle alone is read.
    pub(super) fn of(mut matrix: Mat<f64>) -> Result<Self, Failed> {
        let size = matrix.nrows();
        let params = Spec::<LltParams, f64>::from(<LltParams as Auto<f64>>::auto());
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(size, Par::Seq, params));
        cholesky_in_place(matrix.as_mut(), <_>::default(), Par::Seq, MemStack::new(&mut memory), params)
            .map_err(|error| Failed(format!("a matrix of {size} rows is not positive definite: {error}")))?;
        // A pivot that is not a number is not reported as one that is not positive.
        match (0..size).find(|i| !matrix[(*i, *i)].is_finite()) {
            Some(row) => Err(Failed(format!("row {row} of a matrix of {size} is not finite"))),
            None => Ok(Self { lower: matrix }),
        }
    }

    pub(super) fn size(&self) -> usize {
        self.lower.nrows()
    }

    /// Of `[A B; Bᵀ C]`, of which the lower triangle of `C` alone is read: `L` is its upper left part.
    pub(super) fn extended(&self, mut beside: Mat<f64>, corner: Mat<f64>) -> Result<Self, Failed> {
        let known = self.size();
        self.solve_lower(beside.as_mut());
        let mut left = corner;
        let whole = BlockStructure::Rectangular;
        let (lower, below) = (BlockStructure::TriangularLower, beside.transpose());
        triangular::matmul(left.as_mut(), lower, Accum::Add, below, whole, &beside, whole, -1.0, Par::Seq);
        let left = Self::of(left)?.lower;
        let of = |i: usize, j: usize| match (i < known, j < known) {
            (true, true) => self.lower[(i, j)],
            (false, true) => beside[(j, i - known)],
            (false, false) => left[(i - known, j - known)],
            (true, false) => 0.0,
        };
        let size = known + left.nrows();
        Ok(Self { lower: Mat::from_fn(size, size, of) })
    }

    /// `L⁻¹ B`.
    pub(super) fn solve_lower(&self, right: MatMut<'_, f64>) {
        solve_lower_triangular_in_place(self.lower.as_ref(), right, Par::Seq);
    }

    /// `L⁻¹ B` where `B` is zero above `row`: of both, the rows from there.
    pub(super) fn solve_lower_from(&self, row: usize, right: MatMut<'_, f64>) {
        let rows = self.size() - row;
        solve_lower_triangular_in_place(self.lower.submatrix(row, row, rows, rows), right, Par::Seq);
    }

    /// `L⁻ᵀ B`.
    pub(super) fn solve_upper(&self, right: MatMut<'_, f64>) {
        solve_upper_triangular_in_place(self.lower.transpose(), right, Par::Seq);
    }

    /// `A⁻¹ b`.
    pub(super) fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut solved = column(right);
        self.solve_lower(solved.as_mut());
        self.solve_upper(solved.as_mut());
        solved.col_as_slice(0).to_vec()
    }

    /// `A⁻¹`, both triangles.
    pub(super) fn inverse(&self) -> Mat<f64> {
        let size = self.size();
        let mut out = Mat::zeros(size, size);
        let mut memory = MemBuffer::new(inverse_scratch::<f64>(size, Par::Seq));
        inverse(out.as_mut(), self.lower.as_ref(), Par::Seq, MemStack::new(&mut memory));
        for j in 1..size {
            for i in 0..j {
                out[(i, j)] = out[(j, i)];
            }
        }
        out
    }
}

/// A matrix of one column.
pub(super) fn column(values: &[f64]) -> Mat<f64> {
    Mat::from_fn(values.len(), 1, |i, _| values[i])
}

/// `target += A Aᵀ`, in the lower triangle alone.
pub(super) fn add_gram(target: MatMut<'_, f64>, a: MatRef<'_, f64>) {
    let whole = BlockStructure::Rectangular;
    let lower = BlockStructure::TriangularLower;
    triangular::matmul(target, lower, Accum::Add, a, whole, a.transpose(), whole, 1.0, Par::Seq);
}

/// `A B`.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    matmul::matmul_with_conj(out.as_mut(), Accum::Replace, a, Conj::No, b, Conj::No, 1.0, Par::Seq);
    out
}

/// `Aᵀ b`.
pub(super) fn transposed_times(a: MatRef<'_, f64>, b: &[f64]) -> Vec<f64> {
    let b = column(b);
    product(a.transpose(), b.as_ref()).col_as_slice(0).to_vec()
}

/// Sums of the squares of each column.
pub(super) fn squared_columns(a: &Mat<f64>) -> impl Iterator<Item = f64> {
    (0..a.ncols()).map(|j| a.col_as_slice(j).iter().map(|x| x * x).sum())
}

/// Bytes of the values of a matrix.
pub(super) fn bytes(a: &Mat<f64>) -> usize {
    a.nrows() * a.ncols() * size_of::<f64>()
}

impl Cholesky {
    pub(super) fn bytes(&self) -> usize {
        bytes(&self.lower)
    }
}
