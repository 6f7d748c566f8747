//! What counts as known: a matter of variance, not of a probability near one half.

use bhm_core::{
    geometry::Point,
    lattice::offsets,
    map::{ModelledMap, Occupancy},
};

use crate::picture::Bounds;

/// The standard deviation of the log-odds at which knowledge ends: two of it are the whole way from "surely free" to "surely
/// occupied". Observed places have 1 to 5, unobserved ones thirty or more.
pub const KNOWN_DEVIATION: f32 = 8.0;

/// Whether the map learned something about the point of which it says this: the standard deviation is below
/// [`KNOWN_DEVIATION`] and, lest a narrow prior passes for knowledge, the variance below half the prior's.
#[must_use]
pub fn is_known(map: &dyn ModelledMap<2>, point_m: &Point<2>, occupancy: &Occupancy) -> bool {
    occupancy.variance < KNOWN_DEVIATION * KNOWN_DEVIATION
        && occupancy.variance < map.unobserved_at(point_m).variance / 2.0
}

/// The box around everything that the map knows, looked at once per cell of the lattice; `None` if it knows nothing.
#[must_use]
pub fn observed(map: &dyn ModelledMap<2>) -> Option<Bounds> {
    let tiling = &map.model().tiling;
    let lattice = &tiling.lattice;
    let half = lattice.spacing_m / 2.0;
    let mut bounds: Option<Bounds> = None;
    for tile in map.tile_indices() {
        let window = tiling.window(&tile);
        // The cells for which the tile holds the whole stencil.
        let below = lattice.stencil / 2 - 1;
        let centre_m = |cell: [usize; 2]| {
            let node = [0, 1].map(|axis| window.first[axis] + (cell[axis] + below) as i32);
            lattice.position_m(&node).add_scalar(half)
        };
        let centres_m: Vec<_> = offsets(window.width.map(|width| width - lattice.stencil + 1)).map(centre_m).collect();
        let mut answers = vec![Occupancy::UNKNOWN; centres_m.len()];
        map.occupancies(&centres_m, &mut answers);
        for (point_m, answer) in centres_m.iter().zip(&answers) {
            if is_known(map, point_m, answer) {
                let Bounds { min, max } =
                    bounds.get_or_insert(Bounds { min: (*point_m).into(), max: (*point_m).into() });
                for axis in 0..2 {
                    min[axis] = min[axis].min(point_m[axis] - half);
                    max[axis] = max[axis].max(point_m[axis] + half);
                }
            }
        }
    }
    bounds
}
