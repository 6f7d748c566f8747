use std::time::Duration;

use serde::{Deserialize, Serialize};

/// How long scans took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Scans per second, were they to come without pause.
    pub scans_per_s: f64,
    /// Half of the scans took no longer, milliseconds.
    pub p50_ms: f64,
    /// 99 of 100 scans took no longer, milliseconds.
    pub p99_ms: f64,
    /// The longest, milliseconds.
    pub max_ms: f64,
}

impl Timing {
    /// Of these durations, one per scan; all zero if there are none.
    #[must_use]
    pub fn of(mut durations: Vec<Duration>) -> Self {
        durations.sort_unstable();
        let total_s = durations.iter().sum::<Duration>().as_secs_f64();
        // The nearest rank: a duration that occurred, not one between two.
        let rank_ms = |percent: usize| {
            let rank = (durations.len() * percent).div_ceil(100).max(1);
            durations.get(rank - 1).map_or(0.0, |duration| duration.as_secs_f64() * 1e3)
        };
        Self {
            scans_per_s: if total_s > 0.0 { durations.len() as f64 / total_s } else { 0.0 },
            p50_ms: rank_ms(50),
            p99_ms: rank_ms(99),
            max_ms: rank_ms(100),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_the_definition() {
        assert_eq!(Timing::of(vec![]), Timing::default());
        let of = |count: u64| Timing::of((1..=count).rev().map(Duration::from_millis).collect());
        assert_eq!((of(1).p50_ms, of(1).p99_ms, of(1).max_ms), (1.0, 1.0, 1.0));
        assert_eq!((of(200).p50_ms, of(200).p99_ms, of(200).max_ms), (100.0, 198.0, 200.0));
        assert!((of(3).scans_per_s - 500.0).abs() < 1e-9);
    }
}
