//! How well a map predicts what it was not shown.
//!
//! [`hold_out`] divides a log into what a method learns from and labelled points it never saw,
//! [`three_parts`] keeps a further part for the choice of settings. Nothing here knows a mapper, so
//! that every method is judged on the same data.

mod parts;
mod split;
mod task;
mod test_points;
mod timing;
mod training_scan;
mod truth;

pub use parts::{Parts, three_parts};
pub use split::{BeamSplit, Held, Split, Training, hold_out, hold_out_beams};
pub use task::Task;
pub use test_points::TestPoints;
pub use timing::Timing;
pub use training_scan::{Line, Sampling, TrainingScan};
pub use truth::Truth;
