//! Values of options that several commands have: choices by name, and numbers within bounds.

use bhm_bench::evaluation::Held;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// For what is held out, by its name.
pub(crate) fn held() -> impl TypedValueParser<Value = Held> {
    let values = Held::ALL.map(|held| PossibleValue::new(held.name()).help(held.summary()));
    PossibleValuesParser::new(values)
        .map(|name| Held::ALL.into_iter().find(|held| held.name() == name).unwrap_or(Held::Beams))
}

/// For a number that is usable; `expected` says which ones are.
pub(crate) fn number(usable: fn(&f64) -> bool, expected: &'static str) -> impl TypedValueParser<Value = f64> {
    move |text: &str| text.parse().ok().filter(usable).ok_or_else(|| format!("expected {expected}"))
}

/// For the part of the data that is held out.
pub(crate) fn fraction() -> impl TypedValueParser<Value = f64> {
    number(|part| *part > 0.0 && *part < 1.0, "a number above 0 and below 1")
}

/// For a time that may be spent.
pub(crate) fn seconds() -> impl TypedValueParser<Value = f64> {
    number(|seconds| *seconds > 0.0 && seconds.is_finite(), "a number of seconds above 0")
}
