//! The two products of a row with a banded matrix: `Λ += c φφᵀ` and `φᵀΣφ`.
//!
//! A row of a stencil is sparse in the band, but in a regular way: runs of neighbouring weights, all of the same length, one
//! for each line of the stencil. Run by run the products are small dense blocks of fixed size, whose operands stay in
//! registers with vectors and without. A row that is not made so is taken as runs of one.

use super::{Band, Entry};

/// Storage whose rows begin with the upper half of a band.
pub(super) trait UpperRows<const B: usize> {
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B];
}

impl<const M: usize, const B: usize> UpperRows<B> for Band<M, B> {
    #[inline(always)]
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B] {
        &mut self[row]
    }
}

impl<const M: usize, const B: usize> UpperRows<B> for [[[f32; B]; 2]; M] {
    #[inline(always)]
    fn upper_mut(&mut self, row: usize) -> &mut [f32; B] {
        &mut self[row][0]
    }
}

/// The length of the runs that the row consists of, if it is one of those that stencils have; else 1.
#[inline(always)]
fn run_length(row: &[Entry]) -> usize {
    let neighbours = |pair: &&[Entry]| pair[1].index == pair[0].index.wrapping_add(1);
    let run = 1 + row.windows(2).take_while(neighbours).count();
    // Indices ascend, so that a run of which the ends are that far apart has no gap.
    let whole = |chunk: &[Entry]| chunk[run - 1].index == chunk[0].index.wrapping_add(run as u32 - 1);
    if row.len().is_multiple_of(run) && row.chunks_exact(run).all(whole) { run } else { 1 }
}

/// Calls the function with the run length as a constant; stencils are 4, 6 or 8 wide.
macro_rules! by_run_length {
    ($row:expr, $function:ident::<_, $B:ident>($($argument:expr),*)) => {
        match run_length($row) {
            4 => $function::<4, $B>($($argument),*),
            6 => $function::<6, $B>($($argument),*),
            8 => $function::<8, $B>($($argument),*),
            _ => $function::<1, $B>($($argument),*),
        }
    };
}

/// `matrix += weight · φφᵀ` on the band; φ was checked when it was pushed.
#[inline(always)]
pub(super) fn add_outer<const B: usize>(matrix: &mut impl UpperRows<B>, row: &[Entry], weight: f32) {
    by_run_length!(row, add_blocks::<_, B>(matrix, row, weight));
}

/// `φᵀΣφ` from the upper half of Σ's band, given row by row; pairs outside the band count as zero.
#[inline(always)]
pub(super) fn quadratic_form<'s, const B: usize>(row: &[Entry], upper: impl Fn(usize) -> Option<&'s [f32; B]>) -> f32 {
    by_run_length!(row, sum_blocks::<_, B>(row, upper))
}

/// A run's first weight, and its values.
#[inline(always)]
fn values<const N: usize>(run: &[Entry; N]) -> (usize, [f32; N]) {
    (run[0].index(), run.map(|entry| entry.value))
}

#[inline(always)]
fn add_blocks<const N: usize, const B: usize>(matrix: &mut impl UpperRows<B>, row: &[Entry], weight: f32) {
    let (runs, _) = row.as_chunks::<N>();
    for (number, run) in runs.iter().enumerate() {
        let (first, values_here) = values(run);
        let scaled = values_here.map(|value| weight * value);
        for (i, scaled) in scaled.iter().enumerate() {
            for (target, value) in matrix.upper_mut(first + i).iter_mut().zip(&values_here[i..]) {
                *target += scaled * value;
            }
        }
        for later in &runs[number + 1..] {
            let (later_first, later) = values(later);
            let apart = later_first.wrapping_sub(first);
            for (i, scaled) in scaled.iter().enumerate() {
                let target = matrix.upper_mut(first + i).get_mut(apart.wrapping_sub(i)..);
                let Some(target) = target.and_then(|target| target.first_chunk_mut::<N>()) else { continue };
                for (target, value) in target.iter_mut().zip(&later) {
                    *target += scaled * value;
                }
            }
        }
    }
}

#[inline(always)]
fn sum_blocks<'s, const N: usize, const B: usize>(row: &[Entry], upper: impl Fn(usize) -> Option<&'s [f32; B]>) -> f32 {
    let (runs, _) = row.as_chunks::<N>();
    // Added up block by block: where Σ is large and the variance small, long sums lose it.
    let (mut diagonal, mut pairs) = (0.0, 0.0);
    for (number, run) in runs.iter().enumerate() {
        let (first, here) = values(run);
        let (mut on, mut off) = (0.0, 0.0);
        for i in 0..N {
            let Some(sigma) = upper(first + i) else { continue };
            on += here[i] * (sigma[0] * here[i]);
            for j in i + 1..N {
                off += here[i] * (sigma[j - i] * here[j]);
            }
        }
        diagonal += on;
        pairs += off;
        for later in &runs[number + 1..] {
            let (later_first, later) = values(later);
            let apart = later_first.wrapping_sub(first);
            let mut lanes = [0.0; N];
            for (i, value) in here.iter().enumerate() {
                let sigma = upper(first + i).and_then(|sigma| sigma.get(apart.wrapping_sub(i)..)?.first_chunk::<N>());
                let Some(sigma) = sigma else { continue };
                for ((lane, sigma), later) in lanes.iter_mut().zip(sigma).zip(&later) {
                    *lane += value * (sigma * later);
                }
            }
            pairs += lanes.iter().sum::<f32>();
        }
    }
    // Every pair off the diagonal stands for two.
    2.0 * pairs + diagonal
}
