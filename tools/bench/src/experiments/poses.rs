//! What knowing the poses' uncertainty brings (eq. 13): noisy poses taken as exact against their covariance used.

use bhm_core::{
    kernel::{CubicBSplineSettings, KernelSettings, SquaredExponentialSettings},
    settings::Settings,
};
use bhm_host::{
    ScanRecord,
    sim::{PoseNoise, Scene},
};
use serde::Serialize;

use super::{Trial, Variant, split};
use crate::{
    evaluation::{BeamSplit, Truth},
    metrics::{ScoreError, Scores},
    text::{Report, columns, headed},
};

/// Noise that is tried.
#[derive(Clone, Debug)]
pub struct Poses<'a> {
    /// World, route and lidar.
    pub scene: &'static Scene,
    /// Every how many scans are used.
    pub every: usize,
    /// Seed of all noise, of what is held out and of what is asked.
    pub seed: u64,
    /// Standard deviations of the position along each axis, metres.
    pub position_noise: &'a [f64],
    /// Standard deviations of the heading, radians.
    pub heading_noise: &'a [f64],
}

/// What came of it.
#[derive(Serialize)]
#[serde(transparent)]
pub struct Compared(Vec<Contestant>);

/// Points of the world's rectangle that are drawn by lot.
const POINTS: usize = 50_000;

/// Kernels that are tried, whatever is configured: of one a blur is closed form, of the other quadrature.
const KERNELS: [KernelSettings; 2] = [
    KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT),
    KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT),
];

#[derive(Serialize)]
struct Contestant {
    position_m: f64,
    heading_rad: f64,
    covariance_used: bool,
    /// Held-out beams.
    #[serde(flatten)]
    trial: Trial,
    /// The true world.
    world: Scores,
}

impl Poses<'_> {
    /// Learns and asks each of them.
    ///
    /// # Errors
    /// If a contestant cannot learn all that it is shown.
    pub fn compare(&self, base: &Settings) -> anyhow::Result<Compared> {
        let scene = self.scene;
        let scans = |noise: PoseNoise| -> anyhow::Result<Vec<ScanRecord>> {
            Ok(scene.simulate(self.seed).with_pose_noise(noise)?.step_by(self.every).collect())
        };
        let exact = split(&scans(PoseNoise::NONE)?, self.seed)?;
        let variant = |kernel: KernelSettings, name: &str| {
            Variant::new(format!("{}, {name}", kernel.name()), Settings { kernel, ..*base })
        };

        let mut contestants = Vec::new();
        let mut truth: Option<Truth> = None;
        for kernel in KERNELS {
            let (trial, map) = Trial::run(&exact, &variant(kernel, "no noise"))?;
            // Known is what the first of these maps knows: the same points for all.
            let truth = truth.get_or_insert_with(|| Truth::known_to(&*map, &scene.world(), POINTS, self.seed));
            let world = truth.score(&*map)?.ok_or(ScoreError::Empty)?;
            contestants.push(Contestant { position_m: 0.0, heading_rad: 0.0, covariance_used: false, trial, world });
        }
        let Some(truth) = truth else { return Ok(Compared(contestants)) };
        let pairs = self.position_noise.iter().flat_map(|m| self.heading_noise.iter().map(move |rad| (*m, *rad)));
        for (position_m, heading_rad) in pairs {
            // The ranges are the same bit for bit, and so are the dice: the same beams are held out.
            let noisy = split(&scans(PoseNoise { position_m, heading_rad })?, self.seed)?;
            for kernel in KERNELS {
                for covariance_used in [false, true] {
                    let scans = noisy.training.iter().cloned().map(|mut scan| {
                        scan.header.pose_covariance = scan.header.pose_covariance.filter(|_| covariance_used);
                        scan
                    });
                    let split = BeamSplit {
                        training: scans.collect(),
                        test: exact.test.clone(),
                        held: noisy.held,
                        of: noisy.of,
                    };
                    let used = if covariance_used { "covariance used" } else { "taken as exact" };
                    let (trial, map) = Trial::run(&split, &variant(kernel, used))?;
                    let world = truth.score(&*map)?.ok_or(ScoreError::Empty)?;
                    contestants.push(Contestant { position_m, heading_rad, covariance_used, trial, world });
                }
            }
        }
        Ok(Compared(contestants))
    }
}

impl Report for Compared {
    fn text(&self) -> String {
        let contestants = &self.0;
        let head =
            ["position m", "heading rad", "", "beams AUC", "NLL", "ECE", "world AUC", "NLL", "ECE", "narrowed", "rows"];
        let mut rows = headed(head);
        rows.extend(contestants.iter().map(|Contestant { position_m, heading_rad, trial, world, .. }| {
            let narrowed = format!("{:.1} %", 100.0 * trial.narrowed as f64 / trial.observations.max(1) as f64);
            let mut cells = vec![position_m.to_string(), heading_rad.to_string(), trial.name.clone()];
            cells.extend(trial.scores.cells());
            cells.extend(world.cells());
            cells.extend([narrowed, trial.rows.to_string()]);
            cells
        }));
        columns(&rows)
    }
}
