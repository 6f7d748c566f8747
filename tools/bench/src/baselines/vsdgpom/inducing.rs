use std::collections::BTreeSet;

use bhm_core::geometry::Point;

use crate::scattered::{Observation, k_means};

/// Passes of k-means.
const PASSES: u32 = 5;

/// Centres nearer to another inducing point than this part of the spacing are left out: their columns would say the same.
pub(super) const NEAREST: f64 = 0.5;

fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
}

fn covered(known_m: &[[f64; 2]], at_m: [f64; 2], within_m: f64) -> bool {
    known_m.iter().any(|known_m| squared(*known_m, at_m) < within_m * within_m)
}

/// Whether anything was observed further than `spacing_m` from all `known_m`.
pub(super) fn is_new_ground(known_m: &[[f64; 2]], points_m: &[[f64; 2]], spacing_m: f64) -> bool {
    points_m.iter().any(|at_m| !covered(known_m, *at_m, spacing_m))
}

/// Inducing points for what was observed further than `spacing_m` from all `known_m`: its clusters, one for each square of
/// that size which holds such a point, `room` at most.
pub(super) fn discover(
    known_m: &[[f64; 2]],
    points_m: &[[f64; 2]],
    spacing_m: f64,
    room: usize,
    seed: u64,
) -> Vec<[f64; 2]> {
    let fresh_m: Vec<_> = points_m.iter().copied().filter(|at_m| !covered(known_m, *at_m, spacing_m)).collect();
    let squares: BTreeSet<_> = fresh_m.iter().map(|at_m| at_m.map(|x| (x / spacing_m).floor() as i64)).collect();
    let mut found = clusters_of(&fresh_m, squares.len().min(room), NEAREST * spacing_m, seed);
    found.retain(|centre_m| !covered(known_m, *centre_m, NEAREST * spacing_m));
    found
}

/// Centres of `clusters` at most, found by k-means; none within `nearest_m` of another.
pub(super) fn clusters_of(points_m: &[[f64; 2]], clusters: usize, nearest_m: f64, seed: u64) -> Vec<[f64; 2]> {
    let each = |take: &mut dyn FnMut(Observation)| {
        for at_m in points_m {
            take(Observation { at_m: Point::from(at_m.map(|x| x as f32)), weight: 1.0 });
        }
    };
    let mut found: Vec<[f64; 2]> = Vec::new();
    for cluster in k_means(each, clusters, PASSES, seed) {
        let centre_m = cluster.centre_m.map(f64::from);
        if !covered(&found, centre_m, nearest_m) {
            found.push(centre_m);
        }
    }
    found
}
