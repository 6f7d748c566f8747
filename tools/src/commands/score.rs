use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use bhm_bench::{metrics::Scores, reading};
use bhm_host::dataset::{self, PointLog};
use clap::Args;

use crate::output::{Output, table};

/// Score anyone's answers to the questions of `bhm export points`
///
/// Predictions are a CSV, plain or gzip, with one row for each row of the test points, in their order, and a header that names a
/// column `probability` (from 0 to 1) or `logit` (its log-odds); other columns are passed over.
#[derive(Args, Debug)]
pub(crate) struct Score {
    /// The questions (CSV: scan,x,y,label), plain or gzip
    #[arg(long, value_name = "CSV")]
    test: PathBuf,
    /// The answers
    #[arg(long, value_name = "CSV")]
    predictions: PathBuf,
}

impl Score {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let test = PointLog::read(&self.test)?;
        reading::point_log(&self.test, &test.report);
        // A row that was skipped would shift every answer after it.
        anyhow::ensure!(
            test.report.damaged == 0,
            "{}: {} damaged rows; answers cannot be paired with questions",
            self.test.display(),
            test.report.damaged
        );
        let labels: Vec<bool> = test.scans.into_iter().flat_map(|points| points.occupied).collect();
        let logits = read(&self.predictions)?;
        let scores = Scores::of(&logits, &labels)
            .with_context(|| format!("{} for {}", self.predictions.display(), self.test.display()))?;
        output.result(&scores, || {
            let mut rows = vec![("points", format!("{}, {} of them occupied", scores.points, scores.positives))];
            rows.extend(scores.rows());
            table(&rows)
        })
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Probability,
    Logit,
}

/// Log-odds, row by row.
fn read(path: &Path) -> anyhow::Result<Vec<f64>> {
    let file = || path.display().to_string();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(dataset::open(path)?);
    let header = reader.headers().with_context(file)?;
    let column = |name: &str| header.iter().position(|column| column.trim_start_matches('\u{feff}') == name);
    let (column, kind) = match (column("probability"), column("logit")) {
        (Some(column), None) => (column, Kind::Probability),
        (None, Some(column)) => (column, Kind::Logit),
        _ => bail!("{}: expected a header with either a column `probability` or a column `logit`", file()),
    };
    let (mut logits, mut record) = (Vec::new(), csv::StringRecord::new());
    while reader.read_record(&mut record).with_context(file)? {
        let place = || format!("{}, line {}", file(), record.position().map_or(0, csv::Position::line));
        let cell = record.get(column).unwrap_or_default();
        let value: f64 = cell.parse().with_context(|| format!("{}: {cell:?} is not a number", place()))?;
        logits.push(match kind {
            Kind::Logit => value,
            // Certainty that is only a rounding of what is nearly sure is not punished without limit.
            Kind::Probability if (0.0..=1.0).contains(&value) => {
                let probability = value.clamp(f64::MIN_POSITIVE, 1.0 - 0.5 * f64::EPSILON);
                (probability / (1.0 - probability)).ln()
            }
            Kind::Probability => bail!("{}: {value} is not a probability", place()),
        });
    }
    Ok(logits)
}
