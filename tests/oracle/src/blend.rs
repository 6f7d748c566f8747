//! Tiles as one continuous function, in `f64`, from given means and covariances.

use std::collections::BTreeMap;

use super::matrix::{Matrix, quadratic};
use super::{DensePosterior, Features, Kernel, Prediction};
use bhm_core::{kernel::KernelSettings, settings::Settings};

/// Overlapping tiles and how a point's answer is blended from them.
///
/// A tile at `t` holds the nodes `t·stride … t·stride + width − 1`. It answers where it holds a point's whole stencil:
/// `width − stencil + 1` cells a side. Weight: the product over axes of `s(min(distance to that region's edge, o)/o)`, `o`
/// the overlap of neighbouring regions and `s` the quintic smoothstep `6t⁵ − 15t⁴ + 10t³`, divided by the sum over all tile
/// positions there. A position without a tile answers with the prior.
#[derive(Clone, Debug)]
pub struct TileBlend {
    /// Where node (0, 0) sits, metres.
    pub origin_m: [f64; 2],
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f64,
    /// Supports a side that a point sees.
    pub stencil: usize,
    /// The kernel.
    pub kernel: Kernel,
    /// Supports of a tile along each axis.
    pub width: [usize; 2],
    /// Supports from one tile to the next.
    pub stride: [usize; 2],
    /// What is believed of a tile before any scan, in plain coordinates.
    pub prior: DensePosterior,
    /// With a bias: the `c` of tiles that store `w + c·b` instead of the weights `w`, so that `f = Σ(w + c·b)φ + b(1 − cΣφ)`.
    pub bias_coupling: Option<f64>,
    tiles: BTreeMap<[i32; 2], (Vec<f64>, Matrix)>,
}

impl TileBlend {
    /// No tile yet.
    #[must_use]
    pub fn of(settings: &Settings, bias_coupling: Option<f64>) -> Self {
        let spacing_m = f64::from(settings.spacing_m);
        let shape_m2 = |shape: f32| f64::from(shape) * spacing_m * spacing_m;
        Self {
            origin_m: settings.origin_m.map(f64::from),
            spacing_m,
            stencil: settings.tile.stencil,
            kernel: match settings.kernel {
                KernelSettings::CubicBSpline(_) => Kernel::CubicBSpline { spacing_m },
                KernelSettings::SquaredExponential(kernel) => {
                    Kernel::SquaredExponential { shape_m2: shape_m2(kernel.shape) }
                }
                KernelSettings::TwoScales(kernel) => Kernel::TwoScales { shape_m2: shape_m2(kernel.shape) },
            },
            width: settings.tile.width,
            stride: settings.tile.stride,
            prior: super::prior::of(settings),
            bias_coupling,
            tiles: BTreeMap::new(),
        }
    }

    /// Adds a tile, as dense mean and covariance; with a bias, the bias last.
    pub fn insert(&mut self, index: [i32; 2], mean: Vec<f64>, covariance: Matrix) {
        self.tiles.insert(index, (mean, covariance));
    }

    /// Adds a tile of the crate: its band of `Σ` becomes a matrix, zero elsewhere.
    pub fn insert_view<const M: usize, const B: usize>(
        &mut self,
        index: [i32; 2],
        tile: &bhm_core::posterior::PosteriorView<'_, M, B>,
    ) {
        let mut mean: Vec<f64> = tile.mean.iter().copied().map(f64::from).collect();
        let mut covariance = vec![vec![0.0; M]; M];
        for (i, row) in tile.covariance.iter().enumerate() {
            for (j, value) in row.iter().enumerate().take(M - i) {
                covariance[i][i + j] = f64::from(*value);
                covariance[i + j][i] = f64::from(*value);
            }
        }
        if self.bias_coupling.is_some() {
            mean.push(f64::from(tile.bias_mean));
            for (row, value) in covariance.iter_mut().zip(tile.border_covariance) {
                row.push(f64::from(*value));
            }
            let mut last: Vec<f64> = tile.border_covariance.iter().copied().map(f64::from).collect();
            last.push(f64::from(tile.bias_covariance));
            covariance.push(last);
        }
        self.insert(index, mean, covariance);
    }

    /// Number of tiles.
    #[must_use]
    pub fn tiles(&self) -> usize {
        self.tiles.len()
    }

    /// Weight of the tile at a position for a point, before they are normalised; 0 outside its region.
    fn raw_weight(&self, tile: [i32; 2], point_m: &[f64; 2]) -> f64 {
        (0..2)
            .map(|axis| {
                let cells = (point_m[axis] - self.origin_m[axis]) / self.spacing_m;
                let region = (self.width[axis] - self.stencil + 1) as f64;
                let low = f64::from(tile[axis]) * self.stride[axis] as f64 + (self.stencil / 2 - 1) as f64;
                let distance = (cells - low).min(low + region - cells);
                let t = (distance / (region - self.stride[axis] as f64)).clamp(0.0, 1.0);
                6.0 * t.powi(5) - 15.0 * t.powi(4) + 10.0 * t.powi(3)
            })
            .product()
    }

    /// What the tiles together say about a point.
    #[must_use]
    pub fn predict(&self, point_m: &[f64; 2]) -> Prediction {
        let cells = [0, 1].map(|axis| (point_m[axis] - self.origin_m[axis]) / self.spacing_m);
        let near = [0, 1].map(|axis| (cells[axis] / self.stride[axis] as f64).floor() as i32);
        let (mut mean, mut variance, mut total) = (0.0, 0.0, 0.0);
        for x in near[0] - 2..=near[0] + 2 {
            for y in near[1] - 2..=near[1] + 2 {
                let weight = self.raw_weight([x, y], point_m);
                if weight == 0.0 {
                    continue;
                }
                total += weight;
                let phi = self.features([x, y]).at(point_m);
                match self.tiles.get(&[x, y]) {
                    Some((tile_mean, covariance)) => {
                        let mut phi = phi;
                        if let Some(coupling) = self.bias_coupling {
                            phi.push(1.0 - coupling * phi.iter().sum::<f64>());
                        }
                        mean += weight * phi.iter().zip(tile_mean).map(|(p, w)| p * w).sum::<f64>();
                        variance += weight * quadratic(covariance, &phi);
                    }
                    None => {
                        let mut phi = phi;
                        phi.extend((self.prior.mean.len() > phi.len()).then_some(1.0));
                        variance += weight * self.prior.predict(&phi).variance;
                    }
                }
            }
        }
        Prediction::from_moments(mean / total, variance / total)
    }

    /// The supports of a tile.
    fn features(&self, tile: [i32; 2]) -> Features<2> {
        let first = [0, 1].map(|axis| f64::from(tile[axis]) * self.stride[axis] as f64 * self.spacing_m);
        Features {
            origin_m: [self.origin_m[0] + first[0], self.origin_m[1] + first[1]],
            spacing_m: self.spacing_m,
            width: self.width,
            stencil: self.stencil,
            kernel: self.kernel,
            bias: false,
        }
    }

    /// `∂p/∂x`, `∂m/∂x` and `∂s²/∂x` by central differences with step `step_m`, per metre; one `[p, m, s²]` per axis.
    #[must_use]
    pub fn differences(&self, point_m: &[f64; 2], step_m: f64) -> [[f64; 3]; 2] {
        [0, 1].map(|axis| {
            let at = |sign: f64| {
                let mut moved = *point_m;
                moved[axis] += sign * step_m;
                let Prediction { probability, mean, variance } = self.predict(&moved);
                [probability, mean, variance]
            };
            let (ahead, behind) = (at(1.0), at(-1.0));
            [0, 1, 2].map(|i| (ahead[i] - behind[i]) / (2.0 * step_m))
        })
    }
}
