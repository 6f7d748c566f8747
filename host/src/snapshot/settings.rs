//! How settings and capacities are written: mirrors of the core's types, which know no serialisation.
//!
//! A field or variant added to the core fails to compile here until it is added too (variants at the end), and
//! [`VERSION`](super::VERSION) raised.

use bhm_core::{
    beam::{AnyBeamRule, BeamLimits, PointSamples},
    kernel::KernelChoice,
    profile::Capacities,
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    settings::Settings,
    support::{AnySupport, PointSupport},
};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(remote = "Settings")]
pub(super) struct SettingsDef {
    origin_m: [f32; 2],
    spacing_m: f32,
    #[serde(with = "KernelChoiceDef")]
    kernel: KernelChoice,
    kernel_shape: f32,
    #[serde(with = "AnySupportDef")]
    support: AnySupport,
    stencil: usize,
    tile_width: [usize; 2],
    tile_stride: [usize; 2],
    tile_count: Option<[usize; 2]>,
    prior_precision: f32,
    bias: bool,
    bias_precision: f32,
    #[serde(with = "BeamLimitsDef")]
    limits: BeamLimits,
    #[serde(with = "AnyBeamRuleDef")]
    beam: AnyBeamRule,
    #[serde(with = "AnyRuleDef")]
    rule: AnyRule,
    passes: u32,
    forgetting: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Capacities")]
pub(super) struct CapacitiesDef {
    tiles: usize,
    points: usize,
    rows: usize,
    touched: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "KernelChoice")]
enum KernelChoiceDef {
    CubicBSpline,
    SquaredExponential,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "AnySupport")]
enum AnySupportDef {
    PointSupport(#[serde(with = "PointSupportDef")] PointSupport),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PointSupport")]
struct PointSupportDef;

#[derive(Serialize, Deserialize)]
#[serde(remote = "BeamLimits")]
struct BeamLimitsDef {
    range_max_m: f32,
    no_return_free_m: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "AnyBeamRule")]
enum AnyBeamRuleDef {
    PointSamples(#[serde(with = "PointSamplesDef")] PointSamples),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PointSamples")]
struct PointSamplesDef {
    free_spacing_m: f32,
    gap_m: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "AnyRule")]
enum AnyRuleDef {
    GaussianVariational(#[serde(with = "GaussianVariationalDef")] GaussianVariational),
    JaakkolaJordan(#[serde(with = "JaakkolaJordanDef")] JaakkolaJordan),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "GaussianVariational")]
struct GaussianVariationalDef {
    xi_cap: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "JaakkolaJordan")]
struct JaakkolaJordanDef {
    #[serde(with = "XiStartDef")]
    start: XiStart,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "XiStart")]
enum XiStartDef {
    Constant(f32),
    PredictedUpTo(f32),
}
