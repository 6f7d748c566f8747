/// A symmetric 2 × 2 matrix (xx, xy, yy) with its eigenvalues cut at `largest`, its directions kept.
#[must_use]
pub fn narrowed([xx, xy, yy]: [f32; 3], largest: f32) -> [f32; 3] {
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = libm::sqrtf(half * half + xy * xy);
    let (wide, narrow) = (middle + radius, middle - radius);
    if wide <= largest {
        return [xx, xy, yy];
    }
    if narrow >= largest || radius == 0.0 {
        return [largest, 0.0, largest];
    }
    // S = narrow·I + (wide − narrow) vvᵀ, and (wide − narrow) vvᵀ = S − narrow·I: scaled, v needs not be known.
    let keep = (largest - narrow) / (wide - narrow);
    [narrow + keep * (xx - narrow), keep * xy, narrow + keep * (yy - narrow)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_are_cut_and_directions_kept() {
        for i in 0..2_000 {
            let angle = i as f32 * 0.01;
            let (sin, cos) = angle.sin_cos();
            let (wide, narrow) = (0.1 + (i % 7) as f32, 0.01 + (i % 5) as f32 * 0.3);
            let matrix = |wide: f32, narrow: f32| {
                [
                    wide * cos * cos + narrow * sin * sin,
                    (wide - narrow) * sin * cos,
                    wide * sin * sin + narrow * cos * cos,
                ]
            };
            let largest = 0.8;
            let expected = matrix(wide.min(largest), narrow.min(largest));
            for (got, expected) in narrowed(matrix(wide, narrow), largest).iter().zip(expected) {
                assert!((got - expected).abs() < 1e-5 * (1.0 + wide), "{wide} {narrow} at {angle}");
            }
        }
    }
}
