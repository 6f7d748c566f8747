//! How settings are defined: structures with defaults, and sum types of them, each with its names, check and encoding.

/// Defines an enumeration of settings, `"name" => Variant(Settings)` line by line.
///
/// Each variant's settings have a `const DEFAULT` and a method `check`. With the feature `serde` a variant is written by its
/// name in formats for people, and by its place in the list in binary ones: a further variant is added at the end.
macro_rules! sum_type {
    (
        $(#[$attribute:meta])*
        $what:literal $type:ident { $($name:literal => $variant:ident($settings:ty)),* $(,)? }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum $type {
            $(
                #[doc = concat!("See [`", stringify!($settings), "`].")]
                #[cfg_attr(feature = "serde", serde(rename = $name))]
                $variant($settings)
            ),*
        }

        impl $type {
            /// Every variant, with its default settings.
            pub const ALL: &'static [Self] = &[$(Self::$variant(<$settings>::DEFAULT)),*];

            #[doc = concat!("What a variant is, for messages: \"", $what, "\".")]
            pub const WHAT: &'static str = $what;

            /// The variant's name, as a configuration spells it.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self { $(Self::$variant(_) => $name),* }
            }

            /// The variant of that name, with its default settings.
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|variant| variant.name() == name)
            }

            /// Checks the variant's settings.
            pub(crate) fn check(&self) -> Result<(), crate::settings::SettingsError> {
                match self { $(Self::$variant(settings) => settings.check()),* }
            }
        }
    };
}
pub(crate) use sum_type;

/// Defines a structure of settings, each field with its default: the structure, its `DEFAULT` and its encoding, in which a field
/// left out of a configuration has its default and an unknown field is an error.
macro_rules! settings {
    (
        $(#[$attribute:meta])*
        $type:ident { $($(#[$field_attribute:meta])* $field:ident: $of:ty = $default:expr),* $(,)? }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $type {
            $($(#[$field_attribute])* pub $field: $of),*
        }

        impl $type {
            /// The default of every field.
            pub const DEFAULT: Self = Self { $($field: $default),* };
        }

        impl Default for $type {
            fn default() -> Self {
                Self::DEFAULT
            }
        }
    };
}
pub(crate) use settings;
