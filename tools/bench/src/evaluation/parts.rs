use bhm_core::scan::ScanHeader;
use bhm_host::ScanRecord;

use super::{Held, TestPoints, Training, hold_out};

/// A log in three parts that share no beam: what is learned, what decides between settings, and what judges the decision.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Learned while settings are chosen: the beams of neither other part.
    pub training: Vec<ScanRecord>,
    /// Asked while settings are chosen.
    pub validation: TestPoints,
    /// Learned for the final judgement: everything but the test part.
    pub training_and_validation: Vec<ScanRecord>,
    /// Asked once, when the choice has been made.
    pub test: TestPoints,
    /// Beams of the validation part, of the test part, and with a return in all.
    pub beams: [usize; 3],
}

/// Divides the beams of a log: `fraction` of those with a return, below one half, become the validation part and as many the
/// test part.
///
/// The test part is that of [`hold_out`] with the same fraction and seed, so that its scores can be compared.
#[must_use]
pub fn three_parts(scans: &[ScanRecord], fraction: f64, seed: u64) -> Parts {
    let outer = hold_out(scans, Held::Beams, fraction, seed);
    let training_and_validation = scans_of(outer.training);
    // Of what is left, the part that is `fraction` of the whole; other dice, or the throws would repeat.
    let inner =
        hold_out(&training_and_validation, Held::Beams, fraction / (1.0 - fraction), seed ^ 0x7661_6c69_6461_7465);
    Parts {
        training: scans_of(inner.training),
        validation: inner.test,
        training_and_validation,
        test: outer.test,
        beams: [inner.held, outer.held, outer.of],
    }
}

fn scans_of(training: Training) -> Vec<ScanRecord> {
    match training {
        Training::Scans(scans) => scans,
        Training::Points(_) => unreachable!("whole beams are held out of scans, and scans remain"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::geometry::Pose;

    /// 500 scans of four beams, each with a range of its own, and one without return.
    fn log() -> Vec<ScanRecord> {
        (0..500)
            .map(|i| ScanRecord {
                header: ScanHeader {
                    stamp_ns: i,
                    map_from_sensor: Pose::new(0.0, 0.0, 0.0),
                    angle_min_rad: 0.0,
                    angle_increment_rad: 0.0,
                    range_min_m: 0.01,
                    range_max_m: 50.0,
                    ..ScanHeader::default()
                },
                ranges_m: (0..4).map(|beam| 1.0 + 0.01 * (4 * i + beam) as f32).chain([81.0]).collect(),
            })
            .collect()
    }

    /// Which beams the ends of the asked points belong to: every beam has its own length.
    fn asked(points: &TestPoints) -> Vec<usize> {
        let ends = points.points_m.iter().zip(&points.occupied).filter(|(_, occupied)| **occupied);
        ends.map(|(point_m, _)| ((point_m[0] - 1.0) * 100.0).round() as usize).collect()
    }

    fn learned(scans: &[ScanRecord]) -> Vec<usize> {
        let beams = scans.iter().flat_map(|scan| &scan.ranges_m[..4]).enumerate();
        beams.filter(|(_, range_m)| !range_m.is_nan()).map(|(beam, _)| beam).collect()
    }

    #[test]
    fn every_beam_is_in_exactly_one_part() {
        let log = log();
        for (fraction, expected) in [(0.1, 170..230), (0.4, 740..860)] {
            let parts = three_parts(&log, fraction, 3);
            let [validation, test] = [asked(&parts.validation), asked(&parts.test)];
            assert!(expected.contains(&validation.len()) && expected.contains(&test.len()), "{:?}", parts.beams);
            assert_eq!(parts.beams, [validation.len(), test.len(), 2_000]);
            let mut all = [learned(&parts.training), validation.clone(), test.clone()].concat();
            all.sort_unstable();
            assert_eq!(all, (0..2_000).collect::<Vec<_>>());
            let mut not_test = [learned(&parts.training), validation].concat();
            not_test.sort_unstable();
            assert_eq!(not_test, learned(&parts.training_and_validation));
        }
    }

    #[test]
    fn the_test_part_is_that_of_evaluation_and_seeds_matter() {
        let log = log();
        let parts = three_parts(&log, 0.2, 3);
        assert_eq!(parts.test, hold_out(&log, Held::Beams, 0.2, 3).test);
        let other = three_parts(&log, 0.2, 4);
        assert!(other.test != parts.test && other.validation != parts.validation);
    }
}
