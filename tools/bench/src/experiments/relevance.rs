//! What learned relevance brings (Figs. 3c and 4b): supports of learned shape against isotropic ones of many sizes.

use bhm_core::{kernel::KernelChoice, settings::Settings, support::SupportChoice};
use bhm_host::supports::{RelevanceOptions, learn_relevance};
use serde::Serialize;

use super::trial::{BeamSplit, Trial, table, take};

/// Kernels and isotropic supports that are tried.
#[derive(Clone, Debug)]
pub struct Relevance {
    /// Kernel shapes, in units of spacing².
    pub shapes: Vec<f32>,
    /// Standard deviations of isotropic supports, in spacings.
    pub sizes: Vec<f32>,
}

/// What came of it.
#[derive(Serialize)]
#[serde(transparent)]
pub struct Report(Vec<Trial>);

impl Relevance {
    /// Learns and asks each of them.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn run(&self, task: &BeamSplit, base: &Settings) -> anyhow::Result<Report> {
        let base = Settings { kernel: KernelChoice::SquaredExponential, ..*base };
        let mut marks: Vec<Trial> = Vec::new();
        for shape in &self.shapes {
            let settings = Settings { kernel_shape: *shape, ..base };
            marks.push(take(task, format!("g {shape}, points"), settings, None)?.0);
            for size in &self.sizes {
                let round = Settings { support: SupportChoice::GaussianSupport, support_size: *size, ..settings };
                if round.fitted(bhm_core::support::SupportTable::EMPTY).model().is_ok() {
                    marks.push(take(task, format!("g {shape}, isotropic {size}"), round, None)?.0);
                }
            }
            let learned = learn_relevance(|| &task.scans, &settings, &RelevanceOptions::DEFAULT, String::new())?;
            let supports = learned.supports.interned();
            marks.push(take(task, format!("g {shape}, learned"), settings, Some(supports))?.0);
        }
        Ok(Report(marks))
    }
}

impl Report {
    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        table(&self.0)
    }
}
