use std::vec::Vec;

use bhm_core::{
    geometry::Pose,
    mapper::{IntegrateReport, Mapper},
    scan::{Scan, ScanRejected},
};
use bhm_host::map::OwnedMapper;

use super::path::Path;
use crate::OnboardMap;

/// A map on a computer, and the path along which it was made.
pub(crate) struct RecordedMap<const M: usize, const B: usize> {
    map: OwnedMapper<M, B>,
    path: Path,
}

impl<const M: usize, const B: usize> RecordedMap<M, B> {
    pub(crate) fn new(map: OwnedMapper<M, B>, path_poses: usize) -> Self {
        Self { map, path: Path::new(path_poses) }
    }

    pub(super) fn into_parts(self) -> (OwnedMapper<M, B>, Vec<Pose>) {
        (self.map, self.path.into_poses())
    }
}

impl<const M: usize, const B: usize> OnboardMap<M, B> for RecordedMap<M, B> {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        let report = self.map.integrate(scan)?;
        self.path.push(scan.header.map_from_sensor);
        Ok(report)
    }

    fn mapper(&self) -> &Mapper<'_, 2, M, B> {
        self.map.mapper()
    }

    fn archived(&self) -> usize {
        self.map.archive().len()
    }
}
