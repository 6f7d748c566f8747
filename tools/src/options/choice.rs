//! Choices by name, from the core's own lists: what is added there can be chosen here.

use std::str::FromStr;

use bhm_bench::evaluation::Held;
use bhm_core::{
    beam::BeamChoice,
    kernel::KernelChoice,
    profile::{self, Profile},
    rule::AnyRule,
    support::SupportChoice,
};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

/// Things with names, all of which are known.
pub(super) trait Registry: Copy + Send + Sync + 'static {
    /// What one of them is.
    const WHAT: &'static str;

    /// Every one of them.
    fn all() -> impl Iterator<Item = Self>;

    /// Its name.
    fn name(self) -> &'static str;
}

impl Registry for &'static Profile {
    const WHAT: &'static str = "profile";

    fn all() -> impl Iterator<Item = Self> {
        profile::ALL.into_iter()
    }

    fn name(self) -> &'static str {
        self.name
    }
}

/// The core's enumerations of names, each with what one of them is.
macro_rules! registries {
    ($($choice:ty, $what:literal);* $(;)?) => {
        $(impl Registry for $choice {
            const WHAT: &'static str = $what;

            fn all() -> impl Iterator<Item = Self> {
                Self::ALL.iter().copied()
            }

            fn name(self) -> &'static str {
                self.name()
            }
        })*
    };
}

registries! {
    KernelChoice, "kernel";
    SupportChoice, "support";
    BeamChoice, "beam rule";
}

impl Registry for AnyRule {
    const WHAT: &'static str = "rule";

    fn all() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied()
    }

    fn name(self) -> &'static str {
        AnyRule::name(&self)
    }
}

/// One of them, chosen by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice<T>(pub(super) T);

impl<T: Registry> FromStr for Choice<T> {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        T::all().find(|item| item.name() == name).map(Self).ok_or_else(|| {
            let names: Vec<_> = T::all().map(T::name).collect();
            format!("unknown {} `{name}`, expected one of {}", T::WHAT, names.join(", "))
        })
    }
}

/// For the command line: lists the names in the help and in completions.
pub(super) fn parser<T: Registry>() -> impl TypedValueParser<Value = Choice<T>> {
    PossibleValuesParser::new(T::all().map(T::name)).try_map(|name| name.parse::<Choice<T>>())
}

/// For what is held out, by its name.
pub(crate) fn held() -> impl TypedValueParser<Value = Held> {
    let values = Held::ALL.map(|held| PossibleValue::new(held.name()).help(held.summary()));
    PossibleValuesParser::new(values)
        .map(|name| Held::ALL.into_iter().find(|held| held.name() == name).unwrap_or(Held::Beams))
}

impl<T: Registry> Serialize for Choice<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name())
    }
}

impl<'de, T: Registry> Deserialize<'de> for Choice<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}
