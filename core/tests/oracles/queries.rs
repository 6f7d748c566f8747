//! What a map makes of its answers for a point: many at once, rasters, and ray casts.

use bhm_core::{
    geometry::Point,
    lattice::MAX_NODE,
    map::{Grid, Map, Occupancy, OccupancyGradient, RayCast, TileRef},
    profile::COMPACT,
};

use crate::{
    common::{Stream, labelled},
    map::TestMap,
};

/// A map of a dozen tiles, and tiles that do not exist between them.
fn learned() -> TestMap<144, 40> {
    let mut map = TestMap::new(&COMPACT);
    let mut stream = Stream::new(11);
    for _ in 0..12 {
        let middle = [0, 1].map(|_| stream.between(-5.0, 5.0));
        let places: Vec<_> = (0..60).map(|_| middle.map(|x| (x + stream.between(-1.0, 1.0)) as f32)).collect();
        map.integrate_observations(&labelled(&places, |at| at[0] > at[1]));
    }
    map
}

/// Something that no map answers.
const UNTOUCHED: Occupancy = Occupancy { probability: -1.0, mean: -2.0, variance: -3.0 };

#[test]
fn many_answers_are_the_single_ones() {
    let map = learned();
    let mut stream = Stream::new(12);
    for count in [0, 1, 31, 32, 33, 400] {
        let points: Vec<Point<2>> = (0..count)
            .map(|_| match stream.below(9) {
                0 => [f32::NAN, 0.0].into(),
                1 => [0.0, MAX_NODE as f32 * COMPACT.settings.spacing_m].into(),
                // Close enough that neighbours often share a cell, far enough that they do not always.
                _ => [0, 1].map(|_| stream.between(-0.5, 0.5) as f32 * 2.0_f32.powi(stream.below(5) as i32)).into(),
            })
            .collect();
        let mut answers = vec![UNTOUCHED; count + 2];
        map.mapper().occupancies(&points, &mut answers);
        for (point, answer) in points.iter().zip(&answers) {
            assert_eq!(*answer, map.mapper().occupancy(point), "{point:?}");
        }
        assert_eq!(answers[count..], [UNTOUCHED; 2], "there is no point for them");
    }
}

#[test]
fn a_raster_is_the_centres_of_its_cells_row_by_row_from_the_bottom() {
    let map = learned();
    for cells in [[1, 1], [7, 11], [32, 2], [33, 3], [1, 70], [0, 5]] {
        // Powers of two, so that every centre is exact.
        let (corner_m, resolution_m) = ([-3.5, 1.25], 0.125);
        let grid = Grid { corner_m: Point::from(corner_m), resolution_m, cells };
        let mut expected = Vec::new();
        for row in 0..cells[1] {
            for column in 0..cells[0] {
                let [x, y] = [column, row].map(|cell| (cell as f32 + 0.5) * resolution_m);
                expected.push(map.mapper().occupancy(&[corner_m[0] + x, corner_m[1] + y].into()));
            }
        }
        assert_eq!((grid.len(), grid.is_empty()), (expected.len(), expected.is_empty()));
        for room in [expected.len() + 2, expected.len(), expected.len() / 2] {
            let mut answers = vec![UNTOUCHED; room];
            map.mapper().raster(&grid, &mut answers);
            let len = room.min(expected.len());
            assert_eq!(answers[..len], expected[..len], "{cells:?}");
            assert!(answers[len..].iter().all(|answer| *answer == UNTOUCHED), "{cells:?}");
        }
    }
}

const SPACING_M: f64 = 0.25;

/// Round obstacles in free space, and a variance that changes from place to place.
struct Field {
    /// Middle, height in log-odds, and radius, metres.
    obstacles: Vec<([f64; 2], f64, f64)>,
}

impl Field {
    fn new(stream: &mut Stream) -> Self {
        let mut obstacle =
            || ([0, 1].map(|_| stream.between(-6.0, 6.0)), stream.between(2.0, 11.0), stream.between(0.4, 1.2));
        Self { obstacles: (0..14).map(|_| obstacle()).collect() }
    }

    /// Mean and variance of the log-odds.
    fn moments(&self, at: [f64; 2]) -> (f64, f64) {
        let bump = |(middle, height, radius): &([f64; 2], f64, f64)| {
            let square = (at[0] - middle[0]).powi(2) + (at[1] - middle[1]).powi(2);
            height * (-square / (radius * radius)).exp()
        };
        (self.obstacles.iter().map(bump).sum::<f64>() - 4.0, 1.0 + 0.5 * (at[0] - 0.7 * at[1]).sin())
    }
}

impl Map<2> for Field {
    fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        let (mean, variance) = self.moments([point_m.x, point_m.y].map(f64::from));
        Occupancy::from_moments(mean as f32, variance as f32)
    }

    fn gradient(&self, _: &Point<2>) -> OccupancyGradient<2> {
        OccupancyGradient::UNKNOWN
    }

    fn spacing_m(&self) -> f32 {
        SPACING_M as f32
    }

    fn for_each_tile(&self, _: &mut dyn FnMut(&TileRef<'_, 2>)) {}
}

/// A march in steps so small that what they leave out does not matter.
struct March {
    step_m: f64,
    /// The logit `m/√(1 + πs²/8)` at each step.
    logits: Vec<f64>,
}

impl March {
    fn new(field: &Field, origin_m: &Point<2>, direction: &Point<2>, range_m: f32) -> Self {
        const STEPS: usize = 40_000;
        let step_m = f64::from(range_m) / STEPS as f64;
        let logit = |number: usize| {
            let along = step_m * number as f64;
            let at = [0, 1].map(|axis| f64::from(origin_m[axis]) + f64::from(direction[axis]) * along);
            let (mean, variance) = field.moments(at);
            mean / (1.0 + std::f64::consts::PI * variance / 8.0).sqrt()
        };
        Self { step_m, logits: (0..=STEPS).map(logit).collect() }
    }

    /// Where the probability is first above the threshold, and for how far it stays there, metres.
    fn first_m(&self, threshold: f64) -> Option<(f64, f64)> {
        let above = |logit: &f64| 1.0 / (1.0 + (-logit).exp()) > threshold;
        let first = self.logits.iter().position(above)?;
        let stays = self.logits[first..].iter().take_while(|logit| above(logit)).count();
        Some((first as f64 * self.step_m, stays as f64 * self.step_m))
    }

    /// `∫ S(r) dr`, and how far the same by trapezoids of `coarse_m` may be from it, metres.
    ///
    /// A sum of trapezoids of width `t` is off by at most `t²/8 · ∫|f″|` (its Peano kernel is nowhere larger). That bounds
    /// the exponent up to each `r`, hence the factor by which `S(r)` is off, and then the integral of `S`.
    fn expected_m(&self, coarse_m: f64) -> (f64, f64) {
        let kernel = coarse_m * coarse_m / 8.0;
        let rates: Vec<f64> = self.logits.iter().map(|logit| -(1.0 + logit.exp()).ln() / SPACING_M).collect();
        let mut exponents = vec![0.0];
        for pair in rates.windows(2) {
            exponents.push(exponents[exponents.len() - 1] + 0.5 * (pair[0] + pair[1]) * self.step_m);
        }
        let survival: Vec<f64> = exponents.iter().map(|exponent| exponent.exp()).collect();
        let (mut expected, mut bend, mut off) = (0.0, 0.0, 0.0);
        for (number, pair) in survival.windows(2).enumerate() {
            expected += 0.5 * (pair[0] + pair[1]) * self.step_m;
            let second = |f: &[f64]| f.get(number..number + 3).map_or(0.0, |f| (f[0] - 2.0 * f[1] + f[2]).abs());
            bend += second(&rates) / self.step_m;
            off += pair[0] * (kernel * bend).exp_m1() * self.step_m + kernel * second(&survival) / self.step_m;
        }
        (expected, off)
    }
}

#[test]
fn a_ray_ends_where_a_dense_march_ends() {
    let mut stream = Stream::new(13);
    let (mut hits, mut misses, mut inside, mut largest_allowed) = (0, 0, 0, 0.0_f64);
    for _ in 0..30 {
        let field = Field::new(&mut stream);
        for _ in 0..4 {
            let origin_m = Point::<2>::new(stream.between(-6.0, 6.0) as f32, stream.between(-6.0, 6.0) as f32);
            let angle = stream.between(0.0, std::f64::consts::TAU);
            let direction = Point::<2>::new(angle.cos() as f32, angle.sin() as f32);
            let range_m = stream.between(2.0, 12.0) as f32;
            let march = March::new(&field, &origin_m, &direction, range_m);
            // Eight steps a spacing, and one.
            let coarse_m = SPACING_M / 8.0;
            let (expected_m, off_m) = march.expected_m(coarse_m);
            for threshold in [0.2, 0.5, 0.8] {
                let cast = field.cast_ray(&origin_m, &direction, range_m, threshold as f32);
                // Rounding: some hundred steps of a few units in the last place of the range.
                let allowed_m = off_m + 1e-4;
                largest_allowed = largest_allowed.max(allowed_m);
                let difference_m = (f64::from(cast.expected_m) - expected_m).abs();
                assert!(difference_m <= allowed_m, "{cast:?} for {expected_m} within {allowed_m}");
                match march.first_m(threshold) {
                    // Between two steps a ray may miss what is narrower than they are apart.
                    Some((_, stays_m)) if stays_m <= coarse_m => (),
                    Some((first_m, _)) => {
                        // A thousandth of a step, the march's own, and rounding where the probability rises slowly.
                        let allowed_m = coarse_m / 1_000.0 + march.step_m + 2e-4;
                        let found_m = cast.first_m.map(f64::from).expect("the march met something");
                        assert!((found_m - first_m).abs() <= allowed_m, "{found_m} for {first_m}");
                        hits += 1;
                        inside += u32::from(first_m == 0.0);
                    }
                    None => {
                        assert_eq!(cast.first_m, None);
                        misses += 1;
                    }
                }
            }
        }
    }
    assert!(hits > 100 && misses > 50 && inside > 10, "{hits} hits, {inside} of them from inside, {misses} misses");
    assert!(largest_allowed < 0.05, "an allowance of {largest_allowed} m sees nothing");
}

#[test]
fn a_ray_without_a_length_meets_nothing() {
    let field = Field::new(&mut Stream::new(14));
    for range_m in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let cast = field.cast_ray(&Point::zeros(), &Point::<2>::new(1.0, 0.0), range_m, 0.0);
        assert_eq!(cast, RayCast { first_m: None, expected_m: 0.0 }, "{range_m}");
    }
}
