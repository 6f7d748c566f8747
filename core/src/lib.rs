//! Bayesian Hilbert maps in fixed memory.
//!
//! One continuous function says, for every point of space, how likely it is occupied and how sure that is. It is
//! learned scan by scan, exactly (full covariance within a tile), with a bounded number of operations and no memory but
//! what it is given at the start: no `std`, no allocation, no clock, no randomness, no I/O.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod define;

pub mod basis;
pub mod beam;
pub mod em;
pub mod geometry;
pub mod kernel;
pub mod lattice;
pub mod map;
pub mod mapper;
pub mod posterior;
pub mod prior;
pub mod profile;
pub mod relevance;
pub mod rule;
pub mod scan;
pub mod settings;
pub mod shape;
pub mod storage;
pub mod support;
pub mod tile;
