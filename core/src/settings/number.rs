//! What numbers settings may be, each check by the name that its message gives.

use super::SettingsError;
use crate::kernel::Averaging;

pub(crate) const POSITIVE: &str = "a positive number";
pub(crate) const NOT_NEGATIVE: &str = "zero or a positive number";

pub(crate) fn expect(name: &'static str, value: f32, expected: &'static str, is_so: bool) -> Result<(), SettingsError> {
    if is_so { Ok(()) } else { Err(SettingsError::Number { name, value, expected }) }
}

pub(crate) fn positive(name: &'static str, value: f32) -> Result<(), SettingsError> {
    expect(name, value, POSITIVE, value > 0.0 && value.is_finite())
}

/// A prior precision that `f32` can carry beside the information of a few hundred observations.
pub(crate) fn precision(name: &'static str, value: f32) -> Result<(), SettingsError> {
    expect(name, value, "1e-6 to 1e6", (1e-6..=1e6).contains(&value))
}

pub(crate) fn samples(name: &'static str, averaging: Averaging) -> Result<(), SettingsError> {
    expect(name, u32::from(averaging) as f32, "1 to 64", averaging.is_valid())
}

pub(crate) fn support_size(size: f32) -> Result<(), SettingsError> {
    expect("support size", size, "above 0, at most 100", size > 0.0 && size <= 100.0)
}

pub(crate) fn gap(gap_m: f32) -> Result<(), SettingsError> {
    expect("gap before a hit", gap_m, NOT_NEGATIVE, gap_m >= 0.0 && gap_m.is_finite())
}
