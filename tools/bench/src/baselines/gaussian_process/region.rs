use rand::Rng;

use super::super::{Failed, kernel::SquaredExponential};
use super::laplace::Laplace;
use crate::reservoir::{Reservoir, put};

/// What a part of the plane is known by: a uniform sample of the points in and around it, and the classifier of all of them.
#[derive(Default)]
pub(super) struct Region {
    points_m: Vec<[f64; 2]>,
    occupied: Vec<bool>,
    /// Where the next fit begins: `a` of each point, 0 of a new one.
    start: Vec<f64>,
    reservoir: Reservoir,
    fit: Option<Laplace>,
    changed: bool,
}

impl Region {
    /// Takes the point into the sample, perhaps.
    pub(super) fn offer(&mut self, point_m: [f64; 2], occupied: bool, room: usize, rng: &mut impl Rng) {
        let Some(place) = self.reservoir.offer(room, |seen| rng.random_range(0..seen)) else { return };
        put(&mut self.points_m, place, point_m);
        put(&mut self.occupied, place, occupied);
        put(&mut self.start, place, 0.0);
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
