use super::{Support, SupportNumbers};
use crate::{
    define::settings,
    geometry::Point,
    kernel::{
        Averaging, Kernel, MAX_SAMPLES,
        quadrature::{LEGENDRE_12, mean},
    },
    lattice::offsets,
    settings::{SettingsError, number},
};

settings! {
    /// Settings of a [`RectangularSupport`] that is the same at every node.
    RectangleSettings {
        /// Side along every axis, in spacings; a rectangle as wide as the spacing tessellates the plane.
        size: f32 = 1.0,
        /// Samples a side by which the kernel is averaged over the rectangle; 0 for the closed form.
        samples: Averaging = Averaging::Exact,
    }
}

impl RectangleSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::support_size(self.size)?;
        number::samples("samples of a support", self.samples)
    }

    pub(crate) fn build<const D: usize>(&self, spacing_m: f32) -> RectangularSupport<D> {
        RectangularSupport { sides_m: Point::from_element(self.size * spacing_m), averaging: self.samples }
    }
}

/// A support that covers a rectangle around its node, sides along the axes (eq. 14): the kernel averaged over it.
///
/// With sides of one spacing the supports tessellate the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectangularSupport<const D: usize> {
    sides_m: Point<D>,
    averaging: Averaging,
}

impl<const D: usize> RectangularSupport<D> {
    /// From its sides, metres, and how the kernel is averaged over it; `None` unless the sides are positive and finite and
    /// samples, if any, number 1 to [`MAX_SAMPLES`] a side.
    #[must_use]
    pub fn new(sides_m: Point<D>, averaging: Averaging) -> Option<Self> {
        let sides = sides_m.iter().all(|side| *side > 0.0 && side.is_finite());
        (sides && averaging.is_valid()).then_some(Self { sides_m, averaging })
    }

    /// Its sides, metres.
    #[must_use]
    pub const fn sides_m(&self) -> &Point<D> {
        &self.sides_m
    }

    /// The mean over the samples' places; equal shares of the rectangle, each sampled in its middle.
    fn over_samples<T>(&self, count: u32, displacement_m: &Point<D>, f: impl Fn(&Point<D>) -> T) -> T
    where
        T: core::ops::Mul<f32, Output = T> + core::ops::AddAssign,
    {
        let count = count.clamp(1, MAX_SAMPLES) as usize;
        let mut sum = f(displacement_m) * 0.0;
        for sample in offsets([count; D]) {
            let place = Point::from_fn(|axis, _| {
                displacement_m[axis] + ((sample[axis] as f32 + 0.5) / count as f32 - 0.5) * self.sides_m[axis]
            });
            sum += f(&place);
        }
        sum * (1.0 / count.pow(D as u32) as f32)
    }
}

impl<const D: usize> Support<D> for RectangularSupport<D> {
    fn numbers(&self) -> SupportNumbers {
        let mut numbers = SupportNumbers::default();
        for (number, side) in numbers.iter_mut().zip(self.sides_m.iter()) {
            *number = *side;
        }
        if let (Averaging::Samples(count), Some(number)) = (self.averaging, numbers.get_mut(D)) {
            *number = count as f32;
        }
        numbers
    }

    fn from_numbers(numbers: &SupportNumbers) -> Option<Self> {
        let count = *numbers.get(D)?;
        let averaging = if count == 0.0 { Averaging::Exact } else { Averaging::Samples(count as u32) };
        Self::new(Point::from_fn(|axis, _| numbers[axis]), averaging)
    }

    #[inline]
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
        match self.averaging {
            Averaging::Exact => kernel.over_box(displacement_m, &self.sides_m),
            Averaging::Samples(count) => self.over_samples(count, displacement_m, |at| kernel.value(at)),
        }
    }

    #[inline]
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
        match self.averaging {
            Averaging::Exact => kernel.over_box_gradient(displacement_m, &self.sides_m),
            Averaging::Samples(count) => self.over_samples(count, displacement_m, |at| kernel.gradient(at)),
        }
    }

    /// Sampled, the mean over the samples of a segment's closed form; else the quadrature that every support has.
    fn segment_feature(&self, kernel: &impl Kernel<D>, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        match self.averaging {
            Averaging::Exact => mean(LEGENDRE_12, |x| self.feature(kernel, &(middle_m + along_m * x))),
            Averaging::Samples(count) => self.over_samples(count, middle_m, |at| kernel.over_segment(at, along_m)),
        }
    }

    fn cut_off(&self, kernel: &impl Kernel<D>, reach_m: f32) -> f32 {
        let plane = |axis: usize| {
            let mut at = Point::zeros();
            at[axis] = reach_m;
            self.feature(kernel, &at)
        };
        (0..D).map(plane).fold(0.0, |a: f32, b| if b > a || b.is_nan() { b } else { a })
    }
}
