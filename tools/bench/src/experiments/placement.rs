//! What placing supports by data brings over a lattice: the dense posterior, with as many supports and the same kernel.

use std::collections::BTreeSet;

use anyhow::Context;
use bhm_core::{
    geometry::Point,
    kernel::SquaredExponentialSettings,
    settings::Settings,
    support::{AnySupport, SupportTable},
};
use bhm_host::supports::observe;
use serde::Serialize;

use super::squared_exponential;
use crate::{
    evaluation::BeamSplit,
    metrics::Scores,
    progress,
    scattered::{Cluster, ClusterOptions, Clusters, ScatteredSupport, learn_clusters, open_scattered},
    text::{Report, columns, headed},
};

/// Placements that are tried beside a lattice over the box around all data and one over the cells that hold data.
#[derive(Clone, Debug)]
pub struct Placement<'a> {
    /// Clusters that are given.
    pub given: Option<Clusters>,
    /// Numbers of supports, where none are given.
    pub counts: &'a [usize],
    /// Shapes of the squared exponential, in units of the squared pitch of the lattice over the cells that hold data.
    pub shapes: &'a [f32],
    /// How many observations a hit counts as when clusters are looked for.
    pub hit_weights: &'a [f32],
    /// Seed of where clusters begin.
    pub seed: u64,
}

/// What came of it.
#[derive(Serialize)]
#[serde(transparent)]
pub struct Compared(Vec<Contestant>);

/// How a placement did.
#[derive(Serialize)]
struct Contestant {
    name: String,
    supports: usize,
    /// g, m².
    kernel_shape_m2: f32,
    #[serde(flatten)]
    scores: Scores,
    rows: u64,
}

impl Placement<'_> {
    /// Learns and asks each of them.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn compare(&self, split: &BeamSplit, base: &Settings) -> anyhow::Result<Compared> {
        let given = self.given.as_ref();
        let base = Settings { kernel: squared_exponential(SquaredExponentialSettings::DEFAULT.shape), ..*base };
        let data = Data::of(split, &base)?;
        let counts = given.map_or_else(|| self.counts.to_vec(), |given| vec![given.clusters.len()]);
        let mut contestants = Vec::new();
        for count in counts {
            let (pitch_m, observed) = data.observed_cells(count);
            let mut placements = vec![
                ("lattice over the box".to_owned(), data.whole_box(count)),
                ("lattice over data".to_owned(), observed),
            ];
            match given {
                Some(given) => placements.extend(of_clusters(given, "list")),
                None => {
                    for hit_weight in self.hit_weights {
                        let options = ClusterOptions {
                            clusters: count,
                            hit_weight: *hit_weight,
                            seed: self.seed,
                            ..ClusterOptions::DEFAULT
                        };
                        let clusters = learn_clusters(|| &split.training, &base, &options)?;
                        let clusters = Clusters { source: String::new(), clusters };
                        placements.extend(of_clusters(&clusters, &format!("k-means, hits {hit_weight}")));
                    }
                }
            }
            for shape in self.shapes {
                // The lattice of the settings is not the map's; its spacing gives the kernel's shape its unit.
                let settings = Settings { spacing_m: pitch_m, kernel: squared_exponential(*shape), ..base };
                let settings = settings.fitted(&SupportTable::EMPTY);
                let kernel_shape_m2 = shape * pitch_m * pitch_m;
                for (name, supports) in &placements {
                    contestants.push(learned(split, name, settings, kernel_shape_m2, supports)?);
                }
            }
        }
        Ok(Compared(contestants))
    }
}

fn of_clusters(clusters: &Clusters, name: &str) -> [(String, Vec<ScatteredSupport>); 2] {
    let clusters = &clusters.clusters;
    [
        (format!("{name}, centres"), clusters.iter().map(Cluster::point).collect()),
        (
            format!("{name}, Gaussians"),
            clusters.iter().map(|cluster| cluster.gaussian().unwrap_or_else(|| cluster.point())).collect(),
        ),
    ]
}

fn learned(
    split: &BeamSplit,
    name: &str,
    settings: Settings,
    kernel_shape_m2: f32,
    supports: &[ScatteredSupport],
) -> anyhow::Result<Contestant> {
    let title = format!("{}: g {kernel_shape_m2:.3} m2, {name}", supports.len());
    let mut map = open_scattered(settings, supports.to_vec())?;
    let mut rows = 0;
    for scan in progress::over(split.training.iter(), title.clone()) {
        rows += map.integrate(scan).with_context(|| title.clone())? as u64;
    }
    let scores = split.test.score(|point_m| map.occupancy(point_m))?;
    Ok(Contestant { name: name.to_owned(), supports: supports.len(), kernel_shape_m2, scores, rows })
}

/// Where the training beams say anything.
struct Data {
    points_m: Vec<Point<2>>,
    low_m: Point<2>,
    high_m: Point<2>,
}

impl Data {
    fn of(split: &BeamSplit, settings: &Settings) -> anyhow::Result<Self> {
        let mut points_m = Vec::new();
        for scan in &split.training {
            observe(scan, settings, |observation| points_m.push(observation.place.middle_m()));
        }
        let first = *points_m.first().ok_or_else(|| anyhow::anyhow!("the scans hold no usable observation"))?;
        let low_m = points_m.iter().fold(first, |low, at| low.zip_map(at, f32::min));
        let high_m = points_m.iter().fold(first, |high, at| high.zip_map(at, f32::max));
        Ok(Self { points_m, low_m, high_m })
    }

    /// The finest square lattice of at most `count` supports over the whole box.
    fn whole_box(&self, count: usize) -> Vec<ScatteredSupport> {
        let size_m = self.high_m - self.low_m;
        let cells = |pitch_m: f32| [0, 1].map(|axis| (size_m[axis] / pitch_m).ceil().max(1.0) as i32);
        let pitch_m = self.finest(|pitch_m| cells(pitch_m).iter().map(|n| *n as usize).product::<usize>() <= count);
        let [columns, rows] = cells(pitch_m);
        // The lattice is centred on the box.
        let spare_m = [columns, rows].map(|n| n as f32 * pitch_m);
        let corner_m = Point::from_fn(|axis, _| self.low_m[axis] - 0.5 * (spare_m[axis] - size_m[axis]));
        let all = (0..columns).flat_map(|x| (0..rows).map(move |y| [x, y]));
        all.map(|cell| at(&corner_m, cell, pitch_m)).collect()
    }

    /// The finest square lattice of which at most `count` cells hold data, and a support in the middle of each of them.
    fn observed_cells(&self, count: usize) -> (f32, Vec<ScatteredSupport>) {
        let cells = |pitch_m: f32| -> BTreeSet<[i32; 2]> {
            let cell = |at: &Point<2>| [0, 1].map(|axis| ((at[axis] - self.low_m[axis]) / pitch_m).floor() as i32);
            self.points_m.iter().map(cell).collect()
        };
        let pitch_m = self.finest(|pitch_m| cells(pitch_m).len() <= count);
        (pitch_m, cells(pitch_m).into_iter().map(|cell| at(&self.low_m, cell, pitch_m)).collect())
    }

    /// The smallest pitch that fits, by bisection from one that covers everything with one cell.
    fn finest(&self, fits: impl Fn(f32) -> bool) -> f32 {
        let (mut low, mut high) =
            (0.0, 2.0 * (self.high_m - self.low_m).iter().fold(1e-3, |most: f32, side| most.max(*side)));
        for _ in 0..16 {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }
}

fn at(corner_m: &Point<2>, cell: [i32; 2], pitch_m: f32) -> ScatteredSupport {
    let centre_m = Point::from_fn(|axis, _| corner_m[axis] + (cell[axis] as f32 + 0.5) * pitch_m);
    ScatteredSupport { centre_m, support: AnySupport::default() }
}

impl Report for Compared {
    fn text(&self) -> String {
        let contestants = &self.0;
        let best = contestants.iter().map(|one| one.scores.nll).fold(f64::INFINITY, f64::min);
        let mut rows = headed(["", "supports", "g m2", "AUC", "NLL", "ECE", "rows", ""]);
        rows.extend(contestants.iter().map(|Contestant { name, supports, kernel_shape_m2, scores, rows }| {
            let [auc, nll, ece] = scores.cells();
            vec![
                name.clone(),
                supports.to_string(),
                format!("{kernel_shape_m2:.3}"),
                auc,
                nll,
                ece,
                rows.to_string(),
                if scores.nll == best { "best".to_owned() } else { String::new() },
            ]
        }));
        columns(&rows)
    }
}
