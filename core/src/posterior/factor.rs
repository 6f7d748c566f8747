//! Cholesky on the band, in scratch: `Λ = UᵀU`, and the triangular solves.
//!
//! Left-looking, row by row. Each row of `U` is followed by as many zeros (`LD = 2B`), so that a source row shifted by `k`
//! can be read over a full panel of the target row: fixed lengths, operands in registers, no masks.
//!
//! These loops are `inline(always)` so that a caller compiled for wider vectors gets them in its own instruction set.

use super::{Band, NotPositiveDefinite, Row, Rows, Scratch, runs::add_outer};

/// Covers the columns `0..$width` of a target row with panels that are held in registers while their sources stream by, and
/// calls `$body` with each: as many as fit of the first width, then of the second, … The last width must be 1.
///
/// How wide is the processor's to say, and changes no bit of the result. `vectors` fill those of SSE2, AVX2 or NEON; `scalars`
/// leave a processor with 32 single registers room for a weight and what is being loaded.
macro_rules! for_each_panel {
    ($width:expr, vectors [$($vector:literal),*], scalars [$($scalar:literal),*], |$start:ident, $N:ident| $body:block) => {{
        let mut $start = 0;
        #[cfg(any(target_feature = "sse2", target_feature = "neon"))]
        {
            $(while $width - $start >= $vector {
                const $N: usize = $vector;
                $body
                $start += $vector;
            })*
        }
        #[cfg(not(any(target_feature = "sse2", target_feature = "neon")))]
        {
            $(while $width - $start >= $scalar {
                const $N: usize = $scalar;
                $body
                $start += $scalar;
            })*
        }
    }};
}
pub(super) use for_each_panel;

/// `target −= Σ weight · source` over the sources, the target held in registers meanwhile.
#[inline(always)]
pub(super) fn subtract_sources<'s, const N: usize>(
    target: &mut [f32; N],
    sources: impl Iterator<Item = (f32, &'s [f32; N])>,
) {
    let mut panel = *target;
    for (weight, source) in sources {
        for (sum, value) in panel.iter_mut().zip(source) {
            *sum -= weight * value;
        }
    }
    *target = panel;
}

/// The sum of products over the shorter of the two, in eight lanes: vectorises, and rounds less than one after the other.
#[inline(always)]
pub(super) fn dot(left: &[f32], right: &[f32]) -> f32 {
    let len = left.len().min(right.len());
    let mut lanes = [0.0; 8];
    let ((left, left_rest), (right, right_rest)) = (left[..len].as_chunks::<8>(), right[..len].as_chunks::<8>());
    for (a, b) in left.iter().zip(right) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    let rest: f32 = left_rest.iter().zip(right_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

impl<const M: usize, const B: usize> Scratch<M, B> {
    /// Length of a row of `work`.
    pub(super) const LD: usize = 2 * B;

    /// Assembles `Λ₋ + Σ c φφᵀ` from the rows' sites and factors it.
    ///
    /// Hundreds of observations of one and the same spot make `Λ` so ill-conditioned that its rounding alone takes the
    /// prior away. Where a factorisation fails, it is done again with `j·Λᵢᵢ` added to the diagonal, for the `j` of
    /// [`INFLATIONS`]: as if each weight had been observed to be where it is, that much. Answers the `j` it took, 0 in
    /// ordinary updates.
    ///
    /// `refused` is how many of them failed for these rows before: they are not tried again, so that all passes of an update
    /// together make at most as many factorisations as passes and two more.
    ///
    /// # Errors
    /// The first pivot that is not a positive number, if the largest `j` did not help.
    #[inline(always)]
    pub(crate) fn factor(
        &mut self,
        information: &Band<M, B>,
        border: &[f32; M],
        corner: f32,
        rows: &Rows<'_>,
        refused: &mut usize,
    ) -> Result<f32, NotPositiveDefinite> {
        let mut failure = NotPositiveDefinite { row: 0 };
        // The last is tried in any case: the sites are others in each pass.
        for inflation in &INFLATIONS[(*refused).min(INFLATIONS.len() - 1)..] {
            let inflation = *inflation;
            self.assemble(|i| information[i], border, corner);
            for (row, state) in rows.iter() {
                add_outer(&mut self.work, &row, state.site.curvature);
                if row.bias != 0.0 {
                    self.add_border(&row, state.site.curvature);
                }
            }
            if inflation > 0.0 {
                for ([upper, _], inflated) in self.work.iter_mut().zip(&mut self.inflated) {
                    *inflated = inflation * upper[0];
                    upper[0] += *inflated;
                }
                self.inflated_corner = inflation * self.corner;
                self.corner += self.inflated_corner;
            }
            match self.factor_in_place() {
                Ok(()) => return Ok(inflation),
                Err(error) => failure = error,
            }
            *refused += 1;
        }
        Err(failure)
    }

    /// Fills the work rows for [`factor_in_place`](Self::factor_in_place).
    #[inline(always)]
    pub(super) fn assemble(&mut self, row: impl Fn(usize) -> [f32; B], border: &[f32; M], corner: f32) {
        for (i, [upper, padding]) in self.work.iter_mut().enumerate() {
            *upper = row(i);
            padding.fill(0.0);
        }
        self.border = *border;
        self.corner = corner;
    }

    /// Cholesky in the work rows, the bias last.
    ///
    /// # Errors
    /// The first pivot that is not a positive number.
    #[inline(always)]
    pub(super) fn factor_in_place(&mut self) -> Result<(), NotPositiveDefinite> {
        let ld = Self::LD;
        let flat = self.work.as_flattened_mut().as_flattened_mut();
        let (mut corner, border) = (self.corner, &mut self.border);
        for i in 0..M {
            let (done, rest) = flat.split_at_mut(i * ld);
            let Some(row) = rest.first_chunk_mut::<B>() else { break };
            let before = row[0];
            for_each_panel!(B, vectors [24, 16, 8, 1], scalars [16, 8, 4, 1], |start, N| {
                if let Some(target) = row[start..].first_chunk_mut::<N>() {
                    // The row k above contributes U[i−k][k] times its own entries from column k on. These starts lie ld − 1
                    // apart, so that counted from the end the chunks of that length begin with them. It reaches B − k columns
                    // into this row: later panels see fewer sources.
                    let sources = done.rchunks_exact(ld - 1).take(B - 1 - start);
                    subtract_sources(
                        target,
                        sources.map_while(|source| Some((*source.first()?, source[start..].first_chunk()?))),
                    );
                }
            });
            let pivot = row[0];
            // Below this share of the entry it started from, a pivot is nothing but rounding.
            if !(pivot > MIN_PIVOT * before && pivot < f32::INFINITY) {
                return Err(NotPositiveDefinite { row: i });
            }
            let diagonal = libm::sqrtf(pivot);
            let scale = 1.0 / diagonal;
            row[0] = diagonal;
            for value in &mut row[1..] {
                *value *= scale;
            }
            let coupled = border[i] * scale;
            border[i] = coupled;
            if coupled != 0.0 {
                for (later, u) in border[i + 1..].iter_mut().zip(&row[1..]) {
                    *later -= coupled * u;
                }
                corner -= coupled * coupled;
            }
        }
        if !(corner > 0.0 && corner < f32::INFINITY) {
            return Err(NotPositiveDefinite { row: M });
        }
        self.corner = libm::sqrtf(corner);
        Ok(())
    }

    /// `ln |Λ|` of the factored matrix, as an unevaluated sum.
    #[inline(always)]
    pub(crate) fn log_determinant(&self) -> [f32; 2] {
        // Pivots are multiplied in groups so that one logarithm serves four; Kahan's correction keeps the sum's low part.
        let (mut sum, mut low) = (0.0_f32, 0.0_f32);
        let mut add = |value: f32| {
            let corrected = value - low;
            let next = sum + corrected;
            low = (next - sum) - corrected;
            sum = next;
        };
        for group in self.work.chunks(GROUP) {
            add(2.0 * libm::logf(group.iter().map(|row| row[0][0]).product()));
        }
        add(2.0 * libm::logf(self.corner));
        [sum, -low]
    }

    /// Solves `Λ step = Σ g φ` with the factor; the right-hand side comes from the rows' sites.
    #[inline(always)]
    pub(crate) fn solve(&mut self, rows: &Rows<'_>) {
        self.step.fill(0.0);
        self.bias_step = 0.0;
        for (row, state) in rows.iter() {
            row.add_to(state.site.pull, &mut self.step);
            self.bias_step += state.site.pull * row.bias;
        }
        self.solve_in_place();
    }

    /// Replaces `step`, a right-hand side, by the solution.
    #[inline(always)]
    pub(super) fn solve_in_place(&mut self) {
        for i in 0..M {
            let row = &self.work[i][0];
            let solved = self.step[i] / row[0];
            self.step[i] = solved;
            for (later, u) in self.step[i + 1..].iter_mut().zip(&row[1..]) {
                *later -= solved * u;
            }
            self.bias_step -= solved * self.border[i];
        }
        self.bias_step /= self.corner * self.corner;
        for i in (0..M).rev() {
            let row = &self.work[i][0];
            let known = dot(&self.step[i + 1..], &row[1..]);
            self.step[i] = (self.step[i] - known - self.border[i] * self.bias_step) / row[0];
        }
    }

    #[inline(always)]
    fn add_border(&mut self, row: &Row<'_>, weight: f32) {
        row.add_to(weight * row.bias, &mut self.border);
        self.corner += weight * row.bias * row.bias;
    }
}

/// What is added to the diagonal, relative to it, where a factorisation fails: nothing, a few hundred units in the last
/// place, and what holds for any capacity.
const INFLATIONS: [f32; 3] = [0.0, 3e-5, 1e-3];

/// The smallest pivot, relative to the diagonal entry it is left of.
pub(super) const MIN_PIVOT: f32 = 1e-5;

/// Pivots whose product cannot leave `f32`'s range: each is the square root of an information between 1e-18 and 1e18.
const GROUP: usize = 4;
