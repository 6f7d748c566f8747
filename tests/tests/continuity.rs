//! The map is one continuous function: no jump at the borders of tiles, and a gradient that is the function's.

mod common;

use bhm_core::{
    geometry::Point,
    map::Map as _,
    profile::{COMPACT, Capacities, INDOOR, Profile},
};
use bhm_host::map::OwnedMapper;
use bhm_oracle::TileBlend;
use common::{Drive, Stream, drives, points_of};

type Map = OwnedMapper<144, 40>;

struct Learned {
    map: Map,
    oracle: TileBlend,
    /// Where something was observed.
    observed: Vec<[f32; 2]>,
    indices: Vec<[i32; 2]>,
}

/// Every eighth scan of a drive; every tile of it stays in the store.
fn learned(profile: &Profile, drive: &Drive) -> Learned {
    let profile = Profile {
        capacities: Capacities { tiles: 1_024, observations: 32_768, rows: 32_768, touched: 1_024 },
        ..*profile
    };
    let mut map = Map::new(&profile).unwrap();
    let mut observed = Vec::new();
    for scan in drive.scans.iter().step_by(8) {
        let report = map.integrate(&scan.as_scan()).unwrap();
        assert_eq!(report.tiles_failed + report.tiles_evicted, 0);
        observed
            .extend(points_of(scan, &profile.settings).iter().map(|point| <[f32; 2]>::from(point.place.middle_m())));
    }
    let mut oracle = TileBlend::of(&profile.settings, None);
    let mut indices = Vec::new();
    for tile in map.mapper().tiles().iter() {
        oracle.insert_view(tile.index, &tile.posterior.view());
        indices.push(tile.index);
    }
    Learned { map, oracle, observed, indices }
}

impl Learned {
    /// A place on the border of a tile's region, and the axis that crosses it: tiles that exist and their neighbours, so
    /// that the edge of the known world is among them.
    fn border(&self, stream: &mut Stream) -> ([f32; 2], usize) {
        let settings = self.map.mapper().settings();
        let tile = self.indices[stream.below(self.indices.len())];
        let axis = stream.below(2);
        let region = settings.tile.width[axis] - settings.tile.stencil + 1;
        let mut cells = [0.0; 2];
        for (other, cell) in cells.iter_mut().enumerate() {
            let low =
                tile[other] as f64 * settings.tile.stride[other] as f64 + settings.tile.stencil as f64 / 2.0 - 1.0;
            *cell = if other == axis {
                low + if stream.below(2) == 0 { 0.0 } else { region as f64 }
            } else {
                low + stream.between(-1.0, region as f64 + 1.0)
            };
        }
        let at = [0, 1].map(|i| settings.origin_m[i] + (cells[i] * f64::from(settings.spacing_m)) as f32);
        (at, axis)
    }

    /// A place that was observed, one near it, or one anywhere in or around the known world.
    fn anywhere(&self, stream: &mut Stream) -> [f32; 2] {
        let observed = self.observed[stream.below(self.observed.len())];
        let reach = [0.0, 0.3, 3.0, 15.0][stream.below(4)];
        observed.map(|x| x + (reach * stream.between(-1.0, 1.0)) as f32)
    }
}

const BORDERS: usize = 10_000;
const STEP_M: f32 = 1e-3;
/// The specification: what a step of 1 mm may change beyond what the gradient there explains.
const JUMP: f64 = 1e-3;

fn no_jump(learned: &Learned, what: &str) {
    let mut stream = Stream::new(11);
    let (mut worst, mut steepest) = (0.0_f64, 0.0_f64);
    for _ in 0..BORDERS {
        let (at, axis) = learned.border(&mut stream);
        let (mut before, mut after) = (Point::<2>::from(at), Point::<2>::from(at));
        before[axis] -= 0.5 * STEP_M;
        after[axis] += 0.5 * STEP_M;
        let here = learned.map.mapper().gradient(&before);
        let there = learned.map.mapper().occupancy(&after);
        let change = f64::from(there.probability) - f64::from(here.occupancy.probability);
        let explained = f64::from(here.probability[axis]) * f64::from(after[axis] - before[axis]);
        let jump = (change - explained).abs();
        steepest = steepest.max(change.abs());
        worst = worst.max(jump);
        assert!(jump <= JUMP, "across {at:?} along axis {axis}: {change:e}, explained {explained:e}");
    }
    println!("{what}: {BORDERS} borders, 1 mm changes p by {steepest:.2e} at most, unexplained {worst:.2e} at most");
}

/// The specification: 1 % and 1e-2 per metre.
const RELATIVE: f64 = 0.01;
const ABSOLUTE_PER_M: f64 = 1e-2;

/// Far above `f64` rounding over variances of 1e4, far below the length over which a third derivative matters.
const DIFFERENCE_STEP_M: f64 = 1e-5;

/// The value in `f32` against `f64` from the same tiles: `s²` in steps of `f32`, and a position to 2e-6 m under gradients
/// of tens per metre.
const VALUE: f64 = 2e-3;

fn gradient_is_the_functions(learned: &Learned, what: &str) {
    let mut stream = Stream::new(12);
    let (mut worst, mut share, mut value) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut known, mut unknown) = (0, 0);
    for i in 0..6_000 {
        let at = if i % 3 == 0 {
            let (mut at, axis) = learned.border(&mut stream);
            at[axis] += (stream.between(-1.0, 1.0) * 0.3) as f32;
            at
        } else {
            learned.anywhere(&mut stream)
        };
        let got = learned.map.mapper().gradient(&Point::from(at));
        assert_eq!(got.occupancy, learned.map.mapper().occupancy(&Point::from(at)));
        let exact = learned.oracle.predict(&at.map(f64::from));
        let off = (f64::from(got.occupancy.probability) - exact.probability).abs();
        assert!(off <= VALUE, "at {at:?}: {got:?} against {exact:?}");
        value = value.max(off);
        *if exact.variance < 10.0 { &mut known } else { &mut unknown } += 1;
        for (axis, [p, ..]) in learned.oracle.differences(&at.map(f64::from), DIFFERENCE_STEP_M).into_iter().enumerate()
        {
            let error = (f64::from(got.probability[axis]) - p).abs();
            let allowed = RELATIVE * p.abs() + ABSOLUTE_PER_M;
            assert!(error <= allowed, "at {at:?} axis {axis}: {} against {p}; {got:?}", got.probability[axis]);
            worst = worst.max(error);
            share = share.max(error / allowed);
        }
    }
    assert!(known > 1_000 && unknown > 1_000, "{known} known and {unknown} unknown places");
    println!(
        "{what}: gradient at {known} known and {unknown} unknown places off by {worst:.2e} per metre at most, {share:.3} of \
         what is allowed; value off by {value:.2e}"
    );
}

fn one_continuous_function(profile: &Profile) {
    for drive in drives() {
        let learned = learned(profile, &drive);
        let what = format!("{}, {}", profile.name, drive.name);
        no_jump(&learned, &what);
        gradient_is_the_functions(&learned, &what);
    }
}

#[test]
fn at_a_quarter_of_a_metre() {
    one_continuous_function(&INDOOR);
}

#[test]
fn at_half_a_metre() {
    one_continuous_function(&COMPACT);
}
