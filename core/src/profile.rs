//! The bill of materials: every capacity and every default, once, with its unit, effect and reason.

use crate::{
    beam::{AnyBeamRule, BeamLimits, PointSamples},
    kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
    prior::{MaternPrior, PriorSettings, WhitePrior},
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    settings::{BiasSettings, Settings, TileSettings},
    support::{PointSettings, SupportSettings, SupportTable},
};

/// A named configuration: what the map learns, and how much memory it may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// The name, as a command line spells it.
    pub name: &'static str,
    /// In a line, what it is for.
    pub purpose: &'static str,
    /// What decides what is learned.
    pub settings: Settings,
    /// How much memory.
    pub capacities: Capacities,
}

/// How many of everything a mapper's [`Memory`](crate::mapper::Memory) holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capacities {
    /// Tile slots. More need more memory (about 47 KB a slot at 12 × 12); fewer go to the archive and back more often.
    pub tiles: usize,
    /// Observations of one scan. Beyond it, beams are thinned evenly and counted.
    pub observations: usize,
    /// Rows of one scan in one tile. Beyond it rows are dropped and counted.
    pub rows: usize,
    /// Tiles that one scan may touch. Beyond it observations are dropped and counted.
    pub touched: usize,
}

/// The square tile of the cubic B-spline: core 8, halo 2. Measured on a recorded log: a halo below 2 loses accuracy against one
/// joint lattice, and a larger core or halo costs several times the work for nothing.
const SPLINE_TILE: Tile = Tile { stencil: 4, width: [12, 12], stride: [8, 8], count: None };

/// The tile of a kernel that needs a stencil of six: core 8, halo 3.
const WIDE_TILE: Tile = Tile { stencil: 6, width: [14, 14], stride: [8, 8], count: None };

/// The tile of supports or kernels so wide that they need a stencil of eight: core 8, halo 4.
const WIDEST_TILE: Tile = Tile { stencil: 8, width: [16, 16], stride: [8, 8], count: None };

/// One joint lattice over [−20, 20] × [−25, 10] m at 0.5 m: 81 × 71 supports, the shorter axis last, for the narrower band.
const PAPER_TILE: Tile = Tile { stencil: 6, width: [81, 71], stride: [75, 65], count: Some([1, 1]) };

/// Its number of supports and its band are a line of [`shape`](crate::shape).
type Tile = TileSettings<2>;

/// What every profile shares unless it says otherwise.
const BASE: Settings = Settings {
    origin_m: [0.0, 0.0],
    spacing_m: 0.25,
    // Ends inside its stencil, so nothing is cut off, and evaluates no exponential.
    kernel: KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT),
    support: SupportSettings::PointSupport(PointSettings::DEFAULT),
    tile: SPLINE_TILE,
    // A field that knows neighbours costs nothing a scan, and what lies between sparse beams is inferred.
    prior: PriorSettings::Matern(MaternPrior::DEFAULT),
    bias: None,
    limits: BeamLimits::DEFAULT,
    beam: AnyBeamRule::PointSamples(PointSamples::DEFAULT),
    rule: AnyRule::GaussianVariational(GaussianVariational::DEFAULT),
    // The first finds the place, the second and third the weight; more gain less than they cost.
    passes: 3,
    forgetting: 1.0,
};

/// Buildings: 0.25 m between supports.
pub const INDOOR: Profile = Profile {
    name: "indoor",
    purpose: "buildings; walls and door frames resolved, 0.25 m between supports",
    settings: BASE,
    capacities: Capacities { tiles: 512, observations: 32_768, rows: 32_768, touched: 1_024 },
};

/// Buildings in detail: 0.15 m between supports.
pub const FINE: Profile = Profile {
    name: "fine",
    purpose: "buildings in detail; 0.15 m between supports, nearly three times the tiles",
    settings: Settings { spacing_m: 0.15, ..BASE },
    capacities: Capacities { tiles: 1_536, observations: 32_768, rows: 32_768, touched: 3_072 },
};

/// Small memories: 0.5 m between supports.
pub const COMPACT: Profile = Profile {
    name: "compact",
    purpose: "small memories and processors; 0.5 m between supports, a quarter of the tiles",
    settings: Settings { spacing_m: 0.5, ..BASE },
    // 64 tiles of 47 KB are 3 MB and cover 32 × 32 m at once.
    capacities: Capacities { tiles: 64, observations: 4_096, rows: 4_096, touched: 128 },
};

/// Sites of hundreds of metres: 1 m between supports.
pub const OUTDOOR: Profile = Profile {
    name: "outdoor",
    purpose: "sites of hundreds of metres; 1 m between supports",
    settings: Settings {
        spacing_m: 1.0,
        limits: BeamLimits {
            range_max_m: 80.0,
            // Outdoors most missing returns are sky and open ground; half a typical range is a cautious share of it.
            no_return_free_m: 20.0,
        },
        // Sites are wider than rooms: what lies between sparse beams is alike over more metres.
        prior: PriorSettings::Matern(MaternPrior { range_m: 8.0, ..MaternPrior::DEFAULT }),
        beam: AnyBeamRule::PointSamples(PointSamples { free_spacing_m: 2.0, gap_m: 0.3 }),
        ..BASE
    },
    capacities: Capacities { tiles: 1_024, observations: 65_536, rows: 65_536, touched: 2_048 },
};

/// The paper's own choices, on one joint lattice.
pub const PAPER: Profile = Profile {
    name: "paper",
    purpose: "the paper's choices: squared exponential, Jaakkola-Jordan, bias, one joint lattice; slow",
    settings: Settings {
        origin_m: [-20.0, -25.0],
        spacing_m: 0.5,
        kernel: KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT),
        tile: PAPER_TILE,
        // Λ₀ = 10⁻⁴ I, the bias like every weight.
        prior: PriorSettings::White(WhitePrior::DEFAULT),
        bias: Some(BiasSettings { precision: 1e-4 }),
        rule: AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::Constant(1.0) }),
        // "1–2 iterations".
        passes: 2,
        ..BASE
    },
    capacities: Capacities { tiles: 1, observations: 32_768, rows: 32_768, touched: 1 },
};

impl core::fmt::Display for Profile {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

/// Every profile.
pub const ALL: [&Profile; 5] = [&INDOOR, &FINE, &COMPACT, &OUTDOOR, &PAPER];

/// The profile of that name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Profile> {
    ALL.into_iter().find(|profile| profile.name == name)
}

/// What a stencil may cut off without a wider one being taken: invisible beside the rounding of `f32`.
const UNSEEN_CUT_OFF: f32 = 1e-4;

impl Settings {
    /// Takes another kernel, and the prior and tile that fit it; see [`fitted`](Self::fitted).
    #[must_use]
    pub fn with_kernel(self, kernel: KernelSettings) -> Self {
        Self { kernel, ..self }.fitted(&SupportTable::EMPTY)
    }

    /// Takes independent weights if the prior is not defined for the kernel, and the narrowest tile whose stencil cuts off nothing that could be seen of the kernel averaged over each support,
    /// and the widest if each does. A bounded area ([`TileSettings::count`]) keeps its tile.
    ///
    /// Whether what is cut off is acceptable at all, [`model_with`](Self::model_with) says.
    #[must_use]
    pub fn fitted(self, supports: &SupportTable<'_, 2>) -> Self {
        let suited = Self { prior: self.prior.or_white(&self.kernel), ..self };
        if self.tile.count.is_some() {
            return suited;
        }
        let with = |tile: &Tile| Self { tile: *tile, ..suited };
        let fits = |settings: &Self| settings.basis(supports.clone()).cut_off() <= UNSEEN_CUT_OFF;
        [SPLINE_TILE, WIDE_TILE].iter().map(with).find(fits).unwrap_or_else(|| with(&WIDEST_TILE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{settings::SettingsError, shape::SHAPES};

    #[test]
    fn every_profile_is_usable_and_has_a_compiled_shape() {
        for profile in ALL {
            for kernel in KernelSettings::ALL {
                let settings = profile.settings.with_kernel(*kernel);
                let model = match settings.model() {
                    Ok(model) => model,
                    // An area of its own keeps its tile, whatever the kernel needs.
                    Err(SettingsError::CutOff { .. }) if settings.tile.count.is_some() => continue,
                    Err(error) => panic!("{} with {}: {error}", profile.name, kernel.name()),
                };
                let window = model.tiling.window(&[0, 0]);
                let fits =
                    SHAPES.iter().any(|(m, b)| window.supports() == *m && window.band(settings.tile.stencil) <= *b);
                assert!(fits, "{} with {} needs a shape of its own", profile.name, kernel.name());
            }
            assert_eq!(named(profile.name).map(|p| p.name), Some(profile.name));
        }
    }
}
