//! Rows with features at any weights, as the core takes rows: all of one pattern, that of a stencil where they have it.

use bhm_core::posterior::{Pattern, Row, RowState, Rows};

use super::SparseRow;

/// A row with a place for each weight of its pattern, zero where it has no feature.
#[derive(Clone, Debug)]
pub struct BandedRow {
    pub pattern: Pattern,
    pub first: usize,
    pub values: Vec<f32>,
    pub bias: f32,
}

impl BandedRow {
    /// Of a row that fits into a band of `B` among `M` weights, with a place for each weight of the band.
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

    /// Of a row whose features stand where the pattern has them.
    fn with_pattern(row: &SparseRow, bias: f32, pattern: Pattern) -> Self {
        let values = row.entries.iter().map(|(_, value)| *value).collect();
        Self { pattern, first: row.entries[0].0 as usize, values, bias }
    }

    /// Without bias.
    pub fn plain<const M: usize, const B: usize>(row: &SparseRow) -> Self {
        Self::of::<M, B>(row, 0.0)
    }

    pub fn as_row(&self) -> Row<'_> {
        Row { pattern: &self.pattern, first: self.first, values: &self.values, bias: self.bias }
    }
}

/// The pattern of a row, if its features stand in runs of one length.
fn pattern_of(row: &SparseRow) -> Option<Pattern> {
    let first = row.entries.first()?.0;
    let indices: Vec<usize> = row.entries.iter().map(|(index, _)| (index - first) as usize).collect();
    let run = 1 + indices.windows(2).take_while(|pair| pair[1] == pair[0] + 1).count();
    let runs = indices.chunks(run);
    let whole = |chunk: &[usize]| chunk.len() == run && chunk[run - 1] - chunk[0] == run - 1;
    if !runs.clone().all(whole) {
        return None;
    }
    Pattern::new(run, runs.map(|chunk| chunk[0])).ok()
}

/// Does something with rows and their bias features, all of which must be acceptable.
///
/// Rows of one stencil have its pattern, as a map gives it to them; others a place for each weight of the band.
pub fn push_all<'r, const M: usize, const B: usize, T>(
    rows: impl Iterator<Item = (&'r SparseRow, f32)>,
    with: impl FnOnce(&mut Rows<'_>) -> T,
) -> T {
    let rows: Vec<_> = rows.collect();
    let shared = rows.first().and_then(|(row, _)| pattern_of(row));
    let shared = shared.filter(|pattern| rows.iter().all(|(row, _)| pattern_of(row) == Some(*pattern)));
    let banded = |(row, bias): &(&SparseRow, f32)| match shared {
        Some(pattern) => BandedRow::with_pattern(row, *bias, pattern),
        None => BandedRow::of::<M, B>(row, *bias),
    };
    let banded: Vec<_> = rows.iter().map(banded).collect();
    let pattern = shared.unwrap_or(Pattern::contiguous(B.min(M)));
    let features: Vec<f32> = banded.iter().flat_map(|row| row.values.iter().copied()).collect();
    let mut states = vec![RowState::ZERO; banded.len()];
    let mut pushed = Rows::new(&pattern, &features, &mut states);
    for (number, (row, (sparse, _))) in banded.iter().zip(&rows).enumerate() {
        pushed.push::<M, B>(number, row.first, row.bias, sparse.occupied).expect("an acceptable row");
    }
    with(&mut pushed)
}
