use super::super::{Failed, Setup};

/// Supports at most: the matrices of so many are 288 MB each.
const MOST_SUPPORTS: usize = 6_000;
/// By which a spacing with too many supports is widened.
const WIDER: f64 = 1.02;
/// `g = 0.6 h²`.
const KERNEL_SHAPE: f64 = 0.6;
/// Features below are taken as zero.
const LEAST_FEATURE: f64 = 1e-12;

/// Features that are not zero, by their support, in rising order.
pub(super) type Row = Vec<(usize, f64)>;

/// Supports at the nodes of one lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub(super) spacing_m: f64,
    pub(super) origin_m: [f64; 2],
    pub(super) shape: [usize; 2],
}

impl Lattice {
    /// Over the area of a setup, as fine as its size says or as can be.
    pub(super) fn over(setup: &Setup) -> Result<Self, Failed> {
        let origin_m = setup.area_m[0].map(f64::from);
        let extent_m = [0, 1].map(|axis| f64::from(setup.area_m[1][axis]) - origin_m[axis]);
        let mut spacing_m = f64::from(setup.size);
        let sound = spacing_m > 0.0 && origin_m.iter().chain(&extent_m).all(|x| x.is_finite() && x.abs() < 1e9);
        if !(sound && spacing_m.is_finite() && extent_m.iter().all(|x| *x >= 0.0)) {
            return Err(Failed(format!("no lattice of {spacing_m} m over {:?} m", setup.area_m)));
        }
        // Finer than this it cannot be: the nodes of either axis alone would be too many, or all of them.
        let [width_m, height_m] = extent_m;
        let most = MOST_SUPPORTS as f64;
        spacing_m = spacing_m.max(width_m / most).max(height_m / most).max((width_m * height_m / most).sqrt());
        loop {
            let shape = extent_m.map(|x| (x / spacing_m).ceil() as usize + 1);
            if shape[0] * shape[1] <= MOST_SUPPORTS {
                return Ok(Self { spacing_m, origin_m, shape });
            }
            spacing_m *= WIDER;
        }
    }

    pub(super) fn supports(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// `exp(−d²/g)` of every support near a point; empty where there is none, or the point is nowhere.
    pub(super) fn row(&self, point_m: [f32; 2]) -> Row {
        let shape = KERNEL_SHAPE * self.spacing_m * self.spacing_m;
        let reach_m = (shape * -LEAST_FEATURE.ln()).sqrt();
        let point_m = point_m.map(f64::from);
        let near = |axis: usize| {
            let node = |x_m: f64| (x_m - self.origin_m[axis]) / self.spacing_m;
            // What is negative, or not a number, becomes 0.
            let first = node(point_m[axis] - reach_m).ceil() as usize;
            let end = (node(point_m[axis] + reach_m) + 1.0).floor() as usize;
            first..end.min(self.shape[axis])
        };
        let apart = |axis: usize, node: usize| self.origin_m[axis] + node as f64 * self.spacing_m - point_m[axis];
        let mut row = Row::new();
        for y in near(1) {
            for x in near(0) {
                let squared = apart(0, x).powi(2) + apart(1, y).powi(2);
                let feature = (-squared / shape).exp();
                if feature >= LEAST_FEATURE {
                    row.push((y * self.shape[0] + x, feature));
                }
            }
        }
        row
    }
}
