//! What the `bhm` command is made of: how good a map is ([`metrics`]).
#![forbid(unsafe_code)]

pub mod metrics;
