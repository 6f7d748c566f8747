use bhm_core::geometry::Point;
use bhm_host::sim::{PoseNoise, World};
use bhm_tools::metrics::Scores;
use clap::Args;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::simulate::Simulated;
use crate::{
    known::Knowledge,
    live::{Exhibition, Exhibits, Finished, Part},
    output::Output,
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
    exhibits: Exhibits,
}

impl Demo {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.exhibits.effective()? else { return Ok(()) };
        let scene = self.simulated.scene()?;
        let mut arguments = self.part.arguments();
        arguments.extend(options.poses.arguments());
        arguments.extend(self.simulated.arguments());
        let mut title = format!("bhm demo: simulated {}, seed {}", scene.name, self.simulated.seed());
        let PoseNoise { position_m, heading_rad } = self.simulated.pose_noise();
        if position_m > 0.0 || heading_rad > 0.0 {
            title += &format!(", poses off by {position_m} m, {heading_rad} rad");
        }
        let exhibition = Exhibition { title: &title, source: "simulate", arguments, options };
        exhibition.hold(&self.exhibits, |map| score(map, &scene.world(), self.simulated.seed()), output)
    }
}

/// Scores the map against what really stands there (what moves is not part of it) at points that it knows; `None` if it knows none.
fn score(map: &Finished<'_>, world: &World, seed: u64) -> anyhow::Result<Option<Scores>> {
    let knowledge = Knowledge::of(&map.model);
    let bounds = world.bounds();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut logits, mut occupied) = (Vec::new(), Vec::new());
    for _ in 0..TEST_POINTS {
        let at = [0, 1].map(|axis| rng.random_range(bounds.min[axis]..bounds.max[axis]) as f32);
        let point_m = Point::<2>::from(at);
        let occupancy = (map.occupancy)(&point_m);
        if knowledge.is_known(&point_m, &occupancy) {
            logits.push(occupancy.logit());
            occupied.push(world.is_occupied(at));
        }
    }
    Ok(if logits.is_empty() { None } else { Some(Scores::of(&logits, &occupied)?) })
}
