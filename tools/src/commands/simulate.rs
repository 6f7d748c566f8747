use bhm_host::sim::Scene;
use clap::{Args, builder::PossibleValuesParser};

use crate::{
    live::{Meeting, Sending},
    output::Output,
};

/// Send the scans of a simulated robot into shared memory
#[derive(Args, Debug)]
pub(crate) struct Simulate {
    #[command(flatten)]
    meeting: Meeting,
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
    /// Seed of the sensor's noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Simulated {
    /// The scene.
    pub(crate) fn scene(&self) -> anyhow::Result<&'static Scene> {
        Ok(Scene::named(&self.scene)?)
    }

    /// Seed of everything that is drawn by lot.
    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// The options that say the same to another process.
    pub(crate) fn arguments(&self) -> [String; 2] {
        [format!("--scene={}", self.scene), format!("--seed={}", self.seed)]
    }
}

impl Simulate {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let (domain, stop) = self.meeting.enter()?;
        let scene = self.simulated.scene()?;
        let scans = self.sending.part.of(scene.simulate(self.simulated.seed));
        let recorded_s = scans.len().saturating_sub(1) as f64 * scene.trajectory().period_ns() as f64 / 1e9;
        self.sending.run(scans, (recorded_s > 0.0).then_some(recorded_s), &domain, &stop, output)
    }
}
