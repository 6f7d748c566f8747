use crate::tile::TileIndex;

/// The set of tiles one scan touches, in ascending order, in lent memory.
#[derive(Debug)]
pub struct Touched<'m> {
    memory: &'m mut [TileIndex<2>],
    len: usize,
}

impl<'m> Touched<'m> {
    /// The empty set.
    pub fn new(memory: &'m mut [TileIndex<2>]) -> Self {
        Self { memory, len: 0 }
    }

    /// Adds a tile; `false` if it is not in the set and there is no room.
    #[inline]
    pub fn insert(&mut self, tile: TileIndex<2>) -> bool {
        let Err(at) = self.as_slice().binary_search(&tile) else { return true };
        if self.len == self.memory.len() {
            return false;
        }
        self.memory[self.len] = tile;
        self.len += 1;
        self.memory[at..self.len].rotate_right(1);
        true
    }

    /// The tiles.
    #[must_use]
    pub fn as_slice(&self) -> &[TileIndex<2>] {
        &self.memory[..self.len]
    }
}
