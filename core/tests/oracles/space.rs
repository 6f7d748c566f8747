//! The mapper in three dimensions: a sweep of rays inside a hollow sphere, against the dense oracle and against the truth.

use bhm_core::{
    beam::{BeamLimits, Observation, Ray, Reading},
    geometry::Point,
    map::Map,
    mapper::{Link, Mapper, Memory, ObservationSlot, TouchedTile},
    posterior::{Posterior, RowState, Scratch},
    prior::{MaternPrior, PriorSettings, WhitePrior},
    profile::COMPACT,
    scan::{ScanRejected, Sweep},
    settings::{Settings, TileSettings},
    storage::Storage::Lent,
    support::SupportTable,
    tile::{DirectoryEntry, NoArchive, Tile},
};
use bhm_oracle::{DenseMap, DensePosterior, Features, Kernel, Rule};
use nalgebra::SMatrix;

use crate::common::{SAFEGUARD, Stream};

const WIDTH: usize = 6;
const M: usize = WIDTH * WIDTH * WIDTH;
const B: usize = 3 * (1 + WIDTH + WIDTH * WIDTH) + 1;
const SPACING_M: f32 = 0.4;
const TILES: usize = 125;
const OBSERVATIONS: usize = 4_096;

fn settings(prior: PriorSettings, count: Option<[usize; 3]>) -> Settings<3> {
    let Settings { kernel, support, bias, limits, beam, rule, passes, forgetting, .. } = COMPACT.settings;
    let tile = TileSettings { stencil: 4, width: [WIDTH; 3], stride: [2; 3], count };
    Settings {
        origin_m: [0.0; 3],
        spacing_m: SPACING_M,
        kernel,
        support,
        tile,
        prior,
        bias,
        limits,
        beam,
        rule,
        passes,
        forgetting,
    }
}

fn mapper(settings: Settings<3>) -> Mapper<'static, 3, M, B> {
    let memory = Memory {
        tiles: Lent(vec![Tile::VACANT; TILES].leak()),
        directory: Lent(vec![DirectoryEntry::VACANT; TILES].leak()),
        prior: Lent(Box::leak(Box::new(Posterior::ZERO))),
        scratch: Lent(Box::leak(Box::new(Scratch::ZERO))),
        observations: Lent(vec![ObservationSlot::VACANT; OBSERVATIONS].leak()),
        features: Lent(vec![0.0; OBSERVATIONS * 64].leak()),
        links: Lent(vec![Link::VACANT; OBSERVATIONS * 8].leak()),
        touched: Lent(vec![TouchedTile::VACANT; TILES].leak()),
        rows: Lent(vec![RowState::ZERO; OBSERVATIONS].leak()),
        supports: SupportTable::EMPTY,
    };
    Mapper::new(settings, memory).expect("usable settings")
}

/// Directions spread evenly over the sphere.
struct Sphere {
    stamp_ns: u64,
    rays: usize,
    radius_m: f32,
}

impl Sweep<3> for Sphere {
    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn beams(&self) -> usize {
        self.rays
    }

    fn check(&self, is_placeable: impl FnOnce(&Point<3>) -> bool) -> Result<(), ScanRejected> {
        if is_placeable(&Point::<3>::zeros()) { Ok(()) } else { Err(ScanRejected::PoseNotFinite) }
    }

    fn rays(&self, limits: &BeamLimits) -> impl Iterator<Item = Ray<3>> {
        let (limits, radius_m, rays) = (*limits, self.radius_m, self.rays);
        (0..rays).map(move |number| {
            // A Fibonacci lattice.
            let z = 1.0 - (2 * number + 1) as f32 / rays as f32;
            let turn = number as f32 * 2.399_963_2;
            let across = (1.0 - z * z).sqrt();
            Ray {
                number,
                origin_m: Point::<3>::zeros(),
                direction: Point::<3>::new(across * turn.cos(), across * turn.sin(), z),
                reading: Reading::new(radius_m, 0.0, 30.0, &limits),
            }
        })
    }

    fn covariance_at(&self, _: &Point<3>) -> Option<SMatrix<f32, 3, 3>> {
        None
    }
}

#[test]
fn a_hollow_sphere_is_free_within_and_unknown_beyond() {
    let prior = PriorSettings::Matern(MaternPrior { deviation: 30.0, range_m: 0.8 });
    let mut mapper = mapper(settings(prior, None));
    let report = mapper.integrate(&Sphere { stamp_ns: 1, rays: 600, radius_m: 1.2 }, &mut NoArchive).unwrap();
    assert_eq!((report.beams.hits, report.tiles_failed, report.observations.over_capacity), (600, 0, 0));
    assert!(report.tiles_touched > 8 && report.tiles_lost == 0, "{report:?}");
    let mut stream = Stream::new(11);
    for _ in 0..300 {
        let at = [0, 1, 2].map(|_| stream.between(-1.0, 1.0) as f32);
        let length = at.iter().map(|x| x * x).sum::<f32>().sqrt();
        let direction = Point::from(at) / length;
        let ask = |range_m: f32| mapper.view().occupancy(&(direction * range_m));
        assert!(ask(0.7).probability < 0.4, "free at {direction:?}: {:?}", ask(0.7));
        assert!(ask(1.2).probability > 0.6, "the wall at {direction:?}: {:?}", ask(1.2));
        let beyond = ask(6.0);
        assert!((beyond.probability - 0.5).abs() < 1e-6 && beyond.variance > 500.0, "{beyond:?}");
        let seen = mapper.view().cast_ray(&Point::<3>::zeros(), &direction, 5.0, 0.5);
        assert!(seen.first_m.is_some_and(|range_m| (range_m - 1.2).abs() < SPACING_M), "{seen:?}");
    }
    // Older than what was learned.
    let old = mapper.integrate(&Sphere { stamp_ns: 0, rays: 6, radius_m: 1.0 }, &mut NoArchive);
    assert_eq!(old, Err(ScanRejected::StampWentBack { stamp_ns: 0, newest_ns: 1 }));
}

#[test]
fn a_tile_in_space_learns_what_the_dense_oracle_learns() {
    let mut mapper = mapper(settings(PriorSettings::White(WhitePrior { precision: 1e-3 }), Some([1; 3])));
    let features = Features::<3> {
        origin_m: [0.0; 3],
        spacing_m: f64::from(SPACING_M),
        width: [WIDTH; 3],
        stencil: 4,
        kernel: Kernel::CubicBSpline { spacing_m: f64::from(SPACING_M) },
        bias: false,
    };
    let mut dense = DenseMap::new(features, DensePosterior::prior(&[f64::from(1e-3_f32); M]));
    let rule = Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD };
    let mut stream = Stream::new(3);
    let mut place = || [0, 1, 2].map(|_| stream.between(0.41, 1.59) as f32);
    for _ in 0..6 {
        let batch: Vec<_> = (0..80).map(|_| place()).map(|at| (at, at[2] > 0.6 + 0.3 * at[0])).collect();
        let observations: Vec<_> =
            batch.iter().map(|(at, occupied)| Observation::at_point(Point::from(*at), *occupied)).collect();
        let report = mapper.integrate_observations(&observations, &mut NoArchive).unwrap();
        assert_eq!((report.rows, report.tiles_touched), (80, 1));
        let points: Vec<_> = batch.iter().map(|(at, occupied)| (at.map(f64::from), *occupied)).collect();
        dense.learn(&points, &rule, 3).unwrap();
    }
    for _ in 0..500 {
        let at = place();
        // Where one tile answers alone: its region is three cells wide, its neighbours' overlap one.
        if at.iter().any(|x| !(0.81..1.19).contains(x)) {
            continue;
        }
        let (got, exact) = (mapper.view().occupancy(&Point::from(at)), dense.predict(&at.map(f64::from)).unwrap());
        assert!((f64::from(got.probability) - exact.probability).abs() < 1e-3, "{at:?}: {got:?}, {exact:?}");
        assert!((f64::from(got.variance) / exact.variance - 1.0).abs() < 1e-2, "{at:?}: {got:?}, {exact:?}");
    }
}

/// `β`, `β′` and `β″`, one at the peak.
fn spline(t: f64) -> [f64; 3] {
    let (a, sign) = (t.abs(), t.signum());
    if a < 1.0 {
        [1.0 - 1.5 * a * a + 0.75 * a * a * a, sign * (2.25 * a * a - 3.0 * a), 4.5 * a - 3.0]
    } else if a < 2.0 {
        [0.25 * (2.0 - a).powi(3), -0.75 * sign * (2.0 - a).powi(2), 1.5 * (2.0 - a)]
    } else {
        [0.0; 3]
    }
}

/// The quadratic form of the prior is the field's energy up to one factor, whatever the weights.
#[test]
fn the_prior_in_space_is_the_energy_of_the_field() {
    let range_m = 1.0;
    let mapper = mapper(settings(PriorSettings::Matern(MaternPrior { deviation: 30.0, range_m }), None));
    let kappa_squared = 8.0 / f64::from(range_m / SPACING_M).powi(2);
    // Gauss–Legendre with four nodes a cell and axis: exact up to degree seven.
    let nodes = [(-0.861_136_311_594_053, 0.347_854_845_137_454), (-0.339_981_043_584_856, 0.652_145_154_862_546)];
    let nodes = [nodes[0], nodes[1], (-nodes[1].0, nodes[1].1), (-nodes[0].0, nodes[0].1)];
    let line: Vec<(f64, f64)> =
        (0..WIDTH - 3).flat_map(|cell| nodes.map(|(x, weight)| (1.5 + cell as f64 + 0.5 * x, 0.5 * weight))).collect();
    let mut stream = Stream::new(17);
    let mut factors = Vec::new();
    for _ in 0..6 {
        let weights: Vec<f64> = (0..M).map(|_| stream.between(-1.0, 1.0)).collect();
        let mut energy = 0.0;
        for (x, by_x) in &line {
            for (y, by_y) in &line {
                for (z, by_z) in &line {
                    // The field, its slopes, and its second derivatives, the mixed ones twice.
                    let mut field = 0.0;
                    let mut slopes = [0.0; 3];
                    let mut curvatures = [0.0; 9];
                    for (i, weight) in weights.iter().enumerate() {
                        let node = [i / (WIDTH * WIDTH), i / WIDTH % WIDTH, i % WIDTH].map(|node| node as f64);
                        let along = [x - node[0], y - node[1], z - node[2]].map(spline);
                        let product =
                            |orders: [usize; 3]| (0..3).map(|axis| along[axis][orders[axis]]).product::<f64>();
                        field += weight * product([0; 3]);
                        for one in 0..3 {
                            let mut orders = [0; 3];
                            orders[one] += 1;
                            slopes[one] += weight * product(orders);
                            for other in 0..3 {
                                let mut orders = orders;
                                orders[other] += 1;
                                curvatures[3 * one + other] += weight * product(orders);
                            }
                        }
                    }
                    let squares = |of: &[f64]| of.iter().map(|x| x * x).sum::<f64>();
                    let density = kappa_squared * kappa_squared * field * field
                        + 2.0 * kappa_squared * squares(&slopes)
                        + squares(&curvatures);
                    energy += by_x * by_y * by_z * density;
                }
            }
        }
        let mut form = 0.0;
        for (i, row) in mapper.prior().information.iter().enumerate() {
            for (j, entry) in row.iter().enumerate().take(M - i) {
                let both = if j == 0 { 1.0 } else { 2.0 };
                form += both * f64::from(*entry) * weights[i] * weights[i + j];
            }
        }
        factors.push(form / energy);
    }
    let off = factors.iter().map(|factor| (factor / factors[0] - 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 1e-5, "{factors:?}");
}
