//! The belief about all weights at once, full covariance, and both update rules.

use super::matrix::{Factor, Matrix, quadratic, times};
use super::{expected_ln_sigmoid, lambda, ln_sigmoid, sigmoid};

/// A Gaussian over weights, in both forms.
#[derive(Clone, Debug)]
pub struct DensePosterior {
    /// `Λ`.
    pub information: Matrix,
    /// `η = Λμ`.
    pub eta: Vec<f64>,
    /// `μ`.
    pub mean: Vec<f64>,
    /// `Σ = Λ⁻¹`.
    pub covariance: Matrix,
    /// `ln |Λ|`.
    pub log_determinant: f64,
}

/// A row φ and its label.
#[derive(Clone, Debug)]
pub struct Observation {
    /// φ, every feature.
    pub phi: Vec<f64>,
    /// y = 1.
    pub occupied: bool,
}

/// What the belief says about `f = φᵀw`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// `σ(m/√(1 + πs²/8))`.
    pub probability: f64,
    /// `m = φᵀμ`.
    pub mean: f64,
    /// `s² = φᵀΣφ`.
    pub variance: f64,
}

impl Prediction {
    /// From mean and variance of the log-odds.
    #[must_use]
    pub fn from_moments(mean: f64, variance: f64) -> Self {
        let probability = sigmoid(mean / (1.0 + core::f64::consts::PI * variance / 8.0).sqrt());
        Self { probability, mean, variance }
    }
}

/// Where ξ starts in a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum XiStart {
    /// At a number.
    Constant(f64),
    /// At `√(m² + s²)` of the prior, but not above a number.
    PredictedUpTo(f64),
}

/// How far a pass may lower the evidence lower bound `L` before it is taken back half-way: `absolute + relative·|L|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safeguard {
    /// Nats.
    pub absolute: f64,
    /// Per nat of the bound.
    pub relative: f64,
}

impl Safeguard {
    /// Every pass is kept.
    pub const NONE: Self = Self { absolute: f64::INFINITY, relative: 0.0 };

    fn allows(&self, best: f64, next: f64) -> bool {
        next >= best - self.absolute - self.relative * best.abs()
    }
}

/// An update rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// Eqs. (6)–(8).
    JaakkolaJordan {
        /// Where ξ starts.
        start: XiStart,
    },
    /// Opper & Archambeau's, after a first pass of the other from the predicted ξ.
    GaussianVariational {
        /// Largest ξ of the first pass.
        xi_cap: f64,
        /// When a pass is taken back.
        safeguard: Safeguard,
    },
}

/// What the passes of one update did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// The objective after each pass: the bound of Jaakkola–Jordan, or the evidence lower bound.
    pub objectives: Vec<f64>,
    /// Passes that were taken back.
    pub rejected: usize,
}

/// A pass that was kept: what a worse one is taken back towards.
struct GoodPass {
    belief: DensePosterior,
    objective: f64,
    /// Curvature and pull of each observation.
    sites: Vec<(f64, f64)>,
}

impl DensePosterior {
    /// `N(0, diag(precisions)⁻¹)`.
    ///
    /// # Panics
    /// If a precision is not positive.
    #[must_use]
    pub fn prior(precisions: &[f64]) -> Self {
        let n = precisions.len();
        let mut information = vec![vec![0.0; n]; n];
        for (i, precision) in precisions.iter().enumerate() {
            information[i][i] = *precision;
        }
        Self::from_information(information, vec![0.0; n]).expect("positive precisions")
    }

    /// From `Λ` and `η`.
    ///
    /// # Errors
    /// The row of the first pivot of `Λ` that is not a positive number.
    pub fn from_information(information: Matrix, eta: Vec<f64>) -> Result<Self, usize> {
        let factor = Factor::of(&information)?;
        let covariance = factor.inverse();
        let mean = times(&covariance, &eta);
        Ok(Self { information, eta, mean, covariance, log_determinant: factor.log_determinant() })
    }

    /// From `Λ` and `μ`.
    ///
    /// # Errors
    /// See [`from_information`](Self::from_information).
    pub fn from_mean(information: Matrix, mean: Vec<f64>) -> Result<Self, usize> {
        let eta = times(&information, &mean);
        Ok(Self { mean, ..Self::from_information(information, eta)? })
    }

    /// Mean, variance and probability of a row.
    #[must_use]
    pub fn predict(&self, phi: &[f64]) -> Prediction {
        let mean = phi.iter().zip(&self.mean).map(|(p, w)| p * w).sum();
        Prediction::from_moments(mean, quadratic(&self.covariance, phi))
    }

    /// Learns the observations of one scan; the prior is fixed for all passes.
    ///
    /// # Errors
    /// The row of the first pivot that is not a positive number.
    pub fn update(&mut self, observations: &[Observation], rule: &Rule, passes: usize) -> Result<Trace, usize> {
        match *rule {
            Rule::JaakkolaJordan { start } => self.jaakkola_jordan(observations, start, passes),
            Rule::GaussianVariational { xi_cap, safeguard } => {
                self.gaussian_variational(observations, xi_cap, safeguard, passes)
            }
        }
    }

    fn first_xi(&self, observations: &[Observation], start: XiStart) -> Vec<f64> {
        observations
            .iter()
            .map(|observation| match start {
                XiStart::Constant(xi) => xi,
                XiStart::PredictedUpTo(cap) => self.predicted_xi(&observation.phi).min(cap),
            })
            .collect()
    }

    /// Eq. (8): `ξ² = φᵀ(Λ⁻¹ + μμᵀ)φ`.
    fn predicted_xi(&self, phi: &[f64]) -> f64 {
        let Prediction { mean, variance, .. } = self.predict(phi);
        (variance + mean * mean).sqrt()
    }

    /// `Λ₋ + Σ cₙφₙφₙᵀ` and `η₋ + Σ rₙφₙ`.
    fn with_sites(&self, observations: &[Observation], sites: &[(f64, f64)]) -> (Matrix, Vec<f64>) {
        let (mut information, mut eta) = (self.information.clone(), self.eta.clone());
        for (Observation { phi, .. }, (curvature, pull)) in observations.iter().zip(sites) {
            for (i, value) in phi.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                eta[i] += pull * value;
                for (target, other) in information[i].iter_mut().zip(phi) {
                    *target += curvature * value * other;
                }
            }
        }
        (information, eta)
    }

    fn jaakkola_jordan(&mut self, observations: &[Observation], start: XiStart, passes: usize) -> Result<Trace, usize> {
        let prior = self.clone();
        let mut xi = prior.first_xi(observations, start);
        let mut trace = Trace::default();
        for _ in 0..passes {
            let sites: Vec<_> =
                observations.iter().zip(&xi).map(|(o, xi)| (2.0 * lambda(*xi), o.label() - 0.5)).collect();
            let (information, eta) = prior.with_sites(observations, &sites);
            *self = Self::from_information(information, eta)?;
            trace.objectives.push(self.bound(&prior, &xi));
            xi = observations.iter().map(|o| self.predicted_xi(&o.phi)).collect();
        }
        Ok(trace)
    }

    /// The bound of eq. (4), with the ξ that built this belief:
    /// `½ ln|Λ₋| − ½ ln|Λ| + ½ μᵀΛμ − ½ μ₋ᵀΛ₋μ₋ + Σ [ln σ(ξ) − ξ/2 + λ(ξ)ξ²]`.
    #[must_use]
    pub fn bound(&self, prior: &Self, xi: &[f64]) -> f64 {
        0.5 * prior.log_determinant - 0.5 * self.log_determinant + 0.5 * quadratic(&self.information, &self.mean)
            - 0.5 * quadratic(&prior.information, &prior.mean)
            + xi.iter().map(|xi| ln_sigmoid(*xi) - 0.5 * xi + lambda(*xi) * xi * xi).sum::<f64>()
    }

    fn gaussian_variational(
        &mut self,
        observations: &[Observation],
        xi_cap: f64,
        safeguard: Safeguard,
        passes: usize,
    ) -> Result<Trace, usize> {
        let prior = self.clone();
        let first = prior.first_xi(observations, XiStart::PredictedUpTo(xi_cap));
        let mut sites: Vec<_> =
            observations.iter().zip(&first).map(|(o, xi)| (2.0 * lambda(*xi), o.label() - 0.5)).collect();
        let mut good: Option<GoodPass> = None;
        let mut trace = Trace::default();
        for _ in 0..passes {
            let (information, eta) = prior.with_sites(observations, &sites);
            let candidate = Self::from_information(information, eta)?;
            let objective = candidate.evidence_lower_bound(&prior, observations);
            trace.objectives.push(objective);
            match &good {
                Some(good) if !safeguard.allows(good.objective, objective) => {
                    trace.rejected += 1;
                    // (Λ, η) are linear in the sites: this is half-way between the two beliefs.
                    for (site, good) in sites.iter_mut().zip(&good.sites) {
                        *site = (0.5 * (site.0 + good.0), 0.5 * (site.1 + good.1));
                    }
                }
                _ => {
                    let next = observations.iter().map(|o| candidate.expected_site(o)).collect();
                    let sites = core::mem::replace(&mut sites, next);
                    good = Some(GoodPass { belief: candidate, objective, sites });
                }
            }
        }
        if let Some(good) = good {
            *self = good.belief;
        }
        Ok(trace)
    }

    /// `c = κp(1 − p)` and `(y − p) + cm` at the current moments.
    fn expected_site(&self, observation: &Observation) -> (f64, f64) {
        let Prediction { probability: p, mean, variance } = self.predict(&observation.phi);
        let kappa = 1.0 / (1.0 + core::f64::consts::PI * variance / 8.0).sqrt();
        let curvature = kappa * p * (1.0 - p);
        (curvature, (observation.label() - p) + curvature * mean)
    }

    /// `E_q[Σ ln p(y|f)] − KL(q ‖ prior)`, nats.
    #[must_use]
    pub fn evidence_lower_bound(&self, prior: &Self, observations: &[Observation]) -> f64 {
        let likelihood: f64 = observations
            .iter()
            .map(|observation| {
                let Prediction { mean, variance, .. } = self.predict(&observation.phi);
                expected_ln_sigmoid(if observation.occupied { mean } else { -mean }, variance)
            })
            .sum();
        likelihood - self.divergence(prior)
    }

    /// `KL(q ‖ prior) = ½ [tr(Λ₋Σ) − M + (μ − μ₋)ᵀΛ₋(μ − μ₋) + ln|Λ| − ln|Λ₋|]`, nats.
    #[must_use]
    pub fn divergence(&self, prior: &Self) -> f64 {
        let pairs = prior.information.iter().zip(&self.covariance);
        let trace: f64 = pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()).sum();
        let step: Vec<f64> = self.mean.iter().zip(&prior.mean).map(|(a, b)| a - b).collect();
        0.5 * (trace - self.mean.len() as f64
            + quadratic(&prior.information, &step)
            + (self.log_determinant - prior.log_determinant))
    }

    /// Forgets towards `prior`: `Λ ← αΛ + (1 − α)Λ₀`, `η ← αη + (1 − α)η₀`.
    ///
    /// # Errors
    /// The row of the first pivot that is not a positive number.
    pub fn discount(&mut self, prior: &Self, keep: f64) -> Result<(), usize> {
        let blend = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| keep * a + (1.0 - keep) * b).collect();
        let information = self.information.iter().zip(&prior.information).map(|(a, b)| blend(a, b)).collect();
        *self = Self::from_information(information, blend(&self.eta, &prior.eta))?;
        Ok(())
    }
}

impl Observation {
    fn label(&self) -> f64 {
        f64::from(u8::from(self.occupied))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One weight, one feature: the evidence `∫ σ(w) N(w; 0, 1/λ₀) dw = ½` is known, and every bound is below it.
    #[test]
    fn bounds_are_below_a_known_evidence_and_rise() {
        let evidence = 0.5_f64.ln();
        let observations = [Observation { phi: vec![1.0], occupied: true }];
        for precision in [0.01, 1.0, 10.0] {
            let prior = DensePosterior::prior(&[precision]);
            let mut quadratic = prior.clone();
            let rule = Rule::JaakkolaJordan { start: XiStart::Constant(1.0) };
            let bounds = quadratic.update(&observations, &rule, 30).unwrap().objectives;
            assert!(bounds.windows(2).all(|w| w[1] >= w[0] - 1e-13), "{bounds:?}");
            let mut variational = prior.clone();
            let rule =
                Rule::GaussianVariational { xi_cap: 4.0, safeguard: Safeguard { absolute: 1e-6, relative: 0.0 } };
            variational.update(&observations, &rule, 30).unwrap();
            let best = variational.evidence_lower_bound(&prior, &observations);
            assert!(bounds[29] < best && best < evidence, "{} {best} {evidence}", bounds[29]);
            // The quadratic bound is below the evidence lower bound of its own belief.
            assert!(bounds[29] < quadratic.evidence_lower_bound(&prior, &observations));
        }
    }

    #[test]
    fn forgetting_everything_is_the_prior() {
        let prior = DensePosterior::prior(&[0.5, 2.0]);
        let mut belief = prior.clone();
        let observations = [Observation { phi: vec![1.0, 0.3], occupied: true }];
        belief.update(&observations, &Rule::JaakkolaJordan { start: XiStart::Constant(1.0) }, 2).unwrap();
        assert!(belief.mean[0] > 0.1);
        belief.discount(&prior, 0.0).unwrap();
        assert!((belief.divergence(&prior)).abs() < 1e-15);
    }
}
