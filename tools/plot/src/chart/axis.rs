//! From values to positions along an axis, and the ticks that say so.

use super::{Axis, GREATEST, Scale};
use crate::picture::step::{Tick, labelled_ticks};

/// The share of an axis that stays blank at each end: a marker at the least value must not lie on the frame.
const BLANK: f64 = 0.05;

/// The least extent of a linear axis relative to its greatest value: less could not be labelled in few digits.
const LEAST_EXTENT: f64 = 1e-4;

/// The least ratio of a logarithmic axis' ends; below it, it hardly differs from a linear one.
const LEAST_RATIO: f64 = 1.01;

/// Where values lie along an axis, as a share of its length.
pub(super) struct Ruler {
    scale: Scale,
    /// What the axis shows, from its left or lower end; on a logarithmic axis the decimal logarithm.
    ends: [f64; 2],
    /// The labels are in units of this power of ten.
    exponent: i32,
}

impl Ruler {
    /// A ruler for values from the least to the greatest, which its scale can show.
    pub(super) fn new(scale: Scale, [min, max]: [f64; 2]) -> Self {
        let ends = match scale {
            Scale::Linear => {
                let middle = min / 2.0 + max / 2.0;
                let greatest = min.abs().max(max.abs());
                let extent = match max - min {
                    // One value: any axis will do that shows how great it is.
                    0.0 if greatest > 0.0 => greatest / 5.0,
                    0.0 => 1.0,
                    extent => extent.max(LEAST_EXTENT * greatest),
                };
                padded(middle, extent)
            }
            Scale::Logarithmic => {
                let [low, high] = [min, max].map(f64::log10);
                padded((low + high) / 2.0, (high - low).max(LEAST_RATIO.log10()))
            }
        };
        let exponent = match scale {
            Scale::Linear => common_exponent(ends),
            Scale::Logarithmic => 0,
        };
        Self { scale, ends, exponent }
    }

    /// Whether a value can be shown at all.
    pub(super) fn can_show(scale: Scale, value: f64) -> bool {
        match scale {
            Scale::Linear => value.abs() <= GREATEST,
            Scale::Logarithmic => (GREATEST.recip()..=GREATEST).contains(&value),
        }
    }

    /// Whether all values can be shown but perhaps for their sign.
    pub(super) fn can_show_linearly(values: &[f64]) -> bool {
        values.iter().all(|&value| Self::can_show(Scale::Linear, value))
    }

    /// 0 at the left or lower end, 1 at the other; below 0 for what a logarithmic axis cannot show.
    pub(super) fn share(&self, value: f64) -> f64 {
        let place = match self.scale {
            Scale::Linear => value,
            Scale::Logarithmic if value > 0.0 => value.log10(),
            Scale::Logarithmic => return -1.0,
        };
        (place - self.ends[0]) / (self.ends[1] - self.ends[0])
    }

    /// The label of the axis, with the unit of its ticks.
    pub(super) fn caption(&self, axis: &Axis<'_>) -> String {
        match self.exponent {
            0 => axis.label.to_owned(),
            exponent => format!("{} (\u{d7} 1e{exponent})", axis.label),
        }
    }

    /// Ticks along an axis of `axis_px` whose labels' extent along it is given.
    pub(super) fn ticks(&self, axis_px: u32, label_px: fn(&str) -> u32) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => {
                let unit = 10_f64.powi(self.exponent);
                let [low, high] = self.ends.map(|end| end / unit);
                let in_units = labelled_ticks(low, high, axis_px, label_px);
                in_units.into_iter().map(|Tick { value, label }| Tick { value: value * unit, label }).collect()
            }
            Scale::Logarithmic => self.logarithmic_ticks(axis_px, label_px),
        }
    }

    /// The unlabelled ticks between: on a logarithmic axis of few decades the whole multiples of the powers of ten.
    pub(super) fn minor(&self) -> Vec<f64> {
        const MOST_DECADES: f64 = 6.0;
        if self.scale == Scale::Linear || self.ends[1] - self.ends[0] > MOST_DECADES {
            return Vec::new();
        }
        self.multiples(1, &[1, 2, 3, 4, 5, 6, 7, 8, 9]).into_iter().map(|tick| tick.value).collect()
    }

    /// The densest of the usual choices whose labels do not crowd each other.
    fn logarithmic_ticks(&self, axis_px: u32, label_px: fn(&str) -> u32) -> Vec<Tick> {
        const LEAST_GAP_PX: f64 = 18.0;
        let choices: [(i32, &[i32]); 8] =
            [(1, &[1, 2, 5]), (1, &[1, 3]), (1, &[1]), (2, &[1]), (5, &[1]), (10, &[1]), (20, &[1]), (50, &[1])];
        let fits = |ticks: &Vec<Tick>| {
            ticks.windows(2).all(|pair| {
                let apart_px = (self.share(pair[1].value) - self.share(pair[0].value)) * f64::from(axis_px);
                apart_px >= f64::from(label_px(&pair[0].label) + label_px(&pair[1].label)) / 2.0 + LEAST_GAP_PX
            })
        };
        let all = choices.into_iter().map(|(decades, mantissas)| self.multiples(decades, mantissas));
        let ticks = all.into_iter().find(fits).unwrap_or_default();
        if ticks.len() >= 3 || self.ends[1] - self.ends[0] > 1.0 {
            return ticks;
        }
        // Less than a decade: equal steps are nearly equally long. Labelled for the denser, upper end.
        let unit = 10_f64.powi(decade(self.ends[0]));
        let [low, high] = self.ends.map(|end| 10_f64.powf(end) / unit);
        let densest_px =
            f64::from(axis_px) * (high - low) / (high * std::f64::consts::LN_10) / (self.ends[1] - self.ends[0]);
        let dense = labelled_ticks(low, high, densest_px as u32, label_px);
        let values = dense.into_iter().filter(|tick| tick.value > 0.0).map(|tick| tick.value * unit);
        let linear: Vec<Tick> = values.map(|value| Tick { value, label: label(value) }).collect();
        if fits(&linear) && linear.len() > ticks.len() { linear } else { ticks }
    }

    /// These multiples of every `decades`-th power of ten, within the axis.
    fn multiples(&self, decades: i32, mantissas: &[i32]) -> Vec<Tick> {
        let [first, last] = self.ends.map(decade);
        let exponents = (first..=last).filter(|exponent| exponent.rem_euclid(decades) == 0);
        let values = exponents.flat_map(|exponent| mantissas.iter().map(move |&m| decimal(m, exponent)));
        let within = values.filter(|&value| (0.0..=1.0).contains(&self.share(value)));
        within.map(|value| Tick { value, label: label(value) }).collect()
    }
}

fn padded(middle: f64, extent: f64) -> [f64; 2] {
    let half = extent * (0.5 + BLANK);
    [middle - half, middle + half]
}

/// The power of ten at or below a decimal logarithm.
fn decade(logarithm: f64) -> i32 {
    logarithm.floor() as i32
}

/// `mantissa · 10^exponent`. Divides by a whole power of ten, where multiplying by a fraction would round twice.
fn decimal(mantissa: i32, exponent: i32) -> f64 {
    let power = 10_f64.powi(exponent.abs());
    if exponent < 0 { f64::from(mantissa) / power } else { f64::from(mantissa) * power }
}

/// The power of a thousand in which the labels of an axis are short; 0 where they are without one.
fn common_exponent(ends: [f64; 2]) -> i32 {
    let greatest = ends[0].abs().max(ends[1].abs());
    // Probabilities between 0.9999 and 1 still are.
    if (1e-2..1e5).contains(&greatest) && ends[1] - ends[0] >= LEAST_EXTENT / 2.0 {
        return 0;
    }
    decade(greatest.log10()).div_euclid(3) * 3
}

/// A value of few digits, written out where that is short.
fn label(value: f64) -> String {
    // Steps that are no multiples of a power of ten carry the rounding of their unit.
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-3..1e5).contains(&rounded) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::text::label_width;

    fn labels(scale: Scale, range: [f64; 2], axis_px: u32) -> Vec<String> {
        Ruler::new(scale, range).ticks(axis_px, label_width).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ends_leave_a_blank_and_values_lie_between_in_proportion() {
        let linear = Ruler::new(Scale::Linear, [2.0, 4.0]);
        // 2 wide, 0.1 blank at each end: 1.9 to 4.1.
        for (value, share) in [(1.9, 0.0), (2.0, 0.1 / 2.2), (3.0, 0.5), (4.1, 1.0)] {
            assert!((linear.share(value) - share).abs() < 1e-12, "{value}");
        }
        let logarithmic = Ruler::new(Scale::Logarithmic, [0.1, 1000.0]);
        // 4 decades, 0.2 blank at each end.
        for (value, share) in [(0.1, 0.2 / 4.4), (10.0, 0.5), (100.0, 3.2 / 4.4), (1000.0, 4.2 / 4.4)] {
            assert!((logarithmic.share(value) - share).abs() < 1e-12, "{value}");
        }
        assert!(logarithmic.share(0.0) < 0.0 && logarithmic.share(-1.0) < 0.0);
    }

    #[test]
    fn ticks_are_round_and_where_they_say() {
        assert_eq!(labels(Scale::Linear, [0.0, 10.0], 600), ["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]);
        assert_eq!(labels(Scale::Logarithmic, [1.0, 1000.0], 400), ["1", "3", "10", "30", "100", "300", "1000"]);
        assert_eq!(labels(Scale::Logarithmic, [1e-5, 1e6], 400), ["1e-4", "0.01", "1", "100", "10000", "1e6"]);
        assert_eq!(labels(Scale::Logarithmic, [0.2, 0.4], 400), ["0.2", "0.25", "0.3", "0.35", "0.4"]);
        for (scale, range) in [
            (Scale::Linear, [-3.7, 12.0]),
            (Scale::Linear, [0.9991, 0.9995]),
            (Scale::Logarithmic, [0.02, 3.0]),
            (Scale::Logarithmic, [0.21, 0.37]),
        ] {
            for tick in Ruler::new(scale, range).ticks(500, label_width) {
                let said: f64 = tick.label.parse().unwrap();
                assert!((said - tick.value).abs() <= 1e-12 * said.abs(), "{tick:?}");
            }
        }
    }

    #[test]
    fn labels_never_touch_and_there_are_some() {
        let tiny_to_huge = [1e-90, 1e-9, 2e-3, 0.3, 0.999, 1.0, 7.0, 1e3, 123_456.0, 1e9, 1e90];
        for (i, &min) in tiny_to_huge.iter().enumerate() {
            for (&max, scale) in
                tiny_to_huge[i..].iter().flat_map(|max| [(max, Scale::Linear), (max, Scale::Logarithmic)])
            {
                let ruler = Ruler::new(scale, [min, max]);
                let ticks = ruler.ticks(600, label_width);
                assert!((2..=20).contains(&ticks.len()), "{scale:?} {min} {max} {ticks:?}");
                for pair in ticks.windows(2) {
                    let [low, high] = [&pair[0], &pair[1]];
                    let apart_px = (ruler.share(high.value) - ruler.share(low.value)) * 600.0;
                    assert!(apart_px > f64::from(label_width(&low.label) + label_width(&high.label)) / 2.0 + 9.0);
                }
                assert!(ticks.iter().all(|tick| (-1e-6..=1.0 + 1e-6).contains(&ruler.share(tick.value))));
            }
        }
    }

    #[test]
    fn great_and_small_values_share_a_power_of_a_thousand() {
        let caption =
            |min, max| Ruler::new(Scale::Linear, [min, max]).caption(&Axis { label: "t", scale: Scale::Linear });
        assert_eq!(caption(0.0, 50.0), "t");
        assert_eq!(caption(0.0, 3e7), "t (\u{d7} 1e6)");
        assert_eq!(caption(-2e-5, 0.0), "t (\u{d7} 1e-6)");
        assert_eq!(caption(0.0, 0.0), "t");
        assert_eq!(labels(Scale::Linear, [0.0, 2e9], 300), ["0.0", "0.5", "1.0", "1.5", "2.0"]);
    }
}
