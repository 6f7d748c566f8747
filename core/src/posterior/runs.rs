//! The two products of a row with a banded matrix: `Λ += c φφᵀ` and `φᵀΣφ`.
//!
//! Run by run of the row's pattern the products are small dense blocks of fixed size, whose operands stay in registers with
//! vectors and without. Runs of another length than those of stencils are taken as runs of one.

use super::{Band, Pattern, Row};

/// Storage whose rows hold the upper half of a band.
pub(super) trait UpperRows<const B: usize> {
    /// The entries `(row, row) … (row, row + B − 1)`.
    fn upper(&self, row: usize) -> &[f32; B];
}

impl<const M: usize, const B: usize> UpperRows<B> for Band<M, B> {
    #[inline(always)]
    fn upper(&self, row: usize) -> &[f32; B] {
        &self[row]
    }
}

/// Storage whose rows begin with the upper half of a band, to be changed.
pub(super) trait UpperRowsMut<const B: usize> {
    /// The entries `(row, row) … (row, row + B − 1)`.
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B];
}

impl<const M: usize, const B: usize> UpperRowsMut<B> for Band<M, B> {
    #[inline(always)]
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B] {
        &mut self[row]
    }
}

impl<const M: usize, const B: usize> UpperRowsMut<B> for [[[f32; B]; 2]; M] {
    #[inline(always)]
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B] {
        &mut self[row][0]
    }
}

/// Calls the function with the run length as a constant; stencils are 2, 4, 6 or 8 wide.
macro_rules! by_run_length {
    ($pattern:expr, $function:ident::<_ $(, $constant:ident)*>($($argument:expr),*)) => {
        match $pattern.run() {
            4 => $function::<4 $(, $constant)*>($($argument),*),
            6 => $function::<6 $(, $constant)*>($($argument),*),
            8 => $function::<8 $(, $constant)*>($($argument),*),
            2 => $function::<2 $(, $constant)*>($($argument),*),
            _ => $function::<1 $(, $constant)*>($($argument),*),
        }
    };
}

/// `matrix += weight · φφᵀ` on the band; φ was checked when it was pushed.
#[inline(always)]
pub(super) fn add_outer<const B: usize>(matrix: &mut impl UpperRowsMut<B>, row: &Row<'_>, weight: f32) {
    by_run_length!(row.pattern, add_blocks::<_, B>(matrix, row, weight));
}

/// `φᵀΣφ` of `L` rows at the same weights, from the upper half of Σ's band; pairs outside the band count as zero. `values` are
/// the rows' features, weight by weight.
#[inline(always)]
pub(super) fn quadratic_forms<const B: usize, const L: usize>(
    pattern: &Pattern,
    first: usize,
    values: &[[f32; L]],
    sigma: &impl UpperRows<B>,
) -> [f32; L] {
    by_run_length!(pattern, sum_blocks::<_, B, L>(pattern, first, values, sigma))
}

/// The first weights of a row's blocks of `N`: its runs, or single weights.
#[inline(always)]
fn starts<const N: usize>(pattern: &Pattern, first: usize) -> impl Iterator<Item = usize> + Clone + use<'_, N> {
    let run = pattern.run();
    let each = if N == 1 { run } else { 1 };
    pattern.starts().iter().flat_map(move |start| (0..each).map(move |offset| first + start + offset))
}

#[inline(always)]
fn add_blocks<const N: usize, const B: usize>(matrix: &mut impl UpperRowsMut<B>, row: &Row<'_>, weight: f32) {
    let (runs, _) = row.values.as_chunks::<N>();
    let mut blocks = starts::<N>(row.pattern, row.first).zip(runs);
    while let Some((first, here)) = blocks.next() {
        let scaled = here.map(|value| weight * value);
        for (i, scaled) in scaled.iter().enumerate() {
            for (target, value) in matrix.upper_mut(first + i).iter_mut().zip(&here[i..]) {
                *target += scaled * value;
            }
        }
        for (later_first, later) in blocks.clone() {
            let apart = later_first - first;
            for (i, scaled) in scaled.iter().enumerate() {
                let target = matrix.upper_mut(first + i).get_mut(apart - i..);
                let Some(target) = target.and_then(|target| target.first_chunk_mut::<N>()) else { continue };
                for (target, value) in target.iter_mut().zip(later) {
                    *target += scaled * value;
                }
            }
        }
    }
}

/// `sum + weight · values`, row by row.
#[inline(always)]
fn add_scaled<const L: usize>(sum: [f32; L], weight: f32, values: &[f32; L]) -> [f32; L] {
    core::array::from_fn(|row| sum[row] + weight * values[row])
}

/// `sum + left · right`, row by row.
#[inline(always)]
fn add_products<const L: usize>(sum: [f32; L], left: &[f32; L], right: &[f32; L]) -> [f32; L] {
    core::array::from_fn(|row| sum[row] + left[row] * right[row])
}

/// The sum of two, row by row.
#[inline(always)]
fn add<const L: usize>(left: [f32; L], right: [f32; L]) -> [f32; L] {
    core::array::from_fn(|row| left[row] + right[row])
}

/// `Σⱼ sumsⱼ · valuesⱼ`, row by row.
#[inline(always)]
fn weighted<const N: usize, const L: usize>(sums: &[[f32; L]; N], values: &[[f32; L]; N]) -> [f32; L] {
    let products: [[f32; L]; N] = core::array::from_fn(|j| core::array::from_fn(|row| sums[j][row] * values[j][row]));
    products.into_iter().reduce(add).unwrap_or([0.0; L])
}

#[inline(always)]
fn sum_blocks<const N: usize, const B: usize, const L: usize>(
    pattern: &Pattern,
    first: usize,
    values: &[[f32; L]],
    sigma: &impl UpperRows<B>,
) -> [f32; L] {
    let (runs, _) = values.as_chunks::<N>();
    let mut blocks = starts::<N>(pattern, first).zip(runs);
    // Added up block by block: where Σ is large and the variance small, long sums lose it.
    let (mut diagonal, mut pairs) = ([0.0; L], [0.0; L]);
    while let Some((first, here)) = blocks.next() {
        // One sum for each later weight, of what the earlier ones have with it.
        let mut sums = [[0.0; L]; N];
        let mut on = [0.0; L];
        for (i, value) in here.iter().enumerate() {
            let sigma = sigma.upper(first + i);
            on = add_products(on, value, &value.map(|value| sigma[0] * value));
            for j in i + 1..N {
                sums[j] = add_scaled(sums[j], sigma[j - i], value);
            }
        }
        diagonal = add(diagonal, on);
        pairs = add(pairs, weighted(&sums, here));
        for (later_first, later) in blocks.clone() {
            let apart = later_first - first;
            let mut sums = [[0.0; L]; N];
            for (i, value) in here.iter().enumerate() {
                let sigma = sigma.upper(first + i).get(apart - i..).and_then(|sigma| sigma.first_chunk::<N>());
                let Some(sigma) = sigma else { continue };
                for (sum, sigma) in sums.iter_mut().zip(sigma) {
                    *sum = add_scaled(*sum, *sigma, value);
                }
            }
            pairs = add(pairs, weighted(&sums, later));
        }
    }
    // Every pair off the diagonal stands for two.
    core::array::from_fn(|row| 2.0 * pairs[row] + diagonal[row])
}
