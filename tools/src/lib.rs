//! What the `bhm` command is made of: how good a map is ([`metrics`]) and what it looks like ([`picture`]).
//!
//! Neither module knows the mapper. Metrics take logits and labels, pictures take a function of the plane, so our map
//! and every baseline are judged and drawn by the same code.
#![forbid(unsafe_code)]

pub mod metrics;
pub mod picture;
