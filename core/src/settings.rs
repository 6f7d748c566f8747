//! What a map is made with, as plain numbers, and the model that follows from it.

use core::fmt;

use crate::{
    basis::{Basis, MAX_CUT_OFF},
    beam::{AnyBeamRule, BeamChoice, BeamLimits, BeamParameters},
    geometry::Point,
    kernel::{Averaging, KernelChoice, KernelParameters, MAX_SAMPLES},
    lattice::Lattice,
    posterior::{BiasPrior, Prior},
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    support::{SupportChoice, SupportParameters, SupportTable, Supports},
    tile::{MapView, TileSource, Tiling, TilingError},
};

/// Everything that decides what a map learns from a scan. Capacities are not here: they are the length of what is lent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Where lattice node 0 sits, metres.
    pub origin_m: [f32; 2],
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// How far a support reaches.
    pub kernel: KernelChoice,
    /// The isotropic `g` of the squared exponential's `G = g·I` in units of spacing², so that it scales with the lattice.
    pub kernel_shape: f32,
    /// What a support is centred on, where no table of learned supports says otherwise.
    pub support: SupportChoice,
    /// How large the area of a support is, in spacings; a point has none.
    pub support_size: f32,
    /// How the kernel is averaged over that area.
    pub support_averaging: Averaging,
    /// Supports a side that a point sees.
    pub stencil: usize,
    /// Supports of a tile along each axis.
    pub tile_width: [usize; 2],
    /// Supports from one tile to the next along each axis.
    pub tile_stride: [usize; 2],
    /// How many tiles there are along each axis; `None` for an unbounded plane.
    pub tile_count: Option<[usize; 2]>,
    /// Prior precision of each weight.
    pub prior_precision: f32,
    /// Whether there is a bias.
    pub bias: bool,
    /// Prior precision of the bias, if there is one: low, and a tile lends what it learned to where it learned nothing.
    pub bias_precision: f32,
    /// How far beams are believed.
    pub limits: BeamLimits,
    /// What a beam says.
    pub beam: BeamChoice,
    /// Longest piece of a beam for which one free point stands, metres.
    pub free_spacing_m: f32,
    /// Longest line segment, in spacings.
    pub segment_length: f32,
    /// How features are averaged along a segment.
    pub segment_averaging: Averaging,
    /// Length before a hit that is left unlabelled, metres.
    pub gap_m: f32,
    /// How observations are weighed.
    pub rule: AnyRule,
    /// Passes over each scan.
    pub passes: u32,
    /// The factor α by which a tile's information is kept when new data arrives in it; 1 forgets nothing.
    pub forgetting: f32,
}

/// The functions that follow from [`Settings`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model<'s> {
    /// How places become features.
    pub basis: Basis<'s, 2>,
    /// How the plane is cut into tiles.
    pub tiling: Tiling<2>,
    /// What is believed before any scan.
    pub prior: Prior,
    /// What a beam says.
    pub beam: AnyBeamRule,
}

/// Settings that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingsError {
    /// A number outside its range.
    Number {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f32,
        /// What is expected.
        expected: &'static str,
    },
    /// The tiling contradicts itself or the capacities.
    Tiling(TilingError),
    /// A feature is cut off too early: the map would jump where a support leaves the stencil.
    CutOff {
        /// Its value there.
        cut_off: f32,
        /// The stencil.
        stencil: usize,
    },
    /// A slice of the lent memory is empty.
    NoMemory {
        /// Which.
        what: &'static str,
    },
}

impl From<TilingError> for SettingsError {
    fn from(error: TilingError) -> Self {
        Self::Tiling(error)
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { name, value, expected } => write!(f, "{name} is {value}, expected {expected}"),
            Self::Tiling(error) => error.fmt(f),
            Self::CutOff { cut_off, stencil } => write!(
                f,
                "a feature is still {cut_off} where a stencil of {stencil} ends, more than {MAX_CUT_OFF}: \
                 widen the stencil, or narrow the kernel or the supports"
            ),
            Self::NoMemory { what } => write!(f, "no memory was lent for {what}"),
        }
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Checks the settings and builds what follows from them, every node with the same support.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn model(&self) -> Result<Model<'static>, SettingsError> {
        self.model_with(SupportTable::EMPTY)
    }

    /// Checks the settings and builds what follows from them, with supports of their own for the table's nodes.
    ///
    /// # Errors
    /// The first setting that cannot be used, or what the table's supports make impossible.
    pub fn model_with<'s>(&self, table: SupportTable<'s, 2>) -> Result<Model<'s>, SettingsError> {
        self.check_numbers()?;
        let lattice = self.lattice();
        let tiling = Tiling { lattice, width: self.tile_width, stride: self.tile_stride, tiles: self.tile_count };
        // First: to make a basis is to walk over a stencil, which settings from outside may claim to be of any width.
        tiling.check(tiling.window(&[0, 0]).supports(), usize::MAX)?;
        let basis = self.basis(table);
        let cut_off = basis.cut_off();
        if cut_off.is_nan() || cut_off > MAX_CUT_OFF {
            return Err(SettingsError::CutOff { cut_off, stencil: self.stencil });
        }
        let bias = basis.bias_coupling.map(|coupling| BiasPrior { precision: self.bias_precision, coupling });
        let beam = self.beam.build(&BeamParameters {
            spacing_m: self.spacing_m,
            free_spacing_m: self.free_spacing_m,
            segment_length: self.segment_length,
            gap_m: self.gap_m,
        });
        Ok(Model { basis, tiling, prior: Prior { precision: self.prior_precision, bias }, beam })
    }

    /// How places become features, whether or not that makes sense.
    pub(crate) fn basis<'s>(&self, table: SupportTable<'s, 2>) -> Basis<'s, 2> {
        let spacing_m = self.spacing_m;
        let kernel = self
            .kernel
            .build::<2>(&KernelParameters { spacing_m, shape_m2: self.kernel_shape * spacing_m * spacing_m });
        let everywhere = self.support.build(&SupportParameters {
            spacing_m,
            size: self.support_size,
            averaging: self.support_averaging,
        });
        Basis::new(self.lattice(), kernel, Supports { everywhere, table }, self.segment_averaging, self.bias)
    }

    fn lattice(&self) -> Lattice<2> {
        Lattice { origin_m: Point::from(self.origin_m), spacing_m: self.spacing_m, stencil: self.stencil }
    }

    fn check_numbers(&self) -> Result<(), SettingsError> {
        let positive = "a positive number";
        let not_negative = "zero or a positive number";
        let xi = match self.rule {
            AnyRule::GaussianVariational(GaussianVariational { xi_cap }) => xi_cap,
            AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::Constant(xi) | XiStart::PredictedUpTo(xi) }) => xi,
        };
        for (name, value, expected, good) in [
            ("origin x", self.origin_m[0], "a finite number", self.origin_m[0].is_finite()),
            ("origin y", self.origin_m[1], "a finite number", self.origin_m[1].is_finite()),
            ("spacing", self.spacing_m, "1 mm to 1 km", (1e-3..=1e3).contains(&self.spacing_m)),
            ("kernel shape", self.kernel_shape, positive, positive_finite(self.kernel_shape)),
            ("prior precision", self.prior_precision, "1e-6 to 1e6", PRECISIONS.contains(&self.prior_precision)),
            ("bias precision", self.bias_precision, "1e-6 to 1e6", PRECISIONS.contains(&self.bias_precision)),
            ("maximum range", self.limits.range_max_m, positive, self.limits.range_max_m > 0.0),
            ("no-return range", self.limits.no_return_free_m, not_negative, self.limits.no_return_free_m >= 0.0),
            (
                "support size",
                self.support_size,
                "above 0, at most 100",
                self.support_size > 0.0 && self.support_size <= 100.0,
            ),
            ("samples of a support", samples(self.support_averaging), "1 to 64", countable(self.support_averaging)),
            ("free spacing", self.free_spacing_m, positive, positive_finite(self.free_spacing_m)),
            (
                "segment length",
                self.segment_length,
                "above 0, at most 1000",
                self.segment_length > 0.0 && self.segment_length <= 1e3,
            ),
            ("samples of a segment", samples(self.segment_averaging), "1 to 64", countable(self.segment_averaging)),
            ("gap before a hit", self.gap_m, not_negative, self.gap_m >= 0.0 && self.gap_m.is_finite()),
            ("first local parameter xi", xi, "above 0, at most 1000", xi > 0.0 && xi <= 1_000.0),
            ("passes", self.passes as f32, "1 to 100", (1..=100).contains(&self.passes)),
            ("forgetting", self.forgetting, "above 0, at most 1", self.forgetting > 0.0 && self.forgetting <= 1.0),
        ] {
            if !good {
                return Err(SettingsError::Number { name, value, expected });
            }
        }
        Ok(())
    }
}

/// Prior precisions that `f32` can carry beside the information of a few hundred observations.
const PRECISIONS: core::ops::RangeInclusive<f32> = 1e-6..=1e6;

fn positive_finite(value: f32) -> bool {
    value > 0.0 && value.is_finite()
}

fn samples(averaging: Averaging) -> f32 {
    match averaging {
        Averaging::Exact => 1.0,
        Averaging::Samples(count) => count as f32,
    }
}

fn countable(averaging: Averaging) -> bool {
    match averaging {
        Averaging::Exact => true,
        Averaging::Samples(count) => (1..=MAX_SAMPLES).contains(&count),
    }
}

impl Model<'_> {
    /// The map that these tiles are under this model.
    #[must_use]
    pub fn view<T: TileSource<M, B>, const M: usize, const B: usize>(&self, tiles: T) -> MapView<'_, T, M, B> {
        MapView { basis: &self.basis, tiling: &self.tiling, prior: &self.prior, tiles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{profile, tile::TilingError};

    #[test]
    fn a_stencil_of_any_width_is_refused_at_once() {
        // Walked over, it has 10¹³ nodes.
        let settings = Settings { stencil: 1 << 22, bias: true, ..profile::COMPACT.settings };
        let refused = settings.model().expect_err("no tile is as wide");
        assert_eq!(refused, TilingError::Stencil { stencil: 1 << 22 }.into());
    }
}
