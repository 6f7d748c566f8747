//! One scan into one posterior: a fixed number of passes of an update rule, each judged by its objective.
//!
//! The prior `(Λ₋, μ₋)` stays fixed during all passes. Each pass assembles `Λ = Λ₋ + Σ c φφᵀ`, factors it, solves for the step
//! `μ − μ₋`, takes the selected inverse, and reads every row's moments off it. The objective of a pass, in the same terms
//! for every rule, is
//!
//! ```text
//! L = Σₙ E[ln p(yₙ|f)] − KL(q ‖ prior)
//! KL = ½ [ ln|Λ| − ln|Λ₋| − Σₙ cₙ sₙ² + Σₙ (gₙ dₙ − cₙ dₙ²) ],   dₙ = φₙᵀ(μ − μ₋)
//! ```
//!
//! which is eq. (4) rearranged so that nothing large cancels: `tr(Λ₋Σ) = M − Σ c s²`, and
//! `(μ − μ₋)ᵀΛ₋(μ − μ₋) = Σ g d − Σ c d²`.
//!
//! **Safeguard.** A pass that lowers the objective by more than `1e-3 + 1e-5·|L|` is not kept: the next one starts half-way
//! between its sites and those of the best pass, and it is counted. Sites enter `(Λ, η)` linearly, so that this is the
//! interpolation in natural parameters. The first pass is the baseline; what is committed is the last pass that was kept.

use crate::{
    posterior::{Moments, NotPositiveDefinite, Posterior, Rows, Scratch, Site},
    rule::{AnyRule, LabelledMoments, UpdateRule},
};

/// What one update of one posterior did.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UpdateReport {
    /// Passes made.
    pub passes: u32,
    /// Objective of the pass that was kept, nats.
    pub objective: f32,
    /// Passes that were not kept because they lowered the objective or could not be factored.
    pub safeguards: u32,
    /// Passes whose information matrix `f32` could factor only with a little more on its diagonal.
    pub conditioned: u32,
}

/// How much a pass may lower the objective before it is rejected, nats: `1e-3 + 1e-5·|L|`.
///
/// The first term is what the probit approximation costs in ordinary updates near the optimum, the second what `f32` does.
#[inline(always)]
fn tolerance(objective: f32) -> f32 {
    1e-3 + 1e-5 * objective.abs()
}

/// Learns the rows, in exactly `passes` passes (at least one).
///
/// # Errors
/// [`NotPositiveDefinite`] if not one pass could be factored; the posterior is then as before.
#[inline(always)]
pub fn update<const M: usize, const B: usize>(
    posterior: &mut Posterior<M, B>,
    rows: &mut Rows<'_>,
    rule: &AnyRule,
    passes: u32,
    scratch: &mut Scratch<M, B>,
) -> Result<UpdateReport, NotPositiveDefinite> {
    let mut report = UpdateReport::default();
    if rows.is_empty() {
        return Ok(report);
    }
    start(posterior, rows, rule);
    let mut best: Option<Kept> = None;
    let mut failure = NotPositiveDefinite { row: 0 };
    let mut refused = 0;
    for pass in 0..passes.max(1) {
        report.passes += 1;
        let Posterior { information, border_information, bias_information, .. } = &*posterior;
        let factored = scratch.factor(information, border_information, *bias_information, rows, &mut refused);
        let candidate = match factored {
            Ok(inflation) => {
                report.conditioned += u32::from(inflation > 0.0);
                let log_determinant = scratch.log_determinant();
                scratch.solve(rows);
                scratch.invert();
                let inflated = if inflation > 0.0 { scratch.inflated() } else { 0.0 };
                let objective = evaluate(posterior.log_determinant, log_determinant, inflated, rows, rule, scratch);
                // Written so that a NaN is never kept.
                let good =
                    best.map_or(objective.is_finite(), |best| objective >= best.objective - tolerance(best.objective));
                good.then_some(Kept { objective, log_determinant, inflation })
            }
            Err(error) => {
                failure = error;
                None
            }
        };
        let last = pass + 1 == passes.max(1);
        if candidate.is_some() {
            best = candidate;
            scratch.keep(posterior);
            for (_, state) in rows.iter_mut() {
                state.best = state.site;
                if !last {
                    state.site = rule.next_site(&LabelledMoments {
                        label: state.label,
                        prior_mean: state.prior_mean,
                        current: Moments { mean: state.mean, variance: state.variance },
                    });
                }
            }
        } else {
            report.safeguards += 1;
            for (_, state) in rows.iter_mut() {
                state.site.curvature = 0.5 * (state.site.curvature + state.best.curvature);
                state.site.pull = 0.5 * (state.site.pull + state.best.pull);
            }
        }
    }
    let kept = best.ok_or(failure)?;
    report.objective = kept.objective;
    posterior.log_determinant = kept.log_determinant;
    commit(posterior, kept.inflation, rows, scratch);
    Ok(report)
}

/// What is remembered of the last pass that was kept; its sites, step and `Σ` stand where they are needed.
#[derive(Clone, Copy)]
struct Kept {
    objective: f32,
    log_determinant: [f32; 2],
    inflation: f32,
}

/// Reads the prior's moments and asks the rule for the first sites.
#[inline(always)]
fn start<const M: usize, const B: usize>(posterior: &Posterior<M, B>, rows: &mut Rows<'_>, rule: &AnyRule) {
    let view = posterior.view();
    for (row, state) in rows.iter_mut() {
        let current = view.moments(&row);
        state.prior_mean = current.mean;
        state.site = rule.first_site(&LabelledMoments { label: state.label, prior_mean: current.mean, current });
        state.best = Default::default();
    }
}

/// Stores every row's moments under the candidate and returns its objective.
#[inline(always)]
fn evaluate<const M: usize, const B: usize>(
    before: [f32; 2],
    after: [f32; 2],
    inflated: f32,
    rows: &mut Rows<'_>,
    rule: &AnyRule,
    scratch: &Scratch<M, B>,
) -> f32 {
    let mut likelihood = 0.0;
    let mut divergence = (after[0] - before[0]) + (after[1] - before[1]) - inflated;
    for (row, state) in rows.iter_mut() {
        let Moments { mean: step, variance } = scratch.moments(&row);
        state.mean = state.prior_mean + step;
        state.variance = variance;
        let Site { curvature, pull, .. } = state.site;
        divergence += (pull - curvature * step) * step - curvature * variance;
        let observation = LabelledMoments {
            label: state.label,
            prior_mean: state.prior_mean,
            current: Moments { mean: state.mean, variance },
        };
        likelihood += rule.expected_log_likelihood(&observation, &state.site);
    }
    likelihood - 0.5 * divergence
}

/// Adds what the kept pass learned to `Λ₋` and `μ₋`; its `Σ` stands there already.
#[inline(always)]
fn commit<const M: usize, const B: usize>(
    posterior: &mut Posterior<M, B>,
    inflation: f32,
    rows: &Rows<'_>,
    scratch: &Scratch<M, B>,
) {
    scratch.apply_step(&mut posterior.mean, &mut posterior.bias_mean);
    for (row, state) in rows.iter() {
        posterior.learn(&row, state.best.curvature);
    }
    if inflation > 0.0 {
        posterior.inflate(inflation);
    }
}
