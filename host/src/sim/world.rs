//! What is really there.

use super::scene::{Scene, UnknownScene};
use super::solid::{Bounds, Position, Solid};

/// A plane with solids standing on it: the truth a map is judged against.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    solids: Vec<Solid>,
    bounds: Bounds,
}

impl World {
    /// A world of `solids`, to be mapped and judged within `bounds`; outside the bounds, too, only the solids are occupied.
    #[must_use]
    pub fn new(solids: Vec<Solid>, bounds: Bounds) -> Self {
        Self { solids, bounds }
    }

    /// The world of the scene of that name (see [`Scene::names`]).
    ///
    /// # Errors
    /// [`UnknownScene`] lists the names there are.
    pub fn named(name: &str) -> Result<Self, UnknownScene> {
        Scene::named(name).map(Scene::world)
    }

    /// The solids; they may overlap.
    #[must_use]
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The rectangle worth drawing and judging, metres.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Whether a point of the map frame, metres, lies in a solid or on its outline.
    #[must_use]
    pub fn is_occupied(&self, point: [f32; 2]) -> bool {
        let point = point.map(f64::from);
        self.solids.iter().any(|solid| solid.contains(point))
    }

    /// Distance, in lengths of `direction`, to the first solid a ray touches: 0 from within one, `None` if it meets none.
    #[must_use]
    pub fn range_along(&self, origin: Position, direction: Position) -> Option<f64> {
        nearest(self.solids.iter(), origin, direction)
    }

    /// The part of the world a sensor at `centre` can measure.
    pub(super) fn within(&self, centre: Position, radius_m: f64) -> Nearby<'_> {
        Nearby { solids: self.solids.iter().filter(|solid| solid.bounds().reaches(centre, radius_m)).collect() }
    }
}

/// The few solids near a sensor: sorting them out once per scan is all the index a site of hundreds needs.
pub(super) struct Nearby<'a> {
    solids: Vec<&'a Solid>,
}

impl Nearby<'_> {
    /// As [`World::range_along`], for what lies within the radius.
    pub(super) fn range_along(&self, origin: Position, direction: Position) -> Option<f64> {
        nearest(self.solids.iter().copied(), origin, direction)
    }
}

fn nearest<'a>(solids: impl Iterator<Item = &'a Solid>, origin: Position, direction: Position) -> Option<f64> {
    solids.filter_map(|solid| solid.range_along(origin, direction)).min_by(f64::total_cmp)
}
