//! How good a map is and what it costs: what it is asked ([`evaluation`]), how good its answers are ([`metrics`]), what a scan
//! costs ([`cost`], [`instructions`]), other ways of mapping ([`baselines`]) and contests between them ([`contest`]), a
//! [`search`] for the numbers that make a map better, [`experiments`] with how it is made, and the [`reproduction`] of the
//! paper's tables and figures. What only experiments map with is here too ([`scattered`]).
//!
//! Evaluation divides data, metrics take logits and labels, so that our map and every baseline are judged by the same code.
#![forbid(unsafe_code)]

pub mod baselines;
pub mod contest;
pub mod cost;
pub mod evaluation;
pub mod experiments;
pub mod instructions;
pub mod metrics;
pub mod progress;
pub mod reading;
pub mod reproduction;
pub mod reservoir;
pub mod scattered;
pub mod search;
pub mod text;
