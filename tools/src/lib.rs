//! What the `bhm` command is made of: what a map is asked ([`evaluation`]), how good its answers are ([`metrics`]) and what
//! it looks like ([`picture`]); and a [`search`] for the numbers that make them better.
//!
//! No module knows the mapper. Evaluation divides data, metrics take logits and labels, pictures take a function of the
//! plane, so our map and every baseline are judged and drawn by the same code.
#![forbid(unsafe_code)]

pub mod evaluation;
pub mod metrics;
pub mod picture;
pub mod search;
