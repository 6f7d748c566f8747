//! Errors of the sensors. Depends on no other module of the simulator.

use bhm_core::geometry::{Pose, PoseCovariance};
use rand::Rng;

/// How far off the reported poses are: independent normal errors of every scan's pose, with mean 0.
///
/// As a covariance of `(x, y, heading)`: the squares of `position_m`, `position_m` and `heading_rad` on the diagonal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    /// Standard deviation of the position along each axis, metres.
    pub position_m: f64,
    /// Standard deviation of the heading, radians.
    pub heading_rad: f64,
}

/// A standard deviation of a [`PoseNoise`] is negative or not finite.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a pose's noise has standard deviations of at least 0, not {} m and {} rad", .0.position_m, .0.heading_rad)]
pub struct InvalidPoseNoise(pub PoseNoise);

impl PoseNoise {
    /// Poses are reported as they are.
    pub const NONE: Self = Self { position_m: 0.0, heading_rad: 0.0 };

    /// Whether the fields are standard deviations.
    ///
    /// # Errors
    /// [`InvalidPoseNoise`] if one is negative or not finite.
    pub fn validate(&self) -> Result<(), InvalidPoseNoise> {
        let is_deviation = |x: f64| x >= 0.0 && x.is_finite();
        let valid = is_deviation(self.position_m) && is_deviation(self.heading_rad);
        if valid { Ok(()) } else { Err(InvalidPoseNoise(*self)) }
    }

    /// How uncertain the reported poses are; `None` where they are exact.
    #[must_use]
    pub fn covariance(&self) -> Option<PoseCovariance> {
        let Self { position_m, heading_rad } = *self;
        (*self != Self::NONE).then(|| PoseCovariance::independent(position_m as f32, heading_rad as f32))
    }

    /// What is reported for a true pose.
    pub(super) fn perturb(&self, pose: Pose, rng: &mut impl Rng) -> Pose {
        // Adding 0 would turn a coordinate of −0 into +0.
        if *self == Self::NONE {
            return pose;
        }
        let mut off = |value: f32, deviation: f64| (f64::from(value) + deviation * standard_normal(rng)) as f32;
        let (x_m, y_m) = (off(pose.x_m, self.position_m), off(pose.y_m, self.position_m));
        Pose::new(x_m, y_m, off(pose.theta_rad, self.heading_rad))
    }
}

/// A draw from the normal distribution with mean 0 and variance 1 (Box and Muller 1958).
///
/// With `libm`'s functions, not the platform's, which differ in the last bit.
pub(super) fn standard_normal(rng: &mut impl Rng) -> f64 {
    let (u, v) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
    (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn errors_are_independent_with_the_stated_deviations() {
        let noise = PoseNoise { position_m: 0.2, heading_rad: 0.05 };
        let pose = Pose::new(3.0, -2.0, 1.0);
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let draws = 40_000;
        let scores: Vec<[f64; 3]> = (0..draws)
            .map(|_| noise.perturb(pose, &mut rng))
            .map(|off| [(off.x_m - 3.0) / 0.2, (off.y_m + 2.0) / 0.2, (off.theta_rad - 1.0) / 0.05].map(f64::from))
            .collect();
        let mean = |of: &dyn Fn(&[f64; 3]) -> f64| scores.iter().map(of).sum::<f64>() / f64::from(draws);
        // Five standard errors: a standard normal has variance 1, its square 2, a product of two 1.
        let standard_error = 1.0 / f64::from(draws).sqrt();
        for i in 0..3 {
            assert!(mean(&|score| score[i]).abs() < 5.0 * standard_error, "mean {i}");
            for j in 0..=i {
                let (expected, deviation) = if i == j { (1.0, 2.0_f64.sqrt()) } else { (0.0, 1.0) };
                let covariance = mean(&|score| score[i] * score[j]);
                assert!((covariance - expected).abs() < 5.0 * deviation * standard_error, "({i}, {j}): {covariance}");
            }
        }
    }

    #[test]
    fn without_noise_every_bit_stays() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let pose = PoseNoise::NONE.perturb(Pose::new(-0.0, 0.1, -0.0), &mut rng);
        assert_eq!([pose.x_m, pose.y_m, pose.theta_rad].map(f32::to_bits), [-0.0, 0.1, -0.0].map(f32::to_bits));
    }

    #[test]
    fn refuses_what_is_no_deviation() {
        for wrong in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(PoseNoise { position_m: wrong, ..PoseNoise::NONE }.validate().is_err(), "{wrong} m");
            assert!(PoseNoise { heading_rad: wrong, ..PoseNoise::NONE }.validate().is_err(), "{wrong} rad");
        }
        assert_eq!(PoseNoise { position_m: 0.1, heading_rad: 0.0 }.validate(), Ok(()));
    }
}
