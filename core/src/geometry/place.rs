use super::Point;

/// What an observation covers: a point, or every point of a line segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place<const D: usize> {
    /// A point, metres.
    Point(Point<D>),
    /// The segment between two points, metres.
    Segment {
        /// One end.
        from_m: Point<D>,
        /// The other.
        to_m: Point<D>,
    },
}

impl<const D: usize> Place<D> {
    /// The point, or the segment's middle.
    #[inline]
    #[must_use]
    pub fn middle_m(&self) -> Point<D> {
        match self {
            Self::Point(point_m) => *point_m,
            // Not (a + b)/2, which could overflow.
            Self::Segment { from_m, to_m } => from_m * 0.5 + to_m * 0.5,
        }
    }
}

impl<const D: usize> From<Point<D>> for Place<D> {
    fn from(point_m: Point<D>) -> Self {
        Self::Point(point_m)
    }
}
