//! Averages of `exp(−t²)`, the one integral behind every closed form of the squared exponential.

use super::quadrature::{LEGENDRE_5, mean};

/// Intervals shorter than this are averaged by five Gauss–Legendre nodes, whose error is then below 1e-5 of the value
/// where that is above 1e-6; longer ones by `erf`, which loses digits as its arguments approach each other.
pub(super) const SHORT: f32 = 0.75;

/// The average of `exp(−t²)` over `[low, high]`, `low ≤ high`.
#[inline]
pub(super) fn average(low: f32, high: f32) -> f32 {
    let width = high - low;
    if width < SHORT {
        let middle = 0.5 * (low + high);
        return mean(LEGENDRE_5, |x| {
            let t = middle + width * x;
            libm::expf(-t * t)
        });
    }
    // Where both ends lie on one side, erf of both is near ±1: the difference of the complements keeps its digits.
    let integral = if low > 0.5 {
        libm::erfcf(low) - libm::erfcf(high)
    } else if high < -0.5 {
        libm::erfcf(-high) - libm::erfcf(-low)
    } else {
        libm::erff(high) - libm::erff(low)
    };
    const HALF_SQRT_PI: f32 = 0.886_226_95;
    HALF_SQRT_PI * integral / width
}
