use super::{
    LabelledMoments, UpdateRule, check_xi,
    logistic::{jaakkola_lambda, ln_sigmoid},
};
use crate::{define::settings, posterior::Site, settings::SettingsError};

settings! {
    /// The paper's rule: the quadratic bound of Jaakkola and Jordan (2000), eqs. (6)–(8).
    ///
    /// `c = 2λ(ξ)`, `r = y − ½`, and after each pass `ξ² = φᵀ(Σ + μμᵀ)φ`. Its objective, eq. (4) with this bound, never
    /// decreases from pass to pass.
    JaakkolaJordan {
        /// ξ of the first pass.
        start: XiStart = XiStart::PredictedUpTo(4.0),
    }
}

/// Where the local variational parameter ξ starts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum XiStart {
    /// At one value for every observation; public implementations of the paper start at 1.
    Constant(f32),
    /// At what the belief before the scan predicts, `√(m² + s²)`, but no more than this: from a wide prior the uncapped
    /// value would weigh an observation near zero.
    PredictedUpTo(f32),
}

impl JaakkolaJordan {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let (XiStart::Constant(xi) | XiStart::PredictedUpTo(xi)) = self.start;
        check_xi(xi)
    }

    /// The site of an observation with local parameter ξ.
    #[inline(always)]
    pub(super) fn site(observation: &LabelledMoments, xi: f32) -> Site {
        let curvature = 2.0 * jaakkola_lambda(xi);
        Site { curvature, pull: (observation.label - 0.5) - curvature * observation.prior_mean, xi }
    }

    /// `√(m² + s²)`, eq. (8).
    #[inline(always)]
    pub(super) fn predicted_xi(observation: &LabelledMoments) -> f32 {
        let current = &observation.current;
        libm::sqrtf(current.mean * current.mean + current.variance)
    }
}

impl UpdateRule for JaakkolaJordan {
    #[inline(always)]
    fn first_site(&self, observation: &LabelledMoments) -> Site {
        Self::site(
            observation,
            match self.start {
                XiStart::Constant(xi) => xi,
                XiStart::PredictedUpTo(cap) => Self::predicted_xi(observation).min(cap),
            },
        )
    }

    #[inline(always)]
    fn next_site(&self, observation: &LabelledMoments) -> Site {
        Self::site(observation, Self::predicted_xi(observation))
    }

    #[inline(always)]
    fn expected_log_likelihood(&self, observation: &LabelledMoments, site: &Site) -> f32 {
        // ln σ(ξ) + (y − ½)m − ξ/2 − λ(ξ)(m² + s² − ξ²), the squares' difference factored against cancellation.
        let LabelledMoments { label, current, .. } = observation;
        let excess = (current.mean.abs() - site.xi) * (current.mean.abs() + site.xi) + current.variance;
        ln_sigmoid(site.xi) + (label - 0.5) * current.mean - 0.5 * site.xi - 0.5 * site.curvature * excess
    }
}
