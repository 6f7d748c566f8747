use std::f32::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Features, Rows};
use crate::baselines::{Failed, Setup};

/// Most features: rows of a scan are kept at once.
const MAX_FEATURES: f32 = 1e5;
/// Length scale, as a part of the side of the square that each feature has to itself, and the least in metres.
const LENGTH_SCALE: f64 = 0.48;
const LEAST_LENGTH_SCALE_M: f64 = 0.25;
/// Stream of the dice for frequencies; the order of points has another.
const FREQUENCIES: u64 = 1;

/// A cosine and a sine of each of a sample of frequencies, whose inner products are on average a Gaussian of the distance.
pub(super) struct Fourier {
    length_scale_m: f64,
    /// Cycles per metre along x and y.
    frequencies: [Vec<f32>; 2],
}

impl Fourier {
    pub(super) fn new(setup: &Setup) -> Result<Self, Failed> {
        if !(2.0..=MAX_FEATURES).contains(&setup.size) {
            return Err(Failed(format!("{} features are not between 2 and {MAX_FEATURES}", setup.size)));
        }
        let pairs = (setup.size / 2.0).round() as usize;
        let [min_m, max_m] = setup.area_m;
        let area_m2: f64 = (0..2).map(|axis| f64::from(max_m[axis]) - f64::from(min_m[axis])).product();
        let length_scale_m = (LENGTH_SCALE * (area_m2 / (2 * pairs) as f64).sqrt()).max(LEAST_LENGTH_SCALE_M);
        if !length_scale_m.is_finite() {
            return Err(Failed(format!("no length scale for {area_m2} m²")));
        }
        let mut dice = ChaCha8Rng::seed_from_u64(setup.seed);
        dice.set_stream(FREQUENCIES);
        let mut frequencies = [Vec::with_capacity(pairs), Vec::with_capacity(pairs)];
        for _ in 0..pairs {
            let normals = two_normals(&mut dice);
            for (frequencies, normal) in frequencies.iter_mut().zip(normals) {
                frequencies.push((normal / (std::f64::consts::TAU * length_scale_m)) as f32);
            }
        }
        Ok(Self { length_scale_m, frequencies })
    }
}

/// Box and Muller 1958.
fn two_normals(dice: &mut impl Rng) -> [f64; 2] {
    let radius = (-2.0 * (1.0 - dice.random::<f64>()).ln()).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * dice.random::<f64>()).sin_cos();
    [radius * cos, radius * sin]
}

/// Cosine and sine of so many turns, for angles beyond 2²² turns those of another angle. Branch-free, so that vectors do it: the
/// Taylor series of an eighth of a turn at most, and from there by doubling the angle twice.
fn cos_sin(turns: f32) -> [f32; 2] {
    // Adding and taking away 1.5·2²³ rounds to the nearest whole number.
    const ROUNDING: f32 = 12_582_912.0;
    #[allow(clippy::manual_clamp)] // a sum of infinities may be NaN, which these, unlike `clamp`, make a number
    let turns = turns.max(-4_194_304.0).min(4_194_304.0);
    let x = (turns - ((turns + ROUNDING) - ROUNDING)) * (TAU / 4.0);
    let x2 = x * x;
    let sin = x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 / 40_320.0)));
    let twice = |[cos, sin]: [f32; 2]| [1.0 - 2.0 * sin * sin, 2.0 * sin * cos];
    twice(twice([cos, sin]))
}

impl Features for Fourier {
    const EPOCHS: usize = 1;
    const RATE: f32 = 0.7;
    const FIRST_SQUARES: f32 = 1e-2;

    fn count(&self) -> usize {
        2 * self.frequencies[0].len()
    }

    fn description(&self) -> String {
        format!("length scale {:.2} m", self.length_scale_m)
    }

    fn bytes(&self) -> usize {
        2 * size_of_val(&self.frequencies[0][..])
    }

    fn append(&mut self, points_m: &[[f32; 2]], rows: &mut Rows) {
        let pairs = self.frequencies[0].len();
        let scale = (1.0 / pairs as f32).sqrt();
        let [along_x, along_y] = &self.frequencies;
        for point_m in points_m {
            let start = rows.values.len();
            rows.values.resize(start + 2 * pairs, 0.0);
            let (cosines, sines) = rows.values[start..].split_at_mut(pairs);
            let frequencies = along_x.iter().zip(along_y);
            for (((fx, fy), cosine), sine) in frequencies.zip(cosines).zip(sines) {
                let [cos, sin] = cos_sin(fx * point_m[0] + fy * point_m[1]);
                *cosine = scale * cos;
                *sine = scale * sin;
            }
            rows.end_row();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::setup;

    #[test]
    fn sines_and_cosines_are_the_libraries() {
        for step in -40_000..40_000 {
            let turns = step as f32 * 1.37e-3;
            let angle = f64::from(turns) * std::f64::consts::TAU;
            let [cos, sin] = cos_sin(turns);
            assert!(
                (f64::from(cos) - angle.cos()).abs() < 2e-6 && (f64::from(sin) - angle.sin()).abs() < 2e-6,
                "{turns}"
            );
        }
        for turns in [f32::MAX, f32::MIN, f32::INFINITY, f32::NAN] {
            assert!(cos_sin(turns).iter().all(|x| x.abs() <= 1.0 + 1e-6), "{turns}");
        }
    }

    /// Rahimi and Recht 2008: the inner product of two points' features is the kernel, up to `1/√pairs`. The squared sum over
    /// all pairs of points tells a converging sample from one that does not: four times the features, a quarter of it.
    #[test]
    fn inner_products_converge_to_the_kernel() {
        let squared_error = |count: f32| {
            let mut features = Fourier::new(&setup([[-2.0, -2.0], [2.0, 2.0]], count)).unwrap();
            let length_scale_m = features.length_scale_m;
            let points: Vec<[f32; 2]> = (0..20).map(|i| [(i as f32).sin(), (i as f32 * 1.7).cos()]).collect();
            let mut rows = Rows::default();
            features.append(&points, &mut rows);
            let width = features.count();
            let row = |i: usize| &rows.values[i * width..(i + 1) * width];
            let mut sum = 0.0;
            for i in 0..points.len() {
                for j in 0..points.len() {
                    let product: f64 = row(i).iter().zip(row(j)).map(|(a, b)| f64::from(a * b)).sum();
                    let d2: f64 = (0..2).map(|axis| f64::from(points[i][axis] - points[j][axis]).powi(2)).sum();
                    sum += (product - (-d2 / (2.0 * length_scale_m * length_scale_m)).exp()).powi(2);
                }
            }
            sum / (points.len() * points.len()) as f64
        };
        // The variance of a product is at most ½ per pair; over 400 products it strays by little.
        for count in [1000.0, 4000.0, 16_000.0] {
            assert!(squared_error(count) < 1.5 / f64::from(count), "{count}: {}", squared_error(count));
        }
    }

    #[test]
    fn seeds_decide_and_nonsense_is_refused() {
        let of = |seed, size| Fourier::new(&Setup { seed, ..setup([[0.0, 0.0], [9.0, 9.0]], size) });
        assert_eq!(of(1, 64.0).unwrap().frequencies, of(1, 64.0).unwrap().frequencies);
        assert_ne!(of(1, 64.0).unwrap().frequencies, of(2, 64.0).unwrap().frequencies);
        for size in [0.0, 1.0, -5.0, f32::NAN, f32::INFINITY, 1e9] {
            assert!(of(1, size).is_err(), "{size}");
        }
    }
}
