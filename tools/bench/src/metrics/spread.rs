use serde::{Deserialize, Serialize};

/// A mean, and twice the standard deviation around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// Twice the standard deviation (of the sample).
    pub two_sigma: f64,
    /// Of how many.
    pub count: usize,
}

impl Spread {
    /// Of these values; `None` if there are none.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let one = |mean: &f64| Self { mean: *mean, two_sigma: 0.0, count: 1 };
        Self::pooled(&values.iter().map(one).collect::<Vec<_>>())
    }

    /// Of all the values that these are of; `None` if there are none.
    #[must_use]
    pub fn pooled(parts: &[Self]) -> Option<Self> {
        let count: usize = parts.iter().map(|part| part.count).sum();
        let mean = parts.iter().map(|part| part.mean * part.count as f64).sum::<f64>() / count as f64;
        let squares = |part: &Self| {
            let within = (0.5 * part.two_sigma).powi(2) * (part.count.max(1) - 1) as f64;
            within + part.count as f64 * (part.mean - mean).powi(2)
        };
        let squares: f64 = parts.iter().map(squares).sum();
        (count > 0).then(|| Self { mean, two_sigma: 2.0 * (squares / (count.max(2) - 1) as f64).sqrt(), count })
    }

    /// With its sign where that is asked for, and with two deviations where there are several values.
    #[must_use]
    pub fn text(&self, signed: bool) -> String {
        let mean = if signed { format!("{:+.4}", self.mean) } else { format!("{:.4}", self.mean) };
        if self.count > 1 { format!("{mean} ± {:.4}", self.two_sigma) } else { mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_textbooks() {
        let spread = Spread::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        // Sum of squares about the mean of 5 is 32, of 8 values.
        assert_eq!((spread.mean, spread.count), (5.0, 8));
        assert!((spread.two_sigma - 2.0 * (32.0_f64 / 7.0).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of(&[3.0]).unwrap().two_sigma, 0.0);
        assert_eq!(Spread::of(&[]), None);
        // 1, 2, 3, 6: squares around the mean 3 are 14, over 3.
        let spread = Spread::of(&[1.0, 2.0, 3.0, 6.0]).unwrap();
        assert_eq!((spread.text(false), spread.text(true)), ("3.0000 ± 4.3205".into(), "+3.0000 ± 4.3205".into()));
        assert_eq!(Spread::of(&[0.5]).unwrap().text(true), "+0.5000");
    }
}
