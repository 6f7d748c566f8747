//! Round lengths: one, two or five times a power of ten.

/// The powers of ten of all the lengths an axis can show ([`super::frame::is_drawable`]).
const EXPONENTS: std::ops::RangeInclusive<i32> = -5..=8;

/// `mantissa · 10^exponent` with a mantissa of 1, 2 or 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    mantissa: i64,
    exponent: i32,
}

impl Step {
    fn all() -> impl DoubleEndedIterator<Item = Self> {
        EXPONENTS.flat_map(|exponent| [1, 2, 5].map(|mantissa| Self { mantissa, exponent }))
    }

    /// The shortest round length of at least `length`, or the longest there is.
    pub(super) fn at_least(length: f64) -> Self {
        Self::all().find(|step| step.length() >= length).unwrap_or(Self { mantissa: 5, exponent: *EXPONENTS.end() })
    }

    /// The longest round length of at most `length`, or the shortest there is.
    pub(super) fn at_most(length: f64) -> Self {
        let shortest = Self { mantissa: 1, exponent: *EXPONENTS.start() };
        Self::all().rev().find(|step| step.length() <= length).unwrap_or(shortest)
    }

    pub(super) fn length(self) -> f64 {
        self.multiple(1)
    }

    /// Divides by a whole power of ten, where multiplying by a fraction would round twice.
    fn multiple(self, count: i64) -> f64 {
        let units = (count * self.mantissa) as f64;
        let power = 10_f64.powi(self.exponent.abs());
        if self.exponent < 0 { units / power } else { units * power }
    }

    /// `count` steps, with as many decimals as the step has.
    pub(super) fn label(self, count: i64) -> String {
        let decimals = (-self.exponent).max(0) as usize;
        format!("{:.decimals$}", self.multiple(count))
    }

    /// The multiples of the step from `min` to `max`, with their labels.
    pub(super) fn ticks(self, min: f64, max: f64) -> Vec<Tick> {
        // An f32 such as 0.3 is written as a multiple of 0.1 but lies a little beside it.
        let slack = 1e-6;
        let first = (min / self.length() - slack).ceil() as i64;
        let last = (max / self.length() + slack).floor() as i64;
        (first..=last).map(|count| Tick { value: self.multiple(count), label: self.label(count) }).collect()
    }
}

/// A labelled value on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// Ticks from `min` to `max` along an axis of `axis_px`, as near to each other as their labels' extent along the axis
/// lets them be without crowding.
pub(crate) fn labelled_ticks(min: f64, max: f64, axis_px: u32, label_px: impl Fn(&str) -> u32) -> Vec<Tick> {
    const LEAST_GAP_PX: u32 = 24;
    // More would clutter, less leave a short axis bare.
    const LEAST_DISTANCE_PX: u32 = 48;
    const MOST_TICKS: u32 = 12;
    let axis_px_per_unit = f64::from(axis_px) / (max - min);
    let mut distance_px = (axis_px / MOST_TICKS).max(LEAST_DISTANCE_PX);
    loop {
        let step = Step::at_least(f64::from(distance_px) / axis_px_per_unit);
        let ticks = step.ticks(min, max);
        let widest_px = ticks.iter().map(|tick| label_px(&tick.label)).max().unwrap_or(0);
        if f64::from(widest_px + LEAST_GAP_PX) <= step.length() * axis_px_per_unit || ticks.len() <= 1 {
            return ticks;
        }
        distance_px = widest_px + LEAST_GAP_PX;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(step: Step, min: f64, max: f64) -> Vec<String> {
        step.ticks(min, max).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn lengths_are_round() {
        for (limit, at_most, at_least) in
            [(1.0, "1", "1"), (4.99, "2", "5"), (0.3, "0.2", "0.5"), (0.05, "0.05", "0.05"), (73.0, "50", "100")]
        {
            assert_eq!(Step::at_most(limit).label(1), at_most);
            assert_eq!(Step::at_least(limit).label(1), at_least);
        }
    }

    #[test]
    fn ticks_are_the_multiples_within() {
        assert_eq!(labels(Step::at_least(0.5), -0.7, 1.0), ["-0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(Step::at_least(0.1), 0.0, f64::from(0.3_f32)), ["0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(Step::at_least(20.0), 501.0, 555.0), ["520", "540"]);
        assert!(labels(Step::at_least(20.0), 1.0, 19.0).is_empty());
    }
}
