use super::{Baseline, Entry, Failed, Prediction, Setup, Size, grid::Cells};
use crate::evaluation::Lesson;

pub(super) const ENTRIES: &[Entry] = &[Entry {
    name: "counting-grid",
    summary: "occupancy grid that counts hits and free points per cell",
    source: "the reflection-probability (\"counting\") model as a Beta-Bernoulli posterior per cell, prior Beta(1/2, 1/2); \
             counts sampled points instead of traversed cells",
    size: Size::Metres(0.1),
    open: |setup| Ok(Box::new(CountingGrid::new(setup)?)),
}];

/// Pseudo-counts of either label: Jeffreys' prior.
const PRIOR: f32 = 0.5;

/// Points of either label are counted in each cell; a cell's probability is the mean of its Beta posterior
/// `(hits + ½) / (hits + free + 1)`.
struct CountingGrid {
    cells: Cells,
    /// Free points and hits.
    counts: Vec<[f32; 2]>,
}

impl CountingGrid {
    fn new(setup: &Setup) -> Result<Self, Failed> {
        let cells = Cells::over(setup)?;
        Ok(Self { cells, counts: vec![[0.0; 2]; cells.count()] })
    }
}

impl Baseline for CountingGrid {
    fn description(&self) -> String {
        format!("{} m cells", self.cells.cell_m)
    }

    fn integrate(&mut self, lesson: &Lesson) -> Result<(), Failed> {
        for (point_m, occupied) in lesson.points() {
            if let Some(slot) = self.cells.slot_at(point_m) {
                self.counts[slot][usize::from(occupied)] += 1.0;
            }
        }
        Ok(())
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let counts = |point_m: &[f32; 2]| self.cells.slot_at(*point_m).map_or([0.0; 2], |slot| self.counts[slot]);
        let logit = |[free, hits]: [f32; 2]| (f64::from(hits + PRIOR) / f64::from(free + PRIOR)).ln();
        points_m.iter().map(|point_m| Prediction { logit: logit(counts(point_m)), variance: None }).collect()
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(&self.counts[..])
    }
}
