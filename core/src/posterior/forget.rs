use super::{NotPositiveDefinite, Posterior, Prior, Scratch};

impl<const M: usize, const B: usize> Posterior<M, B> {
    /// Discounts what is believed towards the prior (a power prior): `Λ ← αΛ + (1 − α)Λ₀`, `η ← αη + (1 − α)η₀`.
    ///
    /// `keep` is α in (0, 1]. As costly as one pass: mean and covariance are solved for anew.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if rounding made the discounted matrix so; the posterior is then as before.
    pub fn discount(
        &mut self,
        prior: &Prior,
        keep: f32,
        scratch: &mut Scratch<M, B>,
    ) -> Result<(), NotPositiveDefinite> {
        let lose = 1.0 - keep;
        let blend = |information: &[f32; B]| {
            let mut row = information.map(|entry| keep * entry);
            row[0] += lose * prior.precision;
            row
        };
        let border = self.border_information.map(|entry| keep * entry + lose * prior.border());
        let corner = keep * self.bias_information + lose * prior.corner(M);
        scratch.assemble(|i| blend(&self.information[i]), &border, corner);
        scratch.factor_in_place()?;
        let log_determinant = scratch.log_determinant();
        // With η₀ = 0 the new mean solves Λ′ (μ′ − μ) = −(1 − α) Λ₀ μ.
        scratch.bias_step = -lose * prior.corner(M) * self.bias_mean;
        for (step, mean) in scratch.step.iter_mut().zip(&self.mean) {
            *step = -lose * (prior.precision * mean + prior.border() * self.bias_mean);
            scratch.bias_step -= lose * prior.border() * mean;
        }
        if prior.bias.is_none() {
            scratch.bias_step = 0.0;
        }
        scratch.solve_in_place();
        scratch.invert();
        for information in &mut self.information {
            *information = blend(information);
        }
        self.border_information = border;
        self.bias_information = corner;
        self.log_determinant = log_determinant;
        scratch.keep(self);
        scratch.apply_step(&mut self.mean, &mut self.bias_mean);
        Ok(())
    }
}
