use super::{
    JaakkolaJordan, LabelledMoments, UpdateRule, check_xi,
    logistic::{expected_ln_sigmoid, kappa, sigmoid},
};
use crate::{define::settings, posterior::Site, settings::SettingsError};

settings! {
    /// The default rule: the Gaussian variational approximation (Opper & Archambeau 2009).
    ///
    /// An observation weighs its *expected* curvature, which vanishes where the map is already sure: `κ = 1/√(1 + πs²/8)`,
    /// `p = σ(κm)`, `c = κp(1 − p)`, `r = (y − p) + cm`. The first pass of a scan is the Jaakkola–Jordan one with ξ capped,
    /// since from a wide prior these Newton-like passes alone diverge. The objective is the evidence lower bound itself.
    GaussianVariational {
        /// Largest ξ of the first pass.
        xi_cap: f32 = 4.0,
    }
}

impl GaussianVariational {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        check_xi(self.xi_cap)
    }
}

impl UpdateRule for GaussianVariational {
    #[inline(always)]
    fn first_site(&self, observation: &LabelledMoments) -> Site {
        JaakkolaJordan::site(observation, JaakkolaJordan::predicted_xi(observation).min(self.xi_cap))
    }

    #[inline(always)]
    fn next_site(&self, observation: &LabelledMoments) -> Site {
        let LabelledMoments { label, prior_mean, current } = observation;
        let kappa = kappa(current.variance);
        let p = sigmoid(kappa * current.mean);
        let curvature = kappa * p * (1.0 - p);
        Site { curvature, pull: (label - p) + curvature * (current.mean - prior_mean), xi: 0.0 }
    }

    #[inline(always)]
    fn expected_log_likelihood(&self, observation: &LabelledMoments, _: &Site) -> f32 {
        let towards = 2.0 * observation.label - 1.0;
        expected_ln_sigmoid(towards * observation.current.mean, observation.current.variance)
    }
}
