use core::fmt;

/// One non-zero of a row φ.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entry {
    /// Which weight.
    pub index: u32,
    /// Its feature.
    pub value: f32,
}

impl Entry {
    /// The index as one.
    #[inline(always)]
    #[must_use]
    pub const fn index(&self) -> usize {
        self.index as usize
    }
}

/// What one observation adds: `Λ += c φφᵀ` and `Λ(μ − μ₋) += g φ`.
///
/// `g` is relative to the prior mean, `g = r − c φᵀμ₋` for a pull `r` on `η`: the step, unlike `η` itself, does not grow
/// with the number of scans, so `f32` does not lose it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Site {
    /// `c`, the weight of the observation.
    pub curvature: f32,
    /// `g`, its pull away from the prior mean.
    pub pull: f32,
    /// ξ, where a rule has one (Jaakkola–Jordan).
    pub xi: f32,
}

/// One row and all that an update remembers of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowState {
    end: u32,
    pub(crate) label: f32,
    pub(crate) bias: f32,
    pub(crate) prior_mean: f32,
    pub(crate) mean: f32,
    pub(crate) variance: f32,
    pub(crate) site: Site,
    pub(crate) best: Site,
}

impl RowState {
    /// Room for a row, for a `static`; on a computer allocate it zeroed instead, which is the same value.
    pub const ZERO: Self = {
        let site = Site { curvature: 0.0, pull: 0.0, xi: 0.0 };
        Self { end: 0, label: 0.0, bias: 0.0, prior_mean: 0.0, mean: 0.0, variance: 0.0, site, best: site }
    };
}

/// A row that cannot be learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowError {
    /// Two of its weights are further apart than the band: storing the row would lose their coupling.
    OutsideBand {
        /// The lower index.
        first: usize,
        /// The higher index.
        last: usize,
        /// The band.
        band: usize,
    },
    /// An index is not a weight's.
    OutsideMatrix {
        /// The index.
        index: usize,
        /// The number of weights.
        supports: usize,
    },
    /// Indices do not ascend.
    NotAscending {
        /// The index that is not above its predecessor.
        index: usize,
    },
    /// A value is not a finite number.
    NotFinite {
        /// The index of the value.
        index: usize,
    },
    /// The lent memory is full.
    Full,
}

impl fmt::Display for RowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutsideBand { first, last, band } => {
                write!(f, "row couples supports {first} and {last}, further apart than the band of {band} holds")
            }
            Self::OutsideMatrix { index, supports } => write!(f, "row names support {index} of only {supports}"),
            Self::NotAscending { index } => write!(f, "row's indices do not ascend at {index}"),
            Self::NotFinite { index } => write!(f, "row's value at {index} is not finite"),
            Self::Full => write!(f, "no room for another row"),
        }
    }
}

impl core::error::Error for RowError {}

/// The rows of one scan that fall into one posterior, in memory that the caller lends.
#[derive(Debug)]
pub struct Rows<'m> {
    entries: &'m mut [Entry],
    states: &'m mut [RowState],
    len: usize,
}

impl<'m> Rows<'m> {
    /// No rows yet, room for `states.len()` rows of `entries.len()` non-zeros together.
    #[must_use]
    pub fn new(entries: &'m mut [Entry], states: &'m mut [RowState]) -> Self {
        Self { entries, states, len: 0 }
    }

    /// Forgets every row.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds the row φ with its label for a posterior of shape `M`, `B`.
    ///
    /// # Errors
    /// Whatever [`RowError`] names; the rows are then as before.
    pub fn push<const M: usize, const B: usize>(
        &mut self,
        entries: impl IntoIterator<Item = Entry>,
        bias: f32,
        occupied: bool,
    ) -> Result<(), RowError> {
        let start = self.end_of(self.len);
        let mut end = start;
        for entry in entries {
            if entry.index() >= M {
                return Err(RowError::OutsideMatrix { index: entry.index(), supports: M });
            }
            if !entry.value.is_finite() {
                return Err(RowError::NotFinite { index: entry.index() });
            }
            if end > start {
                let (first, previous) = (self.entries[start].index(), self.entries[end - 1].index());
                if entry.index() <= previous {
                    return Err(RowError::NotAscending { index: entry.index() });
                }
                if entry.index() - first >= B {
                    return Err(RowError::OutsideBand { first, last: entry.index(), band: B });
                }
            }
            *self.entries.get_mut(end).ok_or(RowError::Full)? = entry;
            end += 1;
        }
        if !bias.is_finite() {
            return Err(RowError::NotFinite { index: M });
        }
        let state = self.states.get_mut(self.len).ok_or(RowError::Full)?;
        *state = RowState { end: end as u32, label: f32::from(u8::from(occupied)), bias, ..RowState::default() };
        self.len += 1;
        Ok(())
    }

    #[inline(always)]
    fn end_of(&self, rows: usize) -> usize {
        if rows == 0 { 0 } else { self.states[rows - 1].end as usize }
    }

    /// Every row's entries and state.
    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&[Entry], &RowState)> {
        let mut start = 0;
        self.states[..self.len].iter().map(move |state| {
            let row = &self.entries[start..state.end as usize];
            start = state.end as usize;
            (row, state)
        })
    }

    /// Every row's entries and state, the state to be changed.
    #[inline(always)]
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (&[Entry], &mut RowState)> {
        let entries: &[Entry] = self.entries;
        let mut start = 0;
        self.states[..self.len].iter_mut().map(move |state| {
            let row = &entries[start..state.end as usize];
            start = state.end as usize;
            (row, state)
        })
    }
}
