use bhm_core::{
    geometry::Point,
    map::{Map, ModelledMap, Occupancy, TileRef, Viewed},
    posterior::PosteriorView,
    settings::Model,
    tile::{MapView, TileIndex, TileSource},
};
use iceoryx2::sample::Sample;

use super::{
    PosteriorHeader, PosteriorModel, PosteriorRejected, PosteriorTile, posterior_message::KnownModel, topic::Ipc,
};
use crate::{map::Vectorised, supports::LearnedSupports};

/// A posterior that cannot be used, perhaps only not yet.
#[derive(Debug)]
pub(super) struct Refused<const M: usize, const B: usize> {
    pub(super) sample: Sample<Ipc, [PosteriorTile<M, B>], PosteriorHeader>,
    pub(super) why: PosteriorRejected,
}

/// A posterior that passed the checks, borrowed from shared memory until this is dropped. Queries run on it in place.
///
/// The posterior stays as it was when it was received, whatever the mapper does meanwhile, its death included.
#[derive(Debug)]
pub struct PosteriorSample<const M: usize, const B: usize> {
    sample: Sample<Ipc, [PosteriorTile<M, B>], PosteriorHeader>,
    model: PosteriorModel<M, B>,
}

impl<const M: usize, const B: usize> PosteriorSample<M, B> {
    pub(super) fn check(
        sample: Sample<Ipc, [PosteriorTile<M, B>], PosteriorHeader>,
        supports: Option<&LearnedSupports>,
        known: &mut KnownModel<M, B>,
    ) -> Result<Self, Refused<M, B>> {
        match sample.user_header().check_knowing(sample.payload(), supports, known) {
            Ok(model) => Ok(Self { sample, model }),
            Err(why) => Err(Refused { sample, why }),
        }
    }

    /// Which mapper published the posterior, and when.
    #[must_use]
    pub fn header(&self) -> &PosteriorHeader {
        self.sample.user_header()
    }

    /// The posterior's tiles, in ascending order of index.
    #[must_use]
    pub fn tiles(&self) -> &[PosteriorTile<M, B>] {
        self.sample.payload()
    }

    /// The map as queries see it.
    #[must_use]
    pub fn view(&self) -> MapView<'_, &Self, 2, M, B> {
        self.model.view(self)
    }
}

impl<const M: usize, const B: usize> TileSource<2, M, B> for PosteriorSample<M, B> {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        let tiles = self.tiles();
        let at = tiles.binary_search_by_key(index, |tile| tile.index).ok()?;
        Some(tiles[at].view())
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, 2>)) {
        for tile in self.tiles() {
            visit(&TileRef::new(tile.index, tile.updates, tile.touched_at, &tile.view()));
        }
    }
}

impl<const M: usize, const B: usize> ModelledMap<2> for PosteriorSample<M, B> {
    fn model(&self) -> &Model<'_, 2> {
        &self.model.model
    }

    fn unobserved_at(&self, point_m: &Point<2>) -> Occupancy {
        self.view().unobserved_at(point_m)
    }
}

impl<const M: usize, const B: usize> Viewed<2> for PosteriorSample<M, B> {
    fn as_map(&self) -> impl Map<2> + '_ {
        Vectorised(self.view())
    }
}
