use bhm_core::{
    basis::Basis,
    beam::Observation,
    em,
    geometry::{Place, Point},
    map::Occupancy,
    posterior::{Pattern, Posterior, Row, RowState, Rows, Scratch},
    prior::{PriorSettings, WhitePrior},
    scan::Sweep,
    settings::{Model, Settings},
};
use bhm_host::{ScanRecord, map::zeroed_box, supports::observe};

use super::{ScatteredBasis, ScatteredSupport};

/// Most supports that a map is compiled for.
pub const MAX_SCATTERED: usize = 512;

/// A map with supports anywhere, for programs that learn their number at run time.
pub trait ScatteredMap: Send {
    /// Learns a scan; says how many rows it was.
    ///
    /// # Errors
    /// If not all of it can be learned.
    fn integrate(&mut self, scan: &ScanRecord) -> anyhow::Result<usize>;

    /// What the map says about a point; [`Occupancy::UNKNOWN`] if it is not finite.
    fn occupancy(&self, point_m: &Point<2>) -> Occupancy;
}

/// A map of at most `M` supports anywhere. Of the settings, those of lattice, tiles, bias, forgetting and capacities are not
/// read.
#[derive(Debug)]
pub struct DenseMap<const M: usize> {
    settings: Settings,
    model: Model<'static, 2>,
    supports: Vec<ScatteredSupport>,
    posterior: Box<Posterior<M, M>>,
    scratch: Box<Scratch<M, M>>,
    features: Vec<f32>,
    states: Vec<RowState>,
}

impl<const M: usize> DenseMap<M> {
    /// An empty map.
    ///
    /// # Errors
    /// Settings that contradict themselves, no support or more than `M`.
    pub fn new(settings: Settings, supports: Vec<ScatteredSupport>) -> anyhow::Result<Self> {
        let model = settings.model()?;
        anyhow::ensure!((1..=M).contains(&supports.len()), "{} supports, expected 1 to {M}", supports.len());
        let (mut posterior, scratch) = (zeroed_box::<Posterior<M, M>>(), zeroed_box());
        // Supports that may stand anywhere have no lattice for another prior.
        let white = if let PriorSettings::White(prior) = settings.prior { prior } else { WhitePrior::DEFAULT };
        posterior.reset_white(white.precision);
        Ok(Self { settings, model, supports, posterior, scratch, features: Vec::new(), states: Vec::new() })
    }

    fn basis(&self) -> ScatteredBasis<'_> {
        let Basis { kernel, segments, .. } = self.model.basis;
        ScatteredBasis { kernel, supports: &self.supports, segments }
    }
}

impl<const M: usize> ScatteredMap for DenseMap<M> {
    fn integrate(&mut self, scan: &ScanRecord) -> anyhow::Result<usize> {
        let mut observed = Vec::new();
        observe(scan, &self.settings, |observation| observed.push(*observation));
        let (mut features, mut states) = (std::mem::take(&mut self.features), std::mem::take(&mut self.states));
        features.clear();
        for Observation { place, .. } in &observed {
            // A stencil has no room for any uncertainty; here nothing is cut off.
            let spread_m2 = scan.as_scan().covariance_at(&place.middle_m());
            features.extend(self.basis().features(place, spread_m2.as_ref()));
        }
        states.resize(observed.len(), RowState::default());
        let pattern = Pattern::contiguous(self.supports.len());
        let mut rows = Rows::new(&pattern, &features, &mut states);
        for (number, Observation { occupied, .. }) in observed.iter().enumerate() {
            rows.push::<M, M>(number, 0, 0.0, *occupied)?;
        }
        em::update(&mut self.posterior, &mut rows, &self.settings.rule, self.settings.passes, &mut self.scratch)?;
        (self.features, self.states) = (features, states);
        Ok(observed.len())
    }

    fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        if !point_m.iter().all(|x| x.is_finite()) {
            return Occupancy::UNKNOWN;
        }
        let values: Vec<f32> = self.basis().features(&Place::Point(*point_m), None).collect();
        let pattern = Pattern::contiguous(values.len());
        let row = Row { pattern: &pattern, first: 0, values: &values, bias: 0.0 };
        let moments = self.posterior.view().moments(&row);
        Occupancy::from_moments(moments.mean, moments.variance)
    }
}

/// An empty map with these supports, of the smallest compiled capacity that holds them.
///
/// # Errors
/// As [`DenseMap::new`]; more than [`MAX_SCATTERED`] supports.
pub fn open_scattered(settings: Settings, supports: Vec<ScatteredSupport>) -> anyhow::Result<Box<dyn ScatteredMap>> {
    if supports.len() <= 256 {
        Ok(Box::new(DenseMap::<256>::new(settings, supports)?))
    } else {
        Ok(Box::new(DenseMap::<MAX_SCATTERED>::new(settings, supports)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{
        kernel::{KernelSettings, SquaredExponentialSettings},
        profile::COMPACT,
        support::AnySupport,
    };
    use bhm_host::sim::Scene;

    #[test]
    fn a_capacity_does_not_change_what_is_learned() {
        let settings = Settings { spacing_m: 2.0, ..COMPACT.settings }
            .with_kernel(KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT));
        let supports: Vec<_> = (0..200)
            .map(|i| [(i % 20) as f32 - 10.0, (i / 20) as f32 * 2.0 - 10.0])
            .map(|centre_m| ScatteredSupport { centre_m: centre_m.into(), support: AnySupport::default() })
            .collect();
        let scan = Scene::named("building").unwrap().simulate(1).next().unwrap();
        let mut small = open_scattered(settings, supports.clone()).unwrap();
        let mut large = DenseMap::<MAX_SCATTERED>::new(settings, supports.clone()).unwrap();
        assert!(small.integrate(&scan).unwrap() > 300);
        large.integrate(&scan).unwrap();
        for i in 0..100 {
            let at = Point::from([(i % 10) as f32 - 5.0, (i / 10) as f32 - 5.0]);
            let (a, b) = (small.occupancy(&at), large.occupancy(&at));
            assert!((a.probability - b.probability).abs() < 1e-3, "{a:?} {b:?}");
        }
        let many = vec![supports[0]; MAX_SCATTERED + 1];
        assert!(open_scattered(settings, many).is_err());
        assert!(open_scattered(settings, Vec::new()).is_err());
    }
}
