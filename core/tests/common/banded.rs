//! Rows with features at any weights, as the core takes rows: all of one pattern.

use bhm_core::posterior::{Pattern, Row, RowState, Rows};

use super::SparseRow;

/// A row with a place for each weight of a band that holds it, zero where it has no feature.
#[derive(Clone, Debug)]
pub struct BandedRow {
    pub pattern: Pattern,
    pub first: usize,
    pub values: Vec<f32>,
    pub bias: f32,
}

impl BandedRow {
    /// Of a row that fits into a band of `B` among `M` weights.
    pub fn of<const M: usize, const B: usize>(row: &SparseRow, bias: f32) -> Self {
        let len = B.min(M);
        let indices = row.entries.iter().map(|(index, _)| *index as usize);
        let first = indices.min().unwrap_or(0).min(M - len);
        let mut values = vec![0.0; len];
        for (index, value) in &row.entries {
            values[*index as usize - first] = *value;
        }
        Self { pattern: Pattern::contiguous(len), first, values, bias }
    }

    /// Without bias.
    pub fn plain<const M: usize, const B: usize>(row: &SparseRow) -> Self {
        Self::of::<M, B>(row, 0.0)
    }

    pub fn as_row(&self) -> Row<'_> {
        Row { pattern: &self.pattern, first: self.first, values: &self.values, bias: self.bias }
    }
}

/// Does something with rows and their bias features, all of which must be acceptable.
pub fn push_all<'r, const M: usize, const B: usize, T>(
    rows: impl Iterator<Item = (&'r SparseRow, f32)>,
    with: impl FnOnce(&mut Rows<'_>) -> T,
) -> T {
    let (banded, labels): (Vec<_>, Vec<_>) =
        rows.map(|(row, bias)| (BandedRow::of::<M, B>(row, bias), row.occupied)).unzip();
    let pattern = Pattern::contiguous(B.min(M));
    let features: Vec<f32> = banded.iter().flat_map(|row| row.values.iter().copied()).collect();
    let mut states = vec![RowState::ZERO; banded.len()];
    let mut pushed = Rows::new(&pattern, &features, &mut states);
    for (number, (row, occupied)) in banded.iter().zip(labels).enumerate() {
        pushed.push::<M, B>(number, row.first, row.bias, occupied).expect("an acceptable row");
    }
    with(&mut pushed)
}
