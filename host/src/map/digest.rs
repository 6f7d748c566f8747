use std::fmt;

use bhm_core::{posterior::PosteriorView, tile::TileIndex};
use crc32fast::Hasher;

/// A checksum of what a map has learned; equal maps have equal digests, on every machine.
///
/// It covers what queries read: each tile's index, mean and covariance, bit for bit. It finds accidents, not forgeries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PosteriorDigest(pub u32);

impl fmt::Display for PosteriorDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:08x}", self.0)
    }
}

/// The digest of these tiles, which must come in ascending order of index: a mapper's, a file's, or those of a sample in
/// shared memory.
pub fn posterior_digest<'a, const M: usize, const B: usize>(
    tiles: impl IntoIterator<Item = (TileIndex<2>, PosteriorView<'a, M, B>)>,
) -> PosteriorDigest {
    let mut hasher = Hasher::new();
    let mut bytes = Vec::new();
    for (index, view) in tiles {
        let PosteriorView { mean, covariance, border_covariance, bias_covariance, bias_mean } = view;
        bytes.clear();
        bytes.extend(index.iter().flat_map(|i| i.to_le_bytes()));
        for numbers in [&mean[..], covariance.as_flattened(), border_covariance, &[bias_covariance, bias_mean]] {
            bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        }
        hasher.update(&bytes);
    }
    PosteriorDigest(hasher.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_counts_and_so_does_the_order() {
        let digest = |tiles: &[([i32; 2], [f32; 2])]| {
            let (covariance, border) = ([[1.0], [2.0]], [0.0; 2]);
            posterior_digest(tiles.iter().map(|(index, mean)| {
                let view = PosteriorView::<2, 1> {
                    mean,
                    covariance: &covariance,
                    border_covariance: &border,
                    bias_covariance: 1.0,
                    bias_mean: 0.0,
                };
                (*index, view)
            }))
        };
        let (a, b) = (([0, -1], [0.5, 0.0]), ([0, 1], [0.5, 0.25]));
        assert_eq!(digest(&[a, b]), digest(&[a, b]));
        let others =
            [vec![a], vec![b, a], vec![a, ([0, 1], [0.5, 0.25_f32.next_up()])], vec![([0, -1], [0.5, -0.0]), b]];
        for other in others {
            assert_ne!(digest(&other), digest(&[a, b]), "{other:?}");
        }
        assert_eq!(PosteriorDigest(0xab).to_string(), "000000ab");
    }
}
