use std::path::PathBuf;

use bhm_core::{kernel::KernelChoice, settings::Settings, support::SupportChoice};
use bhm_host::supports::{RelevanceOptions, learn_relevance};
use clap::Args;

use super::trial::{Exam, Marks, table, take};
use crate::{options::MapOptions, output::Output};

/// What learned relevance brings (Figs. 3c and 4b): supports of learned shape against isotropic ones of many sizes
///
/// Every kernel shape of --shapes is tried with points, with isotropic Gaussian supports of each size of --sizes, and with
/// Gaussians learned from the training beams. Held-out beams judge.
#[derive(Args, Debug)]
pub(crate) struct Relevance {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of what is held out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Kernel shapes, in units of spacing²
    #[arg(long, value_delimiter = ',', default_value = "0.45,0.7,1.0", value_name = "LIST")]
    shapes: Vec<f32>,
    /// Standard deviations of isotropic supports, in spacings
    #[arg(long, value_delimiter = ',', default_value = "0.3,0.5,0.7", value_name = "LIST")]
    sizes: Vec<f32>,
    #[command(flatten)]
    map: MapOptions,
}

impl Relevance {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let Some(log) = &self.log else { return Ok(()) };
        let exam = Exam::of_log(log, &options, self.every as usize, 0.1, self.seed)?;
        let base = Settings { kernel: KernelChoice::SquaredExponential, ..options.profile.settings };
        let mut marks: Vec<Marks> = Vec::new();
        for shape in &self.shapes {
            let settings = Settings { kernel_shape: *shape, ..base };
            marks.push(take(&exam, format!("g {shape}, points"), settings, None)?.0);
            for size in &self.sizes {
                let round = Settings { support: SupportChoice::GaussianSupport, support_size: *size, ..settings };
                if round.fitted(bhm_core::support::SupportTable::EMPTY).model().is_ok() {
                    marks.push(take(&exam, format!("g {shape}, isotropic {size}"), round, None)?.0);
                }
            }
            let learned = learn_relevance(|| &exam.scans, &settings, &RelevanceOptions::DEFAULT, String::new())?;
            let supports = learned.supports.interned();
            marks.push(take(&exam, format!("g {shape}, learned"), settings, Some(supports))?.0);
        }
        output.result(&marks, || table(&marks))
    }
}
