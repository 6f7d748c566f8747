//! What a beam says: labelled observations, before any weight or lattice is known.
//!
//! To add a rule: write its file, name it in the list below.

mod point_samples;
mod sort;

pub use point_samples::PointSamples;
pub use sort::{BeamEnd, BeamLimits, BeamTally, sort_beam};

use crate::geometry::Point;

/// One beam, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Which beam of its scan.
    pub number: usize,
    /// Where the sensor stands, metres.
    pub origin_m: Point<2>,
    /// Unit vector along the beam.
    pub direction: Point<2>,
    /// How it ended.
    pub end: BeamEnd,
}

/// A point of which the label is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelledPoint {
    /// Where, metres.
    pub point_m: Point<2>,
    /// Occupied or free.
    pub occupied: bool,
}

impl Default for LabelledPoint {
    fn default() -> Self {
        Self { point_m: Point::zeros(), occupied: false }
    }
}

/// Turns a beam into observations, the same ones whenever it is given the same beam.
pub trait BeamRule {
    /// Hands every observation of the beam to `emit`, in a fixed order, until it answers `false`.
    fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPoint) -> bool);
}

macro_rules! beam_rules {
    ($($name:literal => $rule:ident),* $(,)?) => {
        /// The beam rules a map can be configured with.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyBeamRule {
            $(#[doc = concat!("See [`", stringify!($rule), "`].")] $rule($rule)),*
        }

        impl AnyBeamRule {
            /// The rule's name, as a configuration spells it.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self { $(Self::$rule(_) => $name),* }
            }
        }

        impl BeamRule for AnyBeamRule {
            #[inline]
            fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPoint) -> bool) {
                match self { $(Self::$rule(rule) => rule.observe(beam, emit)),* }
            }
        }
    };
}

beam_rules! {
    "point-samples" => PointSamples,
}
