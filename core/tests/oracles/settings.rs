//! Settings that no map can be made with are refused, each by its name.

use bhm_core::{
    beam::{AnyBeamRule, BeamLimits, LineSegments, PointSamples},
    kernel::{KernelSettings, SquaredExponentialSettings, TwoScalesSettings},
    prior::{PriorSettings, WhitePrior},
    profile::COMPACT,
    settings::{BiasSettings, Settings, SettingsError, TileSettings},
    tile::TilingError,
};

const GOOD: Settings = COMPACT.settings;

#[test]
fn numbers_outside_their_range_are_refused_by_name() {
    assert!(GOOD.model().is_ok());
    let limits =
        |range_max_m, no_return_free_m| Settings { limits: BeamLimits { range_max_m, no_return_free_m }, ..GOOD };
    let with_kernel = |kernel| Settings { kernel, ..GOOD };
    let prior = |precision| Settings { prior: PriorSettings::White(WhitePrior { precision }), ..GOOD };
    let points = |rule| Settings { beam: AnyBeamRule::PointSamples(rule), ..GOOD };
    let segments = |rule| Settings { beam: AnyBeamRule::LineSegments(rule), ..GOOD };
    for (name, bad) in [
        ("origin x", Settings { origin_m: [f32::NAN, 0.0], ..GOOD }),
        ("origin y", Settings { origin_m: [0.0, f32::INFINITY], ..GOOD }),
        ("spacing", Settings { spacing_m: 0.0, ..GOOD }),
        ("kernel shape", with_kernel(KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: -0.6 }))),
        ("kernel shape", with_kernel(KernelSettings::TwoScales(TwoScalesSettings { shape: f32::INFINITY }))),
        ("prior precision", prior(1e-7)),
        ("prior precision", prior(1e7)),
        ("bias precision", Settings { bias: Some(BiasSettings { precision: 0.0 }), ..GOOD }),
        ("maximum range", limits(0.0, 0.0)),
        ("no-return range", limits(10.0, -1.0)),
        ("free spacing", points(PointSamples { free_spacing_m: 0.0, ..PointSamples::DEFAULT })),
        ("segment length", segments(LineSegments { length: 1_001.0, ..LineSegments::DEFAULT })),
        ("gap before a hit", points(PointSamples { gap_m: -0.1, ..PointSamples::DEFAULT })),
        ("gap before a hit", segments(LineSegments { gap_m: -0.1, ..LineSegments::DEFAULT })),
        ("passes", Settings { passes: 0, ..GOOD }),
        ("passes", Settings { passes: 101, ..GOOD }),
        ("forgetting", Settings { forgetting: 0.0, ..GOOD }),
        ("forgetting", Settings { forgetting: 1.0_f32.next_up(), ..GOOD }),
    ] {
        let error = bad.model().expect_err(name);
        assert!(matches!(error, SettingsError::Number { name: named, .. } if named == name), "{name}: {error}");
    }
}

/// A region of nine cells: a stride of eight overlaps by one, of five by four, of four by five, more than a stride.
#[test]
fn tiles_overlap_by_one_cell_to_one_stride() {
    let with =
        |stride: usize| Settings { tile: TileSettings { stride: [8, stride], ..GOOD.tile }, ..GOOD }.model().map(drop);
    for stride in 1..=12 {
        let expected = if (5..=8).contains(&stride) {
            Ok(())
        } else {
            Err(SettingsError::Tiling(TilingError::Overlap { width: 12, stride }))
        };
        assert_eq!(with(stride), expected, "a stride of {stride}");
    }
}

/// `exp(−s²/g)`, `s` half a stencil: 5e-3 is allowed.
#[test]
fn a_kernel_that_its_stencil_cuts_off_too_early_is_refused() {
    for (shape, stencil) in [(0.6_f32, 4_usize), (1.5, 4), (0.6, 6), (2.5, 6)] {
        // A tile as much wider as the stencil is, so that nothing else is wrong.
        let tile = TileSettings { stencil, width: [8 + stencil; 2], ..GOOD.tile };
        let kernel = KernelSettings::SquaredExponential(SquaredExponentialSettings { shape });
        let settings = Settings { tile, ..GOOD.with_kernel(kernel) };
        let half = 0.5 * stencil as f64;
        let exact = (-half * half / f64::from(shape)).exp();
        match settings.model() {
            Ok(_) => assert!(exact < 5e-3, "{shape}, {stencil}: {exact}"),
            Err(SettingsError::CutOff { cut_off, .. }) => {
                assert!(exact > 5e-3 && (f64::from(cut_off) - exact).abs() < 1e-6, "{shape}, {stencil}: {cut_off}");
            }
            Err(error) => panic!("{shape}, {stencil}: {error}"),
        }
    }
}
