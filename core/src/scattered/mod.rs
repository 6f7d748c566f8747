//! Supports anywhere: the dense case `B = M`, with a given list of supports instead of a lattice.
//!
//! The paper's pseudo-inputs may lie at any point, such as cluster centres of the data. Without a lattice every support
//! couples with every other: one posterior, dense, whose cost grows with `M³`; the number of supports is bounded and the
//! area it covers is theirs. The same kernels, supports, beam rules, update rules and queries as [`Mapper`]'s, no tiles, no
//! blending, no bias.
//!
//! [`Mapper`]: crate::mapper::Mapper

mod basis;
#[cfg(test)]
mod tests;

pub use basis::{ScatteredBasis, ScatteredSupport};

use crate::{
    beam::LabelledPlace,
    em,
    geometry::{Point, PoseCovariance},
    mapper::{
        IntegrateReport, ScanRejected,
        reading::{self, Reading},
    },
    posterior::{Entry, Posterior, Prior, RowError, RowState, Rows, Scratch},
    scan::Scan,
    settings::{Model, Settings, SettingsError},
    tile::{Occupancy, OccupancyGradient},
};

/// All memory such a map uses, lent by the caller.
#[derive(Debug)]
pub struct ScatteredMemory<'m, const M: usize> {
    /// The supports, at most `M`.
    pub supports: &'m [ScatteredSupport<2>],
    /// What is learned; overwritten with the prior.
    pub posterior: &'m mut Posterior<M, M>,
    /// Working memory.
    pub scratch: &'m mut Scratch<M, M>,
    /// Observations of one scan.
    pub places: &'m mut [LabelledPlace],
    /// Non-zeros of the rows of one scan: at most as many as places times supports.
    pub entries: &'m mut [Entry],
    /// Rows of one scan.
    pub states: &'m mut [RowState],
}

/// A map whose supports lie anywhere. Of the settings, those of lattice, tiles, bias and forgetting are not read.
#[derive(Debug)]
pub struct ScatteredMapper<'m, const M: usize> {
    settings: Settings,
    model: Model<'static>,
    basis: ScatteredBasis<'m, 2>,
    prior: Prior,
    memory: ScatteredMemory<'m, M>,
    newest_stamp_ns: u64,
}

impl<'m, const M: usize> ScatteredMapper<'m, M> {
    /// An empty map.
    ///
    /// # Errors
    /// Settings that contradict themselves, no support or more than `M`, or no memory for observations.
    pub fn new(settings: Settings, memory: ScatteredMemory<'m, M>) -> Result<Self, SettingsError> {
        let model = settings.model()?;
        let supports = memory.supports.len();
        if supports > M {
            let expected = "no more than the supports the map was compiled for";
            return Err(SettingsError::Number { name: "number of supports", value: supports as f32, expected });
        }
        for (what, length) in [
            ("supports", supports),
            ("places", memory.places.len()),
            ("entries", memory.entries.len()),
            ("states", memory.states.len()),
        ] {
            if length == 0 {
                return Err(SettingsError::NoMemory { what });
            }
        }
        let basis = ScatteredBasis {
            kernel: model.basis.kernel,
            supports: memory.supports,
            segments: settings.segment_averaging,
        };
        let prior = Prior { precision: settings.prior_precision, bias: None };
        memory.posterior.reset(&prior);
        Ok(Self { settings, model, basis, prior, memory, newest_stamp_ns: 0 })
    }

    /// How places become features.
    #[must_use]
    pub fn basis(&self) -> &ScatteredBasis<'m, 2> {
        &self.basis
    }

    /// What is believed of the weights before any scan.
    #[must_use]
    pub fn prior(&self) -> &Prior {
        &self.prior
    }

    /// What is believed of them now.
    #[must_use]
    pub fn posterior(&self) -> &Posterior<M, M> {
        self.memory.posterior
    }

    /// Learns a scan; beams that cannot be used are counted.
    ///
    /// # Errors
    /// [`ScanRejected`] if the scan as a whole is not usable; the map is then unchanged.
    #[inline(always)]
    pub fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        reading::check(scan, self.newest_stamp_ns, |position| position.iter().all(|x| x.is_finite()))?;
        self.newest_stamp_ns = scan.stamp_ns;
        let reading = Reading { limits: &self.settings.limits, rule: &self.model.beam, cut: None };
        let (observed, beams) = reading.read(scan, self.memory.places);
        let mut report = IntegrateReport { beams, ..IntegrateReport::default() };
        let uncertainty = scan.pose_covariance.map(|covariance| (scan.map_from_sensor.position(), covariance));
        self.learn(observed, uncertainty, &mut report);
        Ok(report)
    }

    #[inline(always)]
    fn learn(&mut self, count: usize, uncertainty: Option<(Point<2>, PoseCovariance)>, report: &mut IntegrateReport) {
        let ScatteredMemory { posterior, scratch, places, entries, states, .. } = &mut self.memory;
        let mut rows = Rows::new(entries, states);
        for place in &places[..count] {
            let spread = uncertainty.map(|(sensor_m, covariance)| covariance.at(&(place.place.middle_m() - sensor_m)));
            // A stencil has no room for any uncertainty; here nothing is cut off.
            let row = self.basis.row::<M>(&place.place, spread.as_ref());
            match rows.push::<M, M>(row, 0.0, place.occupied) {
                Ok(()) => {
                    report.rows += 1;
                    report.points.used += 1;
                }
                Err(RowError::Full) => report.rows_over_capacity += 1,
                Err(_) => report.rows_refused += 1,
            }
        }
        report.tiles_touched = 1;
        match em::update(posterior, &mut rows, &self.settings.rule, self.settings.passes, scratch) {
            Ok(update) => {
                report.passes += update.passes;
                report.safeguards += update.safeguards;
                report.conditioned += update.conditioned;
                report.objective += update.objective;
            }
            Err(_) => report.tiles_failed += 1,
        }
    }

    /// What the map says about a point; [`Occupancy::UNKNOWN`] if it is not finite.
    #[must_use]
    pub fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        if !point_m.iter().all(|x| x.is_finite()) {
            return Occupancy::UNKNOWN;
        }
        let row = self.basis.row::<M>(&crate::geometry::Place::Point(*point_m), None);
        let moments = self.memory.posterior.view().moments(&row, 0.0);
        Occupancy::from_moments(moments.mean, moments.variance)
    }

    /// How that changes with the point.
    #[must_use]
    pub fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient {
        if !point_m.iter().all(|x| x.is_finite()) {
            return OccupancyGradient::UNKNOWN;
        }
        let view = self.memory.posterior.view();
        let row = self.basis.row::<M>(&crate::geometry::Place::Point(*point_m), None);
        let moments = view.moments(&row, 0.0);
        let slopes = [0, 1].map(|axis| self.basis.slope_row::<M>(point_m, axis));
        let mean = Point::<2>::from_fn(|axis, _| view.mean_of(&slopes[axis], 0.0));
        let variance = Point::<2>::from_fn(|axis, _| 2.0 * view.bilinear(&slopes[axis], 0.0, &row, 0.0));
        OccupancyGradient::from_moments(moments.mean, moments.variance, mean, variance)
    }
}
