//! Lists inside a message, in bytes of a fixed layout: nothing is allocated to read them, and every bit arrives.

use bhm_core::{posterior::PosteriorView, tile::TileIndex};

/// Bytes of a number.
const FLOAT_BYTES: usize = 4;

/// Numbers of a tile of `M` supports in a band of `B`.
#[must_use]
pub const fn tile_floats<const M: usize, const B: usize>() -> usize {
    M + M + 2 + M * B
}

/// The numbers in little-endian bytes, and whether the last one is cut.
pub fn floats(bytes: &[u8]) -> (impl ExactSizeIterator<Item = f32>, bool) {
    let (floats, rest) = bytes.as_chunks::<FLOAT_BYTES>();
    (floats.iter().map(|float| f32::from_le_bytes(*float)), !rest.is_empty())
}

/// Writes numbers as little-endian bytes, as many as there is room for, and answers the bytes written.
pub fn write_floats(numbers: &[f32], bytes: &mut [u8]) -> usize {
    let (room, _) = bytes.as_chunks_mut::<FLOAT_BYTES>();
    room.iter_mut().zip(numbers).for_each(|(to, number)| *to = number.to_le_bytes());
    room.len().min(numbers.len()) * FLOAT_BYTES
}

/// Writes a tile's numbers from the one numbered `from` on, as many as there is room for, and answers the bytes written.
pub fn write_tile<const M: usize, const B: usize>(
    view: &PosteriorView<'_, M, B>,
    from: usize,
    bytes: &mut [u8],
) -> usize {
    let PosteriorView { mean, covariance, border_covariance, bias_covariance, bias_mean } = view;
    let (mut skipped, mut written) = (0, 0);
    for numbers in [&mean[..], &border_covariance[..], &[*bias_covariance, *bias_mean], covariance.as_flattened()] {
        let first = (from + written / FLOAT_BYTES).saturating_sub(skipped).min(numbers.len());
        written += write_floats(&numbers[first..], &mut bytes[written..]);
        skipped += numbers.len();
    }
    written
}

/// The numbers of a tile, see [`write_tile`], as queries read them; `None` if there are too few.
#[must_use]
pub fn view_of<const M: usize, const B: usize>(floats: &[f32]) -> Option<PosteriorView<'_, M, B>> {
    let (mean, rest) = floats.split_first_chunk::<M>()?;
    let (border_covariance, rest) = rest.split_first_chunk::<M>()?;
    let ([bias_covariance, bias_mean], rest) = rest.split_first_chunk::<2>()?;
    let covariance = rest.as_chunks::<B>().0.first_chunk::<M>()?;
    Some(PosteriorView {
        mean,
        covariance,
        border_covariance,
        bias_covariance: *bias_covariance,
        bias_mean: *bias_mean,
    })
}

/// Which tile, and how new.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TileVersion {
    /// The tile's place in the grid of tiles.
    pub index: TileIndex<2>,
    /// Updates that it has learned from.
    pub updates: u64,
    /// The mapper's scan count when it was last touched.
    pub touched_at: u64,
}

impl TileVersion {
    /// Bytes of one.
    pub const BYTES: usize = 24;

    /// In bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let Self { index: [x, y], updates, touched_at } = self;
        let mut bytes = [0; Self::BYTES];
        bytes[..4].copy_from_slice(&x.to_le_bytes());
        bytes[4..8].copy_from_slice(&y.to_le_bytes());
        bytes[8..16].copy_from_slice(&updates.to_le_bytes());
        bytes[16..].copy_from_slice(&touched_at.to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let word = |at: usize| bytes[at..].first_chunk().copied().unwrap_or_default();
        let long = |at: usize| bytes[at..].first_chunk().copied().unwrap_or_default();
        Self {
            index: [i32::from_le_bytes(word(0)), i32::from_le_bytes(word(4))],
            updates: u64::from_le_bytes(long(8)),
            touched_at: u64::from_le_bytes(long(16)),
        }
    }
}

/// The tiles in these bytes; `None` if the last one is cut.
pub fn tile_versions(bytes: &[u8]) -> Option<impl ExactSizeIterator<Item = TileVersion>> {
    let (tiles, rest) = bytes.as_chunks::<{ TileVersion::BYTES }>();
    rest.is_empty().then(|| tiles.iter().map(TileVersion::from_bytes))
}

/// Bytes of a tile's index.
pub const INDEX_BYTES: usize = 8;

/// A tile's index in bytes.
#[must_use]
pub fn index_bytes(index: &TileIndex<2>) -> [u8; INDEX_BYTES] {
    let [[a, b, c, d], [e, f, g, h]] = index.map(i32::to_le_bytes);
    [a, b, c, d, e, f, g, h]
}

/// The indices in these bytes; `None` if the last one is cut.
pub fn indices(bytes: &[u8]) -> Option<impl ExactSizeIterator<Item = TileIndex<2>>> {
    let (indices, rest) = bytes.as_chunks::<INDEX_BYTES>();
    let index = |[a, b, c, d, e, f, g, h]: &[u8; INDEX_BYTES]| {
        [i32::from_le_bytes([*a, *b, *c, *d]), i32::from_le_bytes([*e, *f, *g, *h])]
    };
    rest.is_empty().then(|| indices.iter().map(index))
}

/// Writes counts and their names: of each the name's length in one byte, the name, the count. Answers the bytes written;
/// `None` if there is no room for all, or a name is longer than 255 bytes.
pub fn write_named<'n>(counts: impl IntoIterator<Item = (&'n str, u64)>, bytes: &mut [u8]) -> Option<usize> {
    let mut written = 0;
    for (name, count) in counts {
        let length = [u8::try_from(name.len()).ok()?];
        for part in [&length, name.as_bytes(), &count.to_le_bytes()] {
            bytes.get_mut(written..written + part.len())?.copy_from_slice(part);
            written += part.len();
        }
    }
    Some(written)
}

/// The counts and their names, see [`write_named`], up to the first that cannot be read.
pub fn named(mut bytes: &[u8]) -> impl Iterator<Item = Result<(&str, u64), NotNamed>> {
    core::iter::from_fn(move || {
        if bytes.is_empty() {
            return None;
        }
        let first = first_named(bytes);
        bytes = first.map_or(&[], |(_, rest)| rest);
        Some(first.map(|(named, _)| named).ok_or(NotNamed))
    })
}

fn first_named(bytes: &[u8]) -> Option<((&str, u64), &[u8])> {
    let (length, rest) = bytes.split_first()?;
    let (name, rest) = rest.split_at_checked(usize::from(*length))?;
    let (count, rest) = rest.split_first_chunk()?;
    Some(((str::from_utf8(name).ok()?, u64::from_le_bytes(*count)), rest))
}

/// Bytes that are not a count and its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotNamed;
