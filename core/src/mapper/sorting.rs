use crate::tile::TileIndex;

/// One observation in one tile, and the tile's next.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    observation: u32,
    next: u32,
}

impl Link {
    /// Room for a link.
    pub const VACANT: Self = Self { observation: 0, next: 0 };
}

/// One tile that a scan touches, and where the chain of its observations begins and ends.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TouchedTile<const D: usize> {
    index: TileIndex<D>,
    first: u32,
    last: u32,
}

impl<const D: usize> TouchedTile<D> {
    /// Room for a tile.
    pub const VACANT: Self = Self { index: [0; D], first: 0, last: 0 };
}

/// The observations of one scan sorted into tiles: tiles in ascending order, each with its observations in the order in which
/// they were inserted.
#[derive(Debug)]
pub(super) struct Sorting<'m, const D: usize> {
    tiles: &'m mut [TouchedTile<D>],
    links: &'m mut [Link],
    tiles_len: usize,
    links_len: usize,
    /// Where the last tile was found: neighbouring observations mostly share it.
    recent: usize,
}

impl<'m, const D: usize> Sorting<'m, D> {
    /// No observations.
    pub(super) fn new(tiles: &'m mut [TouchedTile<D>], links: &'m mut [Link]) -> Self {
        Self { tiles, links, tiles_len: 0, links_len: 0, recent: 0 }
    }

    /// Notes that an observation lies in a tile; `false` if there is no room for the tile or for the note.
    #[inline(always)]
    pub(super) fn insert(&mut self, index: TileIndex<D>, observation: usize) -> bool {
        let link = self.links_len as u32;
        if self.links_len == self.links.len() {
            return false;
        }
        let known = match self.tiles[..self.tiles_len].get(self.recent) {
            Some(recent) if recent.index == index => Ok(self.recent),
            _ => self.tiles[..self.tiles_len].binary_search_by(|tile| tile.index.cmp(&index)),
        };
        let at = match known {
            Ok(at) => {
                let tile = &mut self.tiles[at];
                self.links[tile.last as usize].next = link;
                tile.last = link;
                at
            }
            Err(_) if self.tiles_len == self.tiles.len() => return false,
            Err(at) => {
                self.tiles[self.tiles_len] = TouchedTile { index, first: link, last: link };
                self.tiles_len += 1;
                self.tiles[at..self.tiles_len].rotate_right(1);
                at
            }
        };
        self.recent = at;
        self.links[self.links_len] = Link { observation: observation as u32, next: link };
        self.links_len += 1;
        true
    }

    /// The tiles in ascending order, each with its observations.
    pub(super) fn tiles(&self) -> impl Iterator<Item = (&TileIndex<D>, impl Iterator<Item = usize>)> {
        let links = &self.links[..self.links_len];
        self.tiles[..self.tiles_len].iter().map(move |tile| {
            let mut next = Some(tile.first);
            let observations = core::iter::from_fn(move || {
                let link = links[next? as usize];
                // The last link refers to itself.
                next = (Some(link.next) != next).then_some(link.next);
                Some(link.observation as usize)
            });
            (&tile.index, observations)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{collections::BTreeMap, vec, vec::Vec};

    #[test]
    fn tiles_ascend_and_keep_the_order_of_their_observations() {
        let (mut tiles, mut links) = (vec![TouchedTile::VACANT; 20], vec![Link::VACANT; 500]);
        let mut sorting = Sorting::new(&mut tiles, &mut links);
        let mut naive: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        let mut state = 1_u32;
        for observation in 0..600 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let index = [(state >> 20) as i32 % 5 - 2, (state >> 26) as i32 % 6];
            let fits =
                naive.values().map(Vec::len).sum::<usize>() < 500 && (naive.len() < 20 || naive.contains_key(&index));
            assert_eq!(sorting.insert(index, observation), fits);
            if fits {
                naive.entry(index).or_default().push(observation);
            }
        }
        let sorted: Vec<_> = sorting.tiles().map(|(index, observations)| (*index, observations.collect())).collect();
        assert_eq!(sorted, naive.into_iter().collect::<Vec<(_, Vec<usize>)>>());
    }
}
