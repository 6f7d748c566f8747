use bhm_bench::evaluation::Truth;
use bhm_core::map::ModelledMap;
use bhm_host::sim::PoseNoise;
use clap::Args;

use super::simulate::Simulated;
use crate::{
    output::Output,
    processes::{MappingRun, MappingRunOptions, Part},
};

/// Points of the world's rectangle that are drawn by lot; those that the map knows are scored.
const TEST_POINTS: usize = 100_000;

/// Map a simulated world with three processes: a robot, the onboard process, a consumer
#[derive(Args, Debug)]
pub(crate) struct Demo {
    #[command(flatten)]
    simulated: Simulated,
    #[command(flatten)]
    part: Part,
    #[command(flatten)]
    options: MappingRunOptions,
}

impl Demo {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.options.effective()? else { return Ok(()) };
        let scene = self.simulated.scene()?;
        let mut arguments = self.part.arguments();
        arguments.extend(options.poses.arguments());
        arguments.extend(self.simulated.arguments());
        let mut title = format!("bhm demo: simulated {}, seed {}", scene.name, self.simulated.seed);
        let PoseNoise { position_m, heading_rad } = self.simulated.pose_noise();
        if position_m > 0.0 || heading_rad > 0.0 {
            title += &format!(", poses off by {position_m} m, {heading_rad} rad");
        }
        let run = MappingRun { title: &title, source: "simulate", arguments, options };
        // Against what is really there, at points that the map knows.
        let truth = |map: &dyn ModelledMap<2>| Truth::known_to(map, &scene.world(), TEST_POINTS, self.simulated.seed);
        run.run(&self.options, |map| Ok(truth(map).score(map)?), output)
    }
}
