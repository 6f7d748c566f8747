//! Which numbers are searched for, and where.

use std::{f64::consts::SQRT_2, str::FromStr};

use bhm_bench::search::{Axis, Values};
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::By;
use crate::{
    options::{Effective, MapOption},
    output::Usage,
};

/// In which order candidates are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Search {
    /// One option after the other, the rest held at the best so far
    Coordinate,
    /// Every combination
    Grid,
}

/// Values to try: numbers with commas between them, or `auto` for two geometric steps to either side of the best so far.
#[derive(Clone, Debug, PartialEq)]
enum List {
    Auto,
    Given(Vec<f32>),
}

/// Each of them: `auto`, or a list such as `0.2,0.25,0.3`.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Where to look (`auto`, or numbers with commas between them)")]
pub(super) struct SearchAxes {
    /// Spacings to try, metres; see --max-cost
    #[arg(long, value_name = "LIST")]
    try_spacing: Option<List>,
    /// Kernel shapes to try, for a kernel that has one (squared-exponential)
    #[arg(long, value_name = "LIST")]
    try_kernel_shape: Option<List>,
    /// Deviations of the matern prior to try
    #[arg(long, value_name = "LIST")]
    try_prior_deviation: Option<List>,
    /// Ranges of the matern prior to try, metres
    #[arg(long, value_name = "LIST")]
    try_prior_range: Option<List>,
    /// Precisions of the white prior to try
    #[arg(long, value_name = "LIST")]
    try_prior_precision: Option<List>,
    /// Free spacings to try, metres; not with --by objective
    #[arg(long, value_name = "LIST")]
    try_free_spacing: Option<List>,
    /// Gaps before a hit to try, metres; not with --by objective
    #[arg(long, value_name = "LIST")]
    try_gap: Option<List>,
}

impl FromStr for List {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let number = |part: &str| part.trim().parse::<f32>().ok().filter(|number| number.is_finite());
        let numbers: Option<Vec<f32>> = text.split(',').map(number).collect();
        numbers.map(Self::Given).ok_or_else(|| "expected `auto`, or numbers with commas between them".to_owned())
    }
}

impl SearchAxes {
    /// What is searched for and where, beginning at these options.
    ///
    /// # Errors
    /// [`Usage`] for a number that the options do not use, or that this score cannot compare.
    pub(super) fn of(&self, start: &Effective, by: By) -> anyhow::Result<(Vec<&'static MapOption>, Vec<Axis>)> {
        let mut asked: Vec<(&str, &List, f64)> = Vec::new();
        // A prior is known by its order of magnitude at best; lengths are known better.
        for (number, list, factor) in [
            ("spacing", &self.try_spacing, SQRT_2),
            ("kernel-shape", &self.try_kernel_shape, SQRT_2),
            ("prior-deviation", &self.try_prior_deviation, 2.0),
            ("prior-range", &self.try_prior_range, 2.0),
            ("prior-precision", &self.try_prior_precision, 10.0),
            ("free-spacing", &self.try_free_spacing, SQRT_2),
            ("gap", &self.try_gap, SQRT_2),
        ] {
            asked.extend(list.as_ref().map(|list| (number, list, factor)));
        }
        if asked.is_empty() {
            let own =
                [("kernel-shape", SQRT_2), ("prior-deviation", 2.0), ("prior-range", 2.0), ("prior-precision", 10.0)];
            let has = |name: &str| MapOption::named(name).is_some_and(|option| start.number(option).is_ok());
            asked.extend(
                own.into_iter().filter(|(name, _)| has(name)).map(|(name, factor)| (name, &List::Auto, factor)),
            );
        }
        let (mut options, mut axes) = (Vec::new(), Vec::new());
        for (name, list, factor) in &asked {
            let option = MapOption::named(name).ok_or_else(|| Usage(format!("--try-{name}: no such option")))?;
            let value = start.number(option).map_err(|problem| Usage(format!("--try-{name}: {problem}")))?;
            let problem = if option.changes_observations() && by == By::Objective {
                Some("another value makes other observations, whose objectives cannot be compared".to_owned())
            } else if **list == List::Auto && value <= 0.0 {
                Some(format!("it is {value}: nothing to go around"))
            } else {
                None
            };
            if let Some(problem) = problem {
                return Err(Usage(format!("--try-{name}: {problem}")).into());
            }
            let values = match list {
                List::Auto => Values::Around { factor: *factor },
                List::Given(values) => Values::Given(values.clone()),
            };
            options.push(option);
            axes.push(Axis { start: value, values });
        }
        Ok((options, axes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{
        kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
        profile,
    };

    const SPLINE: KernelSettings = KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT);
    const EXPONENTIAL: KernelSettings = KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT);

    fn start(kernel: KernelSettings) -> Effective {
        let mut profile = profile::COMPACT;
        profile.settings = profile.settings.with_kernel(kernel);
        Effective::of(profile)
    }

    #[test]
    fn lists_are_numbers_or_auto() {
        assert_eq!("0.2,0.25, 3e-1".parse(), Ok(List::Given(vec![0.2, 0.25, 0.3])));
        assert_eq!("auto".parse(), Ok(List::Auto));
        for text in ["", "0.2,", "0.2;0.3", "nan", "1,inf", "Auto"] {
            assert!(text.parse::<List>().is_err(), "{text}");
        }
    }

    #[test]
    fn by_default_the_prior_is_searched_and_the_shape_where_there_is_one() {
        let flags = |kernel| -> Vec<&str> {
            let (options, _) = SearchAxes::default().of(&start(kernel), By::Nll).unwrap();
            options.iter().map(|option| option.flag).collect()
        };
        assert_eq!(flags(SPLINE), ["prior-deviation", "prior-range"]);
        assert_eq!(flags(EXPONENTIAL), ["kernel-shape", "prior-precision"]);
    }

    #[test]
    fn only_what_is_asked_for_is_searched_and_from_where_the_options_are() {
        let asked = SearchAxes { try_gap: Some(List::Given(vec![0.0, 0.2])), ..SearchAxes::default() };
        let (options, axes) = asked.of(&start(SPLINE), By::Nll).unwrap();
        assert_eq!(options.iter().map(|option| option.flag).collect::<Vec<_>>(), ["gap"]);
        assert_eq!(axes, [Axis { start: 0.1, values: Values::Given(vec![0.0, 0.2]) }]);
    }
}
