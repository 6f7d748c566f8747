use bhm_host::sim::{PoseNoise, Scene, Simulation};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};

use crate::{
    options::number,
    output::Output,
    processes::{DomainOptions, Sending},
};

/// Send the scans of a simulated robot into shared memory
#[derive(Args, Debug)]
pub(crate) struct Simulate {
    #[command(flatten)]
    domain: DomainOptions,
    #[command(flatten)]
    simulated: Simulated,
    #[command(flatten)]
    sending: Sending,
}

/// What is simulated.
#[derive(Args, Clone, Debug)]
pub(crate) struct Simulated {
    /// World, route and lidar
    #[arg(long, default_value = "building", value_parser = PossibleValuesParser::new(Scene::names()))]
    scene: String,
    /// Seed of all noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Standard deviation of the position that the robot reports, along each axis, metres
    #[arg(long, value_name = "M", default_value_t = 0.0, value_parser = deviation())]
    position_noise: f64,
    /// Standard deviation of the heading that the robot reports, radians
    #[arg(long, value_name = "RAD", default_value_t = 0.0, value_parser = deviation())]
    heading_noise: f64,
}

impl Simulated {
    /// The scene.
    pub(crate) fn scene(&self) -> anyhow::Result<&'static Scene> {
        Ok(Scene::named(&self.scene)?)
    }

    /// How far off the poses are that the robot reports.
    pub(crate) fn pose_noise(&self) -> PoseNoise {
        PoseNoise { position_m: self.position_noise, heading_rad: self.heading_noise }
    }

    /// All scans.
    fn simulation(&self) -> anyhow::Result<Simulation> {
        Ok(self.scene()?.simulate(self.seed).with_pose_noise(self.pose_noise())?)
    }

    /// The options that say the same to another process.
    pub(crate) fn arguments(&self) -> [String; 4] {
        [
            format!("--scene={}", self.scene),
            format!("--seed={}", self.seed),
            format!("--position-noise={}", self.position_noise),
            format!("--heading-noise={}", self.heading_noise),
        ]
    }
}

impl Simulate {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let (domain, stop) = self.domain.join()?;
        let scene = self.simulated.scene()?;
        let scans = self.sending.part.of(self.simulated.simulation()?);
        let recorded_s = scans.len().saturating_sub(1) as f64 * scene.trajectory().period_ns() as f64 / 1e9;
        self.sending.run(scans, (recorded_s > 0.0).then_some(recorded_s), &domain, &stop, output)
    }
}

fn deviation() -> impl TypedValueParser<Value = f64> {
    number(|deviation| *deviation >= 0.0 && deviation.is_finite(), "a standard deviation of at least 0")
}
