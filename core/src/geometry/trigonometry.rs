//! Sine and cosine that stay in `f32`.
//!
//! `libm`'s `sinf` and `cosf` reduce and evaluate in `f64`, which costs a microcontroller without a double-precision unit
//! a factor of thirty in the whole update.

/// π/2 split in three so that `k·π/2` is subtracted with the error of the last part only (Cody and Waite).
const HALF_PI_PARTS: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Largest argument, in radians, for which the three-part reduction keeps the stated accuracy.
const REDUCIBLE_RAD: f32 = 8_192.0;

/// Sine and cosine of an angle in radians.
///
/// Absolute error below 2e-7 for |angle| ≤ 8 192 rad; larger or non-finite angles give `(NaN, NaN)`, so that a corrupt
/// heading cannot pass as a direction.
#[must_use]
pub fn sin_cos(angle_rad: f32) -> (f32, f32) {
    if !(-REDUCIBLE_RAD..=REDUCIBLE_RAD).contains(&angle_rad) {
        return (f32::NAN, f32::NAN);
    }
    let turns = angle_rad * core::f32::consts::FRAC_2_PI;
    let quadrant = (turns + if turns >= 0.0 { 0.5 } else { -0.5 }) as i32;
    let k = quadrant as f32;
    let r = ((angle_rad - k * HALF_PI_PARTS[0]) - k * HALF_PI_PARTS[1]) - k * HALF_PI_PARTS[2];
    let r2 = r * r;
    // Minimax polynomials on [−π/4, π/4] (the classical single-precision ones of the Cephes library).
    let sin = r + r * r2 * (-1.666_665_5e-1 + r2 * (8.332_161e-3 - r2 * 1.951_529_6e-4));
    let cos = 1.0 - 0.5 * r2 + r2 * r2 * (4.166_664_6e-2 + r2 * (-1.388_731_6e-3 + r2 * 2.443_315_7e-5));
    match quadrant & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_f64_over_the_whole_range() {
        let mut worst = 0.0_f64;
        for i in -400_000..=400_000 {
            let angle = i as f32 * 0.020_47;
            let (sin, cos) = sin_cos(angle);
            let exact = f64::from(angle);
            worst = worst.max((f64::from(sin) - exact.sin()).abs()).max((f64::from(cos) - exact.cos()).abs());
        }
        assert!(worst < 2e-7, "worst absolute error {worst:e}");
    }

    #[test]
    fn refuses_what_it_cannot_reduce() {
        for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e9] {
            assert!(sin_cos(angle).0.is_nan());
        }
    }
}
