//! What tests of the core need, here and in the package `tests`: posteriors to work on, a scan's observations, the oracle's view
//! of the core's numbers.
#![allow(dead_code, unused_imports, reason = "each test file is a program of its own and uses a part of this")]
#![allow(unreachable_pub, reason = "there is nobody outside a test program")]

mod banded;
mod bordered;
mod inverse;
mod spline;
mod stream;

pub use banded::{BandedRow, lattice_pattern, push_all};
use bhm_core::{
    beam::{BeamLimits, BeamRule, BeamTally, Observation, RayEnd},
    em::{self, UpdateReport},
    posterior::{NotPositiveDefinite, Pattern, Posterior, Scratch},
    rule::AnyRule,
    scan::Scan,
    settings::Settings,
};
use bhm_oracle::Observation as DenseObservation;
use bhm_oracle::{DensePosterior, Matrix, Safeguard};
pub use bordered::{BorderedRow, bordered, bordered_observations, dense_bordered_prior};
pub use inverse::Inverse;
pub use spline::spline_row;
pub use stream::Stream;

/// How far a pass may lower the bound, as the core's `em` module states it: `1e-3 + 1e-5·|L|`.
pub const SAFEGUARD: Safeguard = Safeguard { absolute: 1e-3, relative: 1e-5 };

/// What a scan's readings mean under these limits, beam by beam, and what became of each.
pub fn read(scan: &Scan<'_>, limits: &BeamLimits) -> (Vec<(usize, RayEnd)>, BeamTally) {
    let mut tally = BeamTally::default();
    let ends = scan.rays(limits).filter_map(|ray| {
        tally.count(&ray.reading);
        Some((ray.number, ray.reading.end()?))
    });
    (ends.collect(), tally)
}

/// The labelled points that a scan is under these settings.
pub fn points_of(scan: &Scan<'_>, settings: &Settings) -> Vec<Observation<2>> {
    let mut points = Vec::new();
    for ray in scan.rays(&settings.limits) {
        settings.beam.observe(&ray, settings.spacing_m, |point| {
            points.push(point);
            true
        });
    }
    points
}

/// Labelled points as a map takes them.
pub fn labelled(places: &[[f32; 2]], occupied: impl Fn(&[f32; 2]) -> bool) -> Vec<Observation<2>> {
    places.iter().map(|at| Observation::at_point((*at).into(), occupied(at))).collect()
}

/// Every number of a posterior, as its bits. Taken apart whole, so that a field added to it fails to compile here.
pub fn posterior_bits<const M: usize, const B: usize>(posterior: &Posterior<M, B>) -> Vec<u32> {
    let Posterior {
        information,
        covariance,
        mean,
        border_information,
        border_covariance,
        bias_information,
        bias_covariance,
        bias_mean,
        log_determinant,
    } = posterior;
    information
        .as_flattened()
        .iter()
        .chain(covariance.as_flattened())
        .chain(mean)
        .chain(border_information)
        .chain(border_covariance)
        .chain([bias_information, bias_covariance, bias_mean])
        .chain(log_determinant)
        .map(|value| value.to_bits())
        .collect()
}

/// A posterior and everything needed to update it.
pub struct Learner<const M: usize, const B: usize> {
    pub prior: Box<Posterior<M, B>>,
    /// Of its rows.
    pub pattern: Pattern,
    pub posterior: Box<Posterior<M, B>>,
    pub scratch: Box<Scratch<M, B>>,
}

impl<const M: usize, const B: usize> Clone for Learner<M, B> {
    fn clone(&self) -> Self {
        let mut copy = Self { pattern: self.pattern, ..Self::new(|prior| prior.copy_from(&self.prior)) };
        copy.posterior.copy_from(&self.posterior);
        copy
    }
}

/// One observation as both sides take it.
#[derive(Clone)]
pub struct SparseRow {
    pub entries: Vec<(u32, f32)>,
    pub occupied: bool,
}

/// Short, since thousands of rows are printed when a property fails.
impl std::fmt::Debug for SparseRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let peak = self.entries.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        write!(f, "{}{:?}", if self.occupied { '+' } else { '-' }, peak.unwrap_or(&(0, 0.0)))
    }
}

impl<const M: usize, const B: usize> Learner<M, B> {
    /// With the prior that is written over all zeros.
    pub fn new(write: impl FnOnce(&mut Posterior<M, B>)) -> Self {
        // SAFETY: both are documented to be plain numbers for which all-zero bytes are a value.
        let posterior = || unsafe { Box::<Posterior<M, B>>::new_zeroed().assume_init() };
        // SAFETY: as above.
        let scratch = unsafe { Box::<Scratch<M, B>>::new_zeroed().assume_init() };
        let (mut prior, mut posterior) = (posterior(), posterior());
        write(&mut prior);
        posterior.copy_from(&prior);
        Self { prior, pattern: Pattern::contiguous(B.min(M)), posterior, scratch }
    }

    /// With a prior of this precision and no bias.
    pub fn flat(precision: f32) -> Self {
        Self::new(|prior| prior.reset_white(precision))
    }

    /// A learner of points on a lattice, whose rows are lines of a stencil: the core adds them up line by line.
    pub fn on_lattice<const D: usize>(self, width: usize, stencil: usize) -> Self {
        Self { pattern: lattice_pattern::<D>(width, stencil), ..self }
    }

    /// A row as the core takes it, without bias.
    pub fn banded(&self, row: &SparseRow) -> BandedRow {
        BandedRow::new::<M>(row, 0.0, &self.pattern)
    }

    /// Learns rows that must all be acceptable.
    pub fn update(
        &mut self,
        rows: &[SparseRow],
        rule: &AnyRule,
        passes: u32,
    ) -> Result<UpdateReport, NotPositiveDefinite> {
        let rows = rows.iter().map(|row| (row, 0.0));
        let Self { posterior, pattern, scratch, .. } = self;
        push_all::<M, B, _>(pattern, rows, |rows| em::update(posterior, rows, rule, passes, scratch))
    }

    /// The information matrix in `f64`; without bias.
    pub fn information(&self) -> Matrix {
        let mut dense = vec![vec![0.0; M]; M];
        for (i, row) in self.posterior.information.iter().enumerate() {
            for (j, value) in row.iter().enumerate().take(M - i) {
                dense[i][i + j] = f64::from(*value);
                dense[i + j][i] = f64::from(*value);
            }
        }
        dense
    }

    /// The same belief in `f64`; without bias. `Σ` and everything else follow from the information matrix and the mean.
    ///
    /// An error is the row of the pivot that is not positive: rounding made the core's matrix no matrix of a belief.
    pub fn dense(&self) -> Result<DensePosterior, usize> {
        let mean = self.posterior.mean.iter().copied().map(f64::from).collect();
        DensePosterior::from_mean(self.information(), mean)
    }
}

/// Rows with every feature, for the oracle.
pub fn observations<const M: usize>(rows: &[SparseRow]) -> Vec<DenseObservation> {
    rows.iter()
        .map(|row| {
            let mut phi = vec![0.0; M];
            for (index, value) in &row.entries {
                phi[*index as usize] = f64::from(*value);
            }
            DenseObservation { phi, occupied: row.occupied }
        })
        .collect()
}

/// Largest and root mean square of differences.
#[derive(Clone, Copy, Debug, Default)]
pub struct Differences {
    pub count: usize,
    pub largest: f64,
    squares: f64,
}

impl Differences {
    pub fn add(&mut self, difference: f64) {
        assert!(difference.is_finite());
        self.count += 1;
        self.largest = self.largest.max(difference.abs());
        self.squares += difference * difference;
    }

    pub fn rms(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }
}

impl std::fmt::Display for Differences {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rms {:.2e}, largest {:.2e} over {}", self.rms(), self.largest, self.count)
    }
}
