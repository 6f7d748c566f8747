//! What an uncertain pose does to observations: the dense posterior in `f64` of features that are the kernel averaged over
//! where each observation may lie.

use bhm_core::{
    geometry::{Point, Pose, PoseCovariance},
    kernel::{KernelSettings, SquaredExponentialSettings},
    posterior::{Pattern, Row},
    profile::{COMPACT, Capacities, Profile},
    scan::{Scan, ScanHeader},
    settings::{Settings, TileSettings},
};
use bhm_oracle::{Average, Bump, Extent, Features, Kernel, Observation, Rule};

use crate::{
    common::{SAFEGUARD, Stream, points_of},
    map::TestMap,
};

const WIDTH: usize = 12;
const STENCIL: usize = 8;
const SPACING_M: f64 = 0.5;
/// `g = 0.6 h²`.
const SHAPE_M2: f64 = 0.15;

/// One tile, whose region is 5 × 5 cells around (0, 0) with the widest stencil, so that there is room to widen.
fn profile() -> Profile {
    let half_m = (0.5 * SPACING_M * (WIDTH - 1) as f64) as f32;
    Profile {
        settings: Settings {
            origin_m: [-half_m; 2],
            tile: TileSettings {
                stencil: STENCIL,
                width: [WIDTH; 2],
                stride: [WIDTH - STENCIL; 2],
                count: Some([1, 1]),
            },
            ..COMPACT
                .settings
                .with_kernel(KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: 0.6 }))
        },
        capacities: Capacities { tiles: 1, ..COMPACT.capacities },
        ..COMPACT
    }
}

fn features() -> Features<2> {
    Features {
        origin_m: [-0.5 * SPACING_M * (WIDTH - 1) as f64; 2],
        spacing_m: SPACING_M,
        width: [WIDTH; 2],
        stencil: STENCIL,
        kernel: Kernel::SquaredExponential { shape_m2: SHAPE_M2 },
        bias: false,
    }
}

/// `P = J Σ Jᵀ`, `J = [I | (−l_y, l_x)ᵀ]`, entry by entry as the product says.
fn covariance_at(pose: &PoseCovariance, lever: [f64; 2]) -> [[f64; 2]; 2] {
    let [xx, xy, yy, xt, yt, tt] =
        [pose.xx_m2, pose.xy_m2, pose.yy_m2, pose.x_theta_m_rad, pose.y_theta_m_rad, pose.theta_rad2].map(f64::from);
    let sigma = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
    let jacobian = [[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]]];
    let entry = |i: usize, j: usize| -> f64 {
        (0..3).map(|a| (0..3).map(|b| jacobian[i][a] * sigma[a][b] * jacobian[j][b]).sum::<f64>()).sum()
    };
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

/// The kernel averaged over where an observation may lie, at each support that its middle sees.
fn blurred(features: &Features<2>, at: [f64; 2], covariance_m2: [[f64; 2]; 2]) -> Vec<f64> {
    let bump = Bump::Exponentials(vec![(1.0, [[SHAPE_M2, 0.0], [0.0, SHAPE_M2]])]);
    let average = Average::new(&bump, &Extent { covariance_m2, ..Extent::POINT }, 1);
    let seen = features.at(&at);
    let value = |(number, seen): (usize, &f64)| {
        if *seen == 0.0 {
            return 0.0;
        }
        let node = [number / WIDTH, number % WIDTH];
        average.at(&[0, 1].map(|axis| at[axis] - features.origin_m[axis] - node[axis] as f64 * SPACING_M))
    };
    seen.iter().enumerate().map(value).collect()
}

/// A scan from some metres outside the tile, of a wall that runs through it.
fn scan(stream: &mut Stream, stamp_ns: u64, covariance: PoseCovariance) -> Scan<'static> {
    let side = stream.between(0.0, std::f64::consts::TAU);
    let distance = stream.between(5.0, 9.0);
    let sensor = [distance * side.cos(), distance * side.sin()];
    let ranges_m: Vec<f32> = (0..41).map(|_| (distance + stream.between(-0.3, 0.3)) as f32).collect();
    Scan {
        header: ScanHeader {
            stamp_ns,
            map_from_sensor: Pose::new(sensor[0] as f32, sensor[1] as f32, (side + std::f64::consts::PI) as f32),
            pose_covariance: Some(covariance),
            angle_min_rad: -0.2,
            angle_increment_rad: 0.01,
            range_min_m: 0.1,
            range_max_m: 30.0,
        },
        ranges_m: ranges_m.leak(),
    }
}

/// The specification's bound for ordinary runs.
const LARGEST: f64 = 5e-3;

/// The largest variance along each axis, m², at which no more than 5e-3 of the widened kernel is cut off: at half a stencil
/// from its middle it is `g/(g + 2v) · exp(−s²/(g + 2v))`, which rises with `v` as long as anything is cut off at all.
fn room_m2() -> f64 {
    let reach_m = 0.5 * STENCIL as f64 * SPACING_M;
    let cut_off = |v: f64| SHAPE_M2 / (SHAPE_M2 + 2.0 * v) * (-reach_m * reach_m / (SHAPE_M2 + 2.0 * v)).exp();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *if cut_off(middle) <= 5e-3 { &mut low } else { &mut high } = middle;
    }
    low
}

fn agrees(covariance: PoseCovariance, what: &str) -> u32 {
    let profile = profile();
    let features = features();
    let mut map = TestMap::<144, 92>::new(&profile);
    let mut dense = bhm_oracle::prior::of(&profile.settings);
    let rule = Rule::GaussianVariational { xi_cap: 4.0, safeguard: SAFEGUARD };
    let mut stream = Stream::new(61);
    let (mut rows, mut all_narrowed) = (0, 0);
    let room_m2 = room_m2();
    for stamp_ns in 1..=4 {
        let scan = scan(&mut stream, stamp_ns, covariance);
        let report = map.integrate(&scan).expect("a good scan");
        assert_eq!(report.tiles_failed, 0, "{what}");
        let sensor = scan.header.map_from_sensor.position();
        let mut narrowed = 0;
        let observations: Vec<_> = points_of(&scan, &profile.settings)
            .iter()
            .filter_map(|point| {
                let middle = point.place.middle_m();
                let at = [f64::from(middle.x), f64::from(middle.y)];
                let lever = [at[0] - f64::from(sensor.x), at[1] - f64::from(sensor.y)];
                if !features.hold_whole(STENCIL, &at) {
                    return None;
                }
                let mut spread = covariance_at(&covariance, lever);
                let largest = spread[0][0].max(spread[1][1]);
                if largest > room_m2 {
                    narrowed += 1;
                    spread = spread.map(|row| row.map(|entry| entry * room_m2 / largest));
                }
                Some(Observation { phi: blurred(&features, at, spread), occupied: point.occupied })
            })
            .collect();
        assert_eq!(report.observations.narrowed, narrowed, "{what}");
        all_narrowed += narrowed;
        assert_eq!(report.rows as usize, observations.len(), "{what}");
        rows += observations.len();
        dense.update(&observations, &rule, profile.settings.passes as usize).expect("positive definite");
    }
    assert!(rows > 100, "{what}: {rows} rows");
    let tile = map.mapper().tiles().iter().next().expect("a tile");
    let region = 0.5 * SPACING_M * (WIDTH - STENCIL + 1) as f64;
    let pattern = Pattern::new(STENCIL, (0..STENCIL).map(|line| line * WIDTH)).expect("a stencil");
    let mut worst = 0.0_f64;
    for _ in 0..500 {
        let at = [0, 1].map(|_| stream.between(-region, region) as f32);
        let exact = dense.predict(&features.at(&at.map(f64::from)));
        // The tile alone: the map blends it with the prior towards the edge of its region.
        let stencil = map.mapper().basis().features(&Point::from(at)).expect("on the lattice");
        let window = map.mapper().tiling().window(&[0, 0]);
        let first = window.index_of_whole(&stencil.stencil.first, STENCIL).expect("inside");
        let moments =
            tile.posterior.view().moments(&Row { pattern: &pattern, first, values: &stencil.values, bias: 0.0 });
        let got = bhm_oracle::Prediction::from_moments(f64::from(moments.mean), f64::from(moments.variance));
        worst = worst.max((got.probability - exact.probability).abs());
        assert!((got.probability - exact.probability).abs() <= LARGEST, "{what}: at {at:?} {got:?} for {exact:?}");
    }
    println!("{what}: {rows} rows, {all_narrowed} narrowed, probability off by {worst:.1e} at most");
    all_narrowed
}

#[test]
fn an_uncertain_heading_widens_by_the_distance_from_the_sensor() {
    assert_eq!(agrees(PoseCovariance::independent(0.0, 0.03), "heading"), 0);
}

#[test]
fn an_uncertain_position_widens_everything_alike() {
    let covariance = PoseCovariance { xx_m2: 0.05, xy_m2: -0.02, yy_m2: 0.03, ..PoseCovariance::default() };
    assert_eq!(agrees(covariance, "position"), 0);
}

/// The part that position and heading share makes a point more certain on one side of the sensor and less on the other.
#[test]
fn position_and_heading_that_err_together_widen_as_their_product_says() {
    let together = PoseCovariance {
        xx_m2: 0.05,
        xy_m2: 0.01,
        yy_m2: 0.04,
        x_theta_m_rad: 0.004,
        y_theta_m_rad: -0.003,
        theta_rad2: 0.0009,
    };
    assert!(together.is_valid());
    assert_eq!(agrees(together, "both"), 0);
}

/// What the stencil has no room for is left out, and counted.
#[test]
fn a_pose_too_uncertain_for_the_stencil_widens_as_far_as_there_is_room() {
    assert!(agrees(PoseCovariance::independent(0.4, 0.12), "too uncertain") > 100);
}
