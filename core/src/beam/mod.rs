//! What a beam says: labelled observations, before any weight or lattice is known.
//!
//! To add a rule: write its file, name it in the list below.

mod line_segments;
mod point_samples;
mod sort;

pub use line_segments::LineSegments;
pub use point_samples::PointSamples;
pub use sort::{BeamEnd, BeamLimits, BeamTally, sort_beam};

use crate::geometry::{Place, Point};

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

/// A point or a segment of which the label is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LabelledPlace {
    /// Where, metres.
    pub place: Place<2>,
    /// Occupied or free.
    pub occupied: bool,
}

impl LabelledPlace {
    /// Room for an observation, for a `static`; on a computer allocate it zeroed instead, which is as good a value.
    pub const VACANT: Self = Self { place: Place::Point(Point::<2>::new(0.0, 0.0)), occupied: false };
}

/// Turns a beam into observations, the same ones whenever it is given the same beam.
pub trait BeamRule {
    /// The rule that a configuration describes.
    fn from_parameters(parameters: &BeamParameters) -> Self;

    /// Hands every observation of the beam to `emit`, in a fixed order, until it answers `false`.
    fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPlace) -> bool);
}

/// What a beam rule is made from; each takes what it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamParameters {
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// Longest piece of a beam for which one free point stands, metres.
    pub free_spacing_m: f32,
    /// Longest segment, in spacings.
    pub segment_length: f32,
    /// Length before a hit that is left unlabelled, metres: range noise must not put free space on the wall.
    pub gap_m: f32,
}

/// Most pieces of one beam, whatever its range and their length.
const MAX_PIECES: usize = 4_096;

/// Into how many equal pieces no longer than `longest_m` a length is cut, at least one and at most `max`.
#[inline]
fn pieces(length_m: f32, longest_m: f32, max: usize) -> usize {
    // Clamped before the conversion: a beam limit may be infinite.
    let quotient = (length_m / longest_m).min(max as f32);
    (quotient as usize + usize::from(quotient as usize as f32 != quotient)).max(1)
}

macro_rules! beam_rules {
    ($($name:literal => $rule:ident),* $(,)?) => {
        /// The beam rules a map can be configured with.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyBeamRule {
            $(#[doc = concat!("See [`", stringify!($rule), "`].")] $rule($rule)),*
        }

        /// Names of [`AnyBeamRule`]'s variants, as a configuration spells them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum BeamChoice {
            $(#[doc = concat!("See [`", stringify!($rule), "`].")] $rule),*
        }

        impl BeamChoice {
            /// Every rule there is.
            pub const ALL: &'static [Self] = &[$(Self::$rule),*];

            /// The rule's name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$rule => $name),* }
            }

            /// The rule itself.
            #[must_use]
            pub fn build(self, parameters: &BeamParameters) -> AnyBeamRule {
                match self { $(Self::$rule => AnyBeamRule::$rule($rule::from_parameters(parameters))),* }
            }
        }

        impl AnyBeamRule {
            /// See [`BeamRule::observe`].
            #[inline]
            pub fn observe(&self, beam: &Beam, emit: &mut dyn FnMut(LabelledPlace) -> bool) {
                match self { $(Self::$rule(rule) => rule.observe(beam, emit)),* }
            }
        }
    };
}

beam_rules! {
    "point-samples" => PointSamples,
    "line-segments" => LineSegments,
}
