use rand::Rng;

use crate::reservoir::{Reservoir, put};

/// Points that are kept at most; beyond, a uniform sample of all.
const MOST_KEPT: usize = 1 << 20;

/// What was learned before, to be learned again.
#[derive(Default)]
pub(super) struct History {
    kept: Vec<([f32; 2], bool)>,
    reservoir: Reservoir,
}

impl History {
    pub(super) fn seen(&self) -> u64 {
        self.reservoir.seen()
    }

    pub(super) fn add(&mut self, point: ([f32; 2], bool), rng: &mut impl Rng) {
        if let Some(place) = self.reservoir.offer(MOST_KEPT, |seen| rng.random_range(0..seen)) {
            put(&mut self.kept, place, point);
        }
    }

    /// Draws with replacement; nothing if nothing is kept.
    pub(super) fn draw(&self, count: usize, rng: &mut impl Rng) -> Vec<([f32; 2], bool)> {
        let count = if self.kept.is_empty() { 0 } else { count };
        (0..count).map(|_| self.kept[rng.random_range(0..self.kept.len())]).collect()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.kept[..])
    }
}
