use core::fmt;

use super::{Pattern, Row};

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
    /// Which of the lent features.
    features: u32,
    /// The first weight.
    first: u32,
    pub(crate) bias: f32,
    pub(crate) label: f32,
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
        Self {
            features: 0,
            first: 0,
            bias: 0.0,
            label: 0.0,
            prior_mean: 0.0,
            mean: 0.0,
            variance: 0.0,
            site,
            best: site,
        }
    };
}

/// A row that cannot be learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RowError {
    /// Two of its weights are further apart than the band: storing the row would lose their coupling.
    OutsideBand {
        /// What the pattern spans.
        span: usize,
        /// The band.
        band: usize,
    },
    /// Its last weight does not exist.
    OutsideMatrix {
        /// The index of the last weight.
        index: usize,
        /// The number of weights.
        supports: usize,
    },
    /// A feature is not a finite number.
    NotFinite {
        /// Which feature, in the pattern's order; their number for the bias's.
        feature: usize,
    },
    /// There are no features of that number.
    NoFeatures {
        /// The number.
        number: usize,
    },
    /// The memory for rows is full.
    Full,
}

impl fmt::Display for RowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutsideBand { span, band } => {
                write!(f, "a row spans {span} supports, further apart than the band of {band} holds")
            }
            Self::OutsideMatrix { index, supports } => write!(f, "a row names support {index} of only {supports}"),
            Self::NotFinite { feature } => write!(f, "a row's feature {feature} is not finite"),
            Self::NoFeatures { number } => write!(f, "a row names features {number}, which do not exist"),
            Self::Full => write!(f, "no room for another row"),
        }
    }
}

impl core::error::Error for RowError {}

/// The rows of one scan that fall into one posterior, in memory that the caller lends.
#[derive(Debug)]
pub struct Rows<'m> {
    pattern: &'m Pattern,
    features: &'m [f32],
    states: &'m mut [RowState],
    len: usize,
}

impl<'m> Rows<'m> {
    /// No rows yet, and room for `states.len()`. `features` holds the features of observations one after the other, each in
    /// the pattern's order.
    #[must_use]
    pub fn new(pattern: &'m Pattern, features: &'m [f32], states: &'m mut [RowState]) -> Self {
        Self { pattern, features, states, len: 0 }
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

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds the row of observation `number`'s features, the first of which belongs to weight `first`, with its label, for a
    /// posterior of shape `M`, `B`.
    ///
    /// # Errors
    /// Whatever [`RowError`] names; the rows are then as before.
    #[inline(always)]
    pub fn push<const M: usize, const B: usize>(
        &mut self,
        number: usize,
        first: usize,
        bias: f32,
        occupied: bool,
    ) -> Result<(), RowError> {
        let span = self.pattern.span();
        if span > B {
            return Err(RowError::OutsideBand { span, band: B });
        }
        if first >= M || span > M - first {
            return Err(RowError::OutsideMatrix { index: first.saturating_add(span).saturating_sub(1), supports: M });
        }
        let values = features_of(self.pattern, self.features, number).ok_or(RowError::NoFeatures { number })?;
        if let Some(feature) = values.iter().chain(&[bias]).position(|value| !value.is_finite()) {
            return Err(RowError::NotFinite { feature });
        }
        let state = self.states.get_mut(self.len).ok_or(RowError::Full)?;
        let label = f32::from(u8::from(occupied));
        *state = RowState { features: number as u32, first: first as u32, bias, label, ..RowState::ZERO };
        self.len += 1;
        Ok(())
    }

    /// Every row and its state.
    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Row<'_>, &RowState)> {
        let Self { pattern, features, .. } = *self;
        self.states[..self.len].iter().map(move |state| (row_of(pattern, features, state), state))
    }

    /// Every row and its state, the state to be changed.
    #[inline(always)]
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (Row<'_>, &mut RowState)> {
        let Self { pattern, features, .. } = *self;
        self.states[..self.len].iter_mut().map(move |state| (row_of(pattern, features, state), state))
    }
}

#[inline(always)]
fn features_of<'a>(pattern: &Pattern, features: &'a [f32], number: usize) -> Option<&'a [f32]> {
    let start = number.checked_mul(pattern.len())?;
    features.get(start..)?.get(..pattern.len())
}

#[inline(always)]
fn row_of<'a>(pattern: &'a Pattern, features: &'a [f32], state: &RowState) -> Row<'a> {
    // Checked when the row was pushed.
    let values = features_of(pattern, features, state.features as usize).unwrap_or_default();
    Row { pattern, first: state.first as usize, values, bias: state.bias }
}
