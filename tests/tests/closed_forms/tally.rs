//! Errors against a tolerance.

use core::fmt::Display;

/// What an error may be: relative where the value is above `floor`, absolute elsewhere.
#[derive(Clone, Copy)]
pub struct Tolerance {
    pub relative: f64,
    pub floor: f64,
    pub absolute: f64,
}

/// Of closed forms: sixteen roundings of an exponent of 14 (a value of 1e-6) are 16·14·6e-8 = 1.3e-5, a few such in a row
/// below 1e-4.
pub const CLOSED: Tolerance = Tolerance { relative: 1e-4, floor: 1e-6, absolute: 1e-7 };

pub struct Tally {
    what: String,
    tolerance: Tolerance,
    count: usize,
    failures: usize,
    relative: f64,
    absolute: f64,
    worst: (f64, String),
}

impl Tally {
    pub fn new(what: &str, tolerance: Tolerance) -> Self {
        Self {
            what: what.into(),
            tolerance,
            count: 0,
            failures: 0,
            relative: 0.0,
            absolute: 0.0,
            worst: (0.0, String::new()),
        }
    }

    pub fn add(&mut self, got: f32, exact: f64, case: &impl Display) {
        let error = (f64::from(got) - exact).abs();
        let Tolerance { relative, floor, absolute } = self.tolerance;
        let excess = if exact.abs() > floor {
            self.relative = self.relative.max(error / exact.abs());
            error / exact.abs() / relative
        } else {
            self.absolute = self.absolute.max(error);
            error / absolute
        };
        self.count += 1;
        // A NaN is a failure, not a number below the tolerance.
        let fails = excess.is_nan() || excess > 1.0;
        self.failures += usize::from(fails);
        if fails && (excess.is_nan() || excess > self.worst.0) {
            self.worst = (excess, format!("{got:e} against {exact:e} {case}"));
        }
    }

    /// Prints the worst errors, and fails if one was too large.
    pub fn finish(self) {
        let Self { what, tolerance: Tolerance { floor, .. }, count, failures, relative, absolute, worst } = self;
        println!("{what}: {count} cases, relative {relative:.1e} above {floor:.0e}, absolute {absolute:.1e} below");
        assert!(failures == 0, "{what}: {failures} of {count} off, the worst {:.1} times: {}", worst.0, worst.1);
    }
}
