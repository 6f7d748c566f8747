//! Experiments of the paper and beyond it, each a file or a folder: the variants that it compares, and its columns of the table.
//!
//! A new one is its file, its `mod` line, and its options in the command.

pub mod granularity;
pub mod kernels;
pub mod placement;
pub mod poses;
pub mod relevance;
pub mod segments;
pub mod shapes;
mod trial;

use bhm_core::kernel::{KernelSettings, SquaredExponentialSettings};
use bhm_host::ScanRecord;

pub use self::trial::{Columns, NoColumns, Table, Trial, Variant};
use crate::evaluation::{BeamSplit, hold_out_beams};

/// The part of the beams that is held out.
const FRACTION: f64 = 0.1;

/// What every variant learns and is asked: a tenth of the beams held out.
///
/// # Errors
/// If that is no beam at all.
pub fn split(scans: &[ScanRecord], seed: u64) -> anyhow::Result<BeamSplit> {
    let split = hold_out_beams(scans, FRACTION, seed);
    anyhow::ensure!(split.held > 0, "nothing to predict: no beam was held out");
    Ok(split)
}

fn squared_exponential(shape: f32) -> KernelSettings {
    KernelSettings::SquaredExponential(SquaredExponentialSettings { shape })
}
