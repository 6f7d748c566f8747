//! The inlined core compiled for the widest vectors that the processor has (AVX2 on x86-64). No fused multiply–add is used: the
//! results are the same bit for bit.
//!
//! Structures and not closures, because a closure is not sure to be inlined where it is called.

use bhm_core::{
    beam::Observation,
    mapper::{IntegrateReport, Mapper},
    scan::{Scan, ScanRejected},
};
use pulp::NullaryFnOnce;

use super::TileArchive;

/// [`Mapper::integrate`].
pub(super) struct Integrate<'a, 'm, const M: usize, const B: usize> {
    pub(super) mapper: &'a mut Mapper<'m, 2, M, B>,
    pub(super) archive: &'a mut TileArchive<M, B>,
    pub(super) scan: &'a Scan<'a>,
}

impl<const M: usize, const B: usize> NullaryFnOnce for Integrate<'_, '_, M, B> {
    type Output = Result<IntegrateReport, ScanRejected>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.mapper.integrate(self.scan, self.archive)
    }
}

/// [`Mapper::integrate_observations`].
pub(super) struct IntegrateObservations<'a, 'm, const M: usize, const B: usize> {
    pub(super) mapper: &'a mut Mapper<'m, 2, M, B>,
    pub(super) archive: &'a mut TileArchive<M, B>,
    pub(super) observations: &'a [Observation<2>],
}

impl<const M: usize, const B: usize> NullaryFnOnce for IntegrateObservations<'_, '_, M, B> {
    type Output = Result<IntegrateReport, ScanRejected>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.mapper.integrate_observations(self.observations, self.archive)
    }
}
