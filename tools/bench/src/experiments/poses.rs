//! What knowing the poses' uncertainty brings (eq. 13): noisy poses taken as exact against their covariance used.

use bhm_core::{kernel::KernelChoice, settings::Settings, support::SupportTable};
use bhm_host::{
    ScanRecord,
    sim::{PoseNoise, Scene},
};
use serde::Serialize;

use super::trial::{BeamSplit, Trial, take};
use crate::{
    evaluation::Truth,
    metrics::{ScoreError, Scores},
    text,
};

/// Noise that is tried.
#[derive(Clone, Debug)]
pub struct Poses {
    /// World, route and lidar.
    pub scene: &'static Scene,
    /// Every how many scans are used.
    pub every: usize,
    /// Seed of all noise, of what is held out and of what is asked.
    pub seed: u64,
    /// Standard deviations of the position along each axis, metres.
    pub position_noise: Vec<f64>,
    /// Standard deviations of the heading, radians.
    pub heading_noise: Vec<f64>,
}

/// What came of it.
#[derive(Serialize)]
#[serde(transparent)]
pub struct Report(Vec<Contestant>);

/// Points of the world's rectangle that are drawn by lot.
const POINTS: usize = 50_000;

/// Kernels that are tried, whatever is configured: of one a blur is closed form, of the other quadrature.
const KERNELS: [KernelChoice; 2] = [KernelChoice::SquaredExponential, KernelChoice::CubicBSpline];

#[derive(Serialize)]
struct Contestant {
    position_m: f64,
    heading_rad: f64,
    covariance_used: bool,
    /// Held-out beams.
    #[serde(flatten)]
    marks: Trial,
    /// The true world.
    world: Scores,
}

impl Poses {
    /// Learns and asks each of them.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn run(&self, base: &Settings) -> anyhow::Result<Report> {
        let scene = self.scene;
        let scans = |noise: PoseNoise| -> anyhow::Result<Vec<ScanRecord>> {
            Ok(scene.simulate(self.seed).with_pose_noise(noise)?.step_by(self.every).collect())
        };
        let exact = BeamSplit::of(&scans(PoseNoise::NONE)?, 0.1, self.seed)?;
        let with = |kernel| Settings { kernel, ..*base }.fitted(SupportTable::EMPTY);

        let mut contestants = Vec::new();
        let mut truth: Option<Truth> = None;
        for kernel in KERNELS {
            let (marks, map) = take(&exact, format!("{}, no noise", kernel.name()), with(kernel), None)?;
            // Known is what the first of these maps knows: the same points for all.
            let truth = truth.get_or_insert_with(|| {
                Truth::known_to(&map.model(), |at| map.occupancy(at), &scene.world(), POINTS, self.seed)
            });
            let world = truth.score(|at| map.occupancy(at))?.ok_or(ScoreError::Empty)?;
            contestants.push(Contestant { position_m: 0.0, heading_rad: 0.0, covariance_used: false, marks, world });
        }
        let Some(truth) = truth else { return Ok(Report(contestants)) };
        let pairs = self.position_noise.iter().flat_map(|m| self.heading_noise.iter().map(move |rad| (*m, *rad)));
        for (position_m, heading_rad) in pairs {
            // The ranges are the same bit for bit, and so are the dice: the same beams are held out.
            let noisy = BeamSplit::of(&scans(PoseNoise { position_m, heading_rad })?, 0.1, self.seed)?.scans;
            for kernel in KERNELS {
                for covariance_used in [false, true] {
                    let scans = noisy.iter().cloned().map(|scan| ScanRecord {
                        pose_covariance: scan.pose_covariance.filter(|_| covariance_used),
                        ..scan
                    });
                    let task = BeamSplit { scans: scans.collect(), test: exact.test.clone() };
                    let used = if covariance_used { "covariance used" } else { "taken as exact" };
                    let (marks, map) = take(&task, format!("{}, {used}", kernel.name()), with(kernel), None)?;
                    let world = truth.score(|at| map.occupancy(at))?.ok_or(ScoreError::Empty)?;
                    contestants.push(Contestant { position_m, heading_rad, covariance_used, marks, world });
                }
            }
        }
        Ok(Report(contestants))
    }
}

impl Report {
    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        let contestants = &self.0;
        let head =
            ["position m", "heading rad", "", "beams AUC", "NLL", "ECE", "world AUC", "NLL", "ECE", "narrowed", "rows"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(contestants.iter().map(|Contestant { position_m, heading_rad, marks, world, .. }| {
            let scores = |scores: &Scores| {
                let auc = scores.auc.map_or("-".to_owned(), |auc| format!("{auc:.5}"));
                [auc, format!("{:.5}", scores.nll), format!("{:.5}", scores.ece)]
            };
            let narrowed = format!("{:.1} %", 100.0 * marks.narrowed as f64 / marks.observations.max(1) as f64);
            let mut cells = vec![position_m.to_string(), heading_rad.to_string(), marks.name.clone()];
            cells.extend(scores(&marks.scores));
            cells.extend(scores(world));
            cells.extend([narrowed, marks.rows.to_string()]);
            cells
        }));
        text::columns(&rows)
    }
}
