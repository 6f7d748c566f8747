use std::f64::consts::TAU;

use super::{Features, Rows};
use crate::baselines::{Failed, Setup, lattice::Lattice};

/// Where the kernel ends, in spacings of the lattice. At 1.7 and 2.3 the log-likelihood is worse.
const REACH: f64 = 2.0;

/// A kernel on every point of a lattice.
pub(super) struct Sparse {
    lattice: Lattice,
}

impl Sparse {
    pub(super) fn new(setup: &Setup) -> Result<Self, Failed> {
        Ok(Self { lattice: Lattice::over(setup, f64::from(setup.size))? })
    }
}

/// Melkumyan and Ramos 2009, equation (8), at the distance `d` in units of where it ends:
/// `(2 + cos 2πd)/3 · (1 − d) + sin 2πd / 2π`.
fn kernel(d: f64) -> f64 {
    if d >= 1.0 { 0.0 } else { (2.0 + (TAU * d).cos()) / 3.0 * (1.0 - d) + (TAU * d).sin() / TAU }
}

impl Features for Sparse {
    const EPOCHS: usize = 5;
    const RATE: f32 = 2.0;
    const FIRST_SQUARES: f32 = 1e-2;

    fn count(&self) -> usize {
        self.lattice.count()
    }

    fn description(&self) -> String {
        format!("supports {} m apart", self.lattice.spacing_m)
    }

    fn bytes(&self) -> usize {
        0
    }

    fn append(&mut self, points_m: &[[f32; 2]], rows: &mut Rows) {
        let reach_m = REACH * self.lattice.spacing_m;
        for point_m in points_m {
            self.lattice.around(*point_m, reach_m, |support, squared_m2| {
                let value = kernel(squared_m2.sqrt() / reach_m);
                if value > 0.0 {
                    rows.indices.push(support as u32);
                    rows.values.push(value as f32);
                }
            });
            rows.end_row();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::setup;

    /// By hand at the quarters, and what makes it a kernel of compact support: 1 at 0, smooth where it ends, no negative part in
    /// its spectrum on the line (the cosine transform by the trapezoidal rule).
    #[test]
    fn the_kernel_is_the_published_one() {
        let quarters =
            [(0.0, 1.0), (0.25, 0.5 + 1.0 / TAU), (0.5, 1.0 / 6.0), (0.75, 1.0 / 6.0 - 1.0 / TAU), (1.0, 0.0)];
        for (d, expected) in quarters {
            assert!((kernel(d) - expected).abs() < 1e-12, "{d}: {}", kernel(d));
        }
        assert!(kernel(0.999) < 1e-6 && kernel(7.0) == 0.0);
        for frequency in 0..60 {
            let f = f64::from(frequency) * 0.1;
            let power: f64 =
                (-1000..=1000).map(|i| f64::from(i) * 1e-3).map(|d| kernel(d.abs()) * (TAU * f * d).cos()).sum();
            assert!(power > -1e-4, "frequency {f}: {power}");
        }
    }

    #[test]
    fn a_row_has_the_supports_in_reach() {
        let mut features = Sparse::new(&setup([[-2.0, -2.0], [2.0, 2.0]], 0.5)).unwrap();
        let mut rows = Rows::default();
        features.append(&[[0.0, 0.0], [1e30, 0.0], [0.1, -0.2]], &mut rows);
        // Nine within one spacing's square, minus none; those two away on an axis are where the kernel ends.
        assert_eq!(rows.ends[..2], [9, 9]);
        assert!(rows.ends[2] >= 9 + 12);
        assert_eq!(rows.values[..9].iter().filter(|value| **value == 1.0).count(), 1);
    }
}
