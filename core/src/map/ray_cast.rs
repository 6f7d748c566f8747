use super::{Map, Occupancy};
use crate::geometry::Point;

/// What a ray meets in a map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RayCast {
    /// Distance of the first place where the probability exceeds the threshold, metres; `None` where the ray meets none.
    pub first_m: Option<f32>,
    /// Expected distance at which the ray ends, metres, at most the ray's length: `∫ S(r) dr`.
    ///
    /// `S` is the probability that nothing was met up to `r`, each spacing of the lattice being an obstacle of its own:
    /// `S(r) = exp ∫₀ʳ ln(1 − p) dr/h`.
    pub expected_m: f32,
}

/// Steps a spacing: a wall of the finest detail that a map holds is wider.
const STEPS_A_SPACING: f32 = 8.0;

/// Most steps of a ray: a longer one is walked in longer steps.
const MAX_STEPS: f32 = 65_536.0;

/// Steps that are asked about at once.
const BATCH: usize = 64;

pub(super) fn cast<const D: usize>(
    map: &(impl Map<D> + ?Sized),
    origin_m: &Point<D>,
    direction: &Point<D>,
    range_max_m: f32,
    threshold: f32,
) -> RayCast {
    let spacing_m = map.spacing_m();
    let steps = (range_max_m / spacing_m * STEPS_A_SPACING).clamp(0.0, MAX_STEPS) as usize + 1;
    let mut cast = RayCast { first_m: None, expected_m: 0.0 };
    // Written so that a range that is not a number is no ray.
    if !(range_max_m > 0.0 && range_max_m.is_finite()) {
        return cast;
    }
    let step_m = range_max_m / steps as f32;
    let at = |number: usize| origin_m + direction * (step_m * number as f32);
    let (mut survival, mut number) = (1.0_f32, 0);
    while number <= steps {
        let count = BATCH.min(steps + 1 - number);
        let mut points = [Point::zeros(); BATCH];
        for (offset, point) in points[..count].iter_mut().enumerate() {
            *point = at(number + offset);
        }
        let mut answers = [Occupancy::UNKNOWN; BATCH];
        map.occupancies(&points[..count], &mut answers[..count]);
        for answer in &answers[..count] {
            if cast.first_m.is_none() && answer.probability > threshold {
                cast.first_m = Some(refine(map, origin_m, direction, number, step_m, threshold));
            }
            // The trapezoidal rule for both integrals: half a step's share at either end.
            let free = libm::expf(0.5 * step_m / spacing_m * ln_free(answer));
            if number > 0 {
                survival *= free;
                cast.expected_m += 0.5 * step_m * survival;
            }
            if number < steps {
                cast.expected_m += 0.5 * step_m * survival;
                survival *= free;
            }
            number += 1;
        }
    }
    cast
}

/// `ln(1 − p)`, right where `p` rounds to 1.
fn ln_free(answer: &Occupancy) -> f32 {
    let logit = answer.logit();
    -(logit.max(0.0) + libm::log1pf(libm::expf(-logit.abs())))
}

/// Where, between the step before `number` and that step, the threshold is passed, metres: by bisection to a thousandth.
fn refine<const D: usize>(
    map: &(impl Map<D> + ?Sized),
    origin_m: &Point<D>,
    direction: &Point<D>,
    number: usize,
    step_m: f32,
    threshold: f32,
) -> f32 {
    let (mut below, mut above) = (number.saturating_sub(1) as f32 * step_m, number as f32 * step_m);
    for _ in 0..10 {
        let middle = 0.5 * (below + above);
        if map.occupancy(&(origin_m + direction * middle)).probability > threshold {
            above = middle;
        } else {
            below = middle;
        }
    }
    above
}
