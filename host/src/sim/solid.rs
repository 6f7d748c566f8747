//! The shapes a world is made of. Depends on no other module of the simulator.

/// A position or a displacement in the map frame, metres; `f64`, so that the truth is finer than the `f32` it judges.
pub type Position = [f64; 2];

/// A convex polygon, occupied inside and on its outline.
///
/// Anything else is several of them: an L-shaped house is two, a wall with a door is two.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Counter-clockwise.
    vertices: Vec<Position>,
    bounds: Bounds,
}

/// An axis-aligned rectangle of the map frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest x and y.
    pub min: Position,
    /// Highest x and y.
    pub max: Position,
}

impl Bounds {
    /// Whether a point lies inside or on the edge.
    #[must_use]
    pub fn contains(&self, point: Position) -> bool {
        (0..2).all(|axis| (self.min[axis]..=self.max[axis]).contains(&point[axis]))
    }

    /// Whether some point of the rectangle is at most `radius_m` from `centre`.
    pub(super) fn reaches(&self, centre: Position, radius_m: f64) -> bool {
        let gap = |axis: usize| centre[axis] - centre[axis].clamp(self.min[axis], self.max[axis]);
        length([gap(0), gap(1)]) <= radius_m
    }
}

impl Solid {
    /// A box with sides `size_m` around `centre`, its first side turned by `heading_rad` from the x axis.
    ///
    /// # Panics
    /// Unless both sides are positive and all numbers finite.
    #[must_use]
    pub fn rectangle(centre: Position, size_m: [f64; 2], heading_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(heading_rad);
        let corner = |right: f64, left: f64| {
            let (u, v) = (right * 0.5 * size_m[0], left * 0.5 * size_m[1]);
            [centre[0] + cos * u - sin * v, centre[1] + sin * u + cos * v]
        };
        Self::convex(vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }

    /// The axis-aligned box between two opposite corners, `min` the lower one.
    ///
    /// # Panics
    /// Unless `max` exceeds `min` along both axes.
    #[must_use]
    pub fn between(min: Position, max: Position) -> Self {
        Self::convex(vec![min, [max[0], min[1]], max, [min[0], max[1]]])
    }

    /// A straight wall whose centre line runs between two points.
    ///
    /// # Panics
    /// Unless the points differ, the thickness is positive and all numbers are finite.
    #[must_use]
    pub fn wall(from: Position, to: Position, thickness_m: f64) -> Self {
        let along = subtract(to, from);
        let half = 0.5 * thickness_m / length(along);
        let left = [-along[1] * half, along[0] * half];
        Self::convex(vec![subtract(from, left), subtract(to, left), add(to, left), add(from, left)])
    }

    /// A regular polygon inscribed in a circle: a column, a tree, a silo.
    ///
    /// # Panics
    /// Unless it has at least three sides, a positive radius and all numbers are finite.
    #[must_use]
    pub fn regular_polygon(centre: Position, radius_m: f64, sides: u8) -> Self {
        let vertex = |index: u8| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(index) / f64::from(sides));
            [centre[0] + radius_m * cos, centre[1] + radius_m * sin]
        };
        Self::convex((0..sides).map(vertex).collect())
    }

    fn convex(vertices: Vec<Position>) -> Self {
        let turns_left = (0..vertices.len()).all(|i| {
            let [a, b, c] = [0, 1, 2].map(|step| vertices[(i + step) % vertices.len()]);
            cross(subtract(b, a), subtract(c, b)) > 0.0
        });
        assert!(vertices.len() >= 3 && turns_left, "not a convex counter-clockwise outline: {vertices:?}");
        let extreme = |pick: fn(f64, f64) -> f64| {
            vertices.iter().copied().reduce(|a, b| [pick(a[0], b[0]), pick(a[1], b[1])]).expect("has vertices")
        };
        let bounds = Bounds { min: extreme(f64::min), max: extreme(f64::max) };
        Self { vertices, bounds }
    }

    /// The outline's corners, counter-clockwise.
    #[must_use]
    pub fn vertices(&self) -> &[Position] {
        &self.vertices
    }

    /// The smallest axis-aligned rectangle around the solid.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Whether a point lies inside or on the outline.
    #[must_use]
    pub fn contains(&self, point: Position) -> bool {
        self.bounds.contains(point) && self.edges().all(|(a, b)| cross(subtract(b, a), subtract(point, a)) >= 0.0)
    }

    /// Distance, in lengths of `direction`, at which a ray first touches the solid; 0 from within, `None` if never.
    ///
    /// Clips the ray against the half-plane of each edge (Cyrus and Beck 1978).
    #[must_use]
    pub fn range_along(&self, origin: Position, direction: Position) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for (a, b) in self.edges() {
            let edge = subtract(b, a);
            let depth = cross(edge, subtract(origin, a));
            let approach = cross(edge, direction);
            if approach > 0.0 {
                enter = enter.max(-depth / approach);
            } else if approach < 0.0 {
                leave = leave.min(-depth / approach);
            } else if depth < 0.0 {
                return None;
            }
        }
        (enter <= leave).then_some(enter)
    }

    fn edges(&self) -> impl Iterator<Item = (Position, Position)> {
        let following = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().copied().zip(following.copied())
    }
}

pub(super) fn add(a: Position, b: Position) -> Position {
    [a[0] + b[0], a[1] + b[1]]
}

pub(super) fn subtract(a: Position, b: Position) -> Position {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn dot(a: Position, b: Position) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(super) fn length(a: Position) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: Position, b: Position) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_a_box_where_arithmetic_says() {
        let solid = Solid::between([2.0, -1.0], [4.0, 1.0]);
        assert_eq!(solid.range_along([0.0, 0.0], [1.0, 0.0]), Some(2.0));
        assert_eq!(solid.range_along([0.0, 0.0], [0.5, 0.0]), Some(4.0), "counted in lengths of the direction");
        assert_eq!(solid.range_along([3.0, 5.0], [0.0, -1.0]), Some(4.0));
        assert_eq!(solid.range_along([0.0, 0.0], [-1.0, 0.0]), None, "behind");
        assert_eq!(solid.range_along([0.0, 2.0], [1.0, 0.0]), None, "beside, parallel to two edges");
        assert_eq!(solid.range_along([0.0, 1.0], [1.0, 0.0]), Some(2.0), "the outline belongs to the solid");
        assert_eq!(solid.range_along([3.0, 0.5], [1.0, 0.0]), Some(0.0), "from within");
    }

    #[test]
    fn a_wall_is_a_turned_box() {
        let wall = Solid::wall([0.0, 0.0], [3.0, 4.0], 0.2);
        assert!(wall.contains([1.5, 2.0]));
        assert!(wall.contains([1.5 - 0.079, 2.0 + 0.059]) && !wall.contains([1.5 - 0.081, 2.0 + 0.061]));
    }

    #[test]
    #[should_panic(expected = "not a convex counter-clockwise outline")]
    fn refuses_a_box_inside_out() {
        let _ = Solid::between([1.0, 0.0], [0.0, 1.0]);
    }

    #[test]
    #[should_panic(expected = "not a convex counter-clockwise outline")]
    fn refuses_what_is_not_a_number() {
        let _ = Solid::rectangle([f64::NAN, 0.0], [1.0, 1.0], 0.0);
    }
}
