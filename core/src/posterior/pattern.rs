use core::fmt;

/// Most runs of a pattern: the lines of a stencil of 8² in the plane or of 4³ in space.
pub const MAX_RUNS: usize = 16;

/// Where the non-zeros of rows stand, relative to their first: runs of neighbouring weights, all of the same length.
///
/// Every row of a tile has the same pattern, one run for each line of the stencil; rows without gaps are a pattern of one run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    run: usize,
    starts: [usize; MAX_RUNS],
    runs: usize,
}

/// A pattern that cannot be: see [`Pattern::new`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PatternError {
    /// Length of a run.
    pub run: usize,
    /// Number of runs.
    pub runs: usize,
}

impl fmt::Display for PatternError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} runs of {} weights: expected 1 to {MAX_RUNS}, in ascending order, not empty", self.runs, self.run)
    }
}

impl core::error::Error for PatternError {}

impl Pattern {
    /// Runs of `run` neighbouring weights that begin at `starts`, counted from the first weight.
    ///
    /// # Errors
    /// [`PatternError`] if there is no run or are more than [`MAX_RUNS`], if runs are empty, the first does not begin at 0, or
    /// one begins before its predecessor ends.
    pub fn new(run: usize, starts: impl IntoIterator<Item = usize>) -> Result<Self, PatternError> {
        let mut pattern = Self { run, starts: [0; MAX_RUNS], runs: 0 };
        let mut ascending = true;
        let mut free = 0;
        for start in starts {
            ascending &= if pattern.runs == 0 { start == 0 } else { start >= free };
            free = start.saturating_add(run);
            if let Some(slot) = pattern.starts.get_mut(pattern.runs) {
                *slot = start;
            }
            pattern.runs += 1;
        }
        let good = run > 0 && ascending && (1..=MAX_RUNS).contains(&pattern.runs);
        if good { Ok(pattern) } else { Err(PatternError { run, runs: pattern.runs }) }
    }

    /// Neighbouring weights without a gap.
    #[must_use]
    pub const fn contiguous(len: usize) -> Self {
        Self { run: len, starts: [0; MAX_RUNS], runs: 1 }
    }

    /// Length of a run.
    #[inline(always)]
    #[must_use]
    pub const fn run(&self) -> usize {
        self.run
    }

    /// Where runs begin, counted from the first weight.
    #[inline(always)]
    #[must_use]
    pub fn starts(&self) -> &[usize] {
        &self.starts[..self.runs.min(MAX_RUNS)]
    }

    /// Number of weights.
    #[inline(always)]
    #[must_use]
    pub const fn len(&self) -> usize {
        self.run * self.runs
    }

    /// Whether the pattern has no weights.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// From the first weight to just behind the last: the band that a row needs.
    #[inline(always)]
    #[must_use]
    pub fn span(&self) -> usize {
        self.starts().last().map_or(0, |start| start + self.run)
    }
}

/// One row φ: its features, where they stand among the weights, and the bias's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<'a> {
    /// Where features stand, counted from `first`.
    pub pattern: &'a Pattern,
    /// The first weight.
    pub first: usize,
    /// The features, in the pattern's order.
    pub values: &'a [f32],
    /// The bias's feature; 0 without bias.
    pub bias: f32,
}

impl<'a> Row<'a> {
    /// The same places with other values.
    #[inline(always)]
    #[must_use]
    pub const fn with(&self, values: &'a [f32], bias: f32) -> Self {
        Self { values, bias, ..*self }
    }

    /// The features as those of one row among others at the same weights.
    #[inline(always)]
    pub(crate) fn alone(&self) -> &'a [[f32; 1]] {
        self.values.as_chunks().0
    }

    /// Runs: the first weight of each, and its features.
    #[inline(always)]
    pub(crate) fn runs(&self) -> impl Iterator<Item = (usize, &'a [f32])> {
        let first = self.first;
        self.pattern
            .starts()
            .iter()
            .zip(self.values.chunks_exact(self.pattern.run))
            .map(move |(start, values)| (first + start, values))
    }

    /// Weights and their features, one by one.
    #[inline(always)]
    pub(crate) fn weights(&self) -> impl Iterator<Item = (usize, f32)> {
        self.runs().flat_map(|(first, values)| values.iter().enumerate().map(move |(k, value)| (first + k, *value)))
    }

    /// `Σ φᵢ xᵢ` over the weights, in their order; weights beyond the end of `of` count as zero.
    #[inline(always)]
    pub(crate) fn dot(&self, of: &[f32]) -> f32 {
        let mut sum = 0.0;
        for (first, values) in self.runs() {
            for (value, x) in values.iter().zip(of.get(first..).unwrap_or_default()) {
                sum += value * x;
            }
        }
        sum
    }

    /// `xᵢ += weight · φᵢ` over the weights.
    #[inline(always)]
    pub(crate) fn add_to(&self, weight: f32, to: &mut [f32]) {
        for (first, values) in self.runs() {
            for (value, x) in values.iter().zip(to.get_mut(first..).unwrap_or_default()) {
                *x += weight * value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_patterns_are_refused() {
        assert!(Pattern::new(4, [0, 12, 24, 36]).is_ok());
        assert_eq!(Pattern::new(4, [0, 12]).map(|pattern| (pattern.len(), pattern.span())), Ok((8, 16)));
        for (run, starts) in [(0, &[0][..]), (4, &[]), (4, &[1, 12]), (4, &[0, 3]), (4, &[0, 12, 8]), (1, &[0; 17])] {
            assert!(Pattern::new(run, starts.iter().copied()).is_err(), "{run} {starts:?}");
        }
    }
}
