//! What one kernel brings over another at equal spacing, and what several on one lattice bring.

use bhm_core::{
    kernel::KernelChoice,
    settings::{Settings, SettingsError},
};
use serde::Serialize;

use super::trial::{Columns, Table, Trial, Variant};
use crate::{evaluation::BeamSplit, text::Report};

/// What a kernel is and costs.
#[derive(Serialize)]
pub struct KernelColumns {
    kernel: &'static str,
    /// Null where the kernel reads none.
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
    let shaped = |kernel: KernelChoice, shapes: &[f32]| -> Vec<Variant> {
        let one = |shape: &f32| {
            let settings = Settings { kernel, kernel_shape: *shape, ..*base };
            Variant::new(format!("{} {shape}", kernel.name()), settings)
        };
        shapes.iter().map(one).collect()
    };
    let spline = KernelChoice::CubicBSpline;
    let mut variants = vec![Variant::new(spline.name(), Settings { kernel: spline, ..*base })];
    variants.extend(shaped(KernelChoice::SquaredExponential, shapes));
    variants.extend(shaped(KernelChoice::TwoScales, two_scales_shapes));
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

impl Columns for KernelColumns {
    const HEADS: &'static [&'static str] = &["M instr/scan"];

    fn of(trial: &Trial, settings: &Settings) -> Result<Self, SettingsError> {
        let Settings { kernel, kernel_shape, .. } = *settings;
        Ok(Self {
            kernel: kernel.name(),
            kernel_shape: (kernel != KernelChoice::CubicBSpline).then_some(kernel_shape),
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
