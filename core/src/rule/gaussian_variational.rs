use super::{
    JaakkolaJordan, Observation, UpdateRule,
    logistic::{expected_ln_sigmoid, kappa, sigmoid},
};
use crate::posterior::Site;

/// The default rule: the Gaussian variational approximation (Opper & Archambeau 2009).
///
/// An observation weighs its *expected* curvature, which vanishes where the map is already sure: `κ = 1/√(1 + πs²/8)`,
/// `p = σ(κm)`, `c = κp(1 − p)`, `r = (y − p) + cm`. The first pass of a scan is the Jaakkola–Jordan one with ξ capped,
/// since from a wide prior these Newton-like passes alone diverge. The objective is the evidence lower bound itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianVariational {
    /// Largest ξ of the first pass.
    pub xi_cap: f32,
}

impl GaussianVariational {
    pub(super) const DEFAULT: Self = Self { xi_cap: 4.0 };
}

impl Default for GaussianVariational {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl UpdateRule for GaussianVariational {
    #[inline(always)]
    fn first_site(&self, observation: &Observation) -> Site {
        JaakkolaJordan::site(observation, JaakkolaJordan::predicted_xi(observation).min(self.xi_cap))
    }

    #[inline(always)]
    fn next_site(&self, observation: &Observation) -> Site {
        let Observation { label, prior_mean, current } = observation;
        let kappa = kappa(current.variance);
        let p = sigmoid(kappa * current.mean);
        let curvature = kappa * p * (1.0 - p);
        Site { curvature, pull: (label - p) + curvature * (current.mean - prior_mean), xi: 0.0 }
    }

    #[inline(always)]
    fn expected_log_likelihood(&self, observation: &Observation, _: &Site) -> f32 {
        let towards = 2.0 * observation.label - 1.0;
        expected_ln_sigmoid(towards * observation.current.mean, observation.current.variance)
    }
}
