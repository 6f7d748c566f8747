use std::vec::Vec;

use bhm_core::geometry::Pose;

/// Where the robot was, in memory that is taken once: when it is full, every second pose goes, and from then on only every
/// second (then every fourth, …) is kept.
#[derive(Debug)]
pub(super) struct Path {
    poses: Vec<Pose>,
    capacity: usize,
    every: u64,
    seen: u64,
}

impl Path {
    /// Room for so many poses, at least two.
    pub(super) fn new(capacity: usize) -> Self {
        let capacity = capacity.max(2);
        Self { poses: Vec::with_capacity(capacity), capacity, every: 1, seen: 0 }
    }

    pub(super) fn push(&mut self, pose: Pose) {
        if self.seen.is_multiple_of(self.every) && self.poses.len() == self.capacity {
            let mut even = false;
            self.poses.retain(|_| {
                even = !even;
                even
            });
            self.every *= 2;
        }
        if self.seen.is_multiple_of(self.every) {
            self.poses.push(pose);
        }
        self.seen += 1;
    }

    pub(super) fn into_poses(self) -> Vec<Pose> {
        self.poses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_path_is_thinned_evenly_in_the_memory_it_began_with() {
        for capacity in [2, 3, 7, 8, 100] {
            for length in [0, 1, 2, 7, 8, 9, 100, 1_000, 12_345] {
                let mut path = Path::new(capacity);
                let allocated = path.poses.capacity();
                for step in 0..length {
                    path.push(Pose::new(step as f32, 0.0, 0.0));
                }
                assert_eq!(path.poses.capacity(), allocated);
                assert!(path.poses.len() <= capacity);
                assert!(path.poses.len() >= length.min(capacity / 2), "at least half is used");
                let every = path.every as f32;
                for (number, pose) in path.poses.iter().enumerate() {
                    assert_eq!(pose.x_m, number as f32 * every, "capacity {capacity}, length {length}");
                }
                // The end of the path is not cut off.
                assert!(length as f32 - path.poses.len() as f32 * every <= 0.0);
            }
        }
    }
}
