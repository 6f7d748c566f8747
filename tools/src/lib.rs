//! What the `bhm` command is made of: what a map is asked ([`evaluation`]), how good its answers are ([`metrics`]), what it
//! looks like ([`picture`]), how it compares ([`chart`]); and a [`search`] for the numbers that make it better.
//!
//! No module knows the mapper. Evaluation divides data, metrics take logits and labels, pictures take a function of the
//! plane, so our map and every baseline are judged and drawn by the same code.
#![forbid(unsafe_code)]

pub mod baselines;
pub mod chart;
pub mod contest;
pub mod evaluation;
pub mod instructions;
pub mod metrics;
pub mod picture;
pub mod search;
