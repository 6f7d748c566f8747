use bhm_core::{
    mapper::{IntegrateReport, Mapper},
    scan::{Scan, ScanRejected},
    tile::Archive,
};

/// A map that the loop can feed and show.
pub trait OnboardMap<const M: usize, const B: usize> {
    /// Learns a scan, bringing tiles back from the archive and sending others there.
    ///
    /// # Errors
    /// If the scan as a whole is not usable; the map is then unchanged.
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected>;

    /// The mapper, to be shown.
    fn mapper(&self) -> &Mapper<'_, 2, M, B>;

    /// Tiles in the archive.
    fn archived(&self) -> usize;
}

/// A mapper in lent memory, and where its tiles go: what a microcontroller has.
#[derive(Debug)]
pub struct LentMap<'m, A, const M: usize, const B: usize> {
    mapper: Mapper<'m, 2, M, B>,
    archive: A,
    archived: usize,
}

impl<'m, A: Archive<2, M, B>, const M: usize, const B: usize> LentMap<'m, A, M, B> {
    /// A mapper that has not begun, and an empty archive.
    #[must_use]
    pub fn new(mapper: Mapper<'m, 2, M, B>, archive: A) -> Self {
        Self { mapper, archive, archived: 0 }
    }
}

impl<A: Archive<2, M, B>, const M: usize, const B: usize> OnboardMap<M, B> for LentMap<'_, A, M, B> {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        let report = self.mapper.integrate(scan, &mut self.archive)?;
        let kept = (report.tiles_evicted - report.tiles_lost) as usize;
        self.archived = (self.archived + kept).saturating_sub(report.tiles_restored as usize);
        Ok(report)
    }

    fn mapper(&self) -> &Mapper<'_, 2, M, B> {
        &self.mapper
    }

    fn archived(&self) -> usize {
        self.archived
    }
}
