//! The bill of materials: every capacity and every default, once, with its unit, effect and reason.

use crate::{
    beam::{BeamChoice, BeamLimits},
    kernel::{Averaging, KernelChoice},
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    settings::Settings,
    support::{SupportChoice, SupportTable},
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

/// How many of everything; each is the length of a slice of [`Memory`](crate::mapper::Memory).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Tile slots. More need more memory (about 47 KB a slot at 12 × 12); fewer go to the archive and back more often.
    pub tiles: usize,
    /// Observations of one scan. Beyond it, beams are thinned evenly and counted.
    pub points: usize,
    /// Rows of one scan in one tile. Beyond it rows are dropped and counted.
    pub rows: usize,
    /// Tiles that one scan may touch. Beyond it observations are dropped and counted.
    pub touched: usize,
}

/// The square tile of the cubic B-spline: core 8, halo 2. Measured on a recorded log: a halo below 2 loses accuracy against one
/// joint lattice, and a larger core or halo costs several times the work for nothing.
const SPLINE_TILE: Tile = Tile { width: [12, 12], stride: [8, 8], stencil: 4 };

/// The tile of a kernel that needs a stencil of six: core 8, halo 3.
const WIDE_TILE: Tile = Tile { width: [14, 14], stride: [8, 8], stencil: 6 };

/// The tile of supports or kernels so wide that they need a stencil of eight: core 8, halo 4.
const WIDEST_TILE: Tile = Tile { width: [16, 16], stride: [8, 8], stencil: 8 };

/// One joint lattice over [−20, 20] × [−25, 10] m at 0.5 m: 81 × 71 supports, the shorter axis last, for the narrower band.
const PAPER_TILE: Tile = Tile { width: [81, 71], stride: [75, 65], stencil: 6 };

/// Its number of supports and its band are a line of [`shape`](crate::shape).
struct Tile {
    width: [usize; 2],
    stride: [usize; 2],
    stencil: usize,
}

/// What every profile shares unless it says otherwise.
const BASE: Settings = Settings {
    origin_m: [0.0, 0.0],
    spacing_m: 0.25,
    // Ends inside its stencil, so nothing is cut off, and evaluates no exponential.
    kernel: KernelChoice::CubicBSpline,
    // g = 0.6 h²: the paper's 0.15 m² at its 0.5 m. Only the squared exponential reads it.
    kernel_shape: 0.6,
    support: SupportChoice::PointSupport,
    // A rectangle as wide as the spacing tessellates the plane. A point has no size.
    support_size: 1.0,
    support_averaging: Averaging::Exact,
    stencil: SPLINE_TILE.stencil,
    tile_width: SPLINE_TILE.width,
    tile_stride: SPLINE_TILE.stride,
    tile_count: None,
    // The paper's Λ₀: nearly flat, so that one beam already decides an unobserved place.
    prior_precision: 1e-4,
    // Gains nothing on a lattice that nearly spans the constants.
    bias: false,
    // A few units of log-odds at most: one tile's bias must not speak for places it never saw.
    bias_precision: 1.0,
    limits: BeamLimits {
        // Indoor lidars see no further; longer readings of a log are mirrors and windows more often than walls.
        range_max_m: 40.0,
        // A missing return indoors is more often a black or shiny surface than free space.
        no_return_free_m: 0.0,
    },
    beam: BeamChoice::PointSamples,
    // One free point a metre: denser ones only repeat what neighbouring beams say.
    free_spacing_m: 1.0,
    // Only line segments read it: long enough that the lattice's own lines, and not the chain's joints, cut most of them.
    segment_length: 4.0,
    segment_averaging: Averaging::Exact,
    // Two or three standard deviations of a lidar's range noise.
    gap_m: 0.1,
    rule: AnyRule::GaussianVariational(GaussianVariational { xi_cap: 4.0 }),
    // The first finds the place, the second and third the weight; more gain less than they cost.
    passes: 3,
    forgetting: 1.0,
};

/// Buildings: 0.25 m between supports.
pub const INDOOR: Profile = Profile {
    name: "indoor",
    purpose: "buildings; walls and door frames resolved, 0.25 m between supports",
    settings: BASE,
    capacities: Capacities { tiles: 512, points: 32_768, rows: 32_768, touched: 1_024 },
};

/// Small memories: 0.5 m between supports.
pub const COMPACT: Profile = Profile {
    name: "compact",
    purpose: "small memories and processors; 0.5 m between supports, a quarter of the tiles",
    settings: Settings { spacing_m: 0.5, ..BASE },
    // 64 tiles of 47 KB are 3 MB and cover 32 × 32 m at once.
    capacities: Capacities { tiles: 64, points: 4_096, rows: 4_096, touched: 128 },
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
        free_spacing_m: 2.0,
        gap_m: 0.3,
        ..BASE
    },
    capacities: Capacities { tiles: 1_024, points: 65_536, rows: 65_536, touched: 2_048 },
};

/// The paper's own choices, on one joint lattice.
pub const PAPER: Profile = Profile {
    name: "paper",
    purpose: "the paper's choices: squared exponential, Jaakkola-Jordan, bias, one joint lattice; slow",
    settings: Settings {
        origin_m: [-20.0, -25.0],
        spacing_m: 0.5,
        kernel: KernelChoice::SquaredExponential,
        stencil: PAPER_TILE.stencil,
        tile_width: PAPER_TILE.width,
        tile_stride: PAPER_TILE.stride,
        tile_count: Some([1, 1]),
        bias: true,
        // Λ₀ = 10⁻⁴ I, the bias like every weight.
        bias_precision: 1e-4,
        rule: AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::Constant(1.0) }),
        // "1–2 iterations".
        passes: 2,
        ..BASE
    },
    capacities: Capacities { tiles: 1, points: 32_768, rows: 32_768, touched: 1 },
};

impl core::fmt::Display for Profile {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

/// Every profile.
pub const ALL: [&Profile; 4] = [&INDOOR, &COMPACT, &OUTDOOR, &PAPER];

/// The profile of that name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Profile> {
    ALL.into_iter().find(|profile| profile.name == name)
}

/// What a stencil may cut off without a wider one being taken: invisible beside the rounding of `f32`.
const UNSEEN_CUT_OFF: f32 = 1e-4;

impl Settings {
    /// Takes another kernel, and the tile that fits its reach; see [`fitted`](Self::fitted).
    #[must_use]
    pub fn with_kernel(self, kernel: KernelChoice) -> Self {
        Self { kernel, ..self }.fitted(SupportTable::EMPTY)
    }

    /// Takes the narrowest tile whose stencil cuts off nothing that could be seen of the kernel averaged over each support,
    /// and the widest if each does. An area of its own ([`tile_count`](Settings::tile_count)) keeps its tile.
    ///
    /// Whether what is cut off is acceptable at all, [`model_with`](Self::model_with) says.
    #[must_use]
    pub fn fitted(self, supports: SupportTable<'_, 2>) -> Self {
        if self.tile_count.is_some() {
            return self;
        }
        let with =
            |tile: &Tile| Self { stencil: tile.stencil, tile_width: tile.width, tile_stride: tile.stride, ..self };
        let fits = |settings: &Self| settings.basis(supports).cut_off() <= UNSEEN_CUT_OFF;
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
            for kernel in KernelChoice::ALL {
                let settings = profile.settings.with_kernel(*kernel);
                let model = match settings.model() {
                    Ok(model) => model,
                    // An area of its own keeps its tile, whatever the kernel needs.
                    Err(SettingsError::CutOff { .. }) if settings.tile_count.is_some() => continue,
                    Err(error) => panic!("{} with {}: {error}", profile.name, kernel.name()),
                };
                let window = model.tiling.window(&[0, 0]);
                let fits = SHAPES.iter().any(|(m, b)| window.supports() == *m && window.band(settings.stencil) <= *b);
                assert!(fits, "{} with {} needs a shape of its own", profile.name, kernel.name());
            }
            assert_eq!(named(profile.name).map(|p| p.name), Some(profile.name));
        }
    }
}
