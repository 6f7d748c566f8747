//! What a map is made with, what it is encoded as, and the model that follows from it.

#[cfg(feature = "serde")]
mod axes;
#[cfg(feature = "serde")]
mod digest;
mod error;
pub(crate) mod number;

#[cfg(feature = "serde")]
pub use digest::{Digest, ENCODED_BYTES};
pub use error::SettingsError;

use crate::{
    basis::{Basis, MAX_CUT_OFF},
    beam::{AnyBeamRule, BeamLimits, BeamRule},
    define::settings,
    geometry::Point,
    kernel::KernelSettings,
    lattice::Lattice,
    posterior::{Pattern, Posterior},
    prior::{BiasPrior, Prior, PriorSettings, WeightPrior},
    rule::AnyRule,
    support::{SupportSettings, SupportTable, Supports},
    tile::{MapView, TileSource, Tiling},
};

/// Everything that decides what a map learns from a scan. Capacities are not here: they are the length of the mapper's memory.
///
/// What only one kernel, support, beam rule or update rule reads stands with it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings<const D: usize = 2> {
    /// Where lattice node 0 sits, metres.
    #[cfg_attr(feature = "serde", serde(with = "axes"))]
    pub origin_m: [f32; D],
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// How strongly a support is correlated with a point.
    pub kernel: KernelSettings,
    /// What a support is centred on, where no table of learned supports says otherwise.
    pub support: SupportSettings,
    /// How the lattice is cut into tiles.
    pub tile: TileSettings<D>,
    /// What is believed of the weights before any scan.
    pub prior: PriorSettings,
    /// A weight common to all places; `None` for a map without bias.
    #[cfg_attr(feature = "serde", serde(default))]
    pub bias: Option<BiasSettings>,
    /// How far beams are believed.
    pub limits: BeamLimits,
    /// Which observations a beam gives.
    pub beam: AnyBeamRule,
    /// How observations are weighed.
    pub rule: AnyRule,
    /// Passes over each scan.
    pub passes: u32,
    /// The factor α by which a tile's information is kept when new data arrives in it; 1 forgets nothing.
    pub forgetting: f32,
}

/// How the lattice is cut into tiles; which shapes are possible, [`Tiling`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TileSettings<const D: usize> {
    /// Supports a side that a point sees.
    pub stencil: usize,
    /// Supports of a tile along each axis.
    #[cfg_attr(feature = "serde", serde(with = "axes"))]
    pub width: [usize; D],
    /// Supports from one tile to the next along each axis.
    #[cfg_attr(feature = "serde", serde(with = "axes"))]
    pub stride: [usize; D],
    /// How many tiles there are along each axis; `None` for unbounded space.
    #[cfg_attr(feature = "serde", serde(default, with = "axes::optional"))]
    pub count: Option<[usize; D]>,
}

settings! {
    /// A bias: one weight common to all places.
    BiasSettings {
        /// Prior precision of the bias: low, and a tile lends what it learned to where it learned nothing.
        precision: f32 = 1.0,
    }
}

/// The functions that follow from [`Settings`].
#[derive(Clone, Debug, PartialEq)]
pub struct Model<'s, const D: usize> {
    /// How places become features.
    pub basis: Basis<'s, D>,
    /// How space is cut into tiles.
    pub tiling: Tiling<D>,
    /// Where the features of a stencil stand among a tile's weights.
    pub pattern: Pattern,
    /// What is believed before any scan.
    pub prior: Prior<D>,
}

impl<const D: usize> Settings<D> {
    /// Supports of a tile: the `M` of its posterior.
    #[must_use]
    pub const fn supports(&self) -> usize {
        let (mut supports, mut axis) = (1, 0);
        while axis < D {
            supports *= self.tile.width[axis];
            axis += 1;
        }
        supports
    }

    /// The band that a tile's posterior needs: the `B` that follows from its width and the stencil.
    #[must_use]
    pub const fn band(&self) -> usize {
        let (mut stride, mut strides, mut axis) = (1, 0, D);
        while axis > 0 {
            axis -= 1;
            strides += stride;
            stride *= self.tile.width[axis];
        }
        (self.tile.stencil - 1) * strides + 1
    }

    /// Supports that a point sees: the features of an observation.
    #[must_use]
    pub const fn stencil_nodes(&self) -> usize {
        self.tile.stencil.pow(D as u32)
    }

    /// Checks the settings and builds what follows from them, every node with the same support.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn model(&self) -> Result<Model<'static, D>, SettingsError> {
        self.model_with(SupportTable::EMPTY)
    }

    /// Checks the settings and builds what follows from them, with supports of their own for the table's nodes.
    ///
    /// # Errors
    /// The first setting that cannot be used, or what the table's supports make impossible.
    pub fn model_with<'s>(&self, table: SupportTable<'s, D>) -> Result<Model<'s, D>, SettingsError> {
        self.check()?;
        let TileSettings { width, stride, count, stencil } = self.tile;
        let tiling = Tiling { lattice: self.lattice(), width, stride, tiles: count };
        // First: to make a basis is to walk over a stencil, which settings from outside may claim to be of any width.
        let window = tiling.window(&[0; D]);
        tiling.check(window.supports(), usize::MAX)?;
        let pattern = window.pattern(stencil)?;
        let basis = self.basis(table);
        let cut_off = basis.cut_off();
        if cut_off.is_nan() || cut_off > MAX_CUT_OFF {
            return Err(SettingsError::CutOff { cut_off, stencil });
        }
        if !self.prior.suits(&self.kernel) {
            let why = "it is not defined for this kernel";
            return Err(SettingsError::Prior { prior: self.prior.name(), why });
        }
        let bias = self.bias.zip(basis.bias_coupling);
        let bias = bias.map(|(bias, coupling)| BiasPrior { precision: bias.precision, coupling });
        let prior = Prior { weights: self.prior, bias, width, spacing_m: self.spacing_m };
        Ok(Model { basis, tiling, pattern, prior })
    }

    /// How places become features, whether or not that makes sense.
    pub(crate) fn basis<'s>(&self, table: SupportTable<'s, D>) -> Basis<'s, D> {
        let supports = Supports { everywhere: self.support.build(self.spacing_m), table };
        let kernel = self.kernel.build(self.spacing_m);
        Basis::new(self.lattice(), kernel, supports, self.beam.segment_averaging(), self.bias.is_some())
    }

    fn lattice(&self) -> Lattice<D> {
        Lattice { origin_m: Point::from(self.origin_m), spacing_m: self.spacing_m, stencil: self.tile.stencil }
    }

    fn check(&self) -> Result<(), SettingsError> {
        for (name, value) in ["origin x", "origin y", "origin z"].into_iter().zip(self.origin_m) {
            number::expect(name, value, "a finite number", value.is_finite())?;
        }
        number::expect("spacing", self.spacing_m, "1 mm to 1 km", (1e-3..=1e3).contains(&self.spacing_m))?;
        self.kernel.check()?;
        self.support.check()?;
        self.prior.check()?;
        self.bias.map_or(Ok(()), |bias| number::precision("bias precision", bias.precision))?;
        self.limits.check()?;
        self.beam.check()?;
        self.rule.check()?;
        number::expect("passes", self.passes as f32, "1 to 100", (1..=100).contains(&self.passes))?;
        let keeps = self.forgetting > 0.0 && self.forgetting <= 1.0;
        number::expect("forgetting", self.forgetting, "above 0, at most 1", keeps)
    }
}

impl<const D: usize> Model<'_, D> {
    /// The map that these tiles are under this model, `unobserved` being its [`prior`](Self::prior).
    #[must_use]
    pub fn view<'a, T: TileSource<D, M, B>, const M: usize, const B: usize>(
        &'a self,
        unobserved: &'a Posterior<M, B>,
        tiles: T,
    ) -> MapView<'a, T, D, M, B> {
        let Self { basis, tiling, pattern, .. } = self;
        MapView { basis, tiling, pattern, unobserved: unobserved.view(), tiles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{profile, tile::TilingError};

    #[test]
    fn a_stencil_of_any_width_is_refused_at_once() {
        // Walked over, it has 10¹³ nodes.
        let mut settings = Settings { bias: Some(BiasSettings::DEFAULT), ..profile::COMPACT.settings };
        settings.tile.stencil = 1 << 22;
        let refused = settings.model().expect_err("no tile is as wide");
        assert_eq!(refused, TilingError::Stencil { stencil: 1 << 22 }.into());
    }

    #[test]
    fn shape_is_the_windows() {
        for profile in profile::ALL {
            let (settings, model) = (profile.settings, profile.settings.model().unwrap());
            let window = model.tiling.window(&[0, 0]);
            assert_eq!(settings.supports(), window.supports());
            assert_eq!(settings.band(), window.band(settings.tile.stencil));
            assert_eq!(settings.stencil_nodes(), model.pattern.len());
            assert_eq!(settings.band(), model.pattern.span());
        }
    }
}
