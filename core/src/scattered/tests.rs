use super::*;
use crate::{
    geometry::Pose,
    kernel::KernelChoice,
    profile::COMPACT,
    support::{AnySupport, GaussianSupport},
};
use nalgebra::SMatrix;
use std::{boxed::Box, vec, vec::Vec};

const M: usize = 64;

/// Supports nowhere near a lattice, some of them Gaussian.
fn supports() -> Vec<ScatteredSupport<2>> {
    let wide = GaussianSupport::new(SMatrix::from([[0.2, 0.05], [0.05, 0.1]])).unwrap();
    (0..60)
        .map(|i| {
            let (angle, radius) = (i as f32 * 2.4, 0.35 * (i as f32).sqrt());
            let support = if i % 3 == 0 { AnySupport::GaussianSupport(wide) } else { AnySupport::default() };
            ScatteredSupport { centre_m: [radius * angle.cos(), radius * angle.sin()].into(), support }
        })
        .collect()
}

fn settings() -> Settings {
    Settings {
        kernel: KernelChoice::SquaredExponential,
        kernel_shape: 1.0,
        stencil: 6,
        tile_width: [14, 14],
        ..COMPACT.settings
    }
}

fn open(supports: &[ScatteredSupport<2>]) -> Result<ScatteredMapper<'_, M>, SettingsError> {
    let memory = ScatteredMemory {
        supports,
        posterior: Box::leak(Box::new(Posterior::ZERO)),
        scratch: Box::leak(Box::new(Scratch::ZERO)),
        places: vec![LabelledPlace::default(); 512].leak(),
        entries: vec![Entry::default(); 512 * M].leak(),
        states: vec![RowState::default(); 512].leak(),
    };
    ScatteredMapper::new(settings(), memory)
}

fn scan(stamp_ns: u64, ranges_m: &[f32]) -> Scan<'_> {
    Scan {
        stamp_ns,
        map_from_sensor: Pose::new(0.1, -0.2, 0.0),
        pose_covariance: None,
        angle_min_rad: -3.1,
        angle_increment_rad: 0.1,
        range_min_m: 0.0,
        range_max_m: 30.0,
        ranges_m,
    }
}

#[test]
fn a_room_is_learned_and_its_gradient_is_its_derivative() {
    let supports = supports();
    let mut map = open(&supports).unwrap();
    for stamp in 0..5 {
        let report = map.integrate(&scan(stamp, &[2.0; 62])).unwrap();
        assert_eq!((report.beams.hits, report.rows, report.tiles_failed), (62, 62 * 3, 0));
    }
    assert!(map.occupancy(&[0.5, 0.5].into()).probability < 0.2);
    assert!(map.occupancy(&[2.1, -0.2].into()).probability > 0.6);
    assert_eq!(map.occupancy(&[f32::NAN, 0.0].into()), Occupancy::UNKNOWN);
    for i in 0..100 {
        let at = Point::<2>::new((i % 10) as f32 * 0.4 - 2.0, (i / 10) as f32 * 0.4 - 2.0);
        let gradient = map.gradient(&at);
        assert_eq!(gradient.occupancy, map.occupancy(&at));
        for axis in 0..2 {
            let mut e = Point::<2>::zeros();
            e[axis] = 0.01;
            let d = |s: f32| {
                (map.occupancy(&(at + e * s)).probability - map.occupancy(&(at - e * s)).probability) / (0.02 * s)
            };
            let difference = (4.0 * d(1.0) - d(2.0)) / 3.0;
            assert!((gradient.probability[axis] - difference).abs() < 2e-2, "{gradient:?} against {difference}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let many = vec![supports()[0]; M + 1];
    assert!(matches!(open(&many), Err(SettingsError::Number { name: "number of supports", .. })));
    assert!(matches!(open(&[]), Err(SettingsError::NoMemory { what: "supports" })));
    let supports = supports();
    let mut map = open(&supports).unwrap();
    map.integrate(&scan(5, &[1.0])).unwrap();
    assert!(matches!(map.integrate(&scan(4, &[1.0])), Err(ScanRejected::StampWentBack { .. })));
}
