//! What counts as known: a matter of variance, not of a probability near one half.

use bhm_core::{geometry::Point, lattice::offsets, map::Occupancy, settings::Model, tile::TileIndex};

use crate::picture::Bounds;

/// The standard deviation of the log-odds at which knowledge ends: two of it are the whole way from "surely free" to "surely
/// occupied". Observed places have 1 to 5, unobserved ones, from the usual wide prior, a hundred.
pub const KNOWN_DEVIATION: f32 = 8.0;

/// Judges what a map made with certain settings says.
#[derive(Clone, Copy, Debug)]
pub struct Knowledge<'a> {
    model: &'a Model<'a, 2>,
}

impl<'a> Knowledge<'a> {
    /// Of a map with these settings.
    #[must_use]
    pub fn of(model: &'a Model<'_, 2>) -> Self {
        Self { model }
    }

    /// The variance of the log-odds at a point where nothing was ever observed; `None` where the map cannot reach.
    fn prior_variance(&self, point_m: &Point<2>) -> Option<f32> {
        let features = self.model.basis.features(point_m)?;
        Some(self.model.prior.variance(&features.values, features.bias))
    }

    /// Whether something was learned about the point: its standard deviation is below [`KNOWN_DEVIATION`] and, lest a narrow
    /// prior passes for knowledge, its variance below half the prior's.
    #[must_use]
    pub fn is_known(&self, point_m: &Point<2>, occupancy: &Occupancy) -> bool {
        self.prior_variance(point_m)
            .is_some_and(|prior| occupancy.variance < (prior / 2.0).min(KNOWN_DEVIATION * KNOWN_DEVIATION))
    }
}

impl Knowledge<'_> {
    /// The box around everything that is known in these tiles, looked at once per cell of the lattice.
    pub fn observed(&self, tiles: &[TileIndex<2>], occupancy: impl Fn(&Point<2>) -> Occupancy) -> Option<Bounds> {
        let lattice = &self.model.tiling.lattice;
        let half = lattice.spacing_m / 2.0;
        let mut bounds: Option<Bounds> = None;
        for tile in tiles {
            let window = self.model.tiling.window(tile);
            // The cells for which the tile holds the whole stencil.
            let below = lattice.stencil / 2 - 1;
            for cell in offsets(window.width.map(|width| width - lattice.stencil + 1)) {
                let node = [0, 1].map(|axis| window.first[axis] + (cell[axis] + below) as i32);
                let corner_m = lattice.position_m(&node);
                let point_m = corner_m.add_scalar(half);
                if self.is_known(&point_m, &occupancy(&point_m)) {
                    let Bounds { min, max } = bounds.get_or_insert(Bounds { min: point_m.into(), max: point_m.into() });
                    for axis in 0..2 {
                        min[axis] = min[axis].min(point_m[axis] - half);
                        max[axis] = max[axis].max(point_m[axis] + half);
                    }
                }
            }
        }
        bounds
    }
}
