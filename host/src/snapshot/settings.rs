//! How settings and capacities are written: mirrors of the core's types, which know no serialisation.
//!
//! A field or variant added to the core fails to compile here until it is added too (variants at the end), and
//! [`VERSION`](super::VERSION) raised.

use bhm_core::{
    beam::{BeamChoice, BeamLimits},
    kernel::{Averaging, KernelChoice},
    profile::Capacities,
    rule::{AnyRule, GaussianVariational, JaakkolaJordan, XiStart},
    settings::Settings,
    support::SupportChoice,
};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(remote = "Settings")]
pub(super) struct SettingsDef {
    origin_m: [f32; 2],
    spacing_m: f32,
    #[serde(with = "kernel_by_name")]
    kernel: KernelChoice,
    kernel_shape: f32,
    #[serde(with = "support_by_name")]
    support: SupportChoice,
    support_size: f32,
    #[serde(with = "AveragingDef")]
    support_averaging: Averaging,
    stencil: usize,
    tile_width: [usize; 2],
    tile_stride: [usize; 2],
    tile_count: Option<[usize; 2]>,
    prior_precision: f32,
    bias: bool,
    bias_precision: f32,
    #[serde(with = "BeamLimitsDef")]
    limits: BeamLimits,
    #[serde(with = "beam_by_name")]
    beam: BeamChoice,
    free_spacing_m: f32,
    segment_length: f32,
    #[serde(with = "AveragingDef")]
    segment_averaging: Averaging,
    gap_m: f32,
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

/// What has a name is written by it, so that a further kernel, support or beam rule changes nothing here.
macro_rules! by_name {
    ($($module:ident => $choice:ty),* $(,)?) => {
        $(mod $module {
            use serde::{Deserialize, Deserializer, Serializer, de::Error};

            pub(super) fn serialize<S: Serializer>(choice: &$choice, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_str(choice.name())
            }

            pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<$choice, D::Error> {
                let name = <&str>::deserialize(from)?;
                let known = <$choice>::ALL.iter().find(|choice| choice.name() == name);
                known.copied().ok_or_else(|| D::Error::custom("unknown name"))
            }
        })*
    };
}

by_name! {
    kernel_by_name => bhm_core::kernel::KernelChoice,
    support_by_name => bhm_core::support::SupportChoice,
    beam_by_name => bhm_core::beam::BeamChoice,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Averaging")]
enum AveragingDef {
    Exact,
    Samples(u32),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "BeamLimits")]
struct BeamLimitsDef {
    range_max_m: f32,
    no_return_free_m: f32,
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
