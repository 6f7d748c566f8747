//! Rows with features at any weights, as the core takes rows: all of one pattern.

use bhm_core::{
    lattice::Window,
    posterior::{Pattern, Row, RowState, Rows},
};

use super::SparseRow;

/// The pattern of points on a lattice so wide along each axis.
pub fn lattice_pattern<const D: usize>(width: usize, stencil: usize) -> Pattern {
    Window { first: [0; D], width: [width; D] }.pattern(stencil).expect("a stencil")
}

/// A row with a place for each weight of a pattern, zero where it has no feature.
#[derive(Clone, Debug)]
pub struct BandedRow {
    pub pattern: Pattern,
    pub first: usize,
    pub values: Vec<f32>,
    pub bias: f32,
}

impl BandedRow {
    /// Of a row with features at no other of `M` weights than the pattern's, from one of them on: the last that will do.
    pub fn new<const M: usize>(row: &SparseRow, bias: f32, pattern: &Pattern) -> Self {
        let lowest = row.entries.iter().map(|(index, _)| *index as usize).min().unwrap_or(0);
        let offsets: Vec<usize> =
            pattern.starts().iter().flat_map(|start| (0..pattern.run()).map(move |offset| start + offset)).collect();
        let from = |first: usize| {
            let mut values = vec![0.0; offsets.len()];
            for (index, value) in &row.entries {
                let place = offsets.binary_search(&(*index as usize).checked_sub(first)?).ok()?;
                values[place] = *value;
            }
            Some(Self { pattern: *pattern, first, values, bias })
        };
        let last = lowest.min(M - pattern.span());
        (0..=last).rev().find_map(from).unwrap_or_else(|| panic!("{row:?} is not of {pattern:?}"))
    }

    /// Of a row anywhere in a band of `B` among `M` weights.
    pub fn of<const M: usize, const B: usize>(row: &SparseRow, bias: f32) -> Self {
        Self::new::<M>(row, bias, &Pattern::contiguous(B.min(M)))
    }

    pub fn as_row(&self) -> Row<'_> {
        Row { pattern: &self.pattern, first: self.first, values: &self.values, bias: self.bias }
    }
}

/// Does something with rows and their bias features, all of which must be acceptable.
pub fn push_all<'r, const M: usize, const B: usize, T>(
    pattern: &Pattern,
    rows: impl Iterator<Item = (&'r SparseRow, f32)>,
    with: impl FnOnce(&mut Rows<'_>) -> T,
) -> T {
    let (banded, labels): (Vec<_>, Vec<_>) =
        rows.map(|(row, bias)| (BandedRow::new::<M>(row, bias, pattern), row.occupied)).unzip();
    let features: Vec<f32> = banded.iter().flat_map(|row| row.values.iter().copied()).collect();
    let mut states = vec![RowState::ZERO; banded.len()];
    let mut pushed = Rows::new(pattern, &features, &mut states);
    for (number, (row, occupied)) in banded.iter().zip(labels).enumerate() {
        pushed.push::<M, B>(number, row.first, row.bias, occupied).expect("an acceptable row");
    }
    with(&mut pushed)
}
