use core::fmt;

use crate::{basis::MAX_CUT_OFF, posterior::PatternError, tile::TilingError};

/// Settings that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SettingsError {
    /// A number outside its range.
    Number {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f32,
        /// What is expected.
        expected: &'static str,
    },
    /// The tiling contradicts itself or the capacities.
    Tiling(TilingError),
    /// The stencil has more lines than rows can have runs.
    Pattern(PatternError),
    /// A feature is cut off too early: the map would jump where a support leaves the stencil.
    CutOff {
        /// Its value there.
        cut_off: f32,
        /// The stencil.
        stencil: usize,
    },
    /// The prior cannot be used.
    Prior {
        /// Its name.
        prior: &'static str,
        /// Why.
        why: &'static str,
    },
    /// A part of the mapper's memory is empty.
    NoMemory {
        /// Which.
        what: &'static str,
    },
}

impl From<TilingError> for SettingsError {
    fn from(error: TilingError) -> Self {
        Self::Tiling(error)
    }
}

impl From<PatternError> for SettingsError {
    fn from(error: PatternError) -> Self {
        Self::Pattern(error)
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { name, value, expected } => write!(f, "{name} is {value}, expected {expected}"),
            Self::Tiling(error) => error.fmt(f),
            Self::Pattern(error) => write!(f, "stencil: {error}"),
            Self::CutOff { cut_off, stencil } => write!(
                f,
                "a feature is still {cut_off} where a stencil of {stencil} ends, more than {MAX_CUT_OFF}: \
                 widen the stencil, or narrow the kernel or the supports"
            ),
            Self::Prior { prior, why } => write!(f, "prior {prior}: {why}"),
            Self::NoMemory { what } => write!(f, "the mapper has no memory for {what}"),
        }
    }
}

impl core::error::Error for SettingsError {}
