//! What one kernel brings over another at equal spacing, and what several on one lattice bring.

use bhm_core::{kernel::KernelChoice, settings::Settings, support::SupportTable};
use serde::Serialize;

use super::trial::{BeamSplit, Trial, table_with, take};
use crate::cost;

/// Kernels that are tried beside the cubic B-spline.
#[derive(Clone, Debug)]
pub struct Kernels {
    /// Shapes of the squared exponential, in units of spacing².
    pub shapes: Vec<f32>,
    /// Shapes of the narrower of two scales, in units of spacing².
    pub two_scales_shapes: Vec<f32>,
}

#[derive(Serialize)]
struct Contestant {
    #[serde(flatten)]
    marks: Trial,
    kernel: &'static str,
    /// Null where the kernel reads none.
    kernel_shape: Option<f32>,
    /// Modelled from what was learned.
    instructions_per_scan: f64,
}

/// What came of it.
#[derive(Serialize)]
pub struct Report {
    contestants: Vec<Contestant>,
    /// What no map can be made with, and why.
    refused: Vec<String>,
}

impl Kernels {
    /// Learns and asks each of them.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn run(&self, task: &BeamSplit, base: &Settings) -> anyhow::Result<Report> {
        let shaped = |kernel: KernelChoice, shapes: &[f32]| -> Vec<(KernelChoice, Option<f32>)> {
            shapes.iter().map(|shape| (kernel, Some(*shape))).collect()
        };
        let candidates = [
            vec![(KernelChoice::CubicBSpline, None)],
            shaped(KernelChoice::SquaredExponential, &self.shapes),
            shaped(KernelChoice::TwoScales, &self.two_scales_shapes),
        ];
        let mut report = Report { contestants: Vec::new(), refused: Vec::new() };
        for (kernel, kernel_shape) in candidates.concat() {
            let settings = Settings { kernel, kernel_shape: kernel_shape.unwrap_or(base.kernel_shape), ..*base };
            let settings = settings.fitted(SupportTable::EMPTY);
            let name = kernel_shape.map_or(kernel.name().to_owned(), |shape| format!("{} {shape}", kernel.name()));
            if let Err(error) = settings.model() {
                report.refused.push(format!("{name}: {error}"));
                continue;
            }
            let (marks, _) = take(task, name, settings, None)?;
            let instructions_per_scan =
                cost::instructions(&settings, marks.rows, marks.passes)? / task.scans.len() as f64;
            report.contestants.push(Contestant { marks, kernel: kernel.name(), kernel_shape, instructions_per_scan });
        }
        Ok(report)
    }
}

impl Report {
    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        let marks: Vec<&Trial> = self.contestants.iter().map(|contestant| &contestant.marks).collect();
        let cost = self.contestants.iter().map(|one| format!("{:.2}", one.instructions_per_scan / 1e6)).collect();
        let refused: String = self.refused.iter().map(|refused| format!("refused: {refused}\n")).collect();
        table_with(&marks, &[("M instr/scan", cost)]) + &refused
    }
}
