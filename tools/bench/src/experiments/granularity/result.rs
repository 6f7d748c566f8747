//! What came out of it: means over the seeds, and who is ahead.

use std::path::PathBuf;

use bhm_core::{
    settings::{Settings, SettingsError},
    support::SupportTable,
};
use bhm_host::{map::AnyMap, supports::LearnedSupports};
use serde::Serialize;

use super::{
    super::{Trial, Variant},
    Dataset, NodeSupport,
};
use crate::{
    evaluation::BeamSplit,
    metrics::Spread,
    text::{Report, columns, headed},
};

/// One seed's run.
#[derive(Serialize)]
pub(super) struct Run {
    seed: u64,
    #[serde(flatten)]
    trial: Trial,
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

/// Has every split learned and asked; the map is the first one's. What no stencil is wide enough for is left out, and says so.
pub(super) fn row(
    splits: &[(u64, BeamSplit)],
    support: NodeSupport,
    settings: Settings,
) -> anyhow::Result<(Row, Option<Box<dyn AnyMap>>)> {
    let (spacing_m, supports) = (settings.spacing_m, support.name());
    let (mut runs, mut first) = (Vec::new(), None);
    for (seed, split) in splits {
        let table = match usable(support, split, &settings)? {
            Ok(table) => table,
            Err(cut_off) => {
                let left_out = Some(cut_off.to_string());
                return Ok((
                    Row { spacing_m, support, supports, auc: None, nll: None, ece: None, left_out, runs: Vec::new() },
                    None,
                ));
            }
        };
        let name = format!("{spacing_m} m, {supports}, seed {seed}");
        let (trial, map) = Trial::run(split, &Variant { name, settings, supports: table })?;
        anyhow::ensure!(trial.scores.auc.is_some(), "seed {seed}: everything that was held out is of one class");
        runs.push(Run { seed: *seed, trial });
        first.get_or_insert(map);
    }
    let spread = |of: fn(&Trial) -> f64| Spread::of(&runs.iter().map(|run| of(&run.trial)).collect::<Vec<_>>());
    let (auc, nll, ece) = (spread(auc_of), spread(|trial| trial.scores.nll), spread(|trial| trial.scores.ece));
    Ok((Row { spacing_m, support, supports, auc, nll, ece, left_out: None, runs }, first))
}

fn auc_of(trial: &Trial) -> f64 {
    trial.scores.auc.unwrap_or(f64::NAN)
}

/// The supports that have to be learned; within, why there is no stencil for this.
fn usable(
    support: NodeSupport,
    split: &BeamSplit,
    settings: &Settings,
) -> anyhow::Result<Result<Option<LearnedSupports>, SettingsError>> {
    let cut_off = |table: &SupportTable<'static, 2>| match settings.fitted(table).model_with(table.clone()) {
        Ok(_) => Ok(None),
        Err(cut_off @ SettingsError::CutOff { .. }) => Ok(Some(cut_off)),
        Err(other) => Err(other),
    };
    if let Some(cut_off) = cut_off(&SupportTable::EMPTY)? {
        return Ok(Err(cut_off));
    }
    let learned = support.learned(split, settings)?;
    let cut_off = learned.as_ref().map_or(Ok(None), |learned| cut_off(learned.table()))?;
    Ok(cut_off.map_or(Ok(learned), Err))
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
pub struct Compared {
    scene: &'static str,
    shape_m2: f32,
    pub(super) rows: Vec<Row>,
    gains: Vec<Gain>,
    #[serde(skip)]
    pub(super) pictures: Vec<PathBuf>,
}

impl Compared {
    pub(super) fn new(data: &Dataset, rows: Vec<Row>) -> Self {
        let of = |support: NodeSupport| rows.iter().filter(move |row| row.support == support && !row.runs.is_empty());
        let pairs = of(NodeSupport::Points).filter_map(|points| {
            let areas = of(NodeSupport::Exact).find(|areas| areas.spacing_m == points.spacing_m)?;
            Some((points, areas))
        });
        let gain = |(points, areas): (&Row, &Row)| {
            let difference = |of: fn(&Trial) -> f64| {
                let seeds = areas.runs.iter().zip(&points.runs);
                Spread::of(&seeds.map(|(areas, points)| of(&areas.trial) - of(&points.trial)).collect::<Vec<_>>())
            };
            Some(Gain {
                spacing_m: points.spacing_m,
                widths: f64::from(points.spacing_m) / f64::from(data.shape_m2).sqrt(),
                auc: difference(auc_of)?,
                nll: difference(|trial| -trial.scores.nll)?,
            })
        };
        let gains = pairs.filter_map(gain).collect();
        Self { scene: data.scene, shape_m2: data.shape_m2, rows, gains, pictures: Vec::new() }
    }

    /// Every run in a line.
    pub(super) fn csv(&self) -> String {
        let mut csv = "scene,shape_m2,spacing_m,supports,seed,auc,nll,ece,rows,passes,stencil,tiles\n".to_owned();
        for (row, run) in self.rows.iter().flat_map(|row| row.runs.iter().map(move |run| (row, run))) {
            let Trial { scores, rows, passes, stencil, tiles, .. } = &run.trial;
            csv += &format!(
                "{},{},{},\"{}\",{},{},{},{},{rows},{passes},{stencil},{tiles}\n",
                self.scene,
                self.shape_m2,
                row.spacing_m,
                row.supports,
                run.seed,
                auc_of(&run.trial),
                scores.nll,
                scores.ece
            );
        }
        csv
    }
}

impl Report for Compared {
    /// Each row, and rectangles against points; then the files.
    fn text(&self) -> String {
        let mut table = headed(["spacing m", "supports", "AUC", "NLL", "ECE", "stencil", ""]);
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
            cells.extend([run.trial.stencil.to_string(), best.to_owned()]);
            table.push(cells);
        }
        let mut gains = headed(["spacing m", "kernel widths", "AUC gain", "NLL gain", "rectangles against points"]);
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
        columns(&table) + "\n" + &columns(&gains) + "\n" + &bhm_plot::folder::list(&self.pictures)
    }
}
