//! Whether learned supports lie along walls, judged by the hits near them alone.

use std::{collections::BTreeMap, f64::consts::PI};

use bhm_core::{
    beam::{BeamLimits, Reading},
    lattice::{Lattice, offsets},
    support::AnySupport,
};
use bhm_host::{ScanRecord, supports::LearnedSupports};
use serde::Serialize;

/// Fewer hits say little about a direction.
const MANY_HITS: f64 = 50.0;

/// Hits that spread this much more along one direction than across are a straight wall: `(λ₁ − λ₂) / (λ₁ + λ₂)`.
const STRAIGHT: f64 = 0.9;

/// A wall that passes a node no further away, in spacings, runs through it.
const THROUGH: f64 = 0.25;

/// How supports lie with respect to the walls near them.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Alignment {
    /// Gaussians with many hits within one spacing of their node.
    supports: usize,
    /// Of them, mean |cos| of the angle between the longer axis and the direction in which the hits spread most, weighted by
    /// how elongated both are: neither a round support nor a corner has a direction.
    weighted_cos: Option<f64>,
    /// Those at straight walls that run through the node.
    through: Part,
    /// Those at straight walls beside it. A support's mean stays at its node: to cover a wall beside it, it grows across.
    beside: Part,
    /// What supports in random directions would give: the mean |cos| of a uniform angle.
    random_cos: f64,
}

/// Some of the supports, each counting once.
#[derive(Clone, Copy, Debug, Serialize)]
struct Part {
    supports: usize,
    cos: Option<f64>,
}

/// Compares the table's Gaussians with the hits of these scans.
pub(super) fn alignment(scans: &[ScanRecord], range_max_m: f32, supports: &LearnedSupports) -> Alignment {
    let spacing_m = supports.spacing_m();
    let hits = Hits::of(scans, range_max_m, f64::from(spacing_m));
    let lattice = Lattice { origin_m: supports.origin_m().into(), spacing_m, stencil: 1 };
    let window = supports.window();
    let [mut weighted, mut through, mut beside] = [Mean::default(), Mean::default(), Mean::default()];
    for (offset, support) in offsets(window.width).zip(supports.supports()) {
        let AnySupport::GaussianSupport(gaussian) = support else { continue };
        let s = gaussian.covariance_m2();
        let own = Direction::of([s[(0, 0)], s[(0, 1)], s[(1, 1)]].map(f64::from));
        let node = [0, 1].map(|axis| window.first[axis] + offset[axis] as i32);
        let centre: [f32; 2] = lattice.position_m(&node).into();
        let Some(wall) = hits.wall(centre.map(f64::from)) else { continue };
        let cos = (own.angle_rad - wall.direction.angle_rad).cos().abs();
        weighted.add(cos, own.elongation * wall.direction.elongation);
        if wall.direction.elongation > STRAIGHT {
            let runs_through = wall.distance_m <= THROUGH * f64::from(spacing_m);
            (if runs_through { &mut through } else { &mut beside }).add(cos, 1.0);
        }
    }
    Alignment {
        supports: weighted.count,
        weighted_cos: weighted.value(),
        through: through.part(),
        beside: beside.part(),
        random_cos: 2.0 / PI,
    }
}

impl Alignment {
    pub(super) fn text(&self) -> String {
        let Self { through, beside, .. } = self;
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        crate::text::table(&[
            ("Gaussians near walls", format!("{}, with {MANY_HITS} hits and more within one spacing", self.supports)),
            ("mean |cos| to the wall", format!("{}, weighted by elongation", number(self.weighted_cos))),
            ("", format!("{}, the {} at straight walls through them", number(through.cos), through.supports)),
            ("", format!("{}, the {} at straight walls beside them", number(beside.cos), beside.supports)),
            ("", format!("{:.3}, were directions random", self.random_cos)),
        ])
    }
}

/// Which way something two-dimensional extends, and how clearly.
struct Direction {
    angle_rad: f64,
    elongation: f64,
}

impl Direction {
    /// Of a covariance's entries xx, xy, yy.
    fn of([xx, xy, yy]: [f64; 3]) -> Self {
        let radius = (0.5 * (xx - yy)).hypot(xy);
        let middle = 0.5 * (xx + yy);
        let elongation = if middle > 0.0 { radius / middle } else { 0.0 };
        Self { angle_rad: 0.5 * (2.0 * xy).atan2(xx - yy), elongation }
    }
}

/// What the hits near a place look like.
struct Wall {
    direction: Direction,
    /// From the place to the line through the middle of the hits.
    distance_m: f64,
}

/// Hits, sorted into square cells as wide as the radius in which they are looked for.
struct Hits {
    radius_m: f64,
    cells: BTreeMap<[i64; 2], Vec<[f64; 2]>>,
}

impl Hits {
    fn of(scans: &[ScanRecord], range_max_m: f32, radius_m: f64) -> Self {
        let mut hits = Self { radius_m, cells: BTreeMap::new() };
        for scan in scans {
            let limits = BeamLimits { range_max_m, no_return_free_m: 0.0 };
            for ray in scan.as_scan().rays(&limits) {
                let Reading::Hit(range_m) = ray.reading else { continue };
                let hit = <[f32; 2]>::from(ray.at(range_m)).map(f64::from);
                hits.cells.entry(hits.cell(hit)).or_default().push(hit);
            }
        }
        hits
    }

    fn cell(&self, at: [f64; 2]) -> [i64; 2] {
        at.map(|metres| (metres / self.radius_m).floor() as i64)
    }

    /// Along what the hits around a place spread most, about their own mean; `None` if they are not many.
    fn wall(&self, around: [f64; 2]) -> Option<Wall> {
        let [x, y] = self.cell(around);
        let cells = offsets([3, 3]).filter_map(|[i, j]| self.cells.get(&[x + i as i64 - 1, y + j as i64 - 1]));
        let (mut count, mut sum, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
        for hit in cells.flatten() {
            let [dx, dy] = [hit[0] - around[0], hit[1] - around[1]];
            if dx.hypot(dy) <= self.radius_m {
                count += 1.0;
                sum = [sum[0] + dx, sum[1] + dy];
                squares = [squares[0] + dx * dx, squares[1] + dx * dy, squares[2] + dy * dy];
            }
        }
        if count < MANY_HITS {
            return None;
        }
        let [dx, dy] = sum.map(|sum| sum / count);
        let means = [dx * dx, dx * dy, dy * dy];
        let direction = Direction::of([0, 1, 2].map(|entry| squares[entry] / count - means[entry]));
        let (sin, cos) = direction.angle_rad.sin_cos();
        Some(Wall { direction, distance_m: (dy * cos - dx * sin).abs() })
    }
}

#[derive(Default)]
struct Mean {
    count: usize,
    sum: f64,
    weight: f64,
}

impl Mean {
    fn add(&mut self, value: f64, weight: f64) {
        self.count += 1;
        self.sum += weight * value;
        self.weight += weight;
    }

    fn value(&self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.sum / self.weight)
    }

    fn part(&self) -> Part {
        Part { supports: self.count, cos: self.value() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{geometry::Pose, lattice::Window, scan::ScanHeader};

    /// One scan that meets a wall at 30° through the origin, seen from (2, −2).
    fn wall() -> Vec<ScanRecord> {
        let (sin, cos) = 30.0_f32.to_radians().sin_cos();
        let hits = (0..200_u16).map(|i| (f32::from(i) - 99.5) * 0.01).map(|along| [along * cos, along * sin]);
        hits.map(|[x, y]| {
            let [dx, dy] = [x - 2.0, y + 2.0];
            ScanRecord {
                header: ScanHeader {
                    stamp_ns: 1,
                    map_from_sensor: Pose::new(2.0, -2.0, 0.0),
                    angle_min_rad: dy.atan2(dx),
                    angle_increment_rad: 0.0,
                    range_max_m: 30.0,
                    ..ScanHeader::default()
                },
                ranges_m: vec![dx.hypot(dy), f32::NAN, 30.0],
            }
        })
        .collect()
    }

    /// A Gaussian at the origin, three times as long as wide, turned by this angle; and a point beside it.
    fn turned(degrees: f32) -> LearnedSupports {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let [long, wide] = [0.09, 0.01];
        let xy = (long - wide) * sin * cos;
        let numbers = [long * cos * cos + wide * sin * sin, xy, long * sin * sin + wide * cos * cos, 0.0, 0.0, 0.0];
        let gaussian = AnySupport::with_numbers("gaussian", &numbers).unwrap();
        let window = Window { first: [0, 0], width: [1, 2] };
        LearnedSupports::new([0.0; 2], 1.0, window, vec![gaussian, AnySupport::default()], None).unwrap()
    }

    #[test]
    fn the_angle_to_a_wall_is_found() {
        for (degrees, expected) in [(30.0, 1.0), (210.0, 1.0), (120.0, 0.0), (75.0, 0.5_f64.sqrt()), (-30.0, 0.5)] {
            let found = alignment(&wall(), 40.0, &turned(degrees));
            assert_eq!((found.supports, found.through.supports, found.beside.supports), (1, 1, 0), "{found:?}");
            for cos in [found.weighted_cos, found.through.cos] {
                assert!((cos.unwrap() - expected).abs() < 1e-3, "{degrees}: {found:?}");
            }
        }
    }

    #[test]
    fn few_hits_are_no_wall() {
        let few: Vec<ScanRecord> = wall().into_iter().step_by(5).collect();
        let found = alignment(&few, 40.0, &turned(30.0));
        assert_eq!((found.supports, found.weighted_cos), (0, None));
    }
}
