//! Priors: what is believed of a tile's weights before any scan.
//!
//! A prior is the belief of a tile that learned nothing: a Gaussian of mean zero, in the same band as every other. It is computed
//! once for a model and shared: a new tile begins as a copy of it, forgetting leads back to it, and a query where no tile exists
//! is answered by it. To add one: write its file, with its settings, and name it in the list below.

mod matern;
mod white;

pub use matern::MaternPrior;
pub use white::WhitePrior;

use crate::{
    define::sum_type,
    kernel::KernelSettings,
    posterior::{NotPositiveDefinite, Posterior, Scratch},
    settings::SettingsError,
};

/// How the weights of a tile hang together before any scan.
pub trait WeightPrior {
    /// Whether the prior is defined for the weights of this kernel.
    fn suits(&self, kernel: &KernelSettings) -> bool;

    /// Overwrites a belief with the prior of a tile of `width` nodes along each axis, `spacing_m` metres apart, without bias.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if rounding made the precision so.
    fn write<const D: usize, const M: usize, const B: usize>(
        &self,
        width: &[usize; D],
        spacing_m: f32,
        belief: &mut Posterior<M, B>,
        scratch: &mut Scratch<M, B>,
    ) -> Result<(), NotPositiveDefinite>;
}

macro_rules! priors {
    ($($name:literal => $variant:ident($prior:ty)),* $(,)?) => {
        sum_type! {
            /// What is believed of the weights before any scan.
            "prior" PriorSettings { $($name => $variant($prior)),* }
        }

        impl WeightPrior for PriorSettings {
            fn suits(&self, kernel: &KernelSettings) -> bool {
                match self { $(Self::$variant(prior) => prior.suits(kernel)),* }
            }

            fn write<const D: usize, const M: usize, const B: usize>(
                &self,
                width: &[usize; D],
                spacing_m: f32,
                belief: &mut Posterior<M, B>,
                scratch: &mut Scratch<M, B>,
            ) -> Result<(), NotPositiveDefinite> {
                match self { $(Self::$variant(prior) => prior.write(width, spacing_m, belief, scratch)),* }
            }
        }
    };
}

priors! {
    "white" => White(WhitePrior),
    "matern" => Matern(MaternPrior),
}

impl PriorSettings {
    /// This prior if it is defined for the kernel's weights, else independent ones.
    #[must_use]
    pub fn or_white(self, kernel: &KernelSettings) -> Self {
        if self.suits(kernel) { self } else { Self::White(WhitePrior::DEFAULT) }
    }
}

/// The prior of a bias in the coordinates of [`Basis::new`](crate::basis::Basis::new): `w′ = w + c·b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasPrior {
    /// Precision of the bias.
    pub precision: f32,
    /// `c`.
    pub coupling: f32,
}

/// The prior of a model's tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<const D: usize> {
    /// How the weights hang together.
    pub weights: PriorSettings,
    /// The bias's part, if there is one.
    pub bias: Option<BiasPrior>,
    /// Nodes of a tile along each axis.
    pub width: [usize; D],
    /// Distance between neighbouring nodes, metres.
    pub spacing_m: f32,
}

impl<const D: usize> Prior<D> {
    /// Overwrites a belief with the prior.
    ///
    /// # Errors
    /// [`SettingsError::Prior`] if the prior cannot be computed in single precision.
    pub fn write<const M: usize, const B: usize>(
        &self,
        belief: &mut Posterior<M, B>,
        scratch: &mut Scratch<M, B>,
    ) -> Result<(), SettingsError> {
        let refused = |NotPositiveDefinite { .. }| SettingsError::Prior {
            prior: self.weights.name(),
            why: "its precision is not positive definite in single precision",
        };
        self.weights.write(&self.width, self.spacing_m, belief, scratch).map_err(refused)?;
        if let Some(bias) = &self.bias {
            belief.couple_bias(bias);
        }
        Ok(())
    }
}
