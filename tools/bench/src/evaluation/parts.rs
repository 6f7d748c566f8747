use bhm_host::ScanRecord;

use super::{BeamSplit, hold_out_beams};

/// A log in three parts that share no beam: what is learned, what decides between settings, and what judges the decision.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// While settings are chosen, the beams of neither other part are learned, and the validation part is asked. Both other
    /// parts count as held out.
    pub validation: BeamSplit,
    /// For the final judgement, everything but the test part is learned, and the test part is asked.
    pub test: BeamSplit,
}

impl Parts {
    /// Beams of the validation part, of the test part, and with a return in all.
    #[must_use]
    pub fn beams(&self) -> [usize; 3] {
        [self.validation.held - self.test.held, self.test.held, self.test.of]
    }
}

/// Divides the beams of a log: `fraction` of those with a return, below one half, become the validation part and as many the
/// test part.
///
/// The test part is that of [`hold_out_beams`] with the same fraction and seed, so that its scores can be compared.
#[must_use]
pub fn three_parts(scans: &[ScanRecord], fraction: f64, seed: u64) -> Parts {
    let test = hold_out_beams(scans, fraction, seed);
    // Of what is left, the part that is `fraction` of the whole; other dice, or the throws would repeat.
    let inner = hold_out_beams(&test.training, fraction / (1.0 - fraction), seed ^ 0x7661_6c69_6461_7465);
    Parts { validation: BeamSplit { held: inner.held + test.held, of: test.of, ..inner }, test }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::{Held, TestPoints, hold_out};
    use bhm_core::{geometry::Pose, scan::ScanHeader};

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
            let [validation, test] = [asked(&parts.validation.test), asked(&parts.test.test)];
            assert!(expected.contains(&validation.len()) && expected.contains(&test.len()), "{:?}", parts.beams());
            assert_eq!(parts.beams(), [validation.len(), test.len(), 2_000]);
            let mut all = [learned(&parts.validation.training), validation.clone(), test.clone()].concat();
            all.sort_unstable();
            assert_eq!(all, (0..2_000).collect::<Vec<_>>());
            let mut not_test = [learned(&parts.validation.training), validation].concat();
            not_test.sort_unstable();
            assert_eq!(not_test, learned(&parts.test.training));
        }
    }

    #[test]
    fn the_test_part_is_that_of_evaluation_and_seeds_matter() {
        let log = log();
        let parts = three_parts(&log, 0.2, 3);
        assert_eq!(parts.test.test, hold_out(&log, Held::Beams, 0.2, 3).test);
        let other = three_parts(&log, 0.2, 4);
        assert!(other.test != parts.test && other.validation != parts.validation);
    }
}
