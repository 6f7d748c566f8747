//! How an observation of the logistic likelihood becomes a Gaussian site.
//!
//! The passes, the safeguard and the algebra are the same for every rule and live in [`em`](crate::em); a rule says what an
//! observation weighs. To add one: write its file, with its settings, and name it in the list below.

mod gaussian_variational;
mod jaakkola_jordan;
pub mod logistic;

pub use gaussian_variational::GaussianVariational;
pub use jaakkola_jordan::{JaakkolaJordan, XiStart};
pub use logistic::sigmoid;

use crate::{
    define::sum_type,
    posterior::{Moments, Site},
    settings::{SettingsError, number},
};

/// A labelled row and the moments of its log-odds: what a rule sees of an observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelledMoments {
    /// 1 for occupied, 0 for free.
    pub label: f32,
    /// `φᵀμ₋`, the log-odds the prior expects.
    pub prior_mean: f32,
    /// Mean and variance of the log-odds under the current belief: the prior in the first pass.
    pub current: Moments,
}

/// An update rule: the site of an observation, and what it contributes to the objective.
pub trait UpdateRule {
    /// The site for the first pass of a scan, from the prior's moments.
    fn first_site(&self, observation: &LabelledMoments) -> Site;

    /// The site for a later pass, from the last pass's moments.
    fn next_site(&self, observation: &LabelledMoments) -> Site;

    /// The observation's term of the objective under the belief that `site` helped to build: a lower bound of, or an
    /// approximation to, `E[ln p(y | f)]`, nats.
    fn expected_log_likelihood(&self, observation: &LabelledMoments, site: &Site) -> f32;
}

fn check_xi(xi: f32) -> Result<(), SettingsError> {
    number::expect("first local parameter xi", xi, "above 0, at most 1000", xi > 0.0 && xi <= 1_000.0)
}

macro_rules! rules {
    ($($name:literal => $rule:ident),* $(,)?) => {
        sum_type! {
            /// The update rules a map can be configured with, each with its settings.
            "rule" AnyRule { $($name => $rule($rule)),* }
        }

        // Asked row by row: next to what a row costs the choice is nothing, and the passes are compiled once for all rules.
        impl UpdateRule for AnyRule {
            #[inline(always)]
            fn first_site(&self, observation: &LabelledMoments) -> Site {
                match self { $(Self::$rule(rule) => rule.first_site(observation)),* }
            }

            #[inline(always)]
            fn next_site(&self, observation: &LabelledMoments) -> Site {
                match self { $(Self::$rule(rule) => rule.next_site(observation)),* }
            }

            #[inline(always)]
            fn expected_log_likelihood(&self, observation: &LabelledMoments, site: &Site) -> f32 {
                match self { $(Self::$rule(rule) => rule.expected_log_likelihood(observation, site)),* }
            }
        }
    };
}

rules! {
    "gaussian-variational" => GaussianVariational,
    "jaakkola-jordan" => JaakkolaJordan,
}
