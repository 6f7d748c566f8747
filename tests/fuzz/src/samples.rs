//! Valid things that seeds are made of.

use bhm_core::{
    geometry::{Pose, PoseCovariance},
    kernel::{Averaging, CubicBSplineSettings, KernelSettings},
    lattice::Window,
    scan::ScanHeader,
    support::{GaussianSettings, RectangleSettings, SupportSettings},
};
use bhm_host::{
    ScanRecord,
    supports::{LearnedSupports, LearnedWith},
};

/// A scan of a round room, from a pose that is known but for a few centimetres.
#[must_use]
pub fn scan(stamp_ns: u64) -> ScanRecord {
    ScanRecord {
        header: ScanHeader {
            stamp_ns,
            map_from_sensor: Pose::new(0.3, -0.2, 0.7),
            pose_covariance: Some(PoseCovariance::independent(0.05, 0.01)),
            angle_min_rad: -3.0,
            angle_increment_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 20.0,
        },
        ranges_m: vec![1.0, 1.5, f32::NAN, -1.0, 0.01, 25.0, f32::INFINITY, 2.0, 1.0, 0.5],
    }
}

/// Every kind of support there is, over a window of 3 by 4 nodes at 0.5 m.
///
/// # Panics
/// If they are none.
#[must_use]
pub fn learned_supports() -> LearnedSupports {
    let window = Window { first: [-1, -2], width: [3, 4] };
    let supports = (0..window.supports()).map(|number| {
        let samples = if number % 2 == 0 { Averaging::Exact } else { Averaging::Samples(3) };
        let size = 0.1 + 0.005 * number as f32;
        let kind = match SupportSettings::ALL[number % SupportSettings::ALL.len()] {
            SupportSettings::GaussianSupport(_) => SupportSettings::GaussianSupport(GaussianSettings { size }),
            SupportSettings::RectangularSupport(_) => {
                SupportSettings::RectangularSupport(RectangleSettings { size, samples })
            }
            point @ SupportSettings::PointSupport(_) => point,
        };
        kind.build(0.5)
    });
    let kernel = KernelSettings::CubicBSpline(CubicBSplineSettings::DEFAULT);
    let learned_with = LearnedWith { kernel, source: "a seed".to_owned() };
    LearnedSupports::new([0.0; 2], 0.5, window, supports.collect(), Some(learned_with)).expect("good supports")
}
