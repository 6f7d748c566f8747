use bhm_host::sim::World;

use crate::evaluation::{Task, TrainingScan};

/// Distance between the places asked, metres times the scale of the place.
const SPACING_M: f32 = 0.5;

/// Beams pass at least so many spacings from an unseen place.
const CLEARANCE: i64 = 1;

/// Places that no training beam of a task came near, and what really stands there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnseenPlaces {
    /// Metres.
    pub points_m: Vec<[f32; 2]>,
    /// Whether an obstacle that stands still is there.
    pub occupied: Vec<bool>,
}

impl UnseenPlaces {
    /// The centres of a grid over the world's bounds whose cells, and the cells around them, no training ray touches.
    #[must_use]
    pub fn of(world: &World, task: &Task, scale: f32) -> Self {
        let cell_m = SPACING_M * scale;
        let bounds = world.bounds();
        let min_m = bounds.min.map(|x| x as f32);
        let shape = [0, 1].map(|axis| ((bounds.max[axis] as f32 - min_m[axis]) / cell_m).ceil().max(0.0) as usize);
        let mut seen = vec![false; shape[0] * shape[1]];
        let mut mark = |point_m: [f32; 2]| {
            let [x, y] = [0, 1].map(|axis| ((point_m[axis] - min_m[axis]) / cell_m).floor() as i64);
            for y in y - CLEARANCE..=y + CLEARANCE {
                for x in x - CLEARANCE..=x + CLEARANCE {
                    let inside = |i: i64, axis: usize| usize::try_from(i).ok().filter(|i| *i < shape[axis]);
                    if let (Some(x), Some(y)) = (inside(x, 0), inside(y, 1)) {
                        seen[y * shape[0] + x] = true;
                    }
                }
            }
        };
        for shown in &task.training {
            along(shown, 0.5 * cell_m, &mut mark);
        }
        let mut places = Self::default();
        for (slot, _) in seen.iter().enumerate().filter(|(_, seen)| !**seen) {
            let [x, y] = [slot % shape[0], slot / shape[0]].map(|i| i as f32 + 0.5);
            let point_m = [min_m[0] + x * cell_m, min_m[1] + y * cell_m];
            places.points_m.push(point_m);
            places.occupied.push(world.is_occupied(point_m));
        }
        places
    }
}

/// Points of every ray of a scan, no farther apart than `step_m`.
fn along(shown: &TrainingScan, step_m: f32, mark: &mut impl FnMut([f32; 2])) {
    let Some(origin_m) = shown.origin_m() else { return };
    for ray in shown.rays() {
        let way_m = [ray.end_m[0] - origin_m[0], ray.end_m[1] - origin_m[1]];
        let steps = (way_m[0].hypot(way_m[1]) / step_m).ceil().max(1.0);
        for step in 0..=steps as u32 {
            let part = step as f32 / steps;
            mark([origin_m[0] + part * way_m[0], origin_m[1] + part * way_m[1]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{contest::Dataset, evaluation::Held};

    #[test]
    fn unseen_places_lie_behind_walls_and_no_ray_comes_near_them() {
        let loaded = Dataset { every: 40, ..Dataset::parse("building").unwrap() }.load(1).unwrap();
        let task = loaded.task(Held::Beams, 0.1, 1).unwrap();
        let world = loaded.world.as_ref().unwrap();
        let unseen = UnseenPlaces::of(world, &task, 1.0);
        let occupied = unseen.occupied.iter().filter(|occupied| **occupied).count();
        assert!(occupied > 5 && unseen.occupied.len() - occupied > 20, "{occupied} of {}", unseen.occupied.len());
        // Against every ray's exact distance, not its samples.
        for place in unseen.points_m.iter().step_by(17) {
            for shown in &task.training {
                let [ox, oy] = shown.origin_m().unwrap();
                for ray in shown.rays() {
                    let way = [ray.end_m[0] - ox, ray.end_m[1] - oy];
                    let to = [place[0] - ox, place[1] - oy];
                    let along = (to[0] * way[0] + to[1] * way[1]) / (way[0] * way[0] + way[1] * way[1]);
                    let along = along.clamp(0.0, 1.0);
                    let distance_m = (to[0] - along * way[0]).hypot(to[1] - along * way[1]);
                    assert!(distance_m > 0.7 * SPACING_M, "{place:?} is {distance_m} m from a ray");
                }
            }
        }
    }
}
