//! The occupancy grid of Moravec and Elfes in log-odds form: each cell adds what every scan says of it.
//!
//! A scan says of a cell at most one thing, and a hit counts before a miss, as OctoMap does it (`computeUpdate`): a beam that
//! grazes the cell in which its neighbour ended does not take back what the neighbour saw. Cells before the end of a ray get a
//! miss; the cell at its end gets a hit if there was one, else nothing. Scans whose origin is unknown have no rays; of those the
//! cells of labelled points get a hit or a miss by their label, in the same way.

use super::{Baseline, Entry, Failed, Prediction, Setup, Size, grid::Cells};
use crate::evaluation::TrainingScan;

pub(super) const ENTRIES: &[Entry] = &[
    Entry {
        name: "log-odds-grid",
        summary: "occupancy grid in log-odds, rays traversed, clamped as OctoMap clamps",
        source: "Moravec and Elfes 1985, Elfes 1989; increments, clamps and one update per cell and scan of OctoMap (Hornung et \
                 al. 2013); traversal of Amanatides and Woo 1987. Planar, without the tree",
        size: Size::Metres(0.1),
        open: |setup| Ok(Box::new(LogOddsGrid::new(setup, OCTOMAP_CLAMPS)?)),
    },
    Entry {
        name: "log-odds-grid-unclamped",
        summary: "the same without clamps",
        source: "Moravec and Elfes 1985, Elfes 1989; increments and one update per cell and scan of OctoMap (Hornung et al. \
                 2013); traversal of Amanatides and Woo 1987. Planar, without the tree",
        size: Size::Metres(0.1),
        open: |setup| Ok(Box::new(LogOddsGrid::new(setup, [0.0, 1.0])?)),
    },
];

/// OctoMap's defaults, as probabilities.
const HIT: f32 = 0.7;
const MISS: f32 = 0.4;
const OCTOMAP_CLAMPS: [f32; 2] = [0.1192, 0.971];

fn log_odds(probability: f32) -> f32 {
    (probability / (1.0 - probability)).ln()
}

/// What the present scan says of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Evidence {
    #[default]
    Nothing,
    Miss,
    Hit,
}

struct LogOddsGrid {
    cells: Cells,
    /// 0 is the prior, one half.
    log_odds: Vec<f32>,
    /// Least and greatest log-odds.
    clamps: [f32; 2],
    /// By cell; nothing between scans.
    evidence: Vec<Evidence>,
    /// The cells of which the present scan says something.
    touched: Vec<usize>,
}

impl LogOddsGrid {
    fn new(setup: &Setup, clamps: [f32; 2]) -> Result<Self, Failed> {
        let cells = Cells::over(setup)?;
        Ok(Self {
            cells,
            log_odds: vec![0.0; cells.count()],
            clamps: clamps.map(log_odds),
            evidence: vec![Evidence::Nothing; cells.count()],
            touched: Vec::new(),
        })
    }

    fn observe(&mut self, slot: Option<usize>, what: Evidence) {
        let Some(slot) = slot else { return };
        match (self.evidence[slot], what) {
            (Evidence::Nothing, _) => {
                self.evidence[slot] = what;
                self.touched.push(slot);
            }
            (Evidence::Miss, Evidence::Hit) => self.evidence[slot] = what,
            _ => {}
        }
    }

    fn commit(&mut self) {
        let [least, greatest] = self.clamps;
        for slot in self.touched.drain(..) {
            let change = log_odds(if self.evidence[slot] == Evidence::Hit { HIT } else { MISS });
            self.log_odds[slot] = (self.log_odds[slot] + change).clamp(least, greatest);
            self.evidence[slot] = Evidence::Nothing;
        }
    }
}

impl Baseline for LogOddsGrid {
    fn description(&self) -> String {
        format!("{} m cells", self.cells.cell_m)
    }

    fn integrate(&mut self, shown: &TrainingScan) -> Result<(), Failed> {
        if let Some(origin_m) = shown.origin_m() {
            for ray in shown.rays() {
                let end = self.cells.column_and_row(ray.end_m);
                let cells = self.cells;
                cells.traverse(origin_m, ray.end_m, |cell| {
                    if cell != end {
                        self.observe(cells.slot(cell), Evidence::Miss);
                    }
                });
                if ray.hit {
                    self.observe(cells.slot(end), Evidence::Hit);
                }
            }
        } else {
            for (point_m, occupied) in shown.points() {
                self.observe(self.cells.slot_at(point_m), if occupied { Evidence::Hit } else { Evidence::Miss });
            }
        }
        self.commit();
        Ok(())
    }

    fn predict(&mut self, points_m: &[[f32; 2]]) -> Vec<Prediction> {
        let logit = |point_m: &[f32; 2]| self.cells.slot_at(*point_m).map_or(0.0, |slot| self.log_odds[slot]);
        points_m.iter().map(|point_m| Prediction { logit: f64::from(logit(point_m)), variance: None }).collect()
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(&self.log_odds[..]) + size_of_val(&self.evidence[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::{of_points, ray, setup};

    fn log_odds_at(grid: &mut LogOddsGrid, point_m: [f32; 2]) -> f64 {
        grid.predict(&[point_m])[0].logit
    }

    fn grid(clamps: [f32; 2]) -> LogOddsGrid {
        LogOddsGrid::new(&setup([[-2.0, -2.0], [8.0, 8.0]], 1.0), clamps).unwrap()
    }

    /// By hand: ln(0.7/0.3) = 0.8472979, ln(0.4/0.6) = −0.4054651; each scan counts once.
    #[test]
    fn a_scan_adds_once_to_a_cell_and_a_hit_counts_before_a_miss() {
        // The longer ray passes through the cell in which the shorter one ends, and both begin in the same cell.
        let rays = [ray([2.5, 0.5]), ray([4.5, 0.5])];
        let expected = [-0.405_465_1, -0.405_465_1, 0.847_297_9, -0.405_465_1, 0.847_297_9, 0.0];
        for rays in [rays, [rays[1], rays[0]]] {
            let mut grid = grid([0.0, 1.0]);
            for scans in 1..=3 {
                grid.integrate(&of_points(0, &rays, Some([0.5, 0.5]))).unwrap();
                for (x, expected) in expected.iter().enumerate() {
                    let found = log_odds_at(&mut grid, [x as f32 + 0.5, 0.5]);
                    assert!((found - f64::from(scans) * expected).abs() < 1e-5, "cell {x} after {scans}: {found}");
                }
            }
        }
    }

    /// Hornung et al. 2013, section 3.3: log-odds between −2 and 3.5.
    #[test]
    fn the_clamps_are_octomaps() {
        let mut grid = grid(OCTOMAP_CLAMPS);
        for scan in 0..20 {
            grid.integrate(&of_points(scan, &[ray([4.5, 0.5])], Some([0.5, 0.5]))).unwrap();
        }
        let (free, hit) = (log_odds_at(&mut grid, [2.5, 0.5]), log_odds_at(&mut grid, [4.5, 0.5]));
        assert!((free + 2.0).abs() < 1e-3 && (hit - 3.5).abs() < 0.02, "{free}, {hit}");
        // 1 hit, then 9 misses: what a clamp is for.
        for scan in 0..9 {
            grid.integrate(&of_points(scan, &[ray([6.5, 0.5])], Some([0.5, 0.5]))).unwrap();
        }
        assert!(log_odds_at(&mut grid, [4.5, 0.5]) < 0.0);
    }

    #[test]
    fn without_an_origin_points_are_learned_by_label() {
        let mut grid = grid([0.0, 1.0]);
        let points = [([1.5, 1.5], true), ([1.6, 1.6], false), ([3.5, 1.5], false), ([3.6, 1.5], false)];
        grid.integrate(&of_points(0, &points, None)).unwrap();
        let found = [[1.5, 1.5], [2.5, 1.5], [3.5, 1.5]].map(|at| log_odds_at(&mut grid, at));
        for (found, expected) in found.iter().zip([0.847_297_9, 0.0, -0.405_465_1]) {
            assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        }
    }

    #[test]
    fn after_a_scan_as_large_nothing_is_allocated_and_nothing_left_over() {
        let mut grid = grid(OCTOMAP_CLAMPS);
        let shown = of_points(0, &[ray([7.5, 6.5]), ray([-1.5, 3.5]), ray([0.5, 0.5])], Some([0.5, 0.5]));
        grid.integrate(&shown).unwrap();
        let before = (grid.touched.as_ptr(), grid.touched.capacity());
        grid.integrate(&shown).unwrap();
        assert_eq!(before, (grid.touched.as_ptr(), grid.touched.capacity()));
        assert!(grid.evidence.iter().all(|evidence| *evidence == Evidence::Nothing));
    }

    #[test]
    fn rays_of_any_length_are_harmless() {
        let mut grid = grid(OCTOMAP_CLAMPS);
        let far = [f32::MAX, -f32::MAX];
        let rays = [ray(far), ray([1e9, 1e9]), ray([-1e9, 0.5]), ray([0.5, 0.5]), ray([f32::MIN_POSITIVE, 8.0])];
        for origin_m in [[0.5, 0.5], [0.0, 0.0], [1e9, 0.5], [-f32::MAX, f32::MAX]] {
            grid.integrate(&of_points(0, &rays, Some(origin_m))).unwrap();
        }
        assert_eq!(log_odds_at(&mut grid, far), 0.0);
    }
}
