//! How well a map predicts what it was not shown.
//!
//! [`hold_out`] divides a log into what a method learns from and labelled points it never saw. Nothing here knows a mapper, so
//! that every method is judged on the same data.

mod split;
mod timing;

pub use split::{Held, Split, TestPoints, Training, hold_out};
pub use timing::Timing;
