//! What is really there. Depends on `mover` and `solid`.

use std::borrow::Cow;

use super::mover::Mover;
use super::solid::{Bounds, Position, Solid};

/// A plane with solids standing on it, and others that drive about: the truth a map is judged against.
///
/// What moves is not part of a place. [`World::is_occupied`], [`World::range_along`] and [`World::solids`] speak of what
/// stands still: a road is free, whoever is just driving there. What was there at one moment says the world of that moment,
/// [`World::at`]; a sensor measures that.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    solids: Vec<Solid>,
    movers: Vec<Mover>,
    bounds: Bounds,
}

impl World {
    /// A world of `solids`, to be mapped and judged within `bounds`; outside the bounds, too, only the solids are occupied.
    #[must_use]
    pub fn new(solids: Vec<Solid>, bounds: Bounds) -> Self {
        Self { solids, movers: Vec::new(), bounds }
    }

    /// The same world with these on the move as well.
    #[must_use]
    pub fn with_movers(self, movers: Vec<Mover>) -> Self {
        Self { movers, ..self }
    }

    /// The solids that stand still; they may overlap.
    #[must_use]
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// What moves.
    #[must_use]
    pub fn movers(&self) -> &[Mover] {
        &self.movers
    }

    /// The world as it is at a stamp, nanoseconds: what moves stands still where it then is, as the last of the solids.
    #[must_use]
    pub fn at(&self, stamp_ns: u64) -> Cow<'_, Self> {
        if self.movers.is_empty() {
            return Cow::Borrowed(self);
        }
        let moved = self.movers.iter().map(|mover| mover.at(stamp_ns));
        Cow::Owned(Self::new(self.solids.iter().cloned().chain(moved).collect(), self.bounds))
    }

    /// The rectangle worth drawing and judging, metres.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Whether a point of the map frame, metres, lies in a solid that stands still or on its outline.
    #[must_use]
    pub fn is_occupied(&self, point: [f32; 2]) -> bool {
        let point = point.map(f64::from);
        self.solids.iter().any(|solid| solid.contains(point))
    }

    /// Distance, in lengths of `direction`, to the first solid standing still that a ray touches: 0 from within one, `None`
    /// if it meets none.
    #[must_use]
    pub fn range_along(&self, origin: Position, direction: Position) -> Option<f64> {
        nearest(self.solids.iter(), origin, direction)
    }

    /// The part of what stands still that a sensor at `centre` can measure.
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
