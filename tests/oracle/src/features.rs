//! Which supports there are and what a point makes of them.

use super::Kernel;

/// A box of supports on a lattice, the last axis counted fastest; with a bias, one more feature that is always 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features<const D: usize> {
    /// Where the first support sits, metres.
    pub origin_m: [f64; D],
    /// Distance between neighbours, metres.
    pub spacing_m: f64,
    /// Supports along each axis.
    pub width: [usize; D],
    /// Supports a side that a point sees: half of them on either side of it. At `usize::MAX` it sees all.
    pub stencil: usize,
    /// The kernel.
    pub kernel: Kernel,
    /// Whether there is a bias.
    pub bias: bool,
}

impl<const D: usize> Features<D> {
    /// Number of features.
    #[must_use]
    pub fn len(&self) -> usize {
        self.width.iter().product::<usize>() + usize::from(self.bias)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `stencil` supports a side around a point all exist.
    #[must_use]
    pub fn hold_whole(&self, stencil: usize, point_m: &[f64; D]) -> bool {
        (0..D).all(|axis| {
            let cell = ((point_m[axis] - self.origin_m[axis]) / self.spacing_m).floor();
            let below = (stencil / 2) as f64 - 1.0;
            cell - below >= 0.0 && cell + (stencil / 2) as f64 <= self.width[axis] as f64 - 1.0
        })
    }

    /// φ(x); supports outside the stencil count 0.
    #[must_use]
    pub fn at(&self, point_m: &[f64; D]) -> Vec<f64> {
        let supports = self.width.iter().product();
        let mut phi = vec![0.0; supports];
        for (number, value) in phi.iter_mut().enumerate() {
            let (mut rest, mut seen, mut displacement) = (number, true, [0.0; D]);
            for axis in (0..D).rev() {
                let node = rest % self.width[axis];
                rest /= self.width[axis];
                displacement[axis] = point_m[axis] - self.origin_m[axis] - node as f64 * self.spacing_m;
                // Half the stencil lies on either side of the point: a support on the left of it belongs to it with
                // less than S/2 cells in between, one on the right with at most S/2.
                let cells = ((point_m[axis] - self.origin_m[axis]) / self.spacing_m).floor() - node as f64;
                let half = (self.stencil / 2) as f64;
                seen &= cells < half && cells >= -half;
            }
            if seen {
                *value = self.kernel.value(&displacement);
            }
        }
        if self.bias {
            phi.push(1.0);
        }
        phi
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_stencil_is_seen_where_it_fits_and_only_there() {
        let features = Features::<2> {
            origin_m: [-1.0, 0.5],
            spacing_m: 0.5,
            width: [7, 5],
            stencil: 4,
            kernel: Kernel::SquaredExponential { shape_m2: 1.0 },
            bias: false,
        };
        for i in -10..50 {
            for j in -10..50 {
                let at = [f64::from(i) * 0.107 - 1.3, f64::from(j) * 0.093 + 0.1];
                let seen = features.at(&at).iter().filter(|value| **value > 0.0).count();
                assert_eq!(seen == 16, features.hold_whole(4, &at), "{seen} at {at:?}");
            }
        }
        // Support 8 = node (1, 3) sits at (−0.5, 2.0).
        assert!((features.at(&[-0.5, 2.0])[8] - 1.0).abs() < 1e-15);
    }
}
