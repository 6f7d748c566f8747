use super::{NotPositiveDefinite, Posterior, Scratch};
use crate::prior::BiasPrior;

/// How a prior is written: a belief of mean zero.
impl<const M: usize, const B: usize> Posterior<M, B> {
    /// Overwrites everything with independent weights of that precision, without bias.
    pub fn reset_white(&mut self, precision: f32) {
        let diagonal = |band: &mut super::Band<M, B>, entry: f32| {
            for row in band {
                row.fill(0.0);
                row[0] = entry;
            }
        };
        diagonal(&mut self.information, precision);
        diagonal(&mut self.covariance, 1.0 / precision);
        self.forget_mean();
        self.log_determinant = [M as f32 * libm::logf(precision), 0.0];
    }

    /// Overwrites everything but the weights' information with what follows from that, mean zero, without bias.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if the information is; the rest is then as before.
    pub fn settle(&mut self, scratch: &mut Scratch<M, B>) -> Result<(), NotPositiveDefinite> {
        scratch.assemble(|i| self.information[i], &[0.0; M], 1.0);
        scratch.factor_in_place()?;
        self.log_determinant = scratch.log_determinant();
        scratch.invert();
        scratch.keep(self);
        self.forget_mean();
        Ok(())
    }

    /// Multiplies the weights' precision by a factor.
    pub(crate) fn scale_precision(&mut self, factor: f32) {
        self.information.as_flattened_mut().iter_mut().for_each(|entry| *entry *= factor);
        self.covariance.as_flattened_mut().iter_mut().for_each(|entry| *entry /= factor);
        self.log_determinant[0] += M as f32 * libm::logf(factor);
    }

    /// Adds a bias, independent of weights `w`, to a belief of mean zero about them, in the coordinates `w′ = w + c·b`.
    pub fn couple_bias(&mut self, bias: &BiasPrior) {
        let BiasPrior { precision, coupling } = *bias;
        // The row sums of the weights' precision.
        let mut sums = [0.0; M];
        for (i, row) in self.information.iter().enumerate() {
            sums[i] += row[0];
            for (j, entry) in row.iter().enumerate().take(M - i).skip(1) {
                sums[i] += entry;
                sums[i + j] += entry;
            }
        }
        self.border_information = sums.map(|sum| -coupling * sum);
        self.bias_information = precision + coupling * coupling * sums.iter().sum::<f32>();
        self.bias_covariance = 1.0 / precision;
        self.border_covariance.fill(coupling * self.bias_covariance);
        for (i, row) in self.covariance.iter_mut().enumerate() {
            for entry in &mut row[..B.min(M - i)] {
                *entry += coupling * coupling * self.bias_covariance;
            }
        }
        // |Λ| does not change under w′ = w + c·b, whose Jacobian has determinant one.
        self.log_determinant[0] += libm::logf(precision);
    }

    fn forget_mean(&mut self) {
        self.mean.fill(0.0);
        self.border_information.fill(0.0);
        self.border_covariance.fill(0.0);
        (self.bias_information, self.bias_covariance, self.bias_mean) = (1.0, 1.0, 0.0);
    }
}
