//! What maps and measurements look like: [`picture`]s of a function of the plane, [`chart`]s of numbers.
//!
//! A picture asks a function, whatever answers: a map in memory, in a file, in shared memory, or a baseline. [`map_picture`]
//! draws what a Bayesian Hilbert map says, where something is known ([`knowledge`]); [`folder`] is where pictures go.
#![forbid(unsafe_code)]

pub mod chart;
pub mod folder;
pub mod knowledge;
pub mod map_picture;
pub mod picture;
