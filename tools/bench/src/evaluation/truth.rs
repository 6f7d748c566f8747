use bhm_core::{
    geometry::Point,
    map::{Map, ModelledMap, Occupancy},
};
use bhm_host::sim::World;
use bhm_plot::knowledge::is_known;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::metrics::{ScoreError, Scores};

/// Points of a simulated world about which a map knows something, and what really stands there; what moves is not part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    points_m: Vec<Point<2>>,
    occupied: Vec<bool>,
}

impl Truth {
    /// Of so many points of the world's rectangle, drawn by lot, those that a map knows.
    pub fn known_to(map: &dyn ModelledMap<2>, world: &World, points: usize, seed: u64) -> Self {
        let bounds = world.bounds();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut truth = Self { points_m: Vec::new(), occupied: Vec::new() };
        for _ in 0..points {
            let at = [0, 1].map(|axis| rng.random_range(bounds.min[axis]..bounds.max[axis]) as f32);
            let point_m = Point::from(at);
            if is_known(map, &point_m, &map.occupancy(&point_m)) {
                truth.points_m.push(point_m);
                truth.occupied.push(world.is_occupied(at));
            }
        }
        truth
    }

    /// How well a map, that one or another, predicts them; `None` if there are none.
    ///
    /// # Errors
    /// If the map says of a point what is no number.
    pub fn score(&self, map: &dyn Map<2>) -> Result<Option<Scores>, ScoreError> {
        let mut answers = vec![Occupancy::UNKNOWN; self.points_m.len()];
        map.occupancies(&self.points_m, &mut answers);
        let logits: Vec<f32> = answers.iter().map(Occupancy::logit).collect();
        if logits.is_empty() { Ok(None) } else { Scores::of(&logits, &self.occupied).map(Some) }
    }
}
