//! A uniform sample of all that is offered, in bounded memory.

/// Vitter's algorithm R, apart from the sample itself, which may be any number of lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reservoir {
    seen: u64,
}

impl Reservoir {
    /// How many were offered.
    #[must_use]
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// The place of the next one in a sample of at most `room`, behind all others or instead of one; `None` if it is not part
    /// of the sample. `draw` draws a number below the one it is given, and is asked only when there is no room left.
    pub fn offer(&mut self, room: usize, draw: impl FnOnce(u64) -> u64) -> Option<usize> {
        self.seen += 1;
        let place = if self.seen <= room as u64 { self.seen - 1 } else { draw(self.seen) };
        usize::try_from(place).ok().filter(|place| *place < room)
    }
}

/// Puts a value in its place in a list, or behind it.
pub fn put<T>(list: &mut Vec<T>, place: usize, value: T) {
    match list.get_mut(place) {
        Some(slot) => *slot = value,
        None => list.push(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn everything_is_kept_equally_often() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut kept = [0; 20];
        for _ in 0..4_000 {
            let (mut reservoir, mut sample) = (Reservoir::default(), Vec::new());
            for item in 0..kept.len() {
                if let Some(place) = reservoir.offer(5, |seen| rng.random_range(0..seen)) {
                    put(&mut sample, place, item);
                }
            }
            assert_eq!((sample.len(), reservoir.seen()), (5, 20));
            sample.into_iter().for_each(|item| kept[item] += 1);
        }
        // 4000 throws at 1/4: 1000, with a standard deviation of 27.
        assert!(kept.iter().all(|count| (860..1_140).contains(count)), "{kept:?}");
    }
}
