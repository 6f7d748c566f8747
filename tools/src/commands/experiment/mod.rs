//! Experiments of the paper and beyond it, each a file or a folder: what it compares, a table, and its pictures.
//!
//! A new one is its file, its `mod` line and its line in the list.

mod cost;
mod granularity;
mod kernels;
mod placement;
mod poses;
mod relevance;
mod segments;
mod shapes;
mod trial;

use clap::Args;

use crate::output::Output;

/// Compare ways of mapping, as the paper's figures do: tables and pictures
#[derive(Args, Debug)]
pub(crate) struct Experiment {
    #[command(subcommand)]
    which: Which,
}

macro_rules! experiments {
    ($($experiment:ident in $module:ident),* $(,)?) => {
        #[derive(Debug, clap::Subcommand)]
        enum Which {
            $($experiment($module::$experiment)),*
        }

        impl Experiment {
            pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
                match &self.which { $(Which::$experiment(experiment) => experiment.run(output)),* }
            }
        }
    };
}

experiments! {
    Granularity in granularity,
    Kernels in kernels,
    Placement in placement,
    Poses in poses,
    Relevance in relevance,
    Segments in segments,
    Shapes in shapes,
}
