//! Choices by name for the command line.

use bhm_bench::evaluation::Held;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// For what is held out, by its name.
pub(crate) fn held() -> impl TypedValueParser<Value = Held> {
    let values = Held::ALL.map(|held| PossibleValue::new(held.name()).help(held.summary()));
    PossibleValuesParser::new(values)
        .map(|name| Held::ALL.into_iter().find(|held| held.name() == name).unwrap_or(Held::Beams))
}
