use rand::Rng;

use super::super::{Failed, kernel::SquaredExponential};
use super::laplace::Laplace;

/// What a part of the plane is known by: a uniform sample of the points in and around it, and the classifier of all of them.
#[derive(Default)]
pub(super) struct Region {
    points_m: Vec<[f64; 2]>,
    occupied: Vec<bool>,
    /// Where the next fit begins: `a` of each point, 0 of a new one.
    start: Vec<f64>,
    seen: u64,
    fit: Option<Laplace>,
    changed: bool,
}

impl Region {
    /// Vitter's algorithm R.
    pub(super) fn offer(&mut self, point_m: [f64; 2], occupied: bool, room: usize, rng: &mut impl Rng) {
        self.seen += 1;
        if self.points_m.len() < room {
            self.points_m.push(point_m);
            self.occupied.push(occupied);
            self.start.push(0.0);
        } else if let Some(slot) = usize::try_from(rng.random_range(0..self.seen)).ok().filter(|slot| *slot < room) {
            self.points_m[slot] = point_m;
            self.occupied[slot] = occupied;
            self.start[slot] = 0.0;
        } else {
            return;
        }
        self.changed = true;
    }

    /// Fits again if its points are others than at the last time, and says so.
    pub(super) fn refit(&mut self, kernel: &SquaredExponential) -> Result<bool, Failed> {
        if !self.changed {
            return Ok(false);
        }
        let fit = Laplace::fit(kernel, &self.points_m, &self.occupied, self.start.clone())?;
        self.start.clone_from(&fit.gradient);
        self.fit = Some(fit);
        self.changed = false;
        Ok(true)
    }

    #[cfg(test)]
    pub(super) fn points_m(&self) -> &[[f64; 2]] {
        &self.points_m
    }

    /// Mean and variance of the log-odds at each point.
    pub(super) fn moments(&self, kernel: &SquaredExponential, asked_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
        match &self.fit {
            Some(fit) => fit.moments(kernel, &self.points_m, asked_m),
            None => vec![[0.0, kernel.variance]; asked_m.len()],
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let points = size_of_val(&self.points_m[..]) + size_of_val(&self.occupied[..]) + size_of_val(&self.start[..]);
        points + self.fit.as_ref().map_or(0, Laplace::memory_bytes)
    }
}
