use super::{Point, sin_cos};

/// A planar rigid motion: where a frame stands in another.
///
/// Named by direction, as `map_from_sensor`: applied to a point in the sensor frame it gives the point in the map frame.
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pose {
    /// Position of the inner frame's origin, metres.
    pub x_m: f32,
    /// Position of the inner frame's origin, metres.
    pub y_m: f32,
    /// Heading of the inner frame's x axis, radians, counter-clockwise.
    pub theta_rad: f32,
}

impl Pose {
    /// A pose from position (metres) and heading (radians).
    #[must_use]
    pub const fn new(x_m: f32, y_m: f32, theta_rad: f32) -> Self {
        Self { x_m, y_m, theta_rad }
    }

    /// Where the inner frame's origin stands.
    #[must_use]
    pub fn position(&self) -> Point<2> {
        Point::<2>::new(self.x_m, self.y_m)
    }

    /// The outer-frame point at `range_m` along `bearing_rad`, measured from the inner frame's x axis.
    ///
    /// A heading or bearing that is not finite or absurdly large gives NaN coordinates (see [`sin_cos`]).
    #[must_use]
    pub fn point_along(&self, bearing_rad: f32, range_m: f32) -> Point<2> {
        self.position() + self.direction(bearing_rad) * range_m
    }

    /// The unit vector along `bearing_rad`, in the outer frame.
    #[must_use]
    pub fn direction(&self, bearing_rad: f32) -> Point<2> {
        let (sin, cos) = sin_cos(self.theta_rad + bearing_rad);
        Point::<2>::new(cos, sin)
    }

    /// Whether every component is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.theta_rad.is_finite()
    }
}
