use nalgebra::SMatrix;

use super::{
    ObservationTally,
    sorting::{Link, Sorting, TouchedTile},
};
use crate::{
    beam::Observation,
    lattice::Node,
    posterior::{Posterior, RowState, Scratch},
    settings::Model,
    storage::Storage,
};

/// What is kept of an observation between reading and learning, beside its features.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservationSlot<const D: usize> {
    /// The first node of its stencil.
    pub(super) first: Node<D>,
    pub(super) bias: f32,
    pub(super) occupied: bool,
}

impl<const D: usize> ObservationSlot<D> {
    /// Room for an observation.
    pub const VACANT: Self = Self { first: [0; D], bias: 0.0, occupied: false };
}

/// The part of [`Memory`](super::Memory) that learns nothing from one scan to the next.
#[derive(Debug)]
pub(super) struct Workspace<'m, const D: usize, const M: usize, const B: usize> {
    pub(super) prior: Storage<'m, Posterior<M, B>>,
    pub(super) scratch: Storage<'m, Scratch<M, B>>,
    pub(super) observations: Storage<'m, [ObservationSlot<D>]>,
    pub(super) features: Storage<'m, [f32]>,
    pub(super) links: Storage<'m, [Link]>,
    pub(super) touched: Storage<'m, [TouchedTile<D>]>,
    pub(super) rows: Storage<'m, [RowState]>,
    /// Observations for which there is room in all of these.
    pub(super) capacity: usize,
}

/// The observations of one scan as they are read: features computed once, and sorted into tiles once.
pub(super) struct Observed<'m, const D: usize> {
    pub(super) slots: &'m mut [ObservationSlot<D>],
    pub(super) features: &'m mut [f32],
    pub(super) sorting: Sorting<'m, D>,
    pub(super) len: usize,
    pub(super) tally: ObservationTally,
}

impl<const D: usize> Observed<'_, D> {
    /// Computes an observation's features, widened by the covariance of where it is (m²), and sorts it into its tiles; counts
    /// what became of it. The caller makes sure that there is room.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        observation: &Observation<D>,
        covariance_m2: Option<SMatrix<f32, D, D>>,
        model: &Model<'_, D>,
    ) {
        let Model { basis, tiling, pattern, .. } = model;
        let (spread, narrowed) = covariance_m2
            .map(|covariance| basis.widening(&covariance))
            .map_or((None, false), |(spread, narrowed)| (Some(spread), narrowed));
        let start = self.len * pattern.len();
        let Some(values) = self.features.get_mut(start..start + pattern.len()) else { return };
        let Some((stencil, bias)) = basis.write_features(&observation.place, spread.as_ref(), values) else {
            self.tally.unplaceable += 1;
            return;
        };
        let Some(slot) = self.slots.get_mut(self.len) else { return };
        *slot = ObservationSlot { first: stencil.first, bias, occupied: observation.occupied };
        let (mut tiles, mut missed) = (0, 0);
        for tile in tiling.holding(&stencil.first).filter(|tile| tiling.contains(tile)) {
            tiles += 1;
            missed += u32::from(!self.sorting.insert(tile, self.len));
        }
        self.len += 1;
        self.tally.outside += u32::from(tiles == 0);
        self.tally.over_capacity += u32::from(missed > 0);
        self.tally.used += u32::from(tiles > missed);
        self.tally.narrowed += u32::from(tiles > missed && narrowed);
    }
}
