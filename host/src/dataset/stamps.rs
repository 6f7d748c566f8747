/// Latest stamp taken from a log, nanoseconds: the year 2262. Beyond it a stamp is noise, and adding one can never overflow.
const LATEST_NS: f64 = i64::MAX as f64;

/// Turns the seconds of a log into nanoseconds that strictly increase, and counts what had to be invented for that.
///
/// Recorded stamps go back, repeat (written with six digits of a Unix time they last for hours) or are all zero. A stamp that
/// is not later than the one before, negative, not a number or absurdly late becomes the one before plus a nanosecond.
#[derive(Debug, Default)]
pub(super) struct StampRepair {
    next_ns: u64,
    pub(super) repaired: u64,
}

impl StampRepair {
    /// The stamp of the next scan, nanoseconds; later than every one returned before.
    pub(super) fn next_ns(&mut self, recorded_s: f64) -> u64 {
        let recorded_ns = recorded_s * 1e9;
        // The cast drops less than a nanosecond, far below the resolution of an f64 that holds a Unix time.
        let usable = (0.0..LATEST_NS).contains(&recorded_ns).then(|| recorded_ns.round() as u64);
        let stamp_ns = usable.filter(|&stamp_ns| stamp_ns >= self.next_ns).unwrap_or_else(|| {
            self.repaired += 1;
            self.next_ns
        });
        self.next_ns = stamp_ns + 1;
        stamp_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repairs_only_what_is_not_later() {
        let mut stamps = StampRepair::default();
        let recorded_s = [0.0, 1.5, 1.5, 1.0, f64::NAN, -3.0, f64::INFINITY, 1e30, 2.0];
        let stamps_ns: Vec<u64> = recorded_s.iter().map(|&s| stamps.next_ns(s)).collect();
        let s = 1_000_000_000;
        assert_eq!(
            stamps_ns,
            [
                0,
                3 * s / 2,
                3 * s / 2 + 1,
                3 * s / 2 + 2,
                3 * s / 2 + 3,
                3 * s / 2 + 4,
                3 * s / 2 + 5,
                3 * s / 2 + 6,
                2 * s
            ]
        );
        assert_eq!(stamps.repaired, 6);
    }

    #[test]
    fn a_first_stamp_that_is_unusable_becomes_zero() {
        let mut stamps = StampRepair::default();
        assert_eq!((stamps.next_ns(f64::NAN), stamps.next_ns(0.0)), (0, 1));
        assert_eq!(stamps.repaired, 2);
    }
}
