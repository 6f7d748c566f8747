//! Posteriors from shared memory, and what they answer.
#![no_main]

use bhm_core::{
    geometry::Point,
    map::{Map, TileRef},
    posterior::PosteriorView,
    profile::COMPACT,
    settings::{BiasSettings, Settings, TileSettings},
    tile::{TileIndex, TileSource},
};
use bhm_fuzz::{bytes_of, learned_supports, message_from, within};
use bhm_host::ipc::{PosteriorHeader, PosteriorTile};

const M: usize = 144;
const B: usize = 40;
type Tile = PosteriorTile<M, B>;

/// Bytes of an input that make a tile: its key, its bias, and a number that fills the rest.
const TILE_BYTES: usize = 36;

/// Most tiles of an input.
const MAX_TILES: usize = 3;

fn header(settings: &Settings, tiles: u64, supports_digest: u32) -> PosteriorHeader {
    let mut header = PosteriorHeader {
        magic: PosteriorHeader::MAGIC,
        version: PosteriorHeader::VERSION,
        mapper: 1,
        sequence: 1,
        resident: tiles,
        supports: M as u32,
        band: B as u32,
        supports_digest,
        ..PosteriorHeader::default()
    };
    header.settings_bytes = postcard::to_slice(settings, &mut header.settings.0).expect("they fit").len() as u32;
    header
}

fn seeds() -> Vec<Vec<u8>> {
    let settings = COMPACT.settings;
    let tile = TileSettings { count: Some([2, 2]), ..settings.tile };
    let bounded = Settings { bias: Some(BiasSettings::DEFAULT), tile, ..settings };
    let digest = learned_supports().digest();
    [(settings, 0, 0), (settings, 2, 0), (bounded, 1, 0), (settings, 1, digest)]
        .into_iter()
        .map(|(settings, tiles, digest)| {
            let header = header(&settings, tiles, digest);
            let mut bytes = bytes_of(&header).to_vec();
            for tile in 0..tiles as u8 {
                let mut key = [0; TILE_BYTES];
                key[16] = tile;
                key[24..28].copy_from_slice(&1_f32.to_le_bytes());
                key[32..].copy_from_slice(&0.5_f32.to_le_bytes());
                bytes.extend(key);
            }
            bytes
        })
        .collect()
}

/// The tile that a few bytes describe.
fn tile(bytes: &[u8]) -> Tile {
    let mut words = [0_u8; TILE_BYTES];
    words[..bytes.len()].copy_from_slice(bytes);
    let word = |at: usize| [words[at], words[at + 1], words[at + 2], words[at + 3]];
    let long = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| words[at + byte]));
    let number = |at| f32::from_le_bytes(word(at));
    let fill = number(32);
    Tile {
        touched_at: long(0),
        updates: long(8),
        index: [i32::from_le_bytes(word(16)), i32::from_le_bytes(word(20))],
        bias_covariance: number(24),
        bias_mean: number(28),
        mean: [fill; M],
        border_covariance: [fill; M],
        covariance: [[fill; B]; M],
    }
}

/// Tiles as a reader of shared memory has them.
struct Tiles(Vec<Tile>);

impl TileSource<2, M, B> for Tiles {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        self.0.iter().find(|tile| tile.index == *index).map(Tile::view)
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, 2>)) {
        for tile in &self.0 {
            visit(&TileRef::new(tile.index, tile.updates, tile.touched_at, &tile.view()));
        }
    }
}

fn check(bytes: &[u8]) {
    let mut rest = bytes;
    let header = message_from::<PosteriorHeader>(&mut rest);
    let tiles = Tiles(rest.chunks(TILE_BYTES).take(MAX_TILES).map(tile).collect());
    let learned = learned_supports();
    for supports in [None, Some(&learned)] {
        let Ok(model) = within(0, || header.check(&tiles.0, supports)) else { continue };
        let view = model.view(&tiles);
        for at in [[0.0, 0.0], [f32::NAN, 0.0], [1e30, -1e30], [header.x_m, header.y_m]] {
            let _ = (view.occupancy(&Point::from(at)), view.gradient(&Point::from(at)));
        }
    }
}

bhm_fuzz::target!(seeds, check);
