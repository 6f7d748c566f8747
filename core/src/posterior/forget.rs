use super::{NotPositiveDefinite, Posterior, Scratch};

impl<const M: usize, const B: usize> Posterior<M, B> {
    /// Discounts what is believed towards the prior (a power prior): `Λ ← αΛ + (1 − α)Λ₀`, `η ← αη + (1 − α)η₀`.
    ///
    /// `keep` is α in (0, 1]. As costly as one pass: mean and covariance are solved for anew.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if rounding made the discounted matrix so; the posterior is then as before.
    pub fn discount(
        &mut self,
        prior: &Self,
        keep: f32,
        scratch: &mut Scratch<M, B>,
    ) -> Result<(), NotPositiveDefinite> {
        let lose = 1.0 - keep;
        let blend = |row: usize| -> [f32; B] {
            let (own, prior) = (&self.information[row], &prior.information[row]);
            core::array::from_fn(|i| keep * own[i] + lose * prior[i])
        };
        let border = core::array::from_fn(|i| keep * self.border_information[i] + lose * prior.border_information[i]);
        let corner = keep * self.bias_information + lose * prior.bias_information;
        scratch.assemble(blend, &border, corner);
        scratch.factor_in_place()?;
        let log_determinant = scratch.log_determinant();
        // With η₀ = 0 the new mean solves Λ′ (μ′ − μ) = −(1 − α) Λ₀ μ.
        scratch.bias_step = prior.bias_information * self.bias_mean;
        scratch.step.fill(0.0);
        for (i, row) in prior.information.iter().enumerate() {
            scratch.step[i] += row[0] * self.mean[i] + prior.border_information[i] * self.bias_mean;
            for (j, entry) in row.iter().enumerate().take(M - i).skip(1) {
                scratch.step[i] += entry * self.mean[i + j];
                scratch.step[i + j] += entry * self.mean[i];
            }
            scratch.bias_step += prior.border_information[i] * self.mean[i];
        }
        scratch.step.iter_mut().chain([&mut scratch.bias_step]).for_each(|step| *step *= -lose);
        scratch.solve_in_place();
        scratch.invert();
        for (own, prior) in self.information.as_flattened_mut().iter_mut().zip(prior.information.as_flattened()) {
            *own = keep * *own + lose * prior;
        }
        self.border_information = border;
        self.bias_information = corner;
        self.log_determinant = log_determinant;
        scratch.keep(self);
        scratch.apply_step(&mut self.mean, &mut self.bias_mean);
        Ok(())
    }
}
