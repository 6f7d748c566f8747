use crate::{beam::BeamTally, tile::Claimed};

/// What became of a scan's observations.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObservationTally {
    /// Learned from by at least one tile.
    pub used: u32,
    /// Dropped: not finite, or further than the lattice reaches.
    pub unplaceable: u32,
    /// Dropped: outside the tiles that a bounded tiling has.
    pub outside: u32,
    /// Missed by at least one of its tiles: the scan touched more tiles than there is memory for.
    pub over_capacity: u32,
    /// Learned, but as less uncertain than the scan's pose makes them: the stencil has no room for all of it (see
    /// [`Basis::widening`](crate::basis::Basis::widening)).
    pub narrowed: u32,
}

/// What integrating one scan did: every outcome by name.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegrateReport {
    /// The beams, used and dropped by reason.
    pub beams: BeamTally,
    /// The observations that the used beams gave.
    pub observations: ObservationTally,
    /// Rows learned, summed over tiles: an observation is a row in each tile that holds its whole stencil.
    pub rows: u32,
    /// Rows dropped because the memory for rows was full.
    pub rows_over_capacity: u32,
    /// Rows that the posterior refused (see [`RowError`](crate::posterior::RowError)); always 0 with checked settings.
    pub rows_refused: u32,
    /// Tiles learned in.
    pub tiles_touched: u32,
    /// Tiles that began as the prior.
    pub tiles_created: u32,
    /// Tiles that came back from the archive.
    pub tiles_restored: u32,
    /// Tiles that left the store.
    pub tiles_evicted: u32,
    /// Evicted tiles that the archive did not keep.
    pub tiles_lost: u32,
    /// Tiles in which an update or a discount failed and changed nothing.
    pub tiles_failed: u32,
    /// Passes, summed over tiles.
    pub passes: u32,
    /// Passes that the safeguard rejected, summed over tiles.
    pub safeguards: u32,
    /// Passes whose information matrix `f32` could factor only with a little more on its diagonal, summed over tiles.
    pub conditioned: u32,
    /// Objective, summed over tiles, nats.
    pub objective: f32,
}

impl IntegrateReport {
    pub(super) fn count(&mut self, claimed: &Claimed) {
        self.tiles_touched += 1;
        self.tiles_created += u32::from(claimed.created);
        self.tiles_restored += u32::from(claimed.restored);
        self.tiles_evicted += u32::from(claimed.evicted);
        self.tiles_lost += u32::from(claimed.lost);
    }
}
