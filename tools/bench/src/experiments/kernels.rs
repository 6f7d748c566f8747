//! What one kernel brings over another at equal spacing, and what several on one lattice bring.

use bhm_core::{
    kernel::{CubicBSplineSettings, KernelSettings, TwoScalesSettings},
    settings::{Settings, SettingsError},
};
use serde::Serialize;

use super::{
    squared_exponential,
    trial::{Columns, Table, Trial, Variant},
};
use crate::{evaluation::BeamSplit, text::Report};

/// What a kernel is and costs.
#[derive(Serialize)]
pub struct KernelColumns {
    kernel: &'static str,
    /// Null where the kernel has none.
    kernel_shape: Option<f32>,
    /// Modelled from what was learned.
    instructions_per_scan: f64,
}

/// What came of it.
#[derive(Serialize)]
pub struct Compared {
    contestants: Table<KernelColumns>,
    /// What no map can be made with, and why.
    refused: Vec<String>,
}

/// Learns and asks the cubic B-spline, squared exponentials of these shapes, in units of spacing², and sums of two of them, of
/// which the narrower has these shapes.
///
/// # Errors
/// If a variant cannot learn all that it is shown.
pub fn compare(
    split: &BeamSplit,
    base: &Settings,
    shapes: &[f32],
    two_scales_shapes: &[f32],
) -> anyhow::Result<Compared> {
    let with = |kernel: KernelSettings| {
        let name = shape_of(&kernel).map_or(kernel.name().to_owned(), |shape| format!("{} {shape}", kernel.name()));
        Variant::new(name, Settings { kernel, ..*base })
    };
    let two_scales = |shape| KernelSettings::TwoScales(TwoScalesSettings { shape });
    let mut variants = vec![with(KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT))];
    variants.extend(shapes.iter().map(|shape| with(squared_exponential(*shape))));
    variants.extend(two_scales_shapes.iter().map(|shape| with(two_scales(*shape))));
    let mut refused = Vec::new();
    variants.retain(|variant| match variant.fitted().model() {
        Ok(_) => true,
        Err(error) => {
            refused.push(format!("{}: {error}", variant.name));
            false
        }
    });
    Ok(Compared { contestants: Table::run(split, &variants)?, refused })
}

/// The shape of a kernel that has one, in units of spacing².
fn shape_of(kernel: &KernelSettings) -> Option<f32> {
    match kernel {
        KernelSettings::SquaredExponential(kernel) => Some(kernel.shape),
        KernelSettings::TwoScales(kernel) => Some(kernel.shape),
        _ => None,
    }
}

impl Columns for KernelColumns {
    const HEADS: &'static [&'static str] = &["M instr/scan"];

    fn of(trial: &Trial, settings: &Settings) -> Result<Self, SettingsError> {
        Ok(Self {
            kernel: settings.kernel.name(),
            kernel_shape: shape_of(&settings.kernel),
            instructions_per_scan: trial.instructions_per_scan(settings)?,
        })
    }

    fn cells(&self) -> Vec<String> {
        vec![format!("{:.2}", self.instructions_per_scan / 1e6)]
    }
}

impl Report for Compared {
    fn text(&self) -> String {
        let refused: String = self.refused.iter().map(|refused| format!("refused: {refused}\n")).collect();
        self.contestants.text() + &refused
    }
}
