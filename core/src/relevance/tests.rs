use super::*;
use std::{vec, vec::Vec};

const SPACING_M: f32 = 0.5;

/// Uniform in [0, 1).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
}

fn learn(points: &[[f32; 2]], passes: usize, settings: RelevanceSettings) -> (Window<2>, Vec<AnySupport<2>>, u64) {
    let lattice = Lattice { origin_m: Point::zeros(), spacing_m: SPACING_M, stencil: 6 };
    let window = Window { first: [-10, -10], width: [21, 21] };
    let mut nodes = vec![NodeStatistics::default(); window.supports()];
    let mut relevance = Relevance::new(lattice, window, settings, &mut nodes).unwrap();
    for _ in 0..passes {
        points.iter().for_each(|point| relevance.observe(&Point::from(*point), 1.0));
        relevance.maximise();
    }
    (window, relevance.supports().collect(), relevance.outside())
}

fn covariance(support: &AnySupport<2>) -> [f64; 3] {
    match support {
        AnySupport::GaussianSupport(gaussian) => {
            let s = gaussian.covariance_m2();
            [s[(0, 0)], s[(0, 1)], s[(1, 1)]].map(f64::from)
        }
        _ => [0.0; 3],
    }
}

/// The same EM in f64, over every node instead of a stencil's, dense and naive.
fn naive(points: &[[f32; 2]], passes: usize, settings: RelevanceSettings) -> Vec<[f64; 3]> {
    let nodes: Vec<[f64; 2]> = (-10..=10).flat_map(|i| (-10..=10).map(move |j| [f64::from(i), f64::from(j)])).collect();
    let first = f64::from(FIRST_DEVIATION * FIRST_DEVIATION);
    let mut mixture = vec![(1.0, [first, 0.0, first]); nodes.len()];
    let nu = f64::from(settings.pseudo_count);
    let mut spreads = Vec::new();
    for _ in 0..passes {
        let mut sums = vec![(0.0, [0.0; 2], [0.0; 3]); nodes.len()];
        for point in points {
            let x = point.map(|metres| f64::from(metres) / f64::from(SPACING_M));
            let parts: Vec<f64> = nodes
                .iter()
                .zip(&mixture)
                .map(|(node, (share, [xx, xy, yy]))| {
                    let (dx, dy) = (x[0] - node[0], x[1] - node[1]);
                    let (xx, yy) = (xx + f64::from(LEAST_VARIANCE), yy + f64::from(LEAST_VARIANCE));
                    let determinant = xx * yy - xy * xy;
                    let square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
                    share * (-0.5 * square).exp() / determinant.sqrt()
                })
                .collect();
            let total: f64 = parts.iter().sum();
            for ((node, part), (weight, offset, scatter)) in nodes.iter().zip(parts).zip(&mut sums) {
                let (dx, dy, r) = (x[0] - node[0], x[1] - node[1], part / total);
                *weight += r;
                offset[0] += r * dx;
                offset[1] += r * dy;
                scatter[0] += r * dx * dx;
                scatter[1] += r * dx * dy;
                scatter[2] += r * dy * dy;
            }
        }
        let cut = |raw: [f64; 3]| {
            narrowed(raw.map(|entry| entry as f32), settings.max_deviation * settings.max_deviation).map(f64::from)
        };
        spreads.clear();
        for ((share, covariance), (weight, offset, scatter)) in mixture.iter_mut().zip(sums) {
            *share = weight + nu;
            let raw: [f64; 3] = scatter.map(|sum: f64| sum / (weight + nu));
            let [x, y]: [f64; 2] = offset;
            let about_mean: [f64; 3] = [x * x, x * y, y * y].map(|square| square / weight.max(1e-300));
            let centred: [f64; 3] = [0, 1, 2].map(|i| (scatter[i] - about_mean[i]) / (weight + nu));
            spreads.push(cut(centred));
            *covariance = cut(raw);
        }
    }
    let square_m2 = f64::from(SPACING_M * SPACING_M);
    spreads.into_iter().map(|spread| spread.map(|entry| entry * square_m2)).collect()
}

/// A wall along the diagonal of the window's middle, and round clutter in a corner.
fn points(random: &mut Random) -> Vec<[f32; 2]> {
    let wall = (0..4_000).map(|_| random.next() * 4.0 - 2.0).collect::<Vec<_>>();
    let mut points: Vec<[f32; 2]> = wall.into_iter().map(|t| [t, t + 0.05 * (random.next() - 0.5)]).collect();
    points.extend((0..1_000).map(|_| [random.next() + 1.5, random.next() - 3.0]));
    points
}

#[test]
fn agrees_with_dense_em_over_every_node() {
    let points = points(&mut Random(1));
    for settings in [RelevanceSettings::DEFAULT, RelevanceSettings { pseudo_count: 1.0, max_deviation: 1.1 }] {
        let (_, supports, outside) = learn(&points, 3, settings);
        assert_eq!(outside, 0);
        for (support, expected) in supports.iter().zip(naive(&points, 3, settings)) {
            for (got, expected) in covariance(support).iter().zip(expected) {
                // A stencil of six drops responsibilities below exp(−½(3/0.7)²) = 1e-4.
                assert!((got - expected).abs() < 3e-3 * f64::from(SPACING_M * SPACING_M), "{got} against {expected}");
            }
        }
    }
}

#[test]
fn supports_lie_along_the_wall_and_those_without_data_are_points() {
    let (window, supports, _) = learn(&points(&mut Random(2)), 4, RelevanceSettings::DEFAULT);
    let at = |node: [i32; 2]| &supports[window.index_of_whole(&node, 1).unwrap()];
    for i in -3..=2 {
        let [xx, xy, yy] = covariance(at([i, i]));
        let tilt = 0.5 * (2.0 * xy).atan2(xx - yy);
        assert!((tilt - std::f64::consts::FRAC_PI_4).abs() < 0.1, "node {i} tilts by {tilt}");
        let radius = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        let (wide, narrow) = (0.5 * (xx + yy) + radius, 0.5 * (xx + yy) - radius);
        assert!(wide > 20.0 * narrow, "node {i}: {wide} and {narrow}");
    }
    for far in [[-9, 9], [8, 8], [-9, -2]] {
        assert_eq!(*at(far), AnySupport::default(), "nothing was seen there");
    }
}

#[test]
fn what_cannot_be_placed_is_counted() {
    let far = [[f32::NAN, 0.0], [1e9, 0.0], [4.9, 0.0]];
    let (_, supports, outside) = learn(&far, 1, RelevanceSettings::DEFAULT);
    assert_eq!(outside, 3);
    assert!(supports.iter().all(|support| *support == AnySupport::default()));
    let mut memory = [NodeStatistics::default(); 3];
    let lattice = Lattice { origin_m: Point::zeros(), spacing_m: SPACING_M, stencil: 6 };
    let window = Window { first: [0, 0], width: [2, 2] };
    let error = Relevance::new(lattice, window, RelevanceSettings::DEFAULT, &mut memory).unwrap_err();
    assert_eq!(error, MemoryMismatch { nodes: 4, lent: 3 });
}
