use super::WeightPrior;
use crate::{
    define::settings,
    kernel::KernelSettings,
    posterior::{NotPositiveDefinite, Posterior, Scratch},
    settings::{SettingsError, number},
};

settings! {
    /// Independent weights: `Λ₀ = precision · I`, the paper's prior.
    ///
    /// Nothing is inferred beyond the stencils of what was observed.
    WhitePrior {
        /// Precision of each weight, the paper's `10⁻⁴`: smaller lets a single beam decide more.
        precision: f32 = 1e-4,
    }
}

impl WhitePrior {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::precision("prior precision", self.precision)
    }
}

impl WeightPrior for WhitePrior {
    fn suits(&self, _: &KernelSettings) -> bool {
        true
    }

    fn write<const D: usize, const M: usize, const B: usize>(
        &self,
        _: &[usize; D],
        _: f32,
        belief: &mut Posterior<M, B>,
        _: &mut Scratch<M, B>,
    ) -> Result<(), NotPositiveDefinite> {
        belief.reset_white(self.precision);
        Ok(())
    }
}
