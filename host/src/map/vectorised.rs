//! The inlined core compiled for the widest vectors that the processor has (AVX2 on x86-64). No fused multiply–add is used: the
//! results are the same bit for bit.
//!
//! Structures and not closures, because a closure is not sure to be inlined where it is called.

use bhm_core::{
    beam::Observation,
    geometry::Point,
    map::{Map, Occupancy, OccupancyGradient, TileRef},
    mapper::{IntegrateReport, Mapper},
    scan::{Scan, ScanRejected},
};
use pulp::{Arch, NullaryFnOnce};

use super::TileArchive;

/// What a map learns from.
#[derive(Clone, Copy)]
pub(super) enum Learned<'a> {
    Scan(&'a Scan<'a>),
    Observations(&'a [Observation<2>]),
}

/// [`Mapper::integrate`], or [`Mapper::integrate_observations`].
pub(super) struct Integrate<'a, 'm, const M: usize, const B: usize> {
    pub(super) mapper: &'a mut Mapper<'m, 2, M, B>,
    pub(super) archive: &'a mut TileArchive<M, B>,
    pub(super) learned: Learned<'a>,
}

impl<const M: usize, const B: usize> NullaryFnOnce for Integrate<'_, '_, M, B> {
    type Output = Result<IntegrateReport, ScanRejected>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        match self.learned {
            Learned::Scan(scan) => self.mapper.integrate(scan, self.archive),
            Learned::Observations(observations) => self.mapper.integrate_observations(observations, self.archive),
        }
    }
}

/// A map whose answers about many points are so compiled.
pub(crate) struct Vectorised<T>(pub(crate) T);

impl<T: Map<2>> Map<2> for Vectorised<T> {
    fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        self.0.occupancy(point_m)
    }

    fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient<2> {
        self.0.gradient(point_m)
    }

    fn spacing_m(&self) -> f32 {
        self.0.spacing_m()
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, 2>)) {
        self.0.for_each_tile(visit);
    }

    fn occupancies(&self, points_m: &[Point<2>], answers: &mut [Occupancy]) {
        Arch::new().dispatch(Occupancies { map: &self.0, points_m, answers });
    }
}

/// [`Map::occupancies`].
struct Occupancies<'a, T> {
    map: &'a T,
    points_m: &'a [Point<2>],
    answers: &'a mut [Occupancy],
}

impl<T: Map<2>> NullaryFnOnce for Occupancies<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.map.occupancies(self.points_m, self.answers);
    }
}
