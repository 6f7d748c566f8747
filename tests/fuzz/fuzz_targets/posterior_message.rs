//! Posteriors from shared memory, and what they answer.
#![no_main]

use bhm_core::{
    geometry::Point,
    posterior::PosteriorView,
    profile::COMPACT,
    settings::Settings,
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

fn name_of<const N: usize>(text: &str) -> [u8; N] {
    let mut name = [0; N];
    name[..text.len()].copy_from_slice(text.as_bytes());
    name
}

fn header(settings: &Settings, tiles: u64, supports_digest: u32) -> PosteriorHeader {
    let flag = |set, flag| if set { flag } else { 0 };
    PosteriorHeader {
        magic: PosteriorHeader::MAGIC,
        version: PosteriorHeader::VERSION,
        flags: flag(settings.bias, PosteriorHeader::BIAS)
            | flag(settings.tile_count.is_some(), PosteriorHeader::BOUNDED),
        mapper: 1,
        sequence: 1,
        resident: tiles,
        origin_m: settings.origin_m,
        spacing_m: settings.spacing_m,
        kernel_shape: settings.kernel_shape,
        support_size: settings.support_size,
        prior_precision: settings.prior_precision,
        bias_precision: settings.bias_precision,
        supports: M as u32,
        band: B as u32,
        stencil: settings.stencil as u32,
        tile_width: settings.tile_width.map(|width| width as u32),
        tile_stride: settings.tile_stride.map(|stride| stride as u32),
        tile_count: settings.tile_count.unwrap_or([0; 2]).map(|count| count as u32),
        supports_digest,
        kernel: name_of(settings.kernel.name()),
        support: name_of(settings.support.name()),
        ..PosteriorHeader::default()
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let settings = COMPACT.settings;
    let bounded = Settings { bias: true, tile_count: Some([2, 2]), ..settings };
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
}

fn check(bytes: &[u8]) {
    let mut rest = bytes;
    let header = message_from::<PosteriorHeader>(&mut rest);
    let tiles = Tiles(rest.chunks(TILE_BYTES).take(MAX_TILES).map(tile).collect());
    for supports in [None, Some(learned_supports().interned())] {
        let Ok(model) = within(0, || header.check(&tiles.0, supports)) else { continue };
        let view = model.view(&tiles);
        for at in [[0.0, 0.0], [f32::NAN, 0.0], [1e30, -1e30], [header.x_m, header.y_m], header.origin_m] {
            let _ = (view.occupancy(&Point::from(at)), view.gradient(&Point::from(at)));
        }
    }
}

bhm_fuzz::target!(seeds, check);
