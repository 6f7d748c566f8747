//! Priors in `f64`: precisions of a tile's weights, from polynomials that are integrated exactly.

use bhm_core::{prior::PriorSettings, settings::Settings};

use super::{DensePosterior, matrix::Matrix};

/// Coefficients of a polynomial, the constant first.
type Polynomial = Vec<f64>;

fn times(left: &[f64], right: &[f64]) -> Polynomial {
    let mut product = vec![0.0; left.len() + right.len() - 1];
    for (i, a) in left.iter().enumerate() {
        for (j, b) in right.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

fn derivative(of: &[f64]) -> Polynomial {
    of.iter().enumerate().skip(1).map(|(power, factor)| power as f64 * factor).collect()
}

/// `∫₀¹`.
fn integral(of: &[f64]) -> f64 {
    of.iter().enumerate().map(|(power, factor)| factor / (power + 1) as f64).sum()
}

/// The pieces of the cubic B-spline, one at its peak, that reach a cell: of the nodes before it, at its ends, and behind it.
fn pieces() -> [Polynomial; 4] {
    let cube = |linear: [f64; 2]| times(&times(&linear, &linear), &linear);
    let scaled = |polynomial: Polynomial, by: f64| -> Polynomial { polynomial.iter().map(|x| by * x).collect() };
    // (1 − t)³/4, (4 − 6t² + 3t³)/4, (1 + 3t + 3t² − 3t³)/4, t³/4.
    [
        scaled(cube([1.0, -1.0]), 0.25),
        vec![1.0, 0.0, -1.5, 0.75],
        vec![0.25, 0.75, 0.75, -0.75],
        scaled(cube([0.0, 1.0]), 0.25),
    ]
}

/// `∫ β⁽ᵏ⁾β⁽ᵏ⁾` of every pair of `count` nodes in a row, over the cells that four nodes reach.
fn gram(count: usize, order: usize) -> Matrix {
    let pieces = pieces().map(|piece| (0..order).fold(piece, |piece, _| derivative(&piece)));
    let mut gram = vec![vec![0.0; count]; count];
    for cell in 0..=count - 4 {
        for (a, left) in pieces.iter().enumerate() {
            for (b, right) in pieces.iter().enumerate() {
                gram[cell + a][cell + b] += integral(&times(left, right));
            }
        }
    }
    gram
}

fn kronecker(left: &Matrix, right: &Matrix) -> Matrix {
    let rows = left.iter().flat_map(|l| right.iter().map(move |r| (l, r)));
    rows.map(|(l, r)| l.iter().flat_map(|a| r.iter().map(move |b| a * b)).collect()).collect()
}

/// `κ⁴ M₀⊗M₀ + 2κ² (M₁⊗M₀ + M₀⊗M₁) + M₂⊗M₀ + 2 M₁⊗M₁ + M₀⊗M₂`, κ in spacings, with the deviation that is wanted in the middle.
fn matern(width: [usize; 2], deviation: f64, range: f64) -> Matrix {
    let kappa_squared = 8.0 / (range * range);
    let [x, y] = width.map(|count| [0, 1, 2].map(|order| gram(count, order)));
    let terms = [
        (kappa_squared * kappa_squared, 0, 0),
        (2.0 * kappa_squared, 1, 0),
        (2.0 * kappa_squared, 0, 1),
        (1.0, 2, 0),
        (2.0, 1, 1),
        (1.0, 0, 2),
    ];
    let weights = width[0] * width[1];
    let mut precision = vec![vec![0.0; weights]; weights];
    for (factor, of_x, of_y) in terms {
        for (row, term) in precision.iter_mut().zip(kronecker(&x[of_x], &y[of_y])) {
            row.iter_mut().zip(term).for_each(|(entry, term)| *entry += factor * term);
        }
    }
    let spline = |distance: f64| match distance.abs() {
        a if a < 1.0 => 1.0 - 1.5 * a * a + 0.75 * a * a * a,
        a if a < 2.0 => 0.25 * (2.0 - a).powi(3),
        _ => 0.0,
    };
    let along = |node: usize, count: usize| spline(node as f64 - (count - 1) as f64 / 2.0);
    let phi: Vec<f64> = (0..weights).map(|i| along(i / width[1], width[0]) * along(i % width[1], width[1])).collect();
    let belief = DensePosterior::from_information(precision.clone(), vec![0.0; weights]).expect("a proper prior");
    let variance = belief.predict(&phi).variance;
    precision.iter_mut().flatten().for_each(|entry| *entry *= variance / (deviation * deviation));
    precision
}

/// What is believed of a tile before any scan: its weights, and the bias last if there is one, in plain coordinates.
#[must_use]
pub fn of(settings: &Settings) -> DensePosterior {
    let weights = settings.supports();
    let mut precision = match settings.prior {
        PriorSettings::White(prior) => {
            let entry = |i, j| if i == j { f64::from(prior.precision) } else { 0.0 };
            (0..weights).map(|i| (0..weights).map(|j| entry(i, j)).collect()).collect()
        }
        PriorSettings::Matern(prior) => {
            let range = f64::from(prior.range_m) / f64::from(settings.spacing_m);
            matern(settings.tile.width, f64::from(prior.deviation), range.clamp(1.0, 32.0))
        }
    };
    if let Some(bias) = settings.bias {
        precision.iter_mut().for_each(|row: &mut Vec<f64>| row.push(0.0));
        precision.push(vec![0.0; weights + 1]);
        precision[weights][weights] = f64::from(bias.precision);
    }
    let weights = precision.len();
    DensePosterior::from_information(precision, vec![0.0; weights]).expect("a proper prior")
}
