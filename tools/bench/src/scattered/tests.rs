use super::*;
use bhm_core::{
    geometry::Pose,
    kernel::{KernelSettings, SquaredExponentialSettings},
    map::Occupancy,
    profile::COMPACT,
    scan::ScanHeader,
    settings::Settings,
    support::{AnySupport, GaussianSupport},
};
use bhm_host::ScanRecord;
use nalgebra::Matrix2;

const M: usize = 64;

/// Supports nowhere near a lattice, some of them Gaussian.
fn supports() -> Vec<ScatteredSupport> {
    let wide = GaussianSupport::new(Matrix2::from([[0.2, 0.05], [0.05, 0.1]])).unwrap();
    (0..60)
        .map(|i| {
            let (angle, radius) = (i as f32 * 2.4, 0.35 * (i as f32).sqrt());
            let support = if i % 3 == 0 { AnySupport::GaussianSupport(wide) } else { AnySupport::default() };
            ScatteredSupport { centre_m: [radius * angle.cos(), radius * angle.sin()].into(), support }
        })
        .collect()
}

fn settings() -> Settings {
    COMPACT.settings.with_kernel(KernelSettings::SquaredExponential(SquaredExponentialSettings { shape: 1.0 }))
}

fn open(supports: Vec<ScatteredSupport>) -> anyhow::Result<DenseMap<M>> {
    DenseMap::new(settings(), supports)
}

fn scan(stamp_ns: u64, ranges_m: &[f32]) -> ScanRecord {
    ScanRecord {
        header: ScanHeader {
            stamp_ns,
            map_from_sensor: Pose::new(0.1, -0.2, 0.0),
            angle_min_rad: -3.1,
            angle_increment_rad: 0.1,
            range_max_m: 30.0,
            ..ScanHeader::default()
        },
        ranges_m: ranges_m.to_vec(),
    }
}

#[test]
fn a_room_is_learned() {
    let mut map = open(supports()).unwrap();
    for stamp in 0..5 {
        assert_eq!(map.integrate(&scan(stamp, &[2.0; 62])).unwrap(), 62 * 3);
    }
    assert!(map.occupancy(&[0.5, 0.5].into()).probability < 0.2);
    assert!(map.occupancy(&[2.1, -0.2].into()).probability > 0.6);
    assert_eq!(map.occupancy(&[f32::NAN, 0.0].into()), Occupancy::UNKNOWN);
}

#[test]
fn what_does_not_fit_is_refused() {
    let many = vec![supports()[0]; M + 1];
    assert_eq!(open(many).unwrap_err().to_string(), "65 supports, expected 1 to 64");
    assert_eq!(open(Vec::new()).unwrap_err().to_string(), "0 supports, expected 1 to 64");
}
