//! How an observation of the logistic likelihood becomes a Gaussian site.
//!
//! The passes, the safeguard and the algebra are the same for every rule and live in [`em`](crate::em); a rule says what an
//! observation weighs. To add one: write its file, name it in the list below.

mod gaussian_variational;
mod jaakkola_jordan;
pub(crate) mod logistic;

pub use gaussian_variational::GaussianVariational;
pub use jaakkola_jordan::{JaakkolaJordan, XiStart};
pub use logistic::sigmoid;

use crate::posterior::{Moments, Site};

/// One observation as a rule sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
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
    fn first_site(&self, observation: &Observation) -> Site;

    /// The site for a later pass, from the last pass's moments.
    fn next_site(&self, observation: &Observation) -> Site;

    /// The observation's term of the objective under the belief that `site` helped to build: a lower bound of, or an
    /// approximation to, `E[ln p(y | f)]`, nats.
    fn expected_log_likelihood(&self, observation: &Observation, site: &Site) -> f32;
}

macro_rules! rules {
    ($($name:literal => $rule:ident),* $(,)?) => {
        /// The update rules a map can be configured with.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyRule {
            $(#[doc = concat!("See [`", stringify!($rule), "`].")] $rule($rule)),*
        }

        impl AnyRule {
            /// Every rule there is, with its defaults.
            pub const ALL: &'static [Self] = &[$(Self::$rule($rule::DEFAULT)),*];

            /// The rule's name, as a configuration spells it.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self { $(Self::$rule(_) => $name),* }
            }
        }

        // Asked row by row: next to what a row costs the choice is nothing, and the passes are compiled once for all rules.
        impl UpdateRule for AnyRule {
            #[inline(always)]
            fn first_site(&self, observation: &Observation) -> Site {
                match self { $(Self::$rule(rule) => rule.first_site(observation)),* }
            }

            #[inline(always)]
            fn next_site(&self, observation: &Observation) -> Site {
                match self { $(Self::$rule(rule) => rule.next_site(observation)),* }
            }

            #[inline(always)]
            fn expected_log_likelihood(&self, observation: &Observation, site: &Site) -> f32 {
                match self { $(Self::$rule(rule) => rule.expected_log_likelihood(observation, site)),* }
            }
        }
    };
}

rules! {
    "gaussian-variational" => GaussianVariational,
    "jaakkola-jordan" => JaakkolaJordan,
}
