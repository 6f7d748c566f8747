//! What tests of several baselines need.

use bhm_core::profile::COMPACT;
use bhm_host::dataset::LabelledPoints;

use super::Setup;
use crate::evaluation::TrainingScan;

pub(super) fn setup(area_m: [[f32; 2]; 2], size: f32) -> Setup {
    Setup { area_m, size, limits: COMPACT.settings.limits, profile: COMPACT, seed: 1 }
}

pub(super) fn ray(end_m: [f32; 2]) -> ([f32; 2], bool) {
    (end_m, true)
}

pub(super) fn of_points(scan: u64, points: &[([f32; 2], bool)], origin_m: Option<[f32; 2]>) -> TrainingScan {
    let (points_m, occupied) = points.iter().copied().unzip();
    TrainingScan::of_points(LabelledPoints { scan, points_m, occupied }, origin_m)
}
