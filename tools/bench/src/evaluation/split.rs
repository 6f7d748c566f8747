use std::fmt;

use bhm_core::beam::{BeamLimits, Ray, Reading};
use bhm_host::{ScanRecord, dataset::LabelledPoints};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::TestPoints;

/// Free points of a beam that are asked for.
const FREE_POINTS: usize = 2;

/// Length before a hit in which no free point is asked for, metres: there, range noise decides the label.
const GAP_M: f32 = 0.1;

/// What is held out as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Held {
    /// Beams, each with every point of it.
    Beams,
    /// Points, of beams whose other points are learned.
    Points,
    /// Scans.
    Scans,
}

impl Held {
    /// Everything that can be held out.
    pub const ALL: [Self; 3] = [Self::Beams, Self::Points, Self::Scans];

    /// As the command line and tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Beams => "beams",
            Self::Points => "points",
            Self::Scans => "scans",
        }
    }

    /// What is held out, and whether something of it is learned all the same.
    #[must_use]
    pub fn summary(self) -> &'static str {
        match self {
            Self::Beams => "Beams, each with every point of it",
            Self::Points => "Points, of beams whose other points are learned",
            Self::Scans => "Scans",
        }
    }
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What a method learns from.
#[derive(Clone, Debug, PartialEq)]
pub enum Training {
    /// Scans, held-out beams as NaN (see [`BeamSplit`]).
    Scans(Vec<ScanRecord>),
    /// Labelled points, scan by scan.
    Points(Vec<LabelledPoints>),
}

/// Scans of which some beams are held out.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamSplit {
    /// Learned, with the ranges of held-out beams replaced by NaN: every mapper drops such a beam, and bearings stay right.
    pub training: Vec<ScanRecord>,
    /// Asked: points of the held-out beams.
    pub test: TestPoints,
    /// How many beams were replaced.
    pub held: usize,
    /// Of how many with a return.
    pub of: usize,
}

/// A log, divided.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// What is learned from.
    pub training: Training,
    /// The position in the log of each scan that is learned from.
    pub positions: Vec<u64>,
    /// What is asked.
    pub test: TestPoints,
    /// How many beams, points or scans were held out.
    pub held: usize,
    /// Of how many.
    pub of: usize,
}

/// Holds out a fraction of a log, each beam, point or scan by its own throw of seeded dice.
///
/// A beam is asked for its hit and for two free points, uniform up to 0.1 m before the hit. Only beams with a return are
/// held out or asked, since of others the truth is not known; those others are learned like any scan.
#[must_use]
pub fn hold_out(scans: &[ScanRecord], held: Held, fraction: f64, seed: u64) -> Split {
    let mut dice = Dice { rng: ChaCha8Rng::seed_from_u64(seed), fraction, held: 0, of: 0 };
    let mut test = TestPoints::default();
    let mut positions: Vec<u64> = (0..scans.len() as u64).collect();
    let numbered = || scans.iter().zip(0..);
    let training = match held {
        Held::Beams => {
            let BeamSplit { training, test, held, of } = hold_out_beams(scans, fraction, seed);
            return Split { training: Training::Scans(training), positions, test, held, of };
        }
        Held::Points => {
            Training::Points(numbered().map(|(scan, at)| points_held_out(scan, at, &mut dice, &mut test)).collect())
        }
        Held::Scans => {
            positions.retain(|at| {
                let scan = &scans[*at as usize];
                let held = dice.throw();
                if held {
                    returns(scan).for_each(|(ray, range_m)| dice.ask(&ray, range_m, |p, o| test.push(*at, p, o)));
                }
                !held
            });
            Training::Scans(positions.iter().map(|at| scans[*at as usize].clone()).collect())
        }
    };
    Split { training, positions, test, held: dice.held, of: dice.of }
}

/// Holds out a fraction of the beams of a log, as [`hold_out`] does.
#[must_use]
pub fn hold_out_beams(scans: &[ScanRecord], fraction: f64, seed: u64) -> BeamSplit {
    let mut dice = Dice { rng: ChaCha8Rng::seed_from_u64(seed), fraction, held: 0, of: 0 };
    let mut test = TestPoints::default();
    let training = scans.iter().zip(0..).map(|(scan, at)| beams_held_out(scan, at, &mut dice, &mut test)).collect();
    BeamSplit { training, test, held: dice.held, of: dice.of }
}

fn beams_held_out(scan: &ScanRecord, at: u64, dice: &mut Dice, test: &mut TestPoints) -> ScanRecord {
    let mut kept = scan.clone();
    for (ray, range_m) in returns(scan) {
        if dice.throw() {
            dice.ask(&ray, range_m, |point, occupied| test.push(at, point, occupied));
            kept.ranges_m[ray.number] = f32::NAN;
        }
    }
    kept
}

fn points_held_out(scan: &ScanRecord, number: u64, dice: &mut Dice, test: &mut TestPoints) -> LabelledPoints {
    let mut all = TestPoints::default();
    returns(scan).for_each(|(ray, range_m)| dice.ask(&ray, range_m, |p, o| all.push(number, p, o)));
    let mut kept = LabelledPoints { scan: number, ..LabelledPoints::default() };
    for (point_m, occupied) in all.points_m.into_iter().zip(all.occupied) {
        if dice.throw() {
            test.push(number, point_m, occupied);
        } else {
            kept.points_m.push(point_m);
            kept.occupied.push(occupied);
        }
    }
    kept
}

/// The rays of a scan that returned, and their ranges.
fn returns(scan: &ScanRecord) -> impl Iterator<Item = (Ray<2>, f32)> {
    const EVERY_RANGE: BeamLimits = BeamLimits { range_max_m: f32::INFINITY, no_return_free_m: 0.0 };
    scan.as_scan().rays(&EVERY_RANGE).filter_map(|ray| match ray.reading {
        Reading::Hit(range_m) => Some((ray, range_m)),
        _ => None,
    })
}

struct Dice {
    rng: ChaCha8Rng,
    fraction: f64,
    held: usize,
    of: usize,
}

impl Dice {
    /// Whether the next of them is held out.
    fn throw(&mut self) -> bool {
        self.of += 1;
        let held = self.rng.random_bool(self.fraction);
        self.held += usize::from(held);
        held
    }

    /// The points of a beam that are asked for.
    fn ask(&mut self, ray: &Ray<2>, range_m: f32, mut push: impl FnMut([f32; 2], bool)) {
        let at = |along_m: f32| ray.at(along_m).into();
        if range_m > GAP_M {
            for _ in 0..FREE_POINTS {
                push(at(self.rng.random::<f32>() * (range_m - GAP_M)), false);
            }
        }
        push(at(range_m), true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::{geometry::Pose, scan::ScanHeader};

    fn log() -> Vec<ScanRecord> {
        let ranges_m = [2.0, f32::NAN, -1.0, 0.05, 81.0, 3.5, f32::INFINITY, 0.001];
        (0..400)
            .map(|i| ScanRecord {
                header: ScanHeader {
                    stamp_ns: i,
                    map_from_sensor: Pose::new(i as f32, -1.0, 0.3),
                    angle_min_rad: -1.0,
                    angle_increment_rad: 0.25,
                    range_min_m: 0.01,
                    range_max_m: 80.0,
                    ..ScanHeader::default()
                },
                ranges_m: ranges_m.to_vec(),
            })
            .collect()
    }

    /// The points of a scan's returning beams lie on them: hits at their ends, two free points each before that.
    fn assert_on_beams(test: &TestPoints) {
        for (&[x, y], &occupied) in test.points_m.iter().zip(&test.occupied) {
            // The robot drives in steps of 1 m along x; no beam reaches back, so some scan's beam must fit.
            let fits = (0..400).any(|i| {
                [(0, 2.0), (3, 0.05), (5, 3.5)].into_iter().any(|(beam, range)| {
                    let bearing = 0.3 - 1.0 + 0.25 * f64::from(beam);
                    let [dx, dy] = [f64::from(x) - f64::from(i), f64::from(y) + 1.0];
                    let along = dx * bearing.cos() + dy * bearing.sin();
                    let across = dy * bearing.cos() - dx * bearing.sin();
                    let right =
                        if occupied { (along - range).abs() < 1e-4 } else { (-1e-4..range - 0.0999).contains(&along) };
                    across.abs() < 1e-4 && right
                })
            });
            assert!(fits, "{x} {y} {occupied}");
        }
    }

    #[test]
    fn whole_beams_are_held_out_with_all_their_points() {
        let log = log();
        let split = hold_out(&log, Held::Beams, 0.25, 7);
        assert_eq!(split.of, 400 * 3);
        assert!((250..350).contains(&split.held), "{}", split.held);
        let Training::Scans(training) = &split.training else { panic!("scans are learned") };
        let mut removed = 0;
        for (before, after) in log.iter().zip(training) {
            for (&before, &after) in before.ranges_m.iter().zip(&after.ranges_m) {
                removed += usize::from(after.is_nan() && !before.is_nan());
                assert!(after.is_nan() || after == before);
            }
        }
        assert_eq!(removed, split.held);
        assert_eq!(split.test.occupied.iter().filter(|occupied| **occupied).count(), split.held);
        assert_on_beams(&split.test);
        assert_eq!(hold_out(&log, Held::Beams, 0.25, 7).test, split.test);
        assert_ne!(hold_out(&log, Held::Beams, 0.25, 8).test, split.test);
    }

    #[test]
    fn points_are_either_learned_or_asked() {
        let split = hold_out(&log(), Held::Points, 0.1, 7);
        let Training::Points(training) = &split.training else { panic!("points are learned") };
        let learned: usize = training.iter().map(|scan| scan.points_m.len()).sum();
        // Two beams with two free points, one too short for any, three hits.
        assert_eq!((learned + split.test.points_m.len(), split.of), (400 * 7, 400 * 7));
        assert_eq!(split.test.points_m.len(), split.held);
        assert_on_beams(&split.test);
    }

    #[test]
    fn whole_scans_are_held_out() {
        let log = log();
        let split = hold_out(&log, Held::Scans, 0.5, 7);
        let Training::Scans(training) = &split.training else { panic!("scans are learned") };
        assert_eq!((training.len() + split.held, split.of), (400, 400));
        assert_eq!(split.test.points_m.len(), 7 * split.held);
        assert_on_beams(&split.test);
    }
}
