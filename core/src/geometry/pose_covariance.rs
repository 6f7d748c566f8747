use nalgebra::SMatrix;

use super::Point;

/// How uncertain a planar pose is: the covariance of its position (m²), its heading (rad²), and between them (m·rad).
///
/// All zero is certainty.
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseCovariance {
    /// Variance of x, m².
    pub xx_m2: f32,
    /// Covariance of x and y, m².
    pub xy_m2: f32,
    /// Variance of y, m².
    pub yy_m2: f32,
    /// Covariance of x and heading, m·rad.
    pub x_theta_m_rad: f32,
    /// Covariance of y and heading, m·rad.
    pub y_theta_m_rad: f32,
    /// Variance of the heading, rad².
    pub theta_rad2: f32,
}

impl PoseCovariance {
    /// Independent errors: the same standard deviation of position along either axis, and one of heading.
    #[must_use]
    pub const fn independent(position_m: f32, heading_rad: f32) -> Self {
        Self {
            xx_m2: position_m * position_m,
            xy_m2: 0.0,
            yy_m2: position_m * position_m,
            x_theta_m_rad: 0.0,
            y_theta_m_rad: 0.0,
            theta_rad2: heading_rad * heading_rad,
        }
    }

    /// The covariance as plain numbers, for messages: xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²).
    #[must_use]
    pub const fn numbers(&self) -> [f32; 6] {
        let Self { xx_m2, xy_m2, yy_m2, x_theta_m_rad, y_theta_m_rad, theta_rad2 } = *self;
        [xx_m2, xy_m2, yy_m2, x_theta_m_rad, y_theta_m_rad, theta_rad2]
    }

    /// The covariance of which these are the [`numbers`](Self::numbers).
    #[must_use]
    pub const fn from_numbers(numbers: [f32; 6]) -> Self {
        let [xx_m2, xy_m2, yy_m2, x_theta_m_rad, y_theta_m_rad, theta_rad2] = numbers;
        Self { xx_m2, xy_m2, yy_m2, x_theta_m_rad, y_theta_m_rad, theta_rad2 }
    }

    /// Whether it is a covariance: finite and, up to rounding, positive semidefinite.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let Self { xx_m2: xx, xy_m2: xy, yy_m2: yy, x_theta_m_rad: xt, y_theta_m_rad: yt, theta_rad2: tt } = *self;
        // Sylvester's criterion over every principal minor, each scaled by its diagonal: |correlation| ≤ 1, and the
        // determinant of the correlation matrix is not negative. Rounding of a rank-one covariance is let pass.
        const ROUNDING: f32 = 1e-4;
        let correlation = |covariance: f32, a: f32, b: f32| {
            // A product of two variances may underflow where the covariance does not.
            if covariance == 0.0 { 0.0 } else { covariance / (libm::sqrtf(a) * libm::sqrtf(b)) }
        };
        let (a, b, c) = (correlation(xy, xx, yy), correlation(xt, xx, tt), correlation(yt, yy, tt));
        let finite = [xx, xy, yy, xt, yt, tt].iter().all(|x| x.is_finite());
        let bounded = [a, b, c].iter().all(|r| r.abs() <= 1.0 + ROUNDING);
        let determinant = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c;
        finite && xx >= 0.0 && yy >= 0.0 && tt >= 0.0 && bounded && determinant >= -ROUNDING
    }

    /// Covariance `P = J Σ Jᵀ`, m², of a point that was seen at `lever_m` from the pose's position (map frame).
    ///
    /// `J = [I | (−l_y, l_x)ᵀ]` is the derivative of the point by the pose: to first order in the heading's error.
    #[inline]
    #[must_use]
    pub fn at(&self, lever_m: &Point<2>) -> SMatrix<f32, 2, 2> {
        let (a, b) = (-lever_m.y, lever_m.x);
        let xx = self.xx_m2 + 2.0 * a * self.x_theta_m_rad + a * a * self.theta_rad2;
        let yy = self.yy_m2 + 2.0 * b * self.y_theta_m_rad + b * b * self.theta_rad2;
        let xy = self.xy_m2 + b * self.x_theta_m_rad + a * self.y_theta_m_rad + a * b * self.theta_rad2;
        // Rounding must not make a variance negative where position and heading are fully correlated.
        SMatrix::from([[xx.max(0.0), xy], [xy, yy.max(0.0)]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn a_point_moves_with_its_pose_as_the_derivative_says() {
        let pose = Pose::new(1.0, -2.0, 0.7);
        let seen = |pose: Pose| pose.point_along(0.4, 5.0);
        let lever = seen(pose) - pose.position();
        // Σ = s sᵀ for a step s of the pose: then P = (J s)(J s)ᵀ, and J s is how far the point moves.
        let (x, y, t) = (0.03_f32, -0.05, 0.002);
        let covariance = PoseCovariance {
            xx_m2: x * x,
            xy_m2: x * y,
            yy_m2: y * y,
            x_theta_m_rad: x * t,
            y_theta_m_rad: y * t,
            theta_rad2: t * t,
        };
        assert!(covariance.is_valid());
        let moved = seen(Pose::new(1.0 + x, -2.0 + y, 0.7 + t)) - seen(pose);
        let spread = covariance.at(&lever);
        let expected = moved * moved.transpose();
        assert!((spread - expected).iter().all(|d| d.abs() < 3e-6), "{spread} against {expected}");
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let good = PoseCovariance::independent(0.1, 0.01);
        assert!(good.is_valid() && PoseCovariance::default().is_valid());
        for bad in [
            PoseCovariance { xx_m2: -1e-6, ..good },
            PoseCovariance { theta_rad2: f32::NAN, ..good },
            PoseCovariance { yy_m2: f32::INFINITY, ..good },
            PoseCovariance { xy_m2: 0.02, ..good },
            PoseCovariance { x_theta_m_rad: 2e-3, ..good },
            PoseCovariance { xy_m2: 1e-3, ..PoseCovariance::default() },
            // Each pair may be so correlated, not all three at once.
            PoseCovariance { xy_m2: 0.9e-2, x_theta_m_rad: 0.9e-3, y_theta_m_rad: -0.9e-3, ..good },
        ] {
            assert!(!bad.is_valid(), "{bad:?}");
        }
    }
}
