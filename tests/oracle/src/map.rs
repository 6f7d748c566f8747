//! One dense map over a fixed box of supports.

use super::{DensePosterior, Features, Observation, Prediction, Rule, Trace};

/// A belief and the features it is about.
#[derive(Clone, Debug)]
pub struct DenseMap<const D: usize> {
    /// Supports and kernel.
    pub features: Features<D>,
    /// Only points around which a stencil this wide lies inside are learned; the features' own stencil may be wider.
    pub whole_stencil: usize,
    /// The belief.
    pub posterior: DensePosterior,
}

impl<const D: usize> DenseMap<D> {
    /// A map that has seen nothing: as many weights as features, the bias last.
    #[must_use]
    pub fn new(features: Features<D>, prior: DensePosterior) -> Self {
        Self { features, whole_stencil: features.stencil, posterior: prior }
    }

    /// Learns the labelled points of one scan, those whose whole stencil lies inside; the others are left out.
    ///
    /// # Errors
    /// The row of the first pivot that is not a positive number.
    pub fn learn(&mut self, points_m: &[([f64; D], bool)], rule: &Rule, passes: usize) -> Result<Trace, usize> {
        let observations: Vec<_> = points_m
            .iter()
            .filter(|(point, _)| self.features.hold_whole(self.whole_stencil, point))
            .map(|(point, occupied)| Observation { phi: self.features.at(point), occupied: *occupied })
            .collect();
        if observations.is_empty() {
            return Ok(Trace::default());
        }
        self.posterior.update(&observations, rule, passes)
    }

    /// What the map says about a point; `None` where a whole stencil does not fit.
    #[must_use]
    pub fn predict(&self, point_m: &[f64; D]) -> Option<Prediction> {
        let inside = self.features.hold_whole(self.whole_stencil, point_m);
        inside.then(|| self.posterior.predict(&self.features.at(point_m)))
    }
}
