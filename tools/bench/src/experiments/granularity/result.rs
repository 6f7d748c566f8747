//! What came out of it: means over the seeds, and who is ahead.

use bhm_core::{
    settings::{Settings, SettingsError},
    support::SupportTable,
};
use bhm_host::{map::AnyMap, supports::LearnedSupports};
use serde::Serialize;

use super::{
    super::trial::{BeamSplit, Trial, take},
    Dataset, NodeSupport,
};
use crate::text::columns;

/// A mean, and how far the seeds lie around it.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Spread {
    pub(super) mean: f64,
    /// Two sample standard deviations; `None` of a single value.
    pub(super) two_sigma: Option<f64>,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean, two_sigma: (values.len() > 1).then(|| 2.0 * (squares / (count - 1.0)).sqrt()) }
    }

    fn text(self, signed: bool) -> String {
        let mean = if signed { format!("{:+.4}", self.mean) } else { format!("{:.4}", self.mean) };
        self.two_sigma.map_or(mean.clone(), |two_sigma| format!("{mean} ± {two_sigma:.4}"))
    }
}

/// One seed's run.
#[derive(Serialize)]
pub(super) struct Run {
    seed: u64,
    #[serde(flatten)]
    marks: Trial,
}

/// One kind of support on one lattice.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) spacing_m: f32,
    #[serde(skip)]
    pub(super) support: NodeSupport,
    pub(super) supports: String,
    /// `None` where the combination was left out.
    pub(super) auc: Option<Spread>,
    pub(super) nll: Option<Spread>,
    ece: Option<Spread>,
    /// Why it was left out, if it was.
    left_out: Option<String>,
    runs: Vec<Run>,
}

/// Learns and asks every task; the map is the first one's. What no stencil is wide enough for is left out, and says so.
pub(super) fn row(
    tasks: &[(u64, BeamSplit)],
    support: NodeSupport,
    settings: Settings,
) -> anyhow::Result<(Row, Option<Box<dyn AnyMap>>)> {
    let (spacing_m, supports) = (settings.spacing_m, support.name());
    let (mut runs, mut first) = (Vec::new(), None);
    for (seed, task) in tasks {
        let table = match usable(support, task, &settings)? {
            Ok(table) => table,
            Err(cut_off) => {
                let left_out = Some(cut_off.to_string());
                return Ok((
                    Row { spacing_m, support, supports, auc: None, nll: None, ece: None, left_out, runs: Vec::new() },
                    None,
                ));
            }
        };
        let (marks, map) = take(task, format!("{spacing_m} m, {supports}, seed {seed}"), settings, table)?;
        anyhow::ensure!(marks.scores.auc.is_some(), "seed {seed}: everything that was held out is of one class");
        runs.push(Run { seed: *seed, marks });
        first.get_or_insert(map);
    }
    let spread = |of: fn(&Trial) -> f64| Some(Spread::of(&runs.iter().map(|run| of(&run.marks)).collect::<Vec<_>>()));
    let (auc, nll, ece) = (spread(auc_of), spread(|marks| marks.scores.nll), spread(|marks| marks.scores.ece));
    Ok((Row { spacing_m, support, supports, auc, nll, ece, left_out: None, runs }, first))
}

fn auc_of(marks: &Trial) -> f64 {
    marks.scores.auc.unwrap_or(f64::NAN)
}

/// The supports that have to be learned; within, why there is no stencil for this.
fn usable(
    support: NodeSupport,
    task: &BeamSplit,
    settings: &Settings,
) -> anyhow::Result<Result<Option<&'static LearnedSupports>, SettingsError>> {
    let with = |table: SupportTable<'static, 2>| settings.fitted(table).model_with(table).err();
    let learned = match with(SupportTable::EMPTY) {
        None => support.learned(task, settings)?,
        Some(cut_off @ SettingsError::CutOff { .. }) => return Ok(Err(cut_off)),
        Some(other) => return Err(other.into()),
    };
    match learned.and_then(|learned| with(learned.table())) {
        None => Ok(Ok(learned)),
        Some(cut_off @ SettingsError::CutOff { .. }) => Ok(Err(cut_off)),
        Some(other) => Err(other.into()),
    }
}

/// Rectangles in closed form against points on one lattice, seed by seed.
#[derive(Serialize)]
struct Gain {
    spacing_m: f32,
    /// The spacing in units of the kernel's width √g.
    widths: f64,
    /// How much greater the AUC is.
    auc: Spread,
    /// How much smaller the NLL is.
    nll: Spread,
}

/// Everything.
#[derive(Serialize)]
pub struct Outcome {
    scene: &'static str,
    shape_m2: f32,
    pub(super) rows: Vec<Row>,
    gains: Vec<Gain>,
}

impl Outcome {
    pub(super) fn new(data: &Dataset, rows: Vec<Row>) -> Self {
        let of = |support: NodeSupport| rows.iter().filter(move |row| row.support == support && !row.runs.is_empty());
        let pairs = of(NodeSupport::Points).filter_map(|points| {
            let areas = of(NodeSupport::Exact).find(|areas| areas.spacing_m == points.spacing_m)?;
            Some((points, areas))
        });
        let gain = |(points, areas): (&Row, &Row)| {
            let difference = |of: fn(&Trial) -> f64| {
                let seeds = areas.runs.iter().zip(&points.runs);
                Spread::of(&seeds.map(|(areas, points)| of(&areas.marks) - of(&points.marks)).collect::<Vec<_>>())
            };
            Gain {
                spacing_m: points.spacing_m,
                widths: f64::from(points.spacing_m) / f64::from(data.shape_m2).sqrt(),
                auc: difference(auc_of),
                nll: difference(|marks| -marks.scores.nll),
            }
        };
        let gains = pairs.map(gain).collect();
        Self { scene: data.scene, shape_m2: data.shape_m2, rows, gains }
    }

    /// Every run in a line.
    pub(super) fn csv(&self) -> String {
        let mut csv = "scene,shape_m2,spacing_m,supports,seed,auc,nll,ece,rows,passes,stencil,tiles\n".to_owned();
        for (row, run) in self.rows.iter().flat_map(|row| row.runs.iter().map(move |run| (row, run))) {
            let Trial { scores, rows, passes, stencil, tiles, .. } = &run.marks;
            csv += &format!(
                "{},{},{},\"{}\",{},{},{},{},{rows},{passes},{stencil},{tiles}\n",
                self.scene,
                self.shape_m2,
                row.spacing_m,
                row.supports,
                run.seed,
                auc_of(&run.marks),
                scores.nll,
                scores.ece
            );
        }
        csv
    }

    /// As tables: each row, and rectangles against points.
    #[must_use]
    pub fn text(&self) -> String {
        let mut table = vec![["spacing m", "supports", "AUC", "NLL", "ECE", "stencil", ""].map(str::to_owned).to_vec()];
        for row in &self.rows {
            let mut cells = vec![row.spacing_m.to_string(), row.supports.clone()];
            let (Some(auc), Some(nll), Some(ece), Some(run)) = (row.auc, row.nll, row.ece, row.runs.first()) else {
                cells.push(format!("left out: {}", row.left_out.as_deref().unwrap_or_default()));
                table.push(cells);
                continue;
            };
            cells.extend([auc, nll, ece].map(|spread| spread.text(false)));
            let rivals = self.rows.iter().filter(|rival| rival.spacing_m == row.spacing_m);
            let least = rivals.filter_map(|rival| rival.nll).map(|nll| nll.mean).fold(f64::INFINITY, f64::min);
            let best = if nll.mean == least { "best NLL here" } else { "" };
            cells.extend([run.marks.stencil.to_string(), best.to_owned()]);
            table.push(cells);
        }
        let head = ["spacing m", "kernel widths", "AUC gain", "NLL gain", "rectangles against points"];
        let mut gains = vec![head.map(str::to_owned).to_vec()];
        gains.extend(self.gains.iter().map(|gain| {
            let verdict = match (gain.auc.mean > 0.0, gain.nll.mean > 0.0) {
                (true, true) => "better in both",
                (true, false) => "better in AUC, worse in NLL",
                (false, true) => "worse in AUC, better in NLL",
                (false, false) => "worse in both",
            };
            let widths = format!("{:.2}", gain.widths);
            vec![gain.spacing_m.to_string(), widths, gain.auc.text(true), gain.nll.text(true), verdict.to_owned()]
        }));
        columns(&table) + "\n" + &columns(&gains)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_two_sample_deviations_and_none_of_a_single_value() {
        // 1, 2, 3, 6: squares around the mean 3 are 14, over 3.
        let spread = Spread::of(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!(spread.mean, 3.0);
        assert!((spread.two_sigma.unwrap() - 2.0 * (14.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!((spread.text(false), spread.text(true)), ("3.0000 ± 4.3205".into(), "+3.0000 ± 4.3205".into()));
        assert_eq!(Spread::of(&[0.5]).text(true), "+0.5000");
    }
}
