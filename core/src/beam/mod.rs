//! From a reading to observations: what a ray means, and which labelled points and segments it gives, before any weight or
//! lattice is known.
//!
//! To add a rule: write its file, with its settings, and name it in the list below.

mod line_segments;
mod point_samples;
mod ray;

pub use line_segments::LineSegments;
pub use point_samples::PointSamples;
pub use ray::{BeamLimits, BeamTally, Ray, RayEnd, Reading};

use crate::{
    define::sum_type,
    geometry::{Place, Point},
    kernel::Averaging,
};

/// A point or a segment of which the label is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<const D: usize> {
    /// Where, metres.
    pub place: Place<D>,
    /// Occupied or free.
    pub occupied: bool,
}

impl<const D: usize> Observation<D> {
    /// A labelled point.
    #[inline]
    #[must_use]
    pub const fn at_point(point_m: Point<D>, occupied: bool) -> Self {
        Self { place: Place::Point(point_m), occupied }
    }
}

/// Turns a ray into observations, the same ones whenever it is given the same ray.
pub trait BeamRule {
    /// Hands every observation of the ray to `emit`, in a fixed order, until `emit` answers `false`. A ray whose reading is
    /// unusable gives none.
    ///
    /// `spacing_m` is the distance between neighbouring supports, metres, for rules whose lengths scale with the lattice.
    fn observe<const D: usize>(&self, ray: &Ray<D>, spacing_m: f32, emit: impl FnMut(Observation<D>) -> bool);

    /// How features are averaged along the segments that the rule gives, if any.
    fn segment_averaging(&self) -> Averaging {
        Averaging::Exact
    }
}

/// Most pieces of one ray, whatever its range and their length.
const MAX_PIECES: usize = 4_096;

/// Into how many equal pieces no longer than `longest_m` a length is cut, at least one and at most `max`.
#[inline]
fn pieces(length_m: f32, longest_m: f32, max: usize) -> usize {
    // Clamped before the conversion: a beam limit may be infinite.
    let quotient = (length_m / longest_m).min(max as f32);
    (quotient as usize + usize::from(quotient as usize as f32 != quotient)).max(1)
}

/// The free part of a ray in metres, which ends `gap_m` before a hit, and the hit.
#[inline]
fn free_and_hit(end: RayEnd, gap_m: f32) -> (f32, Option<f32>) {
    match end {
        RayEnd::Hit(range_m) => (range_m - gap_m, Some(range_m)),
        RayEnd::Free(range_m) => (range_m, None),
    }
}

macro_rules! beam_rules {
    ($($name:literal => $rule:ident),* $(,)?) => {
        sum_type! {
            /// The beam rules a map can be configured with, each with its settings.
            "beam rule" AnyBeamRule { $($name => $rule($rule)),* }
        }

        impl BeamRule for AnyBeamRule {
            #[inline]
            fn observe<const D: usize>(
                &self,
                ray: &Ray<D>,
                spacing_m: f32,
                emit: impl FnMut(Observation<D>) -> bool,
            ) {
                match self { $(Self::$rule(rule) => rule.observe(ray, spacing_m, emit)),* }
            }

            fn segment_averaging(&self) -> Averaging {
                match self { $(Self::$rule(rule) => rule.segment_averaging()),* }
            }
        }
    };
}

beam_rules! {
    "point-samples" => PointSamples,
    "line-segments" => LineSegments,
}
