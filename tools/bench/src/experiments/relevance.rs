//! What learned relevance brings (Figs. 3c and 4b): supports of learned shape against isotropic ones of many sizes.

use bhm_core::{
    settings::Settings,
    support::{GaussianSettings, SupportSettings},
};
use bhm_host::supports::{RelevanceOptions, learn_relevance};

use super::{
    squared_exponential,
    trial::{NoColumns, Table, Variant},
};
use crate::evaluation::BeamSplit;

/// Learns and asks points, isotropic supports of these standard deviations in spacings, and learned ones, each with kernels of
/// these shapes, in units of spacing².
///
/// # Errors
/// If a variant cannot learn all that it is shown.
pub fn compare(split: &BeamSplit, base: &Settings, shapes: &[f32], sizes: &[f32]) -> anyhow::Result<Table<NoColumns>> {
    let mut variants = Vec::new();
    for shape in shapes {
        let points = Settings { kernel: squared_exponential(*shape), ..*base };
        variants.push(Variant::new(format!("g {shape}, points"), points));
        let isotropic = sizes.iter().map(|size| {
            let support = SupportSettings::GaussianSupport(GaussianSettings { size: *size });
            let settings = Settings { support, ..points };
            Variant::new(format!("g {shape}, isotropic {size}"), settings)
        });
        variants.extend(isotropic.filter(|variant| variant.fitted().model().is_ok()));
        let learned = learn_relevance(|| &split.training, &points, &RelevanceOptions::DEFAULT, String::new())?;
        variants.push(Variant::new(format!("g {shape}, learned"), points).with_supports(learned.supports));
    }
    Table::run(split, &variants)
}
