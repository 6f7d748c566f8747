use bhm_core::settings::Settings;

use super::{Effective, values::MapValues};

/// A map option that is a number and can be searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    /// Distance between supports, metres.
    Spacing,
    /// Square of a kernel's width, in units of spacing².
    KernelShape,
    /// Precision of each weight before any scan.
    PriorPrecision,
    /// Longest piece of a beam for which one free point stands, metres.
    FreeSpacing,
    /// Length before a hit that is left unlabelled, metres.
    Gap,
}

impl Number {
    /// As the command line and configuration files spell it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Spacing => "spacing",
            Self::KernelShape => "kernel-shape",
            Self::PriorPrecision => "prior-precision",
            Self::FreeSpacing => "free-spacing",
            Self::Gap => "gap",
        }
    }
}

impl Effective {
    /// One of the numbers in effect.
    pub(crate) fn number(&self, number: Number) -> f32 {
        // Every number is there: `of` names every value that has one.
        MapValues::of(self).number_mut(number).unwrap_or(f32::NAN)
    }

    /// The same with other numbers, or why that cannot be. Tile slots stay as they are: a map does not depend on them.
    pub(crate) fn with(&self, numbers: &[(Number, f32)]) -> Result<Self, String> {
        let mut values = MapValues::of(self);
        for (number, value) in numbers {
            *values.number_mut(*number) = Some(*value);
        }
        values.effective(self.supports.as_ref())
    }

    /// Whether the kernel has a width of its own to be chosen: whether another shape makes another model.
    pub(crate) fn has_kernel_shape(&self) -> bool {
        let settings = self.profile.settings;
        // Narrower, so that a stencil that fits the one fits the other.
        let narrower = Settings { kernel_shape: 0.5 * settings.kernel_shape, ..settings };
        settings.model() != narrower.model()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{kernel::KernelChoice, profile};

    #[test]
    fn numbers_are_set_by_name_and_nothing_else_changes() {
        let start = Effective { max_range_m: Some(30.0), ..Effective::of(profile::INDOOR) };
        let numbers = [
            (Number::Spacing, 0.3),
            (Number::KernelShape, 0.7),
            (Number::PriorPrecision, 1e-3),
            (Number::FreeSpacing, 0.8),
            (Number::Gap, 0.2),
        ];
        for (number, value) in numbers {
            let changed = start.with(&[(number, value)]).unwrap();
            assert_eq!(changed.number(number), value);
            assert_ne!(start.number(number), value);
            // Its name is the key that a configuration file has for it.
            assert!(
                changed.configuration().unwrap().lines().any(|line| line == format!("{} = {value:?}", number.name()))
            );
            assert_eq!(changed.with(&[(number, start.number(number))]), Ok(start.clone()));
        }
        assert_eq!(start.with(&numbers).unwrap().profile.settings.spacing_m, 0.3);
        assert_eq!(start.with(&[(Number::Gap, -1.0)]).unwrap_err().split(" is ").next(), Some("gap before a hit"));
    }

    #[test]
    fn only_the_squared_exponential_has_a_shape() {
        for (kernel, has) in [(KernelChoice::CubicBSpline, false), (KernelChoice::SquaredExponential, true)] {
            let mut profile = profile::COMPACT;
            profile.settings = profile.settings.with_kernel(kernel);
            assert_eq!(Effective::of(profile).has_kernel_shape(), has);
        }
    }
}
