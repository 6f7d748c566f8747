//! Points of a square lattice over a fixed area, which methods with supports everywhere share.

use super::{Failed, Setup};

/// Most points a lattice may have: what is kept for each is a few numbers.
const MAX_POINTS: usize = 1 << 26;
/// `g = 0.6 h²` in `exp(−d²/g)`, in Bayesian Hilbert maps: the paper's 0.15 m² at its 0.5 m.
const KERNEL_SHAPE: f64 = 0.6;

/// Where the points lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub(super) spacing_m: f64,
    /// The first point, in spacings.
    pub(super) origin: [f64; 2],
    /// Points along x and y.
    pub(super) shape: [usize; 2],
}

impl Lattice {
    /// At multiples of the spacing, the area covered with half a spacing to spare.
    pub(super) fn over(setup: &Setup, spacing_m: f64) -> Result<Self, Failed> {
        let [min_m, max_m] = setup.area_m;
        if !(spacing_m > 0.0 && min_m.iter().chain(&max_m).all(|x| x.is_finite())) {
            return Err(Failed(format!("no lattice of {spacing_m} m over {min_m:?} to {max_m:?} m")));
        }
        let origin = min_m.map(|x| (f64::from(x) / spacing_m).round());
        let shape = [0, 1].map(|axis| ((f64::from(max_m[axis]) / spacing_m).round() - origin[axis]).max(0.0) as usize);
        let shape = shape.map(|points| points.saturating_add(1));
        match shape[0].checked_mul(shape[1]) {
            Some(points) if points <= MAX_POINTS => Ok(Self { spacing_m, origin, shape }),
            _ => Err(Failed(format!("{} x {} points {spacing_m} m apart are too many", shape[0], shape[1]))),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Visits the features `exp(−d²/g)`, `g = 0.6 h²`, of a place that are not below `least`, in rising order of their points.
    pub(super) fn features(&self, point_m: [f32; 2], least: f64, mut visit: impl FnMut(usize, f64)) {
        let shape_m2 = KERNEL_SHAPE * self.spacing_m.powi(2);
        self.around(point_m, (-least.ln() * shape_m2).sqrt(), |point, squared_m2| {
            let feature = (-squared_m2 / shape_m2).exp();
            if feature >= least {
                visit(point, feature);
            }
        });
    }

    /// Visits every lattice point no further than `reach_m` from a place along either axis: its number, and the square of its
    /// distance in m².
    pub(super) fn around(&self, point_m: [f32; 2], reach_m: f64, mut visit: impl FnMut(usize, f64)) {
        let x = [0, 1].map(|axis| f64::from(point_m[axis]) / self.spacing_m - self.origin[axis]);
        let reach = reach_m / self.spacing_m;
        // Casts saturate: far outside, the range is empty.
        let range = [0, 1].map(|axis| {
            let after = ((x[axis] + reach).floor() + 1.0).max(0.0) as usize;
            ((x[axis] - reach).ceil().max(0.0) as usize)..after.min(self.shape[axis])
        });
        for row in range[1].clone() {
            for column in range[0].clone() {
                let [dx, dy] = [x[0] - column as f64, x[1] - row as f64];
                visit(row * self.shape[0] + column, (dx * dx + dy * dy) * self.spacing_m * self.spacing_m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::setup;

    /// The oracle measures the distance to every point of the lattice, and places them from the description alone.
    #[test]
    fn around_a_place_is_every_point_in_reach() {
        let lattice = Lattice::over(&setup([[-1.2, 0.1], [2.0, 1.4]], 0.5), 0.5).unwrap();
        let all: Vec<[f64; 2]> = (0..4)
            .flat_map(|row| (-2..=4).map(move |column| [f64::from(column) * 0.5, f64::from(row) * 0.5]))
            .collect();
        assert_eq!(lattice.count(), all.len());
        for place in [[0.0, 0.0], [-1.2, 1.4], [0.6, 0.7], [-2.0, 0.3], [50.0, 0.0]] {
            let mut found = Vec::new();
            lattice.around(place, 0.8, |number, squared_m2| found.push((number, squared_m2)));
            let offset = |at: &[f64; 2]| [at[0] - f64::from(place[0]), at[1] - f64::from(place[1])];
            let expected = all.iter().enumerate().map(|(number, at)| (number, offset(at)));
            let expected: Vec<_> = expected.filter(|(_, d)| d[0].abs() <= 0.8 && d[1].abs() <= 0.8).collect();
            assert_eq!(found.len(), expected.len(), "{place:?}");
            for ((number, squared_m2), (expected, d)) in found.iter().zip(expected) {
                assert!(*number == expected && (squared_m2 - d[0] * d[0] - d[1] * d[1]).abs() < 1e-6);
            }
        }
        lattice.around([f32::MAX, -f32::MAX], 0.8, |number, _| panic!("{number} is not near"));
    }

    #[test]
    fn a_lattice_without_bounds_is_refused() {
        for (spacing_m, far) in [(0.5, f32::MAX), (0.0, 1.0), (f64::NAN, 1.0), (1e-9, 1.0), (0.5, f32::INFINITY)] {
            assert!(
                Lattice::over(&setup([[-far, -far], [far, far]], 0.5), spacing_m).is_err(),
                "{spacing_m} over {far}"
            );
        }
    }
}
