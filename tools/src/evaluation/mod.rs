//! How well a map predicts what it was not shown.
//!
//! [`hold_out`] divides a log into what a method learns from and labelled points it never saw,
//! [`three_parts`] keeps a further part for the choice of settings. Nothing here knows a mapper, so
//! that every method is judged on the same data.

mod exam;
mod lesson;
mod parts;
mod split;
mod timing;

pub use exam::Exam;
pub use lesson::{Lesson, Ray, Sampling};
pub use parts::{Parts, three_parts};
pub use split::{Held, Split, TestPoints, Training, hold_out};
pub use timing::Timing;
