use bhm_core::{geometry::Point, kernel::KernelChoice, settings::Settings, support::SupportTable};
use bhm_host::{
    ScanRecord,
    map::AnyMap,
    sim::{PoseNoise, Scene, World},
};
use bhm_tools::metrics::Scores;
use clap::{Args, builder::PossibleValuesParser};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::trial::{Exam, Marks, take};
use crate::{
    known::Knowledge,
    options::MapOptions,
    output::{self, Output},
};

/// What knowing the poses' uncertainty brings (eq. 13): noisy poses taken as exact against their covariance used
///
/// A simulated robot reports poses with errors of every standard deviation of --position-noise and --heading-noise. Its scans
/// are learned with and without the covariance of those errors. Held-out beams, asked where they really went, judge, and so
/// does the true world at points drawn by lot, of which those count that a map of the noise-free scans knows.
#[derive(Args, Debug)]
pub(crate) struct Poses {
    /// World, route and lidar
    #[arg(long, default_value = "building", value_parser = PossibleValuesParser::new(Scene::names()))]
    scene: String,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Seed of all noise, of what is held out and of what is asked
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviations of the position along each axis, metres
    #[arg(long, value_delimiter = ',', default_value = "0.05,0.1,0.2", value_name = "LIST")]
    position_noise: Vec<f64>,
    /// Standard deviations of the heading, radians
    #[arg(long, value_delimiter = ',', default_value = "0.01,0.03", value_name = "LIST")]
    heading_noise: Vec<f64>,
    #[command(flatten)]
    map: MapOptions,
}

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
    marks: Marks,
    /// The true world.
    world: Scores,
}

impl Poses {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let scene = Scene::named(&self.scene)?;
        let scans = |noise: PoseNoise| -> anyhow::Result<Vec<ScanRecord>> {
            Ok(scene.simulate(self.seed).with_pose_noise(noise)?.step_by(self.every as usize).collect())
        };
        let exact = Exam::of(&scans(PoseNoise::NONE)?, 0.1, self.seed)?;
        let with = |kernel| Settings { kernel, ..options.profile.settings }.fitted(SupportTable::EMPTY);

        let mut contestants = Vec::new();
        let mut truth: Option<Truth> = None;
        for kernel in KERNELS {
            let (marks, map) = take(&exact, format!("{}, no noise", kernel.name()), with(kernel), None)?;
            // Known is what the first of these maps knows: the same points for all.
            let truth = truth.get_or_insert_with(|| Truth::known_to(&*map, &scene.world(), self.seed));
            let world = truth.score(&*map)?;
            contestants.push(Contestant { position_m: 0.0, heading_rad: 0.0, covariance_used: false, marks, world });
        }
        let Some(truth) = truth else { return Ok(()) };
        let pairs = self.position_noise.iter().flat_map(|m| self.heading_noise.iter().map(move |rad| (*m, *rad)));
        for (position_m, heading_rad) in pairs {
            // The ranges are the same bit for bit, and so are the dice: the same beams are held out.
            let noisy = Exam::of(&scans(PoseNoise { position_m, heading_rad })?, 0.1, self.seed)?.scans;
            for kernel in KERNELS {
                for covariance_used in [false, true] {
                    let scans = noisy.iter().cloned().map(|scan| ScanRecord {
                        pose_covariance: scan.pose_covariance.filter(|_| covariance_used),
                        ..scan
                    });
                    let exam = Exam { scans: scans.collect(), test: exact.test.clone() };
                    let used = if covariance_used { "covariance used" } else { "taken as exact" };
                    let (marks, map) = take(&exam, format!("{}, {used}", kernel.name()), with(kernel), None)?;
                    let world = truth.score(&*map)?;
                    contestants.push(Contestant { position_m, heading_rad, covariance_used, marks, world });
                }
            }
        }
        output.result(&contestants, || table(&contestants))
    }
}

/// Points of the world, and what is there.
struct Truth {
    points_m: Vec<Point<2>>,
    occupied: Vec<bool>,
}

impl Truth {
    fn known_to(map: &dyn AnyMap, world: &World, seed: u64) -> Self {
        let model = map.model();
        let knowledge = Knowledge::of(&model);
        let bounds = world.bounds();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut truth = Self { points_m: Vec::new(), occupied: Vec::new() };
        for _ in 0..POINTS {
            let at = [0, 1].map(|axis| rng.random_range(bounds.min[axis]..bounds.max[axis]) as f32);
            let point_m = Point::from(at);
            if knowledge.is_known(&point_m, &map.occupancy(&point_m)) {
                truth.points_m.push(point_m);
                truth.occupied.push(world.is_occupied(at));
            }
        }
        truth
    }

    fn score(&self, map: &dyn AnyMap) -> anyhow::Result<Scores> {
        let logits: Vec<f32> = self.points_m.iter().map(|point_m| map.occupancy(point_m).logit()).collect();
        Ok(Scores::of(&logits, &self.occupied)?)
    }
}

fn table(contestants: &[Contestant]) -> String {
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
    output::columns(&rows)
}
