use std::path::PathBuf;

use bhm_core::{kernel::KernelChoice, settings::Settings, support::SupportTable};
use clap::Args;
use serde::Serialize;

use super::{
    cost,
    trial::{Exam, Marks, table_with, take},
};
use crate::{options::MapOptions, output::Output};

/// What one kernel brings over another at equal spacing, and what several on one lattice bring
///
/// The cubic B-spline, the squared exponential at every shape of --shapes, and the sum of two squared exponentials, the second
/// of twice the length scale, at every shape of --two-scales-shapes. Held-out beams judge.
#[derive(Args, Debug)]
pub(crate) struct Kernels {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of what is held out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Shapes of the squared exponential, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.2,0.3,0.45,0.6,0.8,1.0,1.5", value_name = "LIST")]
    shapes: Vec<f32>,
    /// Shapes of the narrower of two scales, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.1,0.2,0.3,0.45,0.6", value_name = "LIST")]
    two_scales_shapes: Vec<f32>,
    #[command(flatten)]
    map: MapOptions,
}

#[derive(Serialize)]
struct Contestant {
    #[serde(flatten)]
    marks: Marks,
    kernel: &'static str,
    /// Null where the kernel reads none.
    kernel_shape: Option<f32>,
    /// Modelled from what was learned.
    instructions_per_scan: f64,
}

#[derive(Serialize)]
struct Report {
    contestants: Vec<Contestant>,
    /// What no map can be made with, and why.
    refused: Vec<String>,
}

impl Kernels {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let Some(log) = &self.log else { return Ok(()) };
        let exam = Exam::of_log(log, &options, self.every as usize, 0.1, self.seed)?;
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
            let base = options.profile.settings;
            let settings = Settings { kernel, kernel_shape: kernel_shape.unwrap_or(base.kernel_shape), ..base };
            let settings = settings.fitted(SupportTable::EMPTY);
            let name = kernel_shape.map_or(kernel.name().to_owned(), |shape| format!("{} {shape}", kernel.name()));
            if let Err(error) = settings.model() {
                report.refused.push(format!("{name}: {error}"));
                continue;
            }
            let (marks, _) = take(&exam, name, settings, None)?;
            let instructions_per_scan =
                cost::instructions(&settings, marks.rows, marks.passes)? / exam.scans.len() as f64;
            report.contestants.push(Contestant { marks, kernel: kernel.name(), kernel_shape, instructions_per_scan });
        }
        output.result(&report, || report.text())
    }
}

impl Report {
    fn text(&self) -> String {
        let marks: Vec<&Marks> = self.contestants.iter().map(|contestant| &contestant.marks).collect();
        let cost = self.contestants.iter().map(|one| format!("{:.2}", one.instructions_per_scan / 1e6)).collect();
        let refused: String = self.refused.iter().map(|refused| format!("refused: {refused}\n")).collect();
        table_with(&marks, &[("M instr/scan", cost)]) + &refused
    }
}
