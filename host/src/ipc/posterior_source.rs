use bhm_core::{mapper::Mapper, posterior::PosteriorView, settings::Settings, tile::TileIndex};

/// A posterior that can be published: a mapper's own, or one that came from a mapper elsewhere.
pub trait PosteriorSource<const M: usize, const B: usize> {
    /// The settings that the posterior was made with.
    fn settings(&self) -> &Settings;

    /// Scans integrated since the map began.
    fn scans(&self) -> u64;

    /// Stamp of the newest scan integrated, nanoseconds on its source's clock.
    fn newest_stamp_ns(&self) -> u64;

    /// The posterior's tiles, in ascending order of index.
    fn tiles(&self) -> impl ExactSizeIterator<Item = SourceTile<'_, M, B>>;
}

/// A tile that can be published.
#[derive(Clone, Copy, Debug)]
pub struct SourceTile<'a, const M: usize, const B: usize> {
    /// The tile's place in the grid of tiles.
    pub index: TileIndex<2>,
    /// Number of updates that the tile has learned from.
    pub updates: u64,
    /// The mapper's scan count when the tile was last touched.
    pub touched_at: u64,
    /// What queries need of the tile.
    pub view: PosteriorView<'a, M, B>,
}

impl<const M: usize, const B: usize> PosteriorSource<M, B> for Mapper<'_, 2, M, B> {
    fn settings(&self) -> &Settings {
        self.settings()
    }

    fn scans(&self) -> u64 {
        self.scans()
    }

    fn newest_stamp_ns(&self) -> u64 {
        self.newest_stamp_ns()
    }

    fn tiles(&self) -> impl ExactSizeIterator<Item = SourceTile<'_, M, B>> {
        self.tiles().iter().map(|tile| SourceTile {
            index: tile.index,
            updates: tile.updates,
            touched_at: tile.touched_at,
            view: tile.posterior.view(),
        })
    }
}
